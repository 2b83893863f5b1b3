# SPDX-License-Identifier: Apache-2.0
# Where nothing can be written: a device that is full, a folder that is none, a file in the way.
furnace=$ROOT/scenes/furnace.xml
importon render "$furnace" --spp 4 -q -o target.exr || exit 9
run() { importon "$@" 2>&1 >/dev/null; echo "exit $?"; }

for file in /dev/full nowhere/answer target.exr/answer; do
    run info "$furnace" -o $file
    run compare target.exr target.exr -o $file
    [[ $file = /dev/* ]] || run render "$furnace" --spp 1 -q -o $file.exr
    run fit "$furnace" --target target.exr --spp 2 -n 1 -q --no-intervals --checkpoint $file
done
run render "$furnace" --spp 1 -q --paths nowhere/walks.txt
run fit "$furnace" --target target.exr --spp 2 -n 1 -q -o target.exr
run jacobian "$furnace" --spp 2 -q -o target.exr
importon compare target.exr target.exr -q >/dev/null || echo "target.exr is lost"
ls

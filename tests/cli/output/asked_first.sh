# SPDX-License-Identifier: Apache-2.0
# Where a picture cannot go is said before the work, not after it: these runs would take years.
furnace=$ROOT/scenes/furnace.xml
importon render "$furnace" --spp 4 -q -o target.exr || exit 9
run() { timeout 60 importon "$@" -q --spp 1000000000 2>&1 >/dev/null; echo "exit $?"; }

mkdir folder.exr
run render "$furnace" -o nowhere/p.exr
run render "$furnace" -o folder.exr
run render "$furnace" -o p.gif
run render "$furnace" -o target.exr/p.exr
run jacobian "$furnace" -o target.exr
run jacobian "$furnace" -o out --sheet p.gif
run jacobian "$furnace" -o out --sheet nowhere/p.png
run gradient "$furnace" -o target.exr
run gradient "$furnace" --textures target.exr
run gradient "$furnace" -T target.exr --spp 1000000000 -o folder.exr
run fit "$furnace" -T target.exr --checkpoint nowhere/state
run fit "$furnace" -T target.exr --checkpoint folder.exr
run fit "$furnace" -T target.exr -o out --sheet p.gif
ls

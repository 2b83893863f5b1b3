# SPDX-License-Identifier: Apache-2.0
# Every command that writes, on a disk without room: exit 3, a message with the file's name, and what
# was there before is still there, with nothing beside it.
furnace=$ROOT/scenes/furnace.xml
importon render "$furnace" --spp 4 -q -o target.exr || exit 9
importon render "$furnace" --spp 4 -q -o target.pfm || exit 9
target=$PWD/target.exr

# full FILES -- COMMAND...: the files are there before; none may change, or get company.
full() {
    local folder files=()
    while [[ $1 != -- ]]; do files+=("$1"); shift; done
    shift
    folder=$(mktemp -d -p "$OUT") && cd "$folder" || exit 9
    mkdir out
    for file in "${files[@]}"; do echo before >"$file"; done
    find . -type f | sort >../list_before
    # through a pipe: the limit would hit our own files too
    (ulimit -f 0; "$@" --overwrite 2>&1 >/dev/null; echo "exit $?") | sed "s|^|$2: |"
    find . -type f | sort | cmp - ../list_before
    for file in "${files[@]}"; do [[ $(<"$file") == before ]] || echo "$2: $file is lost"; done
    cd "$OUT" || exit 9
}

full p.exr -- importon render "$furnace" --spp 1 -q -o p.exr
full p.pfm -- importon render "$furnace" --spp 1 -q -o p.pfm
full p.png -- importon render "$furnace" --spp 1 -q -o p.png
full p.npy -- importon render "$furnace" --spp 1 -q -o p.npy
full walks.txt p.exr -- importon render "$furnace" --spp 1 -q --paths walks.txt --count 3 -o p.exr
full answer -- importon info "$furnace" -o answer
full answer -- importon check "$furnace" --draws-time 0.1 --paths 10 --fresh-spp 2 -q -o answer
full answer -- importon compare "$target" "$target" -o answer
full out/mean.exr -- importon jacobian "$furnace" --spp 2 -q -o out
full out/target.png out/before.exr out/loss.csv out/recovered.txt -- \
    importon fit "$furnace" --target "$target" --spp 2 -n 2 -q -o out
full state -- importon fit "$furnace" --target "$target" --spp 2 -n 2 -q --checkpoint state

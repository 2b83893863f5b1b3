#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
#     tools/check_layers.sh [LIBRARY.a]
#
# Rooms stand above each other: a file includes files of its own room and of rooms below, so
# no two rooms need each other. With the static library, calls are looked at too: what an
# object file refers to is defined in its own room or below. Commands see the public headers
# alone, and one file knows Embree.
set -uo pipefail
library=${1:+$(realpath "$1")}
cd "$(dirname "$0")/.." || exit 1
rooms=(base math color kind scene search bend elements walk film inverse format render report)
bad=0

complain() {
    echo "$*" >&2
    bad=1
}

declare -A floor
for i in "${!rooms[@]}"; do floor[${rooms[i]}]=$i; done
for folder in src/*/; do
    room=$(basename "$folder")
    [[ -n ${floor[$room]-} ]] || complain "$folder: add it to the rooms of $0"
done

# FILE:#include "ROOM/..." of all of src; includes without a folder stay in their room.
while IFS=: read -r file include; do
    room=${file#src/} room=${room%%/*}
    other=${include#*\"} other=${other%%/*}
    [[ -n ${floor[$other]-} ]] || continue
    ((floor[$other] <= floor[$room])) || complain "$file: $include runs up"
done < <(grep -rE '^#include "[a-z_]+/' src --include='*.[ch]')

while IFS=: read -r file include; do
    complain "$file: $include: commands use include/importon only"
done < <(grep -rE '^#include "([a-z_]+/|\.\./)' cli --include='*.[ch]')

while IFS=: read -r file include; do
    [[ $file == src/scene/intersector.h ]] || complain "$file: $include"
done < <(grep -rE '^#include <embree' src cli include --include='*.[ch]')

# Meson names an object after its path: src_ROOM_FILE.c.o, '/' written as '_'.
if [[ $library ]]; then
    calls=$(nm -A -g "$library" | awk -v order="${rooms[*]}" '
        BEGIN { n = split(order, name, " "); for (i = 1; i <= n; i++) floor[name[i]] = i }
        { object = $1; sub(/^.*src_/, "", object); sub(/\.c\.o:.*/, "", object)
          split(object, part, "_"); symbol = $NF }
        !(part[1] in floor) { print object ": in no room"; next }
        $(NF - 1) == "U" { used[object, symbol] = 1; next }
        { home[symbol] = part[1]; defined++ }
        END {
            for (pair in used) {
                split(pair, p, SUBSEP); split(p[1], part, "_")
                if (p[2] in home && floor[home[p[2]]] > floor[part[1]])
                    print p[1] ".c: refers to " p[2] " of " home[p[2]] ", which runs up"
            }
            if (defined < 500) print "too few symbols: is this the static library?"
        }' | sort)
    [[ -z $calls ]] || complain "$calls"
fi

exit "$bad"

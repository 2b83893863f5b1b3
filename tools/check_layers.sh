#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Includes run down: a file includes its own room and rooms below it, so no two rooms need
# each other. The commands see the public headers alone, and one file knows Embree.
cd "$(dirname "$0")/.." || exit 1
rooms=(base math color kind scene search curved elements walk inverse format render)
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
    [[ $file == src/scene/intersect.c ]] || complain "$file: $include"
done < <(grep -rE '^#include <embree' src cli include --include='*.[ch]')

exit "$bad"

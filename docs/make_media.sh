#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# The pictures of docs/media.md that were computed, computed again; five to ten minutes. With the
# number of a figure of Morley et al. (2006) that one alone: 9.
#
#     docs/make_media.sh [BUILD FOLDER, default build] [FIGURE]
set -euo pipefail
cd "$(dirname "$0")/.."
build=$(cd "${1:-build}" && pwd)
figure=${2:-all}
importon=$build/cli/importon
[[ -x $importon ]] || { echo "$importon: not built" >&2; exit 2; }
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
images=docs/images

say() { echo "$(date +%T) $*" >&2; }
wanted() { [[ $figure == all || $figure == "$1" ]]; }
picture() { # NAME OPTIONS...
    "$importon" render "${@:2}" --seed 1 -q --overwrite --no-manifest -o "$images/media_$1.png"
}

if wanted 9; then
    say "Figure 9: the sky at three times of day"
    for time in 60:3 15:4 2:8; do
        picture "sky_${time%:*}" scenes/sky.xml -m spectral -D elevation="${time%:*}" -D exposure="${time#*:}" \
            -D width=144 -D height=96 --spp 256
    done
fi
for picture in "$images"/media_*.png; do
    bytes=$(stat -c %s "$picture")
    ((bytes < 110000)) || { echo "$picture is larger than 110000 bytes" >&2; exit 1; }
done

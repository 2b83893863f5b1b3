#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# The pictures of docs/media.md that were computed, computed again; five to ten minutes. With the
# number of a figure of Morley et al. (2006) that one alone: 6, 7 (and 8), 9 or 10; or `fire`.
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

if wanted 6; then
    say "Figure 6: look-ups against cells"
    "$build/bench/marching" >"$out/marching.txt"
    python3 - "$out/marching.txt" "$images/media_lookups.svg" <<'PYTHON'
import math, re, sys

rows = [[float(x) for x in m.groups()] for m in re.finditer(r"^ *(\d+) +([\d.]+) +(\d+)$", open(sys.argv[1]).read(), re.M)]
W, H, left, low = 420, 300, 64, 44
x = lambda n: left + (W - left - 16) * (math.log2(n) - 5) / 5
y = lambda v: H - low - (H - low - 12) * math.log10(v) / 6.5
out = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 %d %d" font-family="sans-serif" font-size="11" fill="#444">' % (W, H),
       '<rect width="%d" height="%d" fill="white"/>' % (W, H)]
for n, _, _ in rows:
    out.append('<text x="%.1f" y="%d" text-anchor="middle">%d</text>' % (x(n), H - low + 16, n))
for k in range(0, 7):
    out.append('<line x1="%d" x2="%d" y1="%.1f" y2="%.1f" stroke="#ddd"/>' % (left, W - 16, y(10 ** k), y(10 ** k)))
    out.append('<text x="%d" y="%.1f" text-anchor="end">10<tspan dy="-4" font-size="8">%d</tspan></text>' % (left - 6, y(10 ** k) + 4, k))
for column, color, name, lift in ((2, "#b22", "marched ray", -10), (1, "#247", "walk", -10)):
    at = [(x(r[0]), y(r[column])) for r in rows]
    slope = (math.log(rows[-1][column]) - math.log(rows[0][column])) / (math.log(rows[-1][0]) - math.log(rows[0][0]))
    out.append('<polyline fill="none" stroke="%s" stroke-width="1.6" points="%s"/>' % (color, " ".join("%.1f,%.1f" % p for p in at)))
    out += ['<circle cx="%.1f" cy="%.1f" r="2.6" fill="%s"/>' % (p[0], p[1], color) for p in at]
    out.append('<text x="%.1f" y="%.1f" text-anchor="end" fill="%s">%s, slope %.2f</text>' % (at[3][0], at[3][1] + lift, color, name, slope))
out.append('<text x="%.1f" y="%d" text-anchor="middle">cells along the ray</text>' % ((left + W) / 2, H - 8))
out.append('<text transform="translate(14 %.1f) rotate(-90)" text-anchor="middle">look-ups of the extinction</text></svg>' % ((H - low) / 2))
open(sys.argv[2], "w").write("\n".join(out) + "\n")
PYTHON
fi
if wanted 7 || wanted 8; then
    say "Figures 7 and 8: smoke and its shadow by walks and by marched rays, in equal time"
    "$build/bench/smoke_marched" "$out"
    for name in smoke_walks smoke_marched shadow_walks shadow_marched; do
        cp "$out/$name.png" "$images/media_$name.png"
    done
fi
if wanted 9; then
    say "Figure 9: the sky at three times of day"
    for time in 60:3 15:4 2:8; do
        picture "sky_${time%:*}" scenes/sky.xml -m spectral -D elevation="${time%:*}" -D exposure="${time#*:}" \
            -D width=144 -D height=96 --spp 256
    done
fi
if wanted 10; then
    say "Figure 10: subsurface scattering in a dielectric mesh"
    python3 scenes/wax/make.py "$out/wax.ply"
    picture wax scenes/wax.xml -D mesh="$out/wax.ply" -D res=112 --spp 1024
fi
if wanted fire; then
    say "Fire: a plume that emits"
    "$build/examples/example_smoke" 64 7 "$out/smoke.vol"
    picture fire scenes/fire.xml -D density="$out/smoke.vol" -D res=256 --spp 256
fi
for picture in "$images"/media_*.png; do
    bytes=$(stat -c %s "$picture")
    ((bytes < 110000)) || { echo "$picture is larger than 110000 bytes" >&2; exit 1; }
done

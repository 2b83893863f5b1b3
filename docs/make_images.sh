#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# The README's pictures, rendered again. Two to four minutes. (docs/make_stam.sh makes
# those of docs/stam.md.)
#
#     docs/make_images.sh [BUILD FOLDER, default build]
set -euo pipefail
cd "$(dirname "$0")/.."
build=$(cd "${1:-build}" && pwd)
importon=$build/cli/importon
[[ -x $importon ]] || { echo "$importon: not built" >&2; exit 2; }
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
images=docs/images
most=110000 # bytes of a committed picture

say() { echo "$(date +%T) $*" >&2; }

say "pictures: a textured floor; a rod, a fish-eye and a Luneburg lens"
"$importon" render scenes/textured.xml -D width=256 -D height=192 --spp 256 -q -o "$images/textured.png"
"$importon" render scenes/bend/lenses.xml -D width=300 -D height=150 --spp 256 -q -o "$images/lenses.png"

say "gradient: the Cornell box, and its derivatives by three reflectances"
"$importon" jacobian scenes/cornell.xml -D res=128 --spp 256 -p 'red.*' -p 'green.*' -p 'white.*' -q \
    -o "$out/J" --sheet "$images/cornell_jacobian.png" >"$out/jacobian.txt"

say "derivatives of a table by the place of a lamp"
"$importon" jacobian scenes/placing.xml -m mono --sensor 3 -p lamp.position --set spot.intensity.value=9 \
    --set lamp.intensity.value=4 -q -o "$out/lamp" \
    --sheet "$images/lamp_jacobian.png" >"$out/lamp.txt"

say "fit: wrong walls and a wrong lamp, the target, what was recovered (as ./quickstart)"
size=(-D res=96)
"$importon" render scenes/cornell.xml "${size[@]}" --spp 512 --seed 1 --se -q -o "$out/target.exr"
"$importon" fit scenes/cornell.xml "${size[@]}" --set red.reflectance.value=0.35 \
    --set green.reflectance.value=0.35 --set white.reflectance.value=0.5 --set light.radiance.value=6 \
    -p 'red.*' -p 'green.*' -p 'white.*' -p 'light.*' --target "$out/target.exr" --optimizer lm --spp 64 \
    --seed 2 -q -o "$out/fit" --picture-spp 512 --sheet "$images/cornell_fit.png" >"$out/fit.txt"

say "shape: a ball that becomes a knotty body (docs/do/shape.md)"
scenes/make_shape.py "$out/shape" --views 6 --frequency 8 --res 32 >"$out/shape.txt"
shape=()
for k in 0 1 2 3 4 5; do
    "$importon" render "$out/shape/truth.xml" -s $k --spp 256 --seed 1 -q -o "$out/shape/target$k.exr"
    shape+=(-T "$out/shape/target$k.exr")
done
"$importon" fit "$out/shape/shape.xml" -p body.vertex_positions "${shape[@]}" --spp 6 --lr .1 -n 30 -q -o "$out/shape/found" \
    --picture-spp 256 --sheet "$images/shape_fit.png" >>"$out/shape.txt"

say "report: the page of that fit, as Chromium shows it"
"$importon" jacobian scenes/cornell.xml "${size[@]}" --spp 64 -p 'red.*' -p 'green.*' -q -o "$out/fit" >"$out/fit-J.txt"
"$importon" report "$out/fit" --title "Cornell box: paints and a lamp" -q
chromium --headless --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --hide-scrollbars \
    --window-size=900,900 --virtual-time-budget=5000 --screenshot="$PWD/$images/report.png" \
    "file://$(realpath "$out/fit/report.html")" 2>/dev/null

say "report: finite elements, as Chromium shows them"
"$importon" elements scenes/elements/d.xml --phong '*=0.1,0.6,15' --beam light_left=20 --beam light_right=20 --lux floor \
    --plane 0,0.4,0,0,0,1,1,0,0 --report "$out/elements" -q
"$importon" report "$out/elements" --title "Four lamps in a glossy room" -q
page=$out/elements/report.html
sed -i 's|</body>|<script>document.querySelector("#elements canvas").dispatchEvent(new KeyboardEvent("keydown", {key: "n"}));document.getElementById("pictures").remove()</script></body>|' "$page"
chromium --headless --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --hide-scrollbars \
    --window-size=620,820 --virtual-time-budget=5000 --screenshot="$PWD/$images/report_elements.png" \
    "file://$(realpath "$page")" 2>/dev/null

for picture in report report_elements textured lenses cornell_jacobian lamp_jacobian cornell_fit; do
    bytes=$(stat -c %s "$images/$picture.png")
    say "$images/$picture.png: $bytes bytes"
    ((bytes < most)) || { echo "$images/$picture.png is larger than $most bytes" >&2; exit 1; }
done

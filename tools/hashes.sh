#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Hashes of what the program computes on the scenes of this repository: pictures with their
# errors, walks, gradients, Jacobians, checks, fits, bent rays, finite elements, guides. A
# change that should move no number is compared with its parent:
#
#     tools/hashes.sh build/cli/importon >after.txt
#     diff before.txt after.txt
#
# Numbers of JSON answers are hashed with their keys, one a line, so that a new key is the
# only line that differs in the file of the answer, which --keep FOLDER leaves to look at.
set -uo pipefail
keep=
[[ ${1-} == --keep ]] && { keep=$2; shift 2; }
[[ $# == 1 ]] || { echo "usage: $0 [--keep FOLDER] IMPORTON" >&2; exit 2; }
importon=$(realpath "$1")
top=$(realpath "$(dirname "$0")/..")
work=$(mktemp -d)
cp -r "$top/scenes" "$work/scenes"
cd "$work" || exit 1
mkdir out

# answer NAME COMMAND...: the hash of what it prints in JSON.
answer() {
    local name=$1
    shift
    "$importon" "$@" --json -q 2>/dev/null | python3 -c '
import json, sys
volatile = {"seconds", "spp_taken"}  # what a clock says; what of "spp" was rounded
def walk(path, x):
    if isinstance(x, dict):
        for k in x: walk(path + "." + k, x[k])
    elif isinstance(x, list):
        for i, y in enumerate(x): walk(path + "[%d]" % i, y)
    elif isinstance(x, (int, float)) and path.rpartition(".")[2] not in volatile: print(path, repr(x))
for line in sys.stdin: walk("", json.loads(line))' >"out/$name.txt"
    [[ -s out/$name.txt ]] || echo "$name: no answer" >&2
}
# picture NAME SCENE...: the picture and its errors.
picture() {
    local name=$1
    shift
    "$importon" render "$@" --se --no-preview -q -o "out/$name.exr" 2>"out/$name.err" || cat "out/$name.err" >&2
}

c=scenes/cornell.xml t=scenes/textured.xml l=scenes/lamps.xml s=scenes/stam.xml
small=(-D res=24) wide=(-D width=32 -D height=24)
picture cornell $c "${small[@]}" --spp 16
picture cornell_mono $c "${small[@]}" --spp 16 -m mono
picture cornell_roulette $c "${small[@]}" --spp 16 -D max_depth=-1
picture cornell_guided $c "${small[@]}" --spp 8 --guide
picture cornell_steered $c "${small[@]}" --spp 8 --guide-share 0.5 --guide-roulette 1
picture furnace scenes/furnace.xml --spp 16
picture lamps $l "${small[@]}" --spp 16
picture textured $t "${wide[@]}" --spp 16
for sampling in mixture phong; do picture "stam_$sampling" $s "${small[@]}" --spp 32 -D "sampling=$sampling"; done
picture stam_path $s "${small[@]}" --spp 16 -D integrator=path
picture stam_reciprocal $s "${small[@]}" --spp 16 -D variant=reciprocal
for x in a b d d_lamps glossy; do picture "elements_$x" "scenes/elements/$x.xml" "${small[@]}" --spp 16; done
picture glossy_steered scenes/elements/glossy.xml "${small[@]}" --spp 8 --guide-share 0.5
picture lenses scenes/bend/lenses.xml "${wide[@]}" --spp 16
picture seen scenes/bend/seen.xml -D width=24 --spp 16

for x in cornell lamps; do "$importon" render "scenes/$x.xml" "${small[@]}" --paths "out/$x.paths" --count 60 -q; done
"$importon" render $t "${wide[@]}" --paths out/textured.paths --count 60 -q
"$importon" render scenes/bend/lenses.xml "${wide[@]}" --paths out/lenses.paths --count 60 -q
answer pixel_cornell render $c "${small[@]}" --pixel 9,9 --sample 3
answer pixel_stam render $s "${small[@]}" --pixel 9,9 --sample 3

"$importon" render $c "${small[@]}" --spp 64 --seed 9 --set white.reflectance.value=.5 -q --no-preview -o cornell.exr
"$importon" render $t "${wide[@]}" --spp 64 --seed 9 --set '*alpha*=0.3' -q --no-preview -o textured.exr 2>/dev/null ||
    "$importon" render $t "${wide[@]}" --spp 64 --seed 9 -q --no-preview -o textured.exr
"$importon" render $l "${small[@]}" --spp 64 --seed 9 -q --no-preview -o lamps.exr
"$importon" render $s "${small[@]}" --spp 64 --seed 9 -q --no-preview -o stam.exr
"$importon" render scenes/bend/seen.xml -D width=24 --spp 64 --seed 9 -q --no-preview -o seen.exr
for loss in l2 l1 log relative; do
    answer "loss_cornell_$loss" gradient $c "${small[@]}" --spp 16 -T cornell.exr --loss "$loss"
done
answer loss_cornell_guided gradient $c "${small[@]}" --spp 16 -T cornell.exr --guide-share 0.5
answer loss_cornell_sobol gradient $c "${small[@]}" --spp 32 -T cornell.exr --points sobol
answer loss_cornell_mono gradient $c "${small[@]}" --spp 16 -T cornell.exr -m mono
answer loss_textured gradient $t "${wide[@]}" --spp 16 -T textured.exr
answer loss_lamps gradient $l "${small[@]}" --spp 16 -T lamps.exr
answer loss_stam gradient $s "${small[@]}" --spp 16 -T stam.exr
answer loss_stam_paper gradient $s "${small[@]}" --spp 16 -T stam.exr -D alpha_gradient=paper -D sampling=phong
answer loss_seen gradient scenes/bend/seen.xml -D width=24 --spp 8 -T seen.exr
answer mean_cornell gradient $c "${small[@]}" --spp 16
answer mean_textured gradient $t "${wide[@]}" --spp 8
answer adjoint_lamps gradient $l "${small[@]}" --spp 8 --adjoint lamps.exr
answer jacobian_cornell jacobian $c "${small[@]}" --spp 8 --separate -o out/cornell_jacobian
answer jacobian_stam jacobian $s "${small[@]}" --spp 8 -o out/stam_jacobian
answer check_cornell check $c -D res=16 --paths 200 --fresh-spp 16
answer check_textured check $t -D width=16 -D height=12 --paths 200 --fresh-spp 16
answer check_stam check $s -D res=16 --paths 200 --fresh-spp 16
answer check_lamps check $l -D res=16 --paths 100 --fresh-spp 16
answer check_seen check scenes/bend/seen.xml -D width=16 --paths 100 --fresh-spp 8

for optimizer in adam lm lbfgs; do
    answer "fit_cornell_$optimizer" fit $c "${small[@]}" --spp 8 -T cornell.exr --optimizer "$optimizer" -n 4 -p '*reflectance*'
done
answer fit_textured fit $t "${wide[@]}" --spp 4 -T textured.exr -n 3 -o out/textured_fit
answer fit_cornell_sobol fit $c "${small[@]}" --spp 8 -T cornell.exr --points sobol -n 4 -p '*reflectance*'
answer fit_stam fit $s "${small[@]}" --spp 8 -T stam.exr --optimizer lm -n 3
answer fit_seen fit scenes/bend/seen.xml -D width=24 --spp 4 -T seen.exr -n 2 --no-intervals -o out/seen_fit

for x in focus lens-rz luneburg maxwell plume rod; do
    answer "bend_$x" bend trace "scenes/bend/$x.xml"
done
for x in luneburg rod plume; do answer "bend_check_$x" bend check "scenes/bend/$x.xml"; done
answer bend_fit bend fit scenes/bend/luneburg.xml -n 5
for x in a b d glossy; do
    answer "solve_$x" elements "scenes/elements/$x.xml" -D res=24 --stop 5
done
rm -f out/*.err
# Of an EXR file its chunks alone: the header says how long it took.
python3 - out <<'END'
import pathlib, struct, sys
for f in pathlib.Path(sys.argv[1]).rglob("*.exr"):
    b, i = f.read_bytes(), 8
    while b[i]:  # attributes: name, type, size, value
        i = b.index(0, b.index(0, i) + 1) + 1
        i += 4 + struct.unpack_from("<i", b, i)[0]
    f.write_bytes(b[struct.unpack_from("<q", b, i + 1)[0]:])
END
find out -type f ! -name '*manifest' -printf '%P\n' | LC_ALL=C sort | while read -r f; do
    printf '%s  %s\n' "$(sha256sum "out/$f" | cut -c1-16)" "$f"
done
if [[ $keep ]]; then rm -rf "$keep"; cp -r out "$keep"; fi
rm -rf "$work"

# SPDX-License-Identifier: Apache-2.0
# A result is proved by its manifest, whole or in part; one changed byte anywhere is found.
cp "$ROOT/scenes/furnace.xml" scene.xml
render=(importon render scene.xml -D res=16 --spp 20 --seed 3 -q --no-preview)
"${render[@]}" -o plain.exr
"${render[@]}" -o picture.exr --manifest picture.proof -t 2
importon compare plain.exr picture.exr | grep max
importon verify picture.proof -t 1
importon verify picture.proof --fraction 0.5 --seed 8
gradient=(importon gradient scene.xml -D res=16 -T plain.exr --spp 8)
"${gradient[@]}" >plain.txt
"${gradient[@]}" -o answer.txt --manifest answer.proof
cmp plain.txt <(tail -n +2 answer.txt) # behind the mark of its first line
importon verify answer.proof
fit=(importon fit scene.xml -D res=16 -T plain.exr -p 'ball.*' --set ball.reflectance.value=0.8 --spp 8 -n 2 --optimizer lm -q)
"${fit[@]}" -o result --manifest fit.proof --checkpoint state >fit.txt
importon verify fit.proof
importon verify fit.proof --fraction 0.2 --seed 7 --json
# change FILE: one byte in the middle; a second time: back again.
change() {
    python3 - "$1" <<'P'
import sys
b = bytearray(open(sys.argv[1], "rb").read())
b[len(b) // 2] ^= 1
open(sys.argv[1], "wb").write(b)
P
}
for file in scene.xml plain.exr answer.txt result/parameters.json answer.proof; do
    change $file
    for proof in picture answer fit; do
        importon verify $proof.proof >out 2>&1
        echo "$file $proof: exit $?"
    done
    change $file
done
rm answer.txt
importon verify answer.proof
importon verify scene.xml
importon check scene.xml --manifest x.proof
importon render scene.xml --time 1 --manifest x.proof
importon gradient - --manifest x.proof <scene.xml
importon render scene.xml --manifest scene.xml
importon verify picture.proof --fraction 0
importon verify picture.proof --fraction 1e-6 --seed 1
echo "exit $?"
# Without being asked for, a small manifest stands beside an output file; where sums take
# more than a megabyte, it has none.
"${render[@]}" -o other.exr
importon verify other.exr.manifest
importon verify other.exr.manifest --fraction 0.5 --seed 3
importon render scene.xml -D res=160 --spp 1 -q --no-preview -o large.exr
importon verify large.exr.manifest --fraction 0.5
"${fit[@]}" -o kept >/dev/null
importon verify kept/manifest --fraction 0.1 --seed 1
"${fit[@]}" -n 4 --checkpoint state --resume -o resumed >/dev/null
importon verify resumed/manifest --fraction 0.1
"${render[@]}" -o none.exr --no-manifest
"${render[@]}" -o none.exr --time 1
"${gradient[@]}" -o - >none.txt
echo "a file of another kind" >none.exr.manifest
"${render[@]}" -o none.exr
ls | grep none
cat none.exr.manifest
# The name of a result is no manifest, and its manifest is named.
importon render "$ROOT/scenes/furnace.xml" -D res=4 --spp 4 -q -o result.pfm
importon verify result.pfm
echo "exit $?"

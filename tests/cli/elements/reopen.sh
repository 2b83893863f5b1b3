# SPDX-License-Identifier: Apache-2.0
# A kept solution gives the same picture again; exports have one face a leaf.
scene=$ROOT/scenes/elements/b.xml
importon elements "$scene" -m mono -D res=16 --eps 5e-3 -q -o a.pfm --save b.el --export b.ply \
    --export b.json --json >a.json || exit 9
importon elements "$scene" -m mono -D res=16 --eps 5e-3 -q -o b.pfm --open b.el --threads 1 || exit 9
cmp a.pfm b.pfm
python3 - <<END
import json
leaves = json.load(open("a.json"))["leaves"]
faces = len(json.load(open("b.json"))["elements"])
head = open("b.ply", "rb").read(400).decode("latin1")
print(faces == leaves, "element face %d\n" % leaves in head)
END

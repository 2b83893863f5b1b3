# SPDX-License-Identifier: Apache-2.0
# --until: the same picture on any number of threads, what was reached, ends before that, a
# manifest that verify proves, and what does not go with it.
scene=$ROOT/scenes/cornell.xml
small=("$scene" -D res=8)
# Wanted, reached, looks; and if the error is what was wanted.
said() {
    python3 -c 'import json, sys; u = json.load(sys.stdin)["until"]
print(u["wanted"], u["reached"], u["looks"], u["reached"] == (u["error"] <= u["wanted"]))'
}
importon render "${small[@]}" --until .3 --threads 1 -q --json -o one.exr >one.json || exit 9
importon render "${small[@]}" --until .3 --threads 3 -q --json -o three.exr >three.json || exit 9
said <one.json
sed 's/one.exr/three.exr/' one.json | cmp - three.json && importon compare one.exr three.exr -q | tail -1
importon verify one.exr.manifest -q
importon gradient "${small[@]}" -q --json --until .2 -p 'light.*' | said
importon gradient "${small[@]}" -q --json --until .0001 --spp 64 -p 'light.*' | said
importon render "${small[@]}" -q --json --until .0001 --spp 64 -o few.exr | said
importon render "${small[@]}" --until .1 --pixel 1,1
echo "exit $?"
importon gradient "${small[@]}" --until .1 --part 1/2 -o part
echo "exit $?"
importon render "${small[@]}" --until 0
echo "exit $?"

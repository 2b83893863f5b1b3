# SPDX-License-Identifier: Apache-2.0
# Samples by point: the words, the JSON, the same bits on threads, what does not go together.
read_until() { importon read "$ROOT/scenes/office.xml" -m mono --sensor 1 --grid --until "$@"; }
read_until .05 --seed 3 | head -1
read_until .05 --seed 3 -t 1 --json >one.json && read_until .05 --seed 3 -t 3 --json >three.json
python3 - <<'X'
import json
one, three = (json.load(open(n + ".json"))["grids"][0] for n in ("one", "three"))
assert one["value"] == three["value"] and one["se"] == three["se"], "bits"
u = one["until"]
assert u["wanted"] == .05 and u["reached"] and 0 < u["error"] <= .05 and u["looks"] == 2 and one["samples"] >= 128, u
assert max(s / v for s, v in zip(one["se"], one["value"])) < .05
X
read_until .0001 --spp 100 | head -1
read_until .05 --ends
read_until .05 --time 3
read_until .05 --from lights
read_until .05 --part 1/2 -o part
importon read "$ROOT/scenes/office.xml" --until .05
# Ctrl-C leaves no reading, and says so.
importon read "$ROOT/scenes/office.xml" -m mono --grid --spp 1000000 &
sleep 1
kill -INT $!
wait $!

# SPDX-License-Identifier: Apache-2.0
# --time is kept where one round of all samples would take hours: what fits is the answer.
SECONDS=0
timeout 60 importon gradient "$ROOT/scenes/furnace.xml" --json --spp 100000000 --time 0.5 >a.json || exit 9
((SECONDS <= 30)) || echo "took $SECONDS s"
python3 - <<'END'
import json
a = json.load(open("a.json"))
assert 4 <= a["spp"] < 100000000, a["spp"]
assert abs(a["value"] - 0.5) < 5 * a["se"] + 1e-6, a
END

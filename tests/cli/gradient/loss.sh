# SPDX-License-Identifier: Apache-2.0
# The loss at its own target is zero within its error, and so is the gradient.
importon render "$ROOT/scenes/furnace.xml" -D res=8 --spp 4096 -q --seed 1 -o t.exr || exit 9
importon gradient "$ROOT/scenes/furnace.xml" -D res=8 --json --spp 64 --target t.exr >answer.json || exit 9
python3 - <<'END'
import json
a = json.load(open("answer.json"))
assert a["functional"] == "loss" and a["loss"] == "l2" and a["bias"] == "none"
assert abs(a["value"]) < 4.5 * a["se"] + 1e-4
for p in a["params"]:
    for g, s in zip(*(v if isinstance(v, list) else [v] for v in (p["grad"], p["se"]))):
        assert abs(g) < 4.5 * s + 1e-2, p
END

# SPDX-License-Identifier: Apache-2.0
# The furnace in closed form: d mean / d reflectance = 1, and JSON as documented.
importon gradient --json --seed 7 --spp 256 -p 'ball.*' "$ROOT/scenes/furnace.xml" >answer.json || exit 9
python3 - <<'END'
import json
a = json.load(open("answer.json"))
assert a["command"] == "gradient" and a["seed"] == 7 and a["functional"] == "mean"
(p,) = a["params"]
assert p["name"] == "ball.reflectance.value" and p["unit"] == "1" and p["value"] == 0.5
assert abs(a["value"] - 0.5) < 4.5 * a["se"] + 1e-6 and a["se"] < 1e-3, a
assert abs(p["grad"] - 1) < 4.5 * p["se"] + 1e-6 and p["se"] < 2e-3, p
END

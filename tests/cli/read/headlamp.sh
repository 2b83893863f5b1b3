# SPDX-License-Identifier: Apache-2.0
# A headlamp in fog: lux on a wall from both ends, and derivatives of every number. All light
# is the filament's; fog that is scaled is fog of another extinction.
importon read "$ROOT/scenes/headlamp.xml" -m mono -s 0 -D integrator=photons --ends --spp 30000 --json >ends.json || exit 9
importon read "$ROOT/scenes/headlamp.xml" -m mono -s 0 -p '*' --spp 60000 --json >all.json || exit 8
python3 - <<'END'
import json
r = json.load(open("ends.json"))["readings"]
assert len(r) == 1 and r[0]["unit"] == "lx" and abs(r[0]["z"]) < 4, r
assert r[0]["se"] < 0.05 * r[0]["value"] and r[0]["from_lights"]["se"] < 0.05 * r[0]["value"], r
r = json.load(open("all.json"))["readings"][0]
assert abs(r["value"] - 214.4) < 4 * (r["se"] + 0.6) and r["se"] < 3, r
d = {p["name"]: p["grad"] if isinstance(p["grad"], float) else p["grad"][0] for p in r["derivatives"]}
assert len(d) == 10, d
assert abs(d["filament.radiance.value"] * 1583000 / r["value"] - 1) < 2e-3, d
assert abs(d["fog.scale.value"] / (d["fog.sigma_t.value"] * 0.05) - 1) < 1e-6, d
END
echo "both ends agree"

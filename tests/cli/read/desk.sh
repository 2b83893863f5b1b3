# SPDX-License-Identifier: Apache-2.0
# Lux from both ends, with a derivative: twice the lamp, twice its part of the light.
importon read "$ROOT/scenes/desk.xml" -m mono --spp 20000 --ends -p 'batwing.scale.value' -p 'downlight.scale.value' --json \
    >answer.json || exit 9
python3 - <<'END'
import json
readings = json.load(open("answer.json"))["readings"]
assert [r["sensor"] for r in readings] == ["desk", "board"]
for r in readings:
    assert r["unit"] == "lx" and r["channel"] == "Y" and 50 < r["value"] < 2000, r
    assert abs(r["z"]) < 4.5 and r["from_lights"]["se"] > 0
    parts = [d["grad"] if isinstance(d["grad"], float) else d["grad"][0] for d in r["derivatives"]]
    errors = [d["se"] if isinstance(d["se"], float) else d["se"][0] for d in r["derivatives"]]
    assert len(parts) == 2 and min(parts) > 0
    # All light is lamp light, and lamps are linear.
    assert abs(sum(parts) - r["value"]) < 5 * (sum(errors) + r["se"]), r
END
echo "desk and board agree"

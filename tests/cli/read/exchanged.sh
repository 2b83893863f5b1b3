# SPDX-License-Identifier: Apache-2.0
# Roles exchanged in the file: the sensor's response as a lamp, the lamp's emission as a sensor.
for emits in left right; do
    importon read "$ROOT/scenes/photons/lens.xml" -m spectral -D emits=$emits --ends --spp 40000 --json >$emits.json || exit 9
done
python3 - <<'END'
import json, math
both = [json.load(open(f + ".json"))["readings"] for f in ("left", "right")]
assert all(len(r) == 1 and r[0]["channel"] == "response" and abs(r[0]["z"]) < 4 for r in both), both
a, b = both[0][0], both[1][0]
z = (a["value"] - b["value"]) / math.hypot(a["se"], b["se"])
assert abs(z) < 4 and a["se"] < .05 * a["value"] and b["se"] < .05 * b["value"], (a, b)
END
echo "four readings agree"
# Curves are read of one pixel alone, and have no derivatives.
sed 's/name="width" value="1"/name="width" value="2"/' "$ROOT/scenes/photons/lens/number-left.xml" >wide.xml
sed "s|lens/\$picture-\$emits.xml|$PWD/wide.xml|" "$ROOT/scenes/photons/lens.xml" >lens.xml
importon read lens.xml -m spectral 2>&1 | sed "s|$PWD/||"
importon read "$ROOT/scenes/photons/lens.xml" -m spectral -p '*' 2>&1 | sed "s|$ROOT/||"
true

# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: walks by the million take five times as long there.
# Two photographs with noise, an unknown gamma and exposure and 8 bits, one with a foreign block: its
# pixels are masked, the truth is in (nearly) all 95 % intervals, and what goes out goes in again.
take() { importon render "$SCENES/still.xml" -m mono -q --spp 512 "$@"; }
take -s 0 --seed 9 -D gamma=2 -o left.pfm
take -s 1 --seed 10 -D gamma=2 -D right_exposure=1.6 -o right.pfm
mkdir photos
python3 "$ROOT/tests/cli/measure/camera.py" left.pfm photos/left.ppm 2 0.01 1 8,8,6,5
python3 "$ROOT/tests/cli/measure/camera.py" right.pfm photos/right.ppm 2 0.01 2
measure() {
    importon measure "$SCENES/still.xml" photos -m mono -D floor=.4 -D block=.4 -D lamp=3 \
        --hold 'sky.*' -D gamma=2.2 --stages exposure,lights,materials --spp 8 "$@"
}
measure -o out >said || exit 9
grep -q 'left.ppm: .* are masked' said && echo masked
importon render "$SCENES/still.xml" -m mono -q --spp 1 --set @out/recovered.txt -o again.pfm && echo taken again
python3 - <<'P'
import json
a = json.load(open("out/measure.json"))
truth = {"left.gamma.value": 2, "left.exposure.value": 1, "right.gamma.value": 2, "right.exposure.value": 1.6, "floor.reflectance.value": .5,
         "block.reflectance.value": .6, "lamp.radiance.value": 4}
rows = {r["name"]: r for r in a["fit"]["params"]}
print(sorted(set(truth) ^ set(rows)), "explained" if a["explained"] else "not explained",
      a["photographs"][0]["masked"] > 4, a["photographs"][1]["masked"])
off = [(n, t, rows[n]["lo95"], rows[n]["hi95"]) for n, t in truth.items() if not rows[n]["lo95"] <= t <= rows[n]["hi95"]]
wide = [n for n, t in truth.items() if rows[n]["se"] > .3 * t]
far = [n for n, t in truth.items() if abs(rows[n]["value"] - t) > 3.5 * rows[n]["se"]]
print(len(off) <= 1 or off, wide, far)
print([abs(p["noise"] / .01006 - 1) < .36 for p in a["photographs"]])  # three errors of an estimate by 350 pixels
print([s["stage"] for s in a["stages"]][:4], [n["photograph"] for n in a["next"]] != [])
P

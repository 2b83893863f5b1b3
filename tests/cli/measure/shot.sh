# SPDX-License-Identifier: Apache-2.0
# Noise that grows with light: the photographs are explained by it, with a gamma too, and what is no noise is refused.
importon render "$SCENES/still.xml" -m mono -q -s 0 --seed 9 --spp 1024 -o light.pfm
python3 - <<'P'
import array
import random
(_, size, scale, data), rng = open("light.pfm", "rb").read().split(b"\n", 3), random.Random(4)
light = [max(0, x + rng.gauss(0, (.004 ** 2 + .003 * max(x, 0)) ** .5)) for x in array.array("f", data)]
for name, gamma in ("plain", 1), ("curved", 2.2):
    out = array.array("f", [x ** (1 / gamma) for x in light])
    open(name + ".pfm", "wb").write(b"Pf\n" + size + b"\n" + scale + b"\n" + out.tobytes())
P
measure() {
    local gamma=$1
    shift
    importon measure "$SCENES/still.xml" -m mono -D gamma="$gamma" -D floor=.4 -D block=.4 --hold 'sky.*' --hold '*.exposure.*' \
        --hold '*.gamma.*' --stages lights,materials --spp 32 --json "$@"
}
measure 1 --photo left=plain.pfm --noise read=.004,shot=.003 >plain.json || exit 9
measure 2.2 --photo left=curved.pfm --noise shot=.003,read=.004 >curved.json || exit 9
python3 - <<'P'
import json
for name in "plain", "curved":
    a, truth = json.load(open(name + ".json")), {"floor.reflectance.value": .5, "block.reflectance.value": .6, "lamp.radiance.value": 4}
    rows = {r["name"]: r for r in a["fit"]["params"]}
    print(a["explained"], [abs(rows[n]["value"] - t) < 3.5 * rows[n]["se"] < .35 * 3.5 * t / 2 for n, t in truth.items()],
          abs(a["stages"][-1]["chi2_per_freedom"] - 1) < .3)
P
measure 1 --photo left=plain.pfm --noise white=1 || echo $?
measure 1 --photo left=plain.pfm --noise read=0 || echo $?
measure 1 --photo left=plain.pfm --noise -1 || echo $?

# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: the same walks are run by headlamp and fit_window.
# From a picture of the beam, by walks from the lamp: how dense the fog is, and what the reflector reflects.
headlamp="$ROOT/scenes/headlamp.xml"
small="-D width=24 -D height=8"
importon render "$headlamp" -m mono -s 1 $small --spp 4096 --seed 9 -q --no-manifest -o beam.exr || exit 9
importon fit "$headlamp" -m mono $small -T beam.exr@1 -p fog.sigma_t.value -p mirror.specular_reflectance.value \
    -D density=.08 -D mirror=.6 --optimizer lm --loss relative --epsilon .5 --spp 512 -n 12 -q --json >answer.json || exit 8
python3 - <<'END'
import json
truth = {"fog.sigma_t.value": 0.05, "mirror.specular_reflectance.value": 0.9}
for p in json.load(open("answer.json"))["params"]:
    value, lo, hi = (p[k] if isinstance(p[k], float) else p[k][0] for k in ("value", "lo95", "hi95"))
    t = truth.pop(p["name"])
    half = (hi - lo) / 2
    assert 0 < half < 0.2 * t and abs(value - t) < 1.8 * half, p
assert not truth
END
echo "fog and reflector are found"

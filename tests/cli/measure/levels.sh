# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: minutes of fitting; the other cases of this folder go through the same code there.
# Coarse to fine, a camera is found by a photograph with a gamma, 8 bits, clipped values and masked pixels, from
# a third of the picture away.
importon render "$SCENES/still.xml" -m mono -q -s 1 --seed 9 --spp 512 -D right_exposure=3.4 -o right.pfm
python3 "$ROOT/tests/cli/measure/camera.py" right.pfm right.ppm 2.2 0.01 1 2,12,4,4
python3 - <<'P'
rows = [bytes(0 if 2 <= x < 6 and 12 <= y < 16 else 255 for x in range(24)) for y in range(18)]
open("mask.pgm", "wb").write(b"P5 24 18 255\n" + b"".join(rows))
P
fit() {
    importon fit "$SCENES/still.xml" -m mono -T right.ppm@1 --mask mask.pgm --clip auto -D right_exposure=3.4 -p right.pose \
        --set right.pose=0.5,-0.2,0.2,0.14,0.13,0.1 --optimizer lm --spp 16 -o "$@" >/dev/null 2>&1
    python3 - "$1/parameters.json" <<'P'
import json
import sys
a = json.load(open(sys.argv[1]))
rows = a["params"]
print("found" if all(abs(r["value"]) < 4.5 * r["se"] and r["se"] < .06 for r in rows) else "another minimum", a["clipped"]["clipped"] > 5)
P
}
fit fine --levels 4

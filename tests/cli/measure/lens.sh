# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: minutes of fitting; the other cases of this folder go through the same code there.
# A lens whose field of view and distortion nobody knew is measured beside the paints and the vignetting: intervals hold
# the truth, and none is wide; principal points where they are named, and no lens where nobody asks for it.
sed 's/<integer name="width" value="24"/<float name="vignetting_2" value="$dark"\/> &/
    s/<integrator/<default name="dark" value="0"\/> &/' "$SCENES/still.xml" >scene.xml
importon render scene.xml -m mono -q -s 0 --seed 9 --spp 256 -D dark=-.3 --set left.x_fov=43 --set left.opencv_k1=-.3 -o left.pfm
python3 "$ROOT/tests/cli/measure/camera.py" left.pfm left.ppm 2.2 0.01 1
measure() {
    importon measure "$scene" --photo "left=$photo" -m mono -D floor=.4 -D block=.45 --hold '*.gamma.*' --hold 'sky.*' --hold 'lamp.*' \
        --noise .0104 --spp 8 --no-masks --rounds 1 "$@"
}
scene=scene.xml photo=left.ppm
stages() { sed -n 's/^\(round 1, [a-z]*: [0-9]* numbers\).*/\1/p; s/^\(left\.[px][a-z]*_[^ ]*\) .*/\1/p; s/^\(left\.o[^ ]*\) .*/\1/p' | uniq; }
measure --stages lens,exposure,materials -n 8 -o out | stages
python3 - <<'P'
import json
rows = {r["name"]: r for r in json.load(open("out/measure.json"))["fit"]["params"]}
truth = {"left.x_fov": 43, "left.opencv_k1": -.3, "left.vignetting_2.value": -.3, "floor.reflectance.value": .5,
         "block.reflectance.value": .6, "left.exposure.value": 1}
print(sorted(set(truth) ^ set(rows)), sum(not r["lo95"] <= truth[n] <= r["hi95"] for n, r in rows.items()) <= 1,
      [n for n, r in rows.items() if abs(r["value"] - truth[n]) > 3.5 * r["se"]], [n for n in rows if rows[n]["se"] > (1 if "fov" in n else .2 if "k1" in n else .03)])
P
# What is measured, by a smaller photograph.
sed 's/value="24"/value="12"/; s/value="18"/value="9"/' scene.xml >small.xml
importon render small.xml -m mono -q -s 0 --seed 9 --spp 64 -o small.pfm
python3 "$ROOT/tests/cli/measure/camera.py" small.pfm small.ppm 2.2 0.01 1
scene=small.xml photo=small.ppm
measure -n 1 -p left.opencv_k2 -p left.principal_point_offset_x --stages cameras,lens | stages
measure -n 1 --stages exposure,materials | grep -c 'opencv\|x_fov\|, lens' || true

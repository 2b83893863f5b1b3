# SPDX-License-Identifier: Apache-2.0
# Noise of light, through a power: values of a dark wall are lower in the mean than those of its light, by more than
# the error of their mean, and those that noise makes far darker than the wall count as the others do.
cat >wall.xml <<'X'
<scene version="3.0.0">
    <integrator type="path"> <integer name="max_depth" value="2"/> </integrator>
    <sensor type="perspective" id="left"> <float name="fov" value="40"/>
        <transform name="to_world"> <lookat origin="0, 0, 3" target="0, 0, 0" up="0, 1, 0"/> </transform>
        <film type="hdrfilm"> <integer name="width" value="36"/> <integer name="height" value="27"/> <rfilter type="box"/>
            <float name="gamma" value="2.2"/> </film>
    </sensor>
    <shape type="rectangle"> <transform name="to_world"> <scale value="4"/> </transform>
        <bsdf type="diffuse" id="wall"> <spectrum name="reflectance" value="0.4"/> </bsdf> </shape>
    <emitter type="constant" id="sky"> <spectrum name="radiance" value="0.2"/> </emitter>
</scene>
X
python3 - <<'P'
import array
import random
rng = random.Random(5)
values = array.array("f", [max(0, .1 + rng.gauss(0, .03)) ** (1 / 2.2) for _ in range(36 * 27)])
open("left.pfm", "wb").write(b"Pf\n36 27\n-1\n" + values.tobytes())
P
importon measure wall.xml left.pfm -m mono -p 'wall.*' --noise read=.03 --spp 4 -n 3 --rounds 1 --json >out.json || exit 9
python3 - <<'P'
import json
a = json.load(open("out.json"))
row = a["fit"]["params"][0]
print(a["explained"], abs(row["value"] - .5) < 2.5 * row["se"] < .015)
P

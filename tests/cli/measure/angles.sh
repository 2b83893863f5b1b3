# SPDX-License-Identifier: Apache-2.0
# What a measurement multiplies by the means of photograph and picture are radiances and scales: a sky's rotation and a
# spot's angles stay.
cat >scene.xml <<'X'
<scene version="3.0.0">
    <integrator type="path"> <integer name="max_depth" value="2"/> </integrator>
    <sensor type="perspective" id="view"> <float name="fov" value="40"/>
        <transform name="to_world"> <lookat origin="0, 2, 2" target="0, 0, 0" up="0, 1, 0"/> </transform>
        <film type="hdrfilm"> <integer name="width" value="12"/> <integer name="height" value="9"/> <rfilter type="box"/> </film>
    </sensor>
    <shape type="rectangle"> <transform name="to_world"> <scale value="2"/> <rotate x="1" angle="-90"/> </transform>
        <bsdf type="diffuse" id="floor"/> </shape>
    <emitter type="envmap" id="sky"> <string name="filename" value="sky.pfm"/> <float name="scale" value="1"/>
        <transform name="to_world"> <rotate y="1" angle="30"/> </transform> </emitter>
    <emitter type="spot" id="lamp"> <spectrum name="intensity" value="2"/> <float name="cutoff_angle" value="25"/>
        <transform name="to_world"> <lookat origin="0, 3, 0" target="0, 0, 0" up="0, 0, 1"/> </transform> </emitter>
</scene>
X
python3 - <<'P'
import array
v = array.array("f", [1 + (k % 8) / 8 for k in range(32)])
open("sky.pfm", "wb").write(b"Pf\n8 4\n-1\n" + v.tobytes())
P
importon render scene.xml -m mono -q --spp 64 --seed 5 -o light.pfm
python3 "$ROOT/tests/cli/measure/camera.py" light.pfm view.ppm 2.2 0.01 1
importon measure scene.xml view.ppm -m mono --stages lights --spp 2 -n 1 --rounds 1 --hold sky.data 2>/dev/null | grep 'by the means' |
    sed 's/:.*//'
# A light that is held at a wrong intensity is named, though nothing that moves has derivatives beside a ball of frosted glass
# with facets of GGX.
sed 's/type="diffuse" id="floor"/type="plastic" id="floor"/
    s|^</scene>|<shape type="sphere"> <point name="center" x="0" y="-5" z="0"/> <float name="radius" value=".1"/> <bsdf type="roughdielectric"> <string name="distribution" value="ggx"/> </bsdf> </shape>&|' \
    scene.xml >glossy.xml
cone="--set lamp.cutoff_angle=12 --set lamp.beam_width=8"
importon render glossy.xml -m mono -q --spp 1024 --seed 6 $cone --set lamp.intensity=4 -o view.pfm
importon measure glossy.xml view.pfm -m mono --spp 16 --rounds 1 $cone --noise .005 --stages cameras,lights --hold 'lamp.*' \
    --hold sky.data --hold sky.rotation 2>/dev/null | grep -o 'cameras stay\|may be wrong: lamp.intensity.value'

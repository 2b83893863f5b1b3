# SPDX-License-Identifier: Apache-2.0
# Sensors of different sizes share one sheet; and a file that is no checkpoint is a bad input.
cat >scene.xml <<'X'
<scene version="3.0.0">
    <integrator type="path"/>
    <sensor type="perspective"><film type="hdrfilm">
        <integer name="width" value="6"/><integer name="height" value="4"/><rfilter type="box"/></film></sensor>
    <sensor type="perspective"><film type="hdrfilm">
        <integer name="width" value="3"/><integer name="height" value="5"/><rfilter type="box"/></film></sensor>
    <emitter type="constant" id="sky"/>
</scene>
X
importon render scene.xml -s 0 --spp 1 -q -o 0.exr || exit 9
importon render scene.xml -s 1 --spp 1 -q -o 1.exr || exit 9
importon fit scene.xml -T 0.exr@0 -T 1.exr@1 -n 2 --spp 1 -q -o out --sheet sheet.png >/dev/null
echo "exit $?"
head -c 24 sheet.png | od -An -tu1 -j16
importon fit scene.xml -T 0.exr --spp 1 -q --checkpoint scene.xml --resume
echo "exit $?"

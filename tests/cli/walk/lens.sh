# SPDX-License-Identifier: Apache-2.0
# The ray of a pixel through a lens that distorts, and what is refused.
cat >lens.xml <<'XML'
<scene version="3.0.0">
    <default name="k1" value="-0.28"/>
    <integrator type="path"/>
    <emitter type="constant"/>
    <sensor type="perspective" id="cam">
        <float name="opencv_fx" value="8"/>
        <float name="opencv_k1" value="$k1"/>
        <float name="opencv_k2" value="0.09"/>
        <film type="hdrfilm">
            <integer name="width" value="8"/>
            <integer name="height" value="6"/>
            <rfilter type="box"/>
        </film>
    </sensor>
</scene>
XML
importon render lens.xml --pixel 7,5 --sample 0 --seed 1
# Seen at x'' = (7.5506 - 4)/8 = .44383, y'' = (5.0582 - 3)/8 = .25728, and back:
python3 -c '
x, y = .44383, .25728
for i in range(100):
    r2 = x * x + y * y
    R = 1 - .28 * r2 + .09 * r2 * r2
    x, y = .44383 / R, .25728 / R
n = (x * x + y * y + 1) ** .5
print("%.4f %.4f %.4f" % (-x / n, -y / n, 1 / n))'
importon render lens.xml -D k1=-0.9 --pixel 7,5
importon gradient lens.xml -p cam.opencv_fx

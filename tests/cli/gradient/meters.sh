# SPDX-License-Identifier: Apache-2.0
# Readings of meters by what moves: a mean over a square, and points of a grid; recorded walks of check.
cat >room.xml <<'X'
<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="3"/></integrator>
    <shape type="rectangle" id="table">
        <sensor type="irradiancemeter" id="mean"><film type="hdrfilm"><integer name="width" value="1"/>
            <integer name="height" value="1"/><rfilter type="box"/></film></sensor>
    </shape>
    <shape type="rectangle" id="plane">
        <transform name="to_world"><translate z="0.1"/></transform>
        <sensor type="irradiancemeter" id="grid"><boolean name="virtual" value="true"/><string name="at" value="points"/>
            <film type="hdrfilm"><integer name="width" value="3"/><integer name="height" value="2"/></film></sensor>
    </shape>
    <shape type="cube" id="block"><transform name="to_world"><scale value="0.2"/><translate x="0.3" y="0.2" z="0.8"/></transform></shape>
    <shape type="rectangle" id="lamp">
        <transform name="to_world"><scale value="0.4"/><rotate x="1" angle="180"/><translate x="0.5" z="2"/></transform>
        <emitter type="area"><rgb name="radiance" value="5"/></emitter>
    </shape>
</scene>
X
for sensor in 0 1; do
    importon gradient room.xml -m mono --sensor $sensor --spp 32 -p lamp.pose -p block.pose
    importon check room.xml -m mono --sensor $sensor -p lamp.pose --only frozen 2>summary |
        awk '$1 == "frozen" {print $2, ($6 < 1e-7 ? "within 1e-7" : $6), $NF}'
done
importon gradient room.xml -m mono -p table.pose --spp 32
importon gradient room.xml -m mono --sensor 1 -p plane.pose --spp 32

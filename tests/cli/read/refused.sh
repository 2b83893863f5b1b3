# SPDX-License-Identifier: Apache-2.0
# What has one end, or cannot be reached, is refused by name.
furnace="$ROOT/scenes/furnace.xml"
importon read "$ROOT/scenes/desk.xml" --ends --from lights
importon render "$ROOT/scenes/stam.xml" --from lights -o a.exr
importon elements "$ROOT/scenes/cornell.xml" --from lights
importon check "$ROOT/scenes/cornell.xml" -D res=4 --from lights --verify-sampling
cat >ray.xml <<'X'
<scene version="3.0.0"><integrator type="ptracer"/><sensor type="radiancemeter"><film type="hdrfilm">
<integer name="width" value="1"/><integer name="height" value="1"/></film></sensor>
<shape type="sphere"><emitter type="area"/></shape></scene>
X
importon read ray.xml
cat >stray.xml <<'X'
<scene version="3.0.0"><integrator type="path"/><sensor type="irradiancemeter"/></scene>
X
importon read stray.xml
cat >large.xml <<'X'
<scene version="3.0.0"><integrator type="path"/><shape type="sphere"><sensor type="irradiancemeter"/></shape></scene>
X
importon read large.xml
cat >endless.xml <<'X'
<scene version="3.0.0"><integrator type="volpath"/><medium type="homogeneous" id="haze"/>
<sensor type="perspective"><ref id="haze" name="medium"/><film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/></film></sensor>
<emitter type="constant" id="sky"/><shape type="sphere"/></scene>
X
importon render endless.xml --from lights -o a.exr
cat >turned.xml <<'X'
<scene version="3.0.0"><integrator type="ptracer"/><sensor type="perspective"/>
<shape type="sphere"><bsdf type="twosided" id="tiles"><bsdf type="normalmap"><texture type="checkerboard" name="normalmap"/><bsdf type="diffuse"/></bsdf></bsdf></shape>
<shape type="sphere"><emitter type="area"/></shape></scene>
X
importon render turned.xml -o a.exr
importon fit "$ROOT/scenes/desk.xml" -T =@0 -o F
importon fit "$ROOT/scenes/cornell.xml" -D res=8 -T =3@0 -o F
true

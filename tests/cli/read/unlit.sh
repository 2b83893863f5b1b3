# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: walks by the million take five times as long there.
# Sensors in the dark, and what light walks cannot bring: an error or a warning.
cat >unlit.xml <<'X'
<scene version="3.0.0"><integrator type="path"/>
<shape type="rectangle"><sensor type="irradiancemeter" id="meter"><film type="hdrfilm">
<integer name="width" value="1"/><integer name="height" value="1"/></film></sensor></shape></scene>
X
importon read unlit.xml
importon read unlit.xml --from lights
# One of two meters has its back to the lamp.
cat >wall.xml <<'X'
<scene version="3.0.0"><integrator type="path"/>
<default name="radiance" value="0,1,0"/>
<shape type="rectangle"><transform name="to_world"><scale value=".1"/><translate z="1"/></transform>
<bsdf type="diffuse"><float name="reflectance" value="0"/></bsdf><sensor type="irradiancemeter" id="before"><film type="hdrfilm">
<integer name="width" value="1"/><integer name="height" value="1"/></film></sensor></shape>
<shape type="disk"><transform name="to_world"><rotate y="1" angle="180"/><scale value=".1"/><translate z="-1"/></transform>
<bsdf type="diffuse"><float name="reflectance" value="0"/></bsdf><sensor type="irradiancemeter" id="behind"><film type="hdrfilm">
<integer name="width" value="1"/><integer name="height" value="1"/></film></sensor></shape>
<shape type="rectangle"><transform name="to_world"><scale value="3"/><rotate y="1" angle="180"/><translate z="2"/></transform>
<emitter type="area"><rgb name="radiance" value="$radiance"/></emitter></shape></scene>
X
importon read wall.xml --spp 16
importon read wall.xml --spp 16 -s 1 --json | grep -A3 unlit
importon read wall.xml --spp 16 -s 0 --json | grep -A1 unlit
importon read wall.xml --spp 16 -s 0 -D radiance=0
importon read wall.xml --spp 1 -s 1 --ends >/dev/null
# A camera before clear glass and a mirror.
cat >glass.xml <<'X'
<scene version="3.0.0"><integrator type="ptracer"/><sensor type="perspective" id="eye"><film type="hdrfilm">
<integer name="width" value="4"/><integer name="height" value="4"/></film></sensor>
<shape type="sphere"><bsdf type="dielectric" id="glass"/></shape>
<shape type="sphere"><point name="center" value="0,0,5"/><emitter type="area"/></shape></scene>
X
importon render glass.xml --spp 1 -o a.exr
importon render glass.xml --spp 1 --from sensor -o a.exr
importon read glass.xml --spp 1 >/dev/null
importon fit glass.xml -m mono -T a.exr -p shape1.emitter.radiance.value --spp 4 --optimizer lm --iterations 1 -o fit >told 2>&1
grep 'is missing' told >&2 # once, though the fit writes two pictures
true
cat >night.xml <<'X'
<scene version="3.0.0"><integrator type="path"/>
<emitter type="sunsky" id="sky"><float name="latitude" value="50"/><float name="longitude" value="10"/><float name="timezone" value="1"/>
<integer name="year" value="2024"/><integer name="month" value="12"/><integer name="day" value="21"/><float name="hour" value="22"/></emitter>
<shape type="rectangle"><sensor type="irradiancemeter" id="grid"/></shape></scene>
X
importon read night.xml -m mono >/dev/null
# Days that no month has; places and clocks that do not belong together: the time zone was forgotten.
sed 's/"month" value="12"/"month" value="2"/; s/"day" value="21"/"day" value="30"/' night.xml >day.xml
importon read day.xml -m mono
sed 's/<float name="timezone" value="1"\/>//; s/"hour" value="22"/"hour" value="18"/' night.xml >zone.xml
importon read zone.xml -m mono >/dev/null
# Hours in universal time are right at every longitude.
sed 's/"longitude" value="10"/"longitude" value="-100"/; s/"timezone" value="1"/"timezone" value="0"/; s/"hour" value="22"/"hour" value="18"/' night.xml >utc.xml
importon read utc.xml -m mono >/dev/null
sed 's/"longitude" value="10"/"longitude" value="-100"/; s/"timezone" value="1"/"timezone" value="-6"/; s/"hour" value="22"/"hour" value="12"/' night.xml >right.xml
importon read right.xml -m mono >/dev/null
# A latitude alone.
sed -E 's/<float name="(longitude|timezone)"[^>]*>//g; s/value="22"/value="12"/' night.xml >place.xml
importon read place.xml -m mono >/dev/null

# SPDX-License-Identifier: Apache-2.0
# Readings are targets with their errors: the flux through a window says how bright a lamp
# is, and the spectrum there says what the wall reflects by wavelength.
cat >window.xml <<'X'
<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="4"/></integrator>
<default name="film" value="hdrfilm"/><default name="wall" value="400:0.5, 700:0.5"/>
<shape type="cube"><boolean name="flip_normals" value="true"/>
<bsdf type="diffuse" id="wall"><spectrum name="reflectance" value="$wall"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><scale x=".3" y=".5"/><rotate y="1" angle="90"/><translate x="-.999"/></transform>
<bsdf type="diffuse"><float name="reflectance" value="0"/></bsdf>
<sensor type="irradiancemeter" id="window"><film type="$film"><integer name="width" value="1"/><integer name="height" value="1"/><rfilter type="box"/>
SRF</film></sensor></shape>
<shape type="rectangle"><transform name="to_world"><scale value=".4"/><rotate x="1" angle="90"/><translate y=".99"/></transform>
<emitter type="area" id="lamp"><spectrum name="radiance" value="3"/></emitter></shape></scene>
X
sed 's|^SRF||' window.xml >flux.xml
sed 's|^SRF|<spectrum name="blue" value="400:1, 500:1"/><spectrum name="green" value="500:1, 600:1"/><spectrum name="red" value="600:1, 700:1"/>|' window.xml >spectrum.xml
# A window of .6 x 1 m: 1.2 W through it are 2 W/m^2, known to .02.
importon fit flux.xml -m mono --spp 4000 -p lamp.radiance.value -T =2+-.02 --optimizer lm -q -o F >/dev/null || exit 9
importon read flux.xml -m mono --spp 100000 --set @F/recovered.txt -p lamp.radiance.value --json >flux.json || exit 8
# What the wall reflects, from what the window sees of another one.
importon render spectrum.xml -m spectral -D film=specfilm -D wall="400:0.3, 700:0.8" --spp 100000 --se -q -o seen.exr || exit 7
importon fit spectrum.xml -m spectral -D film=specfilm -T seen.exr@0 -p wall.reflectance.values --optimizer lm --spp 10000 -q -o S >/dev/null || exit 6
python3 - <<'END'
import json
lamp, = json.load(open("F/parameters.json"))["params"]
slope, = json.load(open("flux.json"))["readings"][0]["derivatives"][0]["grad"]
# A reading is linear in the lamp: 2/slope, with the target's error over the slope and that of the walks beside it.
assert abs(lamp["value"] - 2 / slope) < 4.5 * (lamp["se"] ** 2 - (0.02 / slope) ** 2) ** 0.5, (lamp, slope)
assert 0.02 / slope < lamp["se"] < 1.1 * 0.02 / slope, (lamp, slope)
assert lamp["lo95"] < 2 / slope < lamp["hi95"], lamp
wall = json.load(open("S/parameters.json"))["params"]
for found, truth in zip(wall, (0.3, 0.8), strict=True):
    assert abs(found["value"] - truth) < 4.5 * found["se"] and found["se"] < 0.02, found
END
echo "a flux and a spectrum are matched"

# SPDX-License-Identifier: Apache-2.0
# Watts and lumens in one scene: a Radiance light without efficacy beside luminaires or photometric
# meters, and meters without units below luminaires.
printf 'void light glow 0 0 3 20 20 20\nglow polygon panel 0 0 12 2 2 3 2 3 3 3 3 3 3 2 3\n' >lamp.rad
scene() { # FILE, UNITS OF THE METER, WHAT ELSE THERE IS
    cat >"$1" <<XML
<scene version="3.0.0"><integrator type="path"/>$3
<shape type="rectangle"><sensor type="irradiancemeter" id="work"><boolean name="virtual" value="true"/>$2
<film type="hdrfilm"/></sensor></shape></scene>
XML
}
rad='<include filename="lamp.rad"/>' lux='<string name="units" value="photometric"/>'
spot="<emitter type='ies' id='spot'><string name='filename' value='$ROOT/scenes/lamps/opal.ldt'/>"
info() { importon info "$@" 2>&1 >/dev/null; }
scene both.xml "$lux" "$rad$spot</emitter>"
info both.xml
info both.xml -D efficacy=179
info both.xml -D efficacy=1
scene said.xml "$lux" "<default name='efficacy' value='179'/>$rad$spot</emitter>"
info said.xml
scene meter.xml "$lux" "$rad"
info meter.xml
scene watts.xml "" "$rad"
info watts.xml
scene none.xml "" "$spot</emitter>"
info none.xml
info none.xml -m mono
info none.xml -m spectral
scene radiometric.xml "" "$spot<string name='units' value='radiometric'/></emitter>"
info radiometric.xml
scene chosen.xml '<string name="units" value="radiometric"/>' "$spot</emitter>"
info chosen.xml
true

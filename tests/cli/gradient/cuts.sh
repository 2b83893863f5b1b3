# SPDX-License-Identifier: Apache-2.0
# What moves through a camera's near plane, or through a meter that is absent, is cut along a line that is no
# edge: refused. Beside them, and where nothing of it moves, there is an answer.
scene() { # height of the plane, x of the block
    echo "<scene version='3.0.0'><integrator type='path'/><sensor type='orthographic' id='camera'>
<transform name='to_world'><scale value='2'/><lookat origin='0,0,$1' target='0,0,-9' up='0,1,0'/></transform>
<film type='hdrfilm'><integer name='width' value='4'/><integer name='height' value='4'/><rfilter type='box'/></film></sensor>
<shape type='rectangle' id='tile'><transform name='to_world'><translate z='$1'/></transform>
<sensor type='irradiancemeter' id='meter'><boolean name='virtual' value='true'/>
<film type='hdrfilm'><integer name='width' value='2'/><integer name='height' value='2'/><rfilter type='box'/></film></sensor></shape>
<shape type='cube' id='block'><transform name='to_world'><scale value='.3'/><translate x='$2'/></transform></shape>
<shape type='rectangle' id='floor'><transform name='to_world'><scale value='4'/><translate z='-1'/></transform></shape>
<emitter type='constant'/></scene>"
}
for place in "0 0" "0 .9" ".5 0" "0 5"; do
    scene $place >cut.xml
    for sensor in camera meter; do
        echo "- $place, $sensor"
        importon gradient cut.xml -m mono -s $sensor --spp 4 -p block.pose >answer && grep -c 'block.pose\[5\]' answer
    done
done
scene 0 0 >cut.xml
importon gradient cut.xml -m mono -s camera --spp 4 -p floor.pose >answer && grep -c 'floor.pose\[5\]' answer

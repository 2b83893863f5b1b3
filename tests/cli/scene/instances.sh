# SPDX-License-Identifier: Apache-2.0
# What cannot stand in a group, and placements that are refused, each with its place.
head="<scene version='3.0.0'><integrator type='path'/><sensor type='perspective'/><emitter type='constant'/>"
ball="<shape type='shapegroup' id='balls'><shape type='sphere'/></shape>"

refused() { # what, scene
    echo "+ $1" >&2
    printf '%s\n%s\n</scene>\n' "$head" "$2" >scene.xml
    importon render scene.xml -o out.exr
}
at() { # an instance of balls, with more in it
    echo "<shape type='instance'><ref id='balls'/>$1</shape>"
}

refused "a light in a group" "<shape type='shapegroup' id='balls'><shape type='sphere'><emitter type='area'/></shape></shape>"
refused "a sensor in a group" "<shape type='shapegroup'><shape type='sphere'><sensor type='irradiancemeter'/></shape></shape>"
refused "a group in a group" "<shape type='shapegroup' id='all'>$ball</shape>"
refused "a material in a group" "<shape type='shapegroup' id='balls'><shape type='sphere'/><bsdf type='diffuse'/></shape>"
refused "nothing in a group" "<shape type='shapegroup' id='balls'/>$(at '')"
refused "an instance of itself" "<shape type='shapegroup' id='balls'>$(at '')</shape>"
refused "no group" "<shape type='instance'/>"
refused "two groups" "$ball<shape type='shapegroup' id='others'><shape type='cube'/></shape>$(at "<ref id='others'/>")"
refused "a shape of the scene" "<shape type='sphere' id='s'/><shape type='shapegroup' id='balls'><ref id='s'/></shape>"
refused "a flat placement" "$ball$(at "<transform name='to_world'><scale x='0'/></transform>")"
refused "a projective one" "$ball$(at "<transform name='to_world'><matrix value='1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1'/></transform>")"
refused "one beyond all bounds" "$ball$(at "<transform name='to_world'><scale value='1e30'/></transform>")"
refused "a motion through a mirror" "$ball$(at "<transform name='to_world_end'><scale x='-1'/></transform>")"
refused "a motion back in time" "$ball$(at "<transform name='to_world_end'><scale x='2'/></transform><float name='time_start' value='1'/>")"
refused "a misspelt property" "$ball$(at "<transform name='to_wrold'><scale x='2'/></transform>")"
refused "shutter closed before open" "<sensor type='perspective'><float name='shutter_open' value='2'/><float name='shutter_close' value='1'/></sensor>"
refused "times that do not ascend" "<emitter type='point'><string name='times' value='0:1, 0:2'/></emitter>"
refused "a light that is always off" "<emitter type='point'><string name='times' value='0:0'/></emitter>"
refused "a response of 0 while the shutter is open" "<sensor type='perspective'><float name='shutter_close' value='1'/><string name='times' value='1:0, 2:1'/></sensor>"
echo "+ walks alone" >&2
printf '%s\n%s\n</scene>\n' "$head" "$ball$(at '')" | sed "s/'path'/'elements'/" >scene.xml
importon render scene.xml -o out.exr

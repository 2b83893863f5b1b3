# SPDX-License-Identifier: Apache-2.0
# A block that moves while the shutter is open, and both of its places: listed, set, differentiated and
# checked; refusals by name, also of one that slides over the floor.
cat >scene.xml <<END
<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="3"/></integrator>
<sensor type="perspective" id="camera"><float name="shutter_open" value="0"/><float name="shutter_close" value="1"/>
<transform name="to_world"><lookat origin="0, -5, 3" target="0, 0, 0" up="0, 0, 1"/></transform>
<film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/></film></sensor>
<emitter type="constant"/>
<shape type="rectangle" id="floor"><transform name="to_world"><scale value="3"/></transform></shape>
<shape type="shapegroup" id="group"><shape type="cube" id="block"><transform name="to_world"><scale value="0.4"/></transform></shape></shape>
<shape type="instance" id="cart"><ref id="group"/>
<transform name="to_world"><translate x="-0.8" z="0.5"/></transform>
<transform name="to_world_end"><rotate z="1" angle="60"/><translate x="0.8" y="0.3" z="0.6"/></transform></shape>
</scene>
END
render() { importon render -q --spp 4 "$@" -o x.pfm scene.xml && cksum <x.pfm; }
rest=$(render)
[[ $(render --set cart.pose=0,0,0,0,0,0 --set cart.pose_end=0,0,0,0,0,0) == "$rest" ]] && echo at rest: the same
[[ $(render --set cart.pose_end=0,0.5,0,0,0,0.4) != "$rest" ]] && echo its last place moves: another picture
importon info scene.xml | sed -n '/^geometry/,$p'
importon info --set cart.pose_end=0,0.5,0,0,0,0.4 scene.xml | grep 'pose_end'
importon gradient -q --spp 4 -p cart.pose -p cart.pose_end -p floor.pose -p camera.pose scene.xml | grep -c 'pose'
importon gradient -q --spp 4 -p cart.pose_end --target x.pfm scene.xml | grep -c 'cart.pose_end\['
importon check -q --paths 100 -p cart.pose -p cart.pose_end -p camera.pose --only frozen scene.xml | grep -c ' ok'
wood="<bsdf type=\"diffuse\"><texture type=\"bitmap\" name=\"reflectance\"><string name=\"filename\" value=\"$ROOT/scenes/textured/waves.png\"/></texture></bsdf>"
sed "s|<scale value=\"0.4\"/></transform>|&$wood|" scene.xml >painted.xml
importon check -q --paths 100 -p cart.pose -p cart.pose_end -p camera.pose --only frozen painted.xml | grep -c ' ok'
importon fit -q --spp 4 -p cart.pose_end --target x.pfm -n 1 -o fitted scene.xml | grep -c 'cart.pose_end\['
importon gradient -q --spp 4 -p cart.scale scene.xml
importon gradient -q --spp 4 -p cart.to_world scene.xml
importon gradient -q --spp 4 -p group.pose scene.xml
importon gradient -q --spp 4 -p floor.pose_end scene.xml
render --set cart.pose_end=1,2
sed 's|z="0.[56]"|z="0.4"|' scene.xml >slides.xml
importon gradient -q --spp 4 -p cart.pose_end slides.xml
sed 's|<rotate z="1" angle="60"/>|<scale value="1.2"/>|' scene.xml >grows.xml
importon gradient -q --spp 4 -p cart.pose_end grows.xml
importon gradient -q --spp 4 -p cart.wheels scene.xml

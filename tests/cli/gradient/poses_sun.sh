# SPDX-License-Identifier: Apache-2.0
# A sun that moves in its sky, a projector, and a radiancemeter: listed, differentiated where edges have
# no part, found by a fit, and refused.
film='<film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/></film>'
cat >scene.xml <<END
<scene version="3.0.0"><integrator type="direct"/>
<sensor type="perspective" id="camera"><float name="fov" value="60"/>
<transform name="to_world"><lookat origin="0, 0, 0" target="0, 1, .4" up="0, 0, 1"/></transform>$film</sensor>
<emitter type="ciesky" id="sky"><integer name="sky" value="12"/><vector name="sun_direction" value=".3, 1, .6"/></emitter>
</scene>
END
importon info scene.xml | grep '^sky\.' || exit 9
importon render scene.xml --set sky.sun_direction=0.1,0.8304547985,0.4982728791 --spp 64 -o target.exr 2>/dev/null || exit 9
echo "+ fit" >&2
importon fit scene.xml -p sky.sun_direction --hold 'sky.sun_direction[1-2]' --target target.exr --optimizer lm --spp 16 2>/dev/null |
    awk '$1 ~ /^sky/ {print $1, ($1 ~ /0/ ? ($3 > .095 && $3 < .105 ? "found" : $3) : $NF)}'
echo "+ below the horizon" >&2
importon render scene.xml --set sky.sun_direction=1,0,-1 -o out.exr
echo "+ no direction" >&2
importon render scene.xml --set sky.sun_direction=0,0,0 -o out.exr
echo "+ beside a turn" >&2
importon gradient scene.xml -p sky.turn -p sky.sun_direction
echo "+ no disc" >&2
importon gradient scene.xml -p sky.sun_radius
cat >ray.xml <<END
<scene version="3.0.0"><integrator type="direct"/>
<sensor type="radiancemeter" id="ray"><vector name="origin" value="0, 0, 2"/><vector name="direction" value=".2, .1, -1"/>
<film type="hdrfilm"><integer name="width" value="1"/><integer name="height" value="1"/><rfilter type="box"/></film></sensor>
<emitter type="projector" id="beamer"><rgb name="irradiance" value="1"/>
<transform name="to_world"><lookat origin="0, 0, 3" target="0, 0, 0" up="0, 1, 0"/></transform></emitter>
<shape type="rectangle" id="floor"><transform name="to_world"><scale value="3"/></transform></shape>
</scene>
END
importon info ray.xml | grep -A9 '^geometry' || exit 9
importon gradient ray.xml -p beamer.position -p ray.pose --spp 16 2>/dev/null |
    awk '$1 == "beamer.position[2]" {printf "%s %.6f\n", $1, $3}'

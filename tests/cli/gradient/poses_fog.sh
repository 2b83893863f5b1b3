# SPDX-License-Identifier: Apache-2.0
# A box, a ball and a lamp in fog, and a cloud of it alone: gradients, rows of check that hold the walks
# still, and refusals by name.
scene="$ROOT/scenes/fog.xml"
importon gradient -q -D res=8 --spp 4 -p box.pose -p ball.pose -p lamp.pose "$scene" | grep -c 'pose\['
importon check -q -D res=8 --paths 100 -p box.pose -p ball.pose -p lamp.pose --only frozen "$scene" | grep -c ' ok'
sed 's|<float name="albedo" value="$albedo"/>|&<float name="emission" value="1"/>|' "$scene" >glows.xml
importon check -q -D res=8 --paths 100 -p box.pose --only frozen glows.xml | grep -c ' ok'
sed 's|<integrator type="volpath"/>|<integrator type="ptracer"/>|' "$scene" >lights.xml
importon gradient -q -D res=8 --spp 4 -p box.pose lights.xml
sed 's|</sensor>|&<emitter type="point" id="bulb"/>|' "$scene" >bulb.xml
importon gradient -q -D res=8 --spp 4 -p box.pose bulb.xml
sed -e '/<ref id="fog"\/>/d' \
    -e 's|<sensor |<shape type="sphere" id="cloud"><point name="center" value="0, 0, 0.3"/><float name="radius" value="0.4"/><bsdf type="null"/><ref name="interior" id="fog"/></shape>&|' \
    "$scene" >cloud.xml
importon gradient -q -D res=8 --spp 4 -p cloud.center -p cloud.radius -p box.pose cloud.xml | grep -c '^cloud'
importon check -q -D res=8 --paths 100 -p cloud.pose -p box.pose -p lamp.pose --only frozen cloud.xml | grep -c ' ok'
sed 's|<shape type="sphere" id="cloud">|<shape type="disk" id="cloud">|; s|<point name="center" value="0, 0, 0.3"/><float name="radius" value="0.4"/>||' cloud.xml >open.xml
importon gradient -q -D res=8 --spp 4 -p box.pose open.xml

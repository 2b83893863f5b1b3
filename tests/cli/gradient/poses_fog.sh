# SPDX-License-Identifier: Apache-2.0
# A box, a ball and a lamp in fog, and what moves in a medium that ends or glows: gradients, rows of
# check that hold the walks still, and refusals by name.
scene="$ROOT/scenes/fog.xml"
importon gradient -q -D res=8 --spp 4 -p box.pose -p ball.pose -p lamp.pose "$scene" | grep -c 'pose\['
importon check -q -D res=8 --paths 100 -p box.pose -p ball.pose -p lamp.pose --only frozen "$scene" | grep -c ' ok'
sed 's|<float name="albedo" value="$albedo"/>|&<float name="emission" value="1"/>|' "$scene" >glows.xml
importon gradient -q -D res=8 --spp 4 -p box.pose glows.xml
sed 's|<integrator type="volpath"/>|<integrator type="ptracer"/>|' "$scene" >lights.xml
importon gradient -q -D res=8 --spp 4 -p box.pose lights.xml
sed 's|</sensor>|&<emitter type="point" id="bulb"/>|' "$scene" >bulb.xml
importon gradient -q -D res=8 --spp 4 -p box.pose bulb.xml

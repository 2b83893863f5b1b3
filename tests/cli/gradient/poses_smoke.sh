# SPDX-License-Identifier: Apache-2.0
# Smoke of a grid, in a cube that is as large, before cameras that move: with its cells and with a block
# in it, rows of check that hold the walks still, and refusals by name.
{
    printf 'VOL\003\001\000\000\000\003\000\000\000\003\000\000\000\003\000\000\000\001\000\000\000'
    head -c 24 /dev/zero
    for k in {1..27}; do printf "\\000\\000\\$((k % 2 + 2))00\\077"; done
} >smoke.vol
block='<shape type="cube" id="block"><transform name="to_world"><scale value="0.2"/><translate x="0.5" y="0.4" z="0.6"/></transform></shape>'
sed -e "s|<sensor type=\"perspective\" id=\"view00\">|$block&|" -e 's|<shape type="cube">|<shape type="cube" id="box">|' "$ROOT/scenes/smoke.xml" >smoke.xml
importon gradient -q -D res=4 -D depth=3 --spp 4 -p view00.pose -p block.pose -p density.data --textures cells smoke.xml | grep -c 'pose\['
importon check -q -D res=8 -D depth=4 --paths 60 -p view00.pose -p block.pose --only frozen smoke.xml | grep -c ' ok'
importon gradient -q -D res=4 --spp 4 -p box.pose smoke.xml
sed 's|</volume>|<string name="filter_type" value="nearest"/>&|' smoke.xml >jumps.xml
importon gradient -q -D res=4 --spp 4 -p view00.pose jumps.xml
sed 's|<scale value="0.5"/>|<scale value="0.6"/>|' smoke.xml >beyond.xml
importon gradient -q -D res=4 --spp 4 -p view00.pose beyond.xml

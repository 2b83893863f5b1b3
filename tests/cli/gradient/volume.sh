# SPDX-License-Identifier: Apache-2.0
# The gradient of a volume and its standard errors are two files. Neither replaces what is
# not a volume, unless told.
{
    printf 'VOL\003\001\000\000\000\003\000\000\000\003\000\000\000\003\000\000\000\001\000\000\000'
    head -c 24 /dev/zero
    for _ in {1..27}; do printf '\000\000\200\077'; done
} >ones.vol
cat >fog.xml <<'END'
<scene version="3.0.0">
  <integrator type="volpath"/>
  <medium type="heterogeneous" id="fog"><float name="albedo" value="0"/>
    <volume name="sigma_t" type="gridvolume" id="grid"><string name="filename" value="ones.vol"/></volume></medium>
  <shape type="cube"><bsdf type="null"/><ref id="fog" name="interior"/>
    <transform name="to_world"><scale value="0.5"/><translate x="0.5" y="0.5" z="0.5"/></transform></shape>
  <emitter type="constant"/>
  <sensor type="perspective"><transform name="to_world"><lookat origin="0.5,0.5,4" target="0.5,0.5,0.5" up="0,1,0"/></transform>
    <film type="hdrfilm"><integer name="width" value="6"/><integer name="height" value="6"/></film></sensor>
</scene>
END
gradient=(importon gradient fog.xml -p grid.data --spp 4 --textures out -q -o answer.txt)
"${gradient[@]}"; echo "exit $?"; ls out
for name in grid.data.vol grid.data.se.vol; do
    echo "a letter" >out/$name
    "${gradient[@]}"; echo "exit $?"
    cat out/$name
    "${gradient[@]}" --overwrite; echo "exit $?"
    head -c 3 out/$name; echo
done
# Where the grid is: not while it ends with ones, at the border of a box that moves.
importon info fog.xml | grep '^grid'
importon gradient -q --spp 4 -p grid.pose fog.xml
sed 's|<scale value="0.5"/>|<scale value="0.4"/>|' fog.xml >inside.xml
importon gradient -q --spp 4 -p grid.pose -p grid.scale inside.xml | grep -c '^grid'
importon gradient -q --spp 4 --set grid.to_world=0,0,0,0,0,0,0,0,0,0,0,0 -p grid.to_world inside.xml

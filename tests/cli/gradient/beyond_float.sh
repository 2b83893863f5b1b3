# SPDX-License-Identifier: Apache-2.0
# Walks of which an exposure makes more than a float holds are dropped and counted, through every filter.
scene() {
    echo "<scene version='3.0.0'><integrator type='path'/><sensor type='perspective'><film type='hdrfilm'>
<integer name='width' value='4'/><integer name='height' value='4'/><rfilter type='$1'/>
<float name='exposure' value='1e9'/></film><transform name='to_world'>
<lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform></sensor>
<shape type='rectangle' id='floor'><bsdf type='diffuse'/></shape>
<emitter type='constant' id='sky'><rgb name='radiance' value='1e35,1e35,1e35'/></emitter></scene>"
}
scene box >box.xml
scene gaussian >gaussian.xml
{ printf 'PF\n4 4\n-1.0\n'; head -c 192 /dev/zero; } >black.pfm
for filter in box gaussian; do
    for number in sky.radiance.value floor.pose; do
        importon gradient $filter.xml -m rgb --spp 4 --threads 1 -T black.pfm -p $number
        echo "exit $?"
    done
done

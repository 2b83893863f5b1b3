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
echo "- a mask of bytes that are 0 and 1 is a faint one"
{ printf "\x93NUMPY\1\0\x76\0{'descr': '|u1', 'fortran_order': False, 'shape': (4, 4), }%58s\n" ' '; for ((i = 0; i < 16; i++)); do printf '\1'; done; } >bytes.npy
importon gradient box.xml -m rgb --spp 4 --set sky.radiance.value=1,1,1 -T black.pfm --mask bytes.npy -p floor.bsdf.reflectance.value >faint && grep -c loss faint
echo "- in Gauss-Newton's matrices, too"
importon fit box.xml -m rgb --spp 4 --threads 1 -T black.pfm -p sky.radiance.value --optimizer lm --iterations 1 -o found.json
echo "exit $?"

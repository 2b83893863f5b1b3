# SPDX-License-Identifier: Apache-2.0
# The mean, and the product with an adjoint picture, are of the scene's colour, whatever the film
# keeps: alpha, luminance, XYZ, aovs beside it.
scene() {
    cat <<X
<scene version="3.0.0">
    $2
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
        <film type="hdrfilm"><string name="pixel_format" value="$1"/>
            <integer name="width" value="5"/><integer name="height" value="4"/><rfilter type="box"/></film>
    </sensor>
    <emitter type="constant" id="sky"><rgb name="radiance" value="0.5, 1, 2"/></emitter>
    <shape type="sphere"><bsdf type="diffuse" id="ball"/></shape>
</scene>
X
}
path='<integrator type="path"/>'
aov='<integrator type="aov"><string name="aovs" value="d:depth"/><integrator type="path"/></integrator>'
scene rgb "$path" | importon render - -o adjoint.exr --spp 1 -q
for format in rgb rgba luminance luminance_alpha xyz; do
    scene $format "$path" | importon gradient - -p 'sky*' --spp 64 | md5sum
    scene $format "$path" | importon gradient - -p 'sky*' --spp 64 --adjoint adjoint.exr | md5sum
done | sort | uniq -c | sed 's/[0-9a-f]* *-$//'
scene rgb "$path" | importon gradient - -p 'sky*' --spp 64 --json >path.json
scene rgba "$aov" | importon gradient - -p 'sky*' --spp 64 --json | cmp - path.json

# SPDX-License-Identifier: Apache-2.0
# Ids may hold anything; files named by them stay in their folder.
importon render "$ROOT/scenes/furnace.xml" -D res=4 --spp 1 -q -o texture.png || exit 9
cat >scene.xml <<'X'
<scene version="3.0.0">
    <integrator type="path"/>
    <sensor type="perspective">
        <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/></film>
    </sensor>
    <emitter type="constant"/>
    <shape type="rectangle">
        <bsdf type="diffuse" id="../up/x">
            <texture type="bitmap" name="reflectance"><string name="filename" value="texture.png"/></texture>
        </bsdf>
    </shape>
    <shape type="rectangle"><bsdf type="diffuse" id="a/b"/></shape>
</scene>
X
mkdir up
importon gradient scene.xml --spp 1 -q --textures out >/dev/null
importon jacobian scene.xml --spp 1 -q -o out -p 'a/*' >/dev/null
ls out up

# SPDX-License-Identifier: Apache-2.0
# What a fit says where it was cut off, and where its own samples are too few to tell.
cat >balls.xml <<'X'
<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="4"/></integrator>
  <sensor type="perspective"><float name="fov" value="35"/>
    <transform name="to_world"><lookat origin="0,1.2,5" target="0,0.9,0" up="0,1,0"/></transform>
    <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/>
      <rfilter type="box"/></film></sensor>
  <bsdf type="roughconductor" id="metal"><float name="alpha" value="0.15"/></bsdf>
  <bsdf type="roughplastic" id="plastic"><float name="alpha" value="0.2"/>
    <rgb name="diffuse_reflectance" value="0.3,0.2,0.1"/></bsdf>
  <bsdf type="diffuse" id="floor"><rgb name="reflectance" value="0.5,0.4,0.3"/></bsdf>
  <shape type="sphere"><point name="center" x="-0.8" y="0.8" z="0"/><float name="radius" value="0.7"/>
    <ref id="metal"/></shape>
  <shape type="sphere"><point name="center" x="0.8" y="0.8" z="0"/><float name="radius" value="0.7"/>
    <ref id="plastic"/></shape>
  <shape type="rectangle"><transform name="to_world"><scale value="4"/><rotate x="1" angle="-90"/>
    </transform><ref id="floor"/></shape>
  <shape type="rectangle"><transform name="to_world"><scale value="0.6"/><rotate x="1" angle="90"/>
    <translate x="0.5" y="4" z="1"/></transform><emitter type="area"><rgb name="radiance" value="20,18,15"/></emitter></shape>
  <emitter type="constant"><rgb name="radiance" value="0.1,0.12,0.15"/></emitter>
</scene>
X
importon render balls.xml --spp 512 --se -q -o target.exr
importon fit balls.xml -T target.exr --set metal.alpha.value=.25 -p metal.alpha.value --spp 16 -n 5 2>&1 >/dev/null
importon fit balls.xml -T target.exr --set plastic.alpha.value=.1 -p plastic.alpha.value --optimizer lm --spp 16 \
    --seed 2 2>&1 >/dev/null

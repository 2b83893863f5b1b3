# SPDX-License-Identifier: Apache-2.0
# What is declared and stands nowhere loads, as in Mitsuba, and is said.
cat >scene.xml <<'X'
<scene version="3.0.0">
  <integrator type="path"/>
  <emitter type="constant"/>
  <emitter type="area" id="lamp"><rgb name="radiance" value="1, 2, 3"/></emitter>
  <emitter type="directionalarea" id="beam"/>
  <emitter type="area" id="shines"/>
  <film type="hdrfilm" id="large"/>
  <film type="hdrfilm" id="small">
    <integer name="width" value="2"/><integer name="height" value="2"/>
  </film>
  <sampler type="independent"/>
  <rfilter type="box"/>
  <phase type="hg" id="forward"/>
  <volume type="constvolume" id="dense"/>
  <sensor type="irradiancemeter" id="meter"/>
  <bsdf type="diffuse" id="paint"/>
  <texture type="checkerboard" id="squares"/>
  <medium type="homogeneous" id="fog"/>
  <sensor type="perspective"><ref id="small"/></sensor>
  <shape type="sphere"><ref id="shines"/></shape>
</scene>
X
importon info scene.xml | head -n 1
importon render -q --spp 1 --no-preview scene.xml -o a.exr
echo "exit $?"

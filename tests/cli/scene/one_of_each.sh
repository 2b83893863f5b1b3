# SPDX-License-Identifier: Apache-2.0
# What Mitsuba's own writer exports, plugin by plugin (bench/peers/exported.py has all of them): here the forms
# that other writers do not use, and everything that is missing, by name and place, with what would be lost.
cat >forms.xml <<'X'
<scene version="3.9.1">
  <integrator type="prb" id="integrator"><integer name="max_depth" value="3"/></integrator>
  <sensor type="perspective" id="camera" name="camera">
    <film type="hdrfilm" name="film"><integer name="width" value="4"/><integer name="height" value="4"/></film>
  </sensor>
  <emitter type="constant" name="sky"><texture type="d65" name="radiance"/></emitter>
  <shape type="merge" name="both">
    <shape type="cube" id="one" name="part">
      <bsdf type="diffuse" name="bsdf"><texture type="srgb" name="reflectance"><vector name="color" value="0.3, 0.5, 0.7"/></texture></bsdf>
    </shape>
    <shape type="sphere" name="part_2"><bsdf type="diffuse" name="bsdf"><texture type="uniform" name="reflectance"><float name="value" value="0.5"/></texture></bsdf></shape>
  </shape>
</scene>
X
importon info forms.xml
importon render -q --spp 1 --no-preview forms.xml -o forms.exr; echo "exit $?"

cat >missing.xml <<'X'
<scene version="3.9.1">
  <integrator type="stokes"><integrator type="path"/></integrator>
  <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/></film></sensor>
  <emitter type="timed_sunsky"/>
  <shape type="sphere"><bsdf type="polarizer"/></shape>
  <shape type="sphere"><bsdf type="retarder"/></shape>
  <shape type="sphere"><bsdf type="circular"/></shape>
  <shape type="sphere"><bsdf type="pplastic"/></shape>
  <shape type="sphere"><bsdf type="measured_polarized"><string name="filename" value="a.pbsdf"/></bsdf></shape>
  <shape type="sphere"><bsdf type="null"/><medium type="homogeneous" name="interior">
    <phase type="sggx"><volume type="gridvolume" name="S"><string name="filename" value="a.vol"/></volume></phase></medium></shape>
  <shape type="sdfgrid"><string name="filename" value="a.vol"/></shape>
  <shape type="ellipsoids"><string name="filename" value="a.ply"/></shape>
  <shape type="ellipsoidsmesh"><string name="filename" value="a.ply"/></shape>
</scene>
X
importon info missing.xml | grep without; echo "exit ${PIPESTATUS[0]}"
importon render -q --lenient --spp 1 --no-preview missing.xml -o missing.exr; echo "exit $?"

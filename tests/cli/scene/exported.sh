# SPDX-License-Identifier: Apache-2.0
# A scene in the form that exporters write: names on everything, ids on materials, refs with
# slots, an integrator for derivatives. Names stand where there are no ids.
cat > exported.xml <<'XML' || exit 9
<scene version="3.0.0">
  <default name="spp" value="4"/>
  <default name="resx" value="8"/>
  <default name="resy" value="6"/>
  <integrator type="prb" name="integrator"><integer name="max_depth" value="4"/></integrator>
  <sensor type="perspective" name="Camera">
    <string name="fov_axis" value="x"/>
    <float name="fov" value="39.6"/>
    <float name="principal_point_offset_x" value="0"/>
    <float name="principal_point_offset_y" value="0"/>
    <float name="near_clip" value="0.1"/>
    <float name="far_clip" value="100"/>
    <transform name="to_world">
      <rotate x="1" angle="90"/>
      <lookat origin="7.36, -6.93, 4.96" target="0, 0, 0" up="0, 0, 1"/>
    </transform>
    <sampler type="independent" name="sampler"><integer name="sample_count" value="$spp"/></sampler>
    <film type="hdrfilm" name="film">
      <integer name="width" value="$resx"/><integer name="height" value="$resy"/>
      <rfilter type="mitchell" name="rfilter"/>
    </film>
  </sensor>
  <emitter type="constant" name="World"><rgb name="radiance" value="0.05 0.05 0.05"/></emitter>
  <emitter type="spot" name="Spot">
    <rgb name="intensity" value="80 80 80"/>
    <float name="cutoff_angle" value="22.5"/>
    <float name="beam_width" value="22.5"/>
    <transform name="to_world"><lookat origin="4, 1, 6" target="0, 0, 0" up="0, 0, 1"/></transform>
  </emitter>
  <emitter type="directional" name="Sun">
    <rgb name="irradiance" value="1 1 1"/><vector name="direction" x="0.3" y="0.2" z="-1"/>
  </emitter>
  <bsdf type="twosided" id="mat-Material" name="mat-Material">
    <bsdf type="principled" name="bsdf">
      <rgb name="base_color" value="0.8 0.8 0.8"/>
      <float name="roughness" value="0.5"/><float name="specular" value="0.5"/>
      <float name="metallic" value="0"/>
    </bsdf>
  </bsdf>
  <shape type="cube" name="Cube"><ref name="bsdf" id="mat-Material"/></shape>
  <shape type="rectangle" name="Plane">
    <transform name="to_world"><scale value="6"/><translate z="-1"/></transform>
    <bsdf type="diffuse" name="bsdf"><rgb name="reflectance" value="0.5 0.4 0.3"/></bsdf>
  </shape>
</scene>
XML
importon info exported.xml | sed -n 's/  .*//p' || exit 9
importon render -q -o exported.exr exported.xml || exit 9
importon info --json exported.xml | grep -c '"not_supported":\[\]'
importon check -q --draws-time 0.1 --paths 50 --spp 16 --param 'Spot.*' --param 'World.*' exported.xml > checked || cat checked
rm exported.xml exported.exr checked

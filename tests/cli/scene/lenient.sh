# SPDX-License-Identifier: Apache-2.0
# What this version does not have is listed, all at once; --lenient goes on without.
cat > lenient.xml <<'XML' || exit 9
<scene version="3.0.0">
  <integrator type="stokes"><integer name="max_depth" value="3"/></integrator>
  <sensor type="perspective"><transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
    <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/><rfilter type="sinc"/></film></sensor>
  <bsdf type="pplastic" id="paint"><rgb name="diffuse_reflectance" value=".1, .2, .3"/></bsdf>
  <bsdf type="polarised" id="around"><bsdf type="diffuse"><float name="reflectance" value=".25"/></bsdf></bsdf>
  <emitter type="constant"><boolean name="shiny" value="true"/></emitter>
  <emitter type="timed_sunsky"/>
  <shape type="sphere"><ref id="paint"/></shape>
  <shape type="rectangle"><transform name="to_world"><translate z="-2"/></transform><ref id="around"/></shape>
  <shape type="ellipsoids" id="cloud"><ref id="paint"/></shape>
</scene>
XML
echo "+ all of it at once" >&2
importon render -q -o none.exr lenient.xml 2>&1 | sed 's/; it has [^;]*//' >&2
echo "+ lenient" >&2
importon render --lenient --spp 4 -o lenient.exr lenient.xml > /dev/null || exit 9
echo "+ a film and a sampler of old versions" >&2
sed -e 's/hdrfilm/ldrfilm/' -e 's|<rfilter type="sinc"/></film>|<string name="file_format" value="png"/><float name="gamma" value="2.2"/><rfilter type="box"/></film><sampler type="halton"><integer name="sample_count" value="2"/></sampler>|' lenient.xml > old.xml || exit 9
importon render -q -o none.exr old.xml 2>&1 | sed 's/; it has [^;]*//' >&2
importon render --lenient --spp 4 -o lenient.exr old.xml 2>&1 > /dev/null | grep -e film -e sampler >&2
importon info old.xml | grep -e without -e integrator -e shapes || exit 9
grep -v -e stokes -e pplastic -e polarised -e shiny -e timed -e ellipsoids old.xml | sed -e 's|<ref.*/></shape>|</shape>|' -e 's/halton/independent/' > film.xml || exit 9
importon render -q -o none.exr film.xml
importon info film.xml | grep -e without -e sensor -e shapes || exit 9
echo "+ info" >&2
importon info lenient.xml | grep -e without -e integrator -e shapes || exit 9
rm lenient.xml old.xml film.xml lenient.exr

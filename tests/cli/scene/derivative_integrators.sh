# SPDX-License-Identifier: Apache-2.0
# Mitsuba's integrators for derivatives make the pictures of those that they are read as.
picture() { # NAME, INTEGRATOR, PROPERTIES
    importon render --spp 8 --seed 3 -o "$1.pfm" - <<<"<scene version='3.0.0'>
<integrator type='$2'>$3</integrator>
<sensor type='perspective'><transform name='to_world'><lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform>
<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' value='8'/></film></sensor>
<emitter type='constant'><float name='radiance' value='.3'/></emitter>
<emitter type='point'><point name='position' x='2' y='2' z='3'/></emitter>
<shape type='sphere'/><shape type='rectangle'><transform name='to_world'><scale value='3'/><translate z='-1'/></transform></shape>
</scene>" 2>"$1.said" || exit 9
    grep -o "integrator '.*" "$1.said"
}
deep="<integer name='max_depth' value='6'/>"
picture path path "$deep"
picture volpath volpath "$deep"
picture direct direct
for i in prb prb_projective; do picture $i $i; cmp path.pfm $i.pfm && echo same; done
picture more prb "<integer name='max_depth' value='3'/>"
cmp -s path.pfm more.pfm || echo another
picture dp direct_projective "<integer name='sppc' value='4'/><string name='guiding' value='none'/>"
cmp direct.pfm dp.pfm && echo same
picture pv prbvolpath; cmp volpath.pfm pv.pfm && echo same
picture basic prb_basic # without light samples the point is dark
cmp -s path.pfm basic.pfm || echo darker

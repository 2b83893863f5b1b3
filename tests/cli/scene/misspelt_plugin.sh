# SPDX-License-Identifier: Apache-2.0
# A name that is nearly one of ours: what was meant is said beside what there is.
say() { importon render --dump - <<<"<scene version='3.0.0'>$1</scene>"; }
say "<shape type='shpere'/>"
say "<shape type='sphere'><bsdf type='roughconducter'/></shape>"
say "<integrator type='paht'/>"
say "<shape type='sphere'><bsdf type='diffuse'><rgb name='reflectence' value='.5'/></bsdf></shape>"
say "<shape type='rectangle'><transform name='toWorld'/></shape>"
say "<shape type='rectangle'><float name='temperature' value='3'/></shape>"
say "<shape type='sphere'><bsdf type='roughconductor'><float name='alpa' value='.1'/></bsdf></shape>"
# info goes on, and says it of each.
importon info - <<'XML' 2>&1 | grep without >&2
<scene version="3.0.0"><integrator type="paht"/><sensor type="perspective"/><shape type="shpere"/>
<shape type="sphere"><bsdf type="roughconductor"><float name="alpa" value=".1"/></bsdf></shape>
<shape type="disk"><bsdf type="diffuse"><texture type="checkerboard" name="reflectence"/></bsdf></shape></scene>
XML
say "<sensor type='perspective'><string name='fov_axis' value='x'/><float name='Fov' value='40'/></sensor>"
say "<shape type='sphere'><bsdf type='principled'><texture type='checkerboard' name='basecolor'/></bsdf></shape>"

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

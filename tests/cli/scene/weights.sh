# SPDX-License-Identifier: Apache-2.0
# Weights of densities, proxies, and photons: what is wrong with them is said, with its place.
say() {
    importon info - <<<"<scene version='3.0.0'>
$1
<sensor type='perspective'/></scene>" | sed -n 's/^integrator.*/&, fine/p; /^without/p'
}
weights() { say "<integrator type='${2-path}'><string name='weights' value='$1'/></integrator>$3"; }
weights 'kernel=1, uniform=.5'
weights 'kernal=1'
weights 'kernel'
weights 'kernel=1 emitters=x'
weights 'kernel=-1'
weights 'kernel=nan'
weights 'kernel=0, uniform=0'
weights ''
weights 'emitters=1' path "<shape type='sphere'><emitter type='area'/></shape>"
weights 'kernel=1' direct
weights 'kernel=1, proxies=1, environment=2' photons
say "<shape type='sphere'><bsdf type='diffuse'><string name='weights' value='kernel=0'/></bsdf></shape>"
say "<integrator type='photons'/><emitter type='point' id='bulb'/>"
say "<integrator type='photons'><float name='h' value='0'/></integrator>"
say "<integrator type='path'><integer name='split' value='9'/></integrator>"
say "<shape type='sphere' name='proxy'><bsdf type='diffuse'/></shape>"
say "<shape type='sphere' name='proxy'><float name='sampling_weight' value='-1'/></shape>"
say "<shape type='sphere' name='proxy'><float name='sampling_weight' value='0'/></shape>"
say "<shape type='sphere' name='proxy'><string name='colour' value='red'/></shape>"
say "<emitter type='point'><shape type='sphere' name='proxy'/></emitter>"
say "<shape type='sphere'><shape type='sphere' name='prox'/></shape>"
say "<shape type='mesh' name='proxy_2'/>"
scene="<scene version='3.0.0'><integrator type='path'/></scene>"
importon info --weights kernel=1,uniform=1 - <<<"$scene" | sed -n 's/^integrator.*/&, fine/p; /^without/p'
importon info --weights kernel=1,unifrom=1 - <<<"$scene"
importon info --weights kernel=1 - <<<"<scene version='3.0.0'/>"

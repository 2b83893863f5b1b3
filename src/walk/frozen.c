/* SPDX-License-Identifier: Apache-2.0
 *
 * The same walk at other parameters: vertices, directions, densities, MIS weights and
 * roulette stay, values are looked up and multiplied again. Differences of this are what
 * a detached derivative must equal, to rounding (gradients.md 13 A); they are blind to
 * wrong densities, which fresh-seed differences see. */
#include "bend.h"

imp_spec imp__walk_frozen(const struct imp_tracer *tracer, const struct imp_walk *walk)
{
    imp_spec L = {0};
    if (walk->dropped || !walk->valid) return L;
    if (tracer->active && tracer->active->medium) return imp__bend_frozen(tracer, walk);
    for (const struct imp_vertex *v = walk->last; v; v = v->prev) {
        const struct imp_bsdf *b = v->bsdf;
        imp_spec in[IMP_INPUTS_MAX], f, sum = {0};
        if (b) imp__inputs_eval(b->input, b->n_in, &v->at, in);
        if (b && v->shape->interior) imp__bend_inputs(v, in);
        if (b && v->inv_ps > 0) {
            b->ops->eval(b, in, &v->dirs, &f);
            sum += f * v->inv_ps * L;
        }
        if (v->emitter >= 0)
            sum += imp__emitter_radiance(tracer->scene, v->emitter, &v->e_at, v->at.p) *
                   v->e_weight;
        if (v->glows) {
            b->ops->emit(b, in, &v->dirs.wo, &f);
            sum += f * v->g_weight;
        }
        if (v->light >= 0) {
            const struct imp_dirs dirs = {v->dirs.wo, v->l_wi, IMP_SMOOTH};
            b->ops->eval(b, in, &dirs, &f);
            sum += f * imp__emitter_radiance(tracer->scene, v->light, &v->l_at, v->l_p) *
                   v->l_weight;
        }
        L = sum;
    }
    return L;
}

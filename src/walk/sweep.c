/* SPDX-License-Identifier: Apache-2.0
 *
 * The walk visited again: radiance comes down (fold), the adjoint goes up and gradient
 * falls off at every vertex (sweep), or both derivative and radiance come down (tangent).
 * The three differ only in the direction the product rule is read. */
#include "bend.h"
#include "dims.h"

imp_spec imp__walk_fold(struct imp_walk *walk)
{
    imp_spec L = {0};
    for (struct imp_vertex *v = walk->last; v; v = v->prev) {
        v->lin = L;
        L = v->e + v->w * L;
        if (v->light >= 0) L += v->l_f * v->l_le * v->l_weight;
    }
    return L;
}

static bool bsdf_active(const struct imp_active *a, const struct imp_bsdf *b)
{
    return b && b->index >= 0 && a->bsdf[b->index];
}

/* ---- Lane by lane, d of a vertex's three pieces / d its inputs ------------------ */

/* E_k through the BSDF's own emission: d[n_in]. */
static void glow_d(const struct imp_vertex *v, imp_spec *d)
{
    v->bsdf->ops->emit_d(v->bsdf, v->in, &v->dirs.wo, d);
    for (int j = 0; j < v->bsdf->n_in; j++) d[j] *= v->g_weight;
}

/* E_k or B_k through an emitter: d[emitter->n_in], without the factor in front. */
static void emitter_d(const struct imp_emitter *e, const struct imp_emission *x,
                      const struct imp_texcoord *at, imp_spec *d)
{
    imp_spec in[IMP_INPUTS_MAX];
    imp__inputs_eval(e->input, e->n_in, at, in);
    e->ops->eval_d(e, in, x, d);
}

static struct imp_texcoord light_texcoord(const struct imp_vertex *v)
{
    return (struct imp_texcoord){{v->l_at.uv[0], v->l_at.uv[1]}, v->l_p};
}
static struct imp_texcoord emission_texcoord(const struct imp_vertex *v)
{
    return (struct imp_texcoord){{v->e_at.uv[0], v->e_at.uv[1]}, v->at.p};
}

/* Stam's exponent by the attached form, or only its first term as in his App. C
 * (gradients.md 4, E9): replaces the detached derivative of the inputs where the kind
 * offers it. */
static void attached_d(const struct imp_walk *walk, const struct imp_vertex *v, int depth,
                       imp_spec *d)
{
    const struct imp_bsdf *b = v->bsdf;
    if (!b->ops->sample_d) return;
    const double u[3] = {imp__u01(walk->key, imp__dim(depth, IMP_DIM_LOBE)),
                         imp__u01(walk->key, imp__dim(depth, IMP_DIM_DIR_U)),
                         imp__u01(walk->key, imp__dim(depth, IMP_DIM_DIR_V))};
    for (int j = 0; j < b->n_in; j++) {
        imp_spec dweight;
        imp_v3
            dwi; /* its factor, the slope of what arrives, is 0 where this is allowed */
        if (b->ops->sample_d(b, v->in, u, &v->dirs, j, &dweight, &dwi))
            d[j] = dweight * (v->inv_ps * v->pdf); /* 1/s */
    }
}

/* w_k through the BSDF, densities frozen: d[n_in]. */
static void step_d(const struct imp_tracer *tracer, const struct imp_walk *walk,
                   const struct imp_vertex *v, int depth, imp_spec *d)
{
    v->bsdf->ops->eval_d(v->bsdf, v->in, &v->dirs, d);
    for (int j = 0; j < v->bsdf->n_in; j++) d[j] *= v->inv_ps;
    if (tracer->integrator->alpha_gradient != IMP_ALPHA_DETACHED)
        attached_d(walk, v, depth, d);
}

/* B_k through the BSDF. */
static void light_d(const struct imp_vertex *v, imp_spec *d)
{
    const struct imp_dirs dirs = {v->dirs.wo, v->l_wi, IMP_SMOOTH};
    v->bsdf->ops->eval_d(v->bsdf, v->in, &dirs, d);
    for (int j = 0; j < v->bsdf->n_in; j++) d[j] *= v->l_le * v->l_weight;
}

/* ---- Reverse ------------------------------------------------------------------- */

static void emitter_scatter(const struct imp_tracer *tracer, int emitter,
                            const struct imp_emission *x, struct imp_texcoord at,
                            imp_spec bar, struct imp_sink *sink)
{
    const struct imp_emitter *e = tracer->scene->emitters[emitter];
    imp_spec d[IMP_INPUTS_MAX];
    emitter_d(e, x, &at, d);
    for (int j = 0; j < e->n_in; j++) d[j] *= bar;
    imp__inputs_scatter(e->input, e->n_in, &at, d, sink);
}

void imp__walk_sweep(const struct imp_tracer *tracer, const struct imp_walk *walk,
                     imp_spec adjoint, struct imp_sink *sink)
{
    const struct imp_active *active = tracer->active;
    if (walk->dropped || !walk->valid) return;
    imp_spec P = adjoint;
    int depth = 0;
    for (const struct imp_vertex *v = walk->first; v; v = v->next, depth++) {
        const struct imp_bsdf *b = v->bsdf;
        if (v->emitter >= 0 && active->emitter[v->emitter])
            emitter_scatter(tracer, v->emitter, &v->e_at, emission_texcoord(v),
                            P * v->e_weight, sink);
        if (v->light >= 0 && active->emitter[v->light])
            emitter_scatter(tracer, v->light, &v->l_at, light_texcoord(v),
                            P * v->l_f * v->l_weight, sink);
        if (bsdf_active(active, b)) {
            imp_spec bar[IMP_INPUTS_MAX], d[IMP_INPUTS_MAX];
            bool any = false;
            for (int j = 0; j < b->n_in; j++) bar[j] = (imp_spec){0};
            if (v->glows) {
                glow_d(v, d);
                for (int j = 0; j < b->n_in; j++) bar[j] += d[j] * P;
                any = true;
            }
            if (v->light >= 0) {
                light_d(v, d);
                for (int j = 0; j < b->n_in; j++) bar[j] += d[j] * P;
                any = true;
            }
            const imp_spec arriving = P * v->lin;
            if (v->inv_ps > 0 && !imp__is_zero(arriving)) {
                step_d(tracer, walk, v, depth, d);
                for (int j = 0; j < b->n_in; j++) bar[j] += d[j] * arriving;
                any = true;
            }
            if (any) imp__inputs_scatter(b->input, b->n_in, &v->at, bar, sink);
        }
        P *= v->w;
        if (imp__is_zero(P)) break;
    }
    if (active->medium) imp__bend_sweep(tracer, walk, adjoint, sink);
}

/* ---- Forward ------------------------------------------------------------------- */

struct direction {
    const struct imp_active *active;
    const double *x_dot;
};

static double direction_at(const void *payload, int param, size_t element)
{
    const struct direction *d = payload;
    const int64_t base = d->active->base[param];
    return base < 0 ? 0 : d->x_dot[(size_t)base + element];
}

static imp_spec emitter_tangent(const struct imp_tracer *tracer, int emitter,
                                const struct imp_emission *x, struct imp_texcoord at,
                                const struct direction *direction)
{
    const struct imp_emitter *e = tracer->scene->emitters[emitter];
    imp_spec d[IMP_INPUTS_MAX], in_dot[IMP_INPUTS_MAX], sum = {0};
    emitter_d(e, x, &at, d);
    imp__inputs_tangent(e->input, e->n_in, &at, direction_at, direction, in_dot);
    for (int j = 0; j < e->n_in; j++) sum += d[j] * in_dot[j];
    return sum;
}

imp_spec imp__walk_tangent(const struct imp_tracer *tracer, const struct imp_walk *walk,
                           const double *x_dot)
{
    const struct imp_active *active = tracer->active;
    const struct direction direction = {active, x_dot};
    imp_spec L_dot = {0};
    int depth = walk->n - 1;
    if (walk->dropped || !walk->valid) return L_dot;
    for (const struct imp_vertex *v = walk->last; v; v = v->prev, depth--) {
        const struct imp_bsdf *b = v->bsdf;
        L_dot *= v->w;
        if (v->emitter >= 0 && active->emitter[v->emitter])
            L_dot += emitter_tangent(tracer, v->emitter, &v->e_at, emission_texcoord(v),
                                     &direction) *
                     v->e_weight;
        if (v->light >= 0 && active->emitter[v->light])
            L_dot += emitter_tangent(tracer, v->light, &v->l_at, light_texcoord(v),
                                     &direction) *
                     v->l_f * v->l_weight;
        if (!bsdf_active(active, b)) continue;
        imp_spec in_dot[IMP_INPUTS_MAX], d[IMP_INPUTS_MAX];
        imp__inputs_tangent(b->input, b->n_in, &v->at, direction_at, &direction, in_dot);
        if (v->glows) {
            glow_d(v, d);
            for (int j = 0; j < b->n_in; j++) L_dot += d[j] * in_dot[j];
        }
        if (v->light >= 0) {
            light_d(v, d);
            for (int j = 0; j < b->n_in; j++) L_dot += d[j] * in_dot[j];
        }
        if (v->inv_ps > 0) {
            step_d(tracer, walk, v, depth, d);
            for (int j = 0; j < b->n_in; j++) L_dot += d[j] * in_dot[j] * v->lin;
        }
    }
    if (active->medium) L_dot += imp__bend_tangent(tracer, walk, x_dot);
    return L_dot;
}

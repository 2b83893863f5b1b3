/* SPDX-License-Identifier: Apache-2.0
 *
 * The record read again, behind the fold (fold.c). Sweep: the
 * adjoint, from the first vertex to the last (reverse mode, not reverse order), and a
 * piece of gradient falls off at every vertex. Tangent: derivative and radiance together,
 * from the last vertex to the first. The three differ only in the order in which the
 * product rule is read. */
#include "walk/core/vertex.h"
#include "walk/media/sweep_media.h"

static inline bool bsdf_active(const struct imp_tracer *t, const struct imp_vertex *v)
{
    const struct imp_bsdf *b = v->bsdf;
    if (!b || b->index < 0 || !t->active->bsdf[b->index]) return false;
    return t->active->bsdf[b->index] != IMP_BY_EXTINCTION || t->collisions_stand ||
           v->d.stands;
}

bool imp__vertex_active(const struct imp_tracer *t, const struct imp_vertex *v)
{
    return bsdf_active(t, v);
}

/* ---- Lane by lane, d of a vertex's three pieces / d its inputs ------------------ */

/* E_k through the BSDF's own emission: d[n_in]. */
static void glow_d(const struct imp_vertex *v, imp_spec *d)
{
    const imp_v3 wo = imp__vertex_wo(v);
    v->bsdf->ops->emit_d(v->bsdf, v->in, &wo, d);
    for (int j = 0; j < v->bsdf->n_in; j++) d[j] *= v->d.glow_weight;
}

/* d[j] of a constant that moves the lookup of the textures: the sum over these of
 * d[k] (slope . d uv/d input j). */
static void lookup_d(const struct imp_emitter *e, const struct imp_active *active,
                     const struct imp_emission *x, const struct imp_texcoord *at,
                     imp_spec *d)
{
    for (int j = 0; j < e->n_in; j++) {
        const int param = e->input[j]->param;
        double duv[2];
        if (e->input[j]->texture || param < 0 || active->base[param] < 0) continue;
        e->ops->place_d(e, x, j, duv);
        for (int k = 0; k < e->n_in && (duv[0] != 0 || duv[1] != 0); k++) {
            const struct imp_texture *t = e->input[k]->texture;
            imp_spec slope[2];
            if (t && t->ops->slope && t->ops->slope(t, at, e->input[k]->scalar, slope))
                d[j] += d[k] * (slope[0] * duv[0] + slope[1] * duv[1]);
        }
    }
}

/* E_k or B_k through an emitter: d[emitter->n_in], without the factor in front. */
static inline void emitter_d(const struct imp_emitter *e, const struct imp_active *active,
                             const struct imp_emission *x, const struct imp_texcoord *at,
                             imp_spec *d)
{
    imp_spec in[IMP_INPUTS_MAX];
    imp__inputs_eval(e->input, e->n_in, at, in);
    if (imp_likely(!e->shaped)) e->ops->eval_d(e, in, x, d);
    else imp__shaped_light_d(e, at->carried, in, x, d);
    if (imp_unlikely(e->ops->place_d != NULL)) lookup_d(e, active, x, at, d);
}

/* w_k through the BSDF, densities frozen: d[n_in]. */
static void step_d(const struct imp_tracer *tracer, const struct imp_walk *walk,
                   const struct imp_vertex *v, int depth, imp_spec *d)
{
    const struct imp_dirs dirs = imp__vertex_dirs(v);
    imp__bsdf_eval_d(v->bsdf, v->carried, v->in, &dirs, d);
    for (int j = 0; j < v->bsdf->n_in; j++) d[j] *= v->scale;
    if (tracer->integrator->alpha_gradient != IMP_ALPHA_DETACHED)
        imp__attached_d(walk, v, depth, d);
}

/* B_k through the BSDF. */
static void light_d(const struct imp_vertex *v, imp_spec *d)
{
    const struct imp_dirs dirs = imp__light_dirs(v);
    imp__bsdf_eval_d(v->bsdf, v->carried, v->in, &dirs, d);
    for (int j = 0; j < v->bsdf->n_in; j++) d[j] *= v->light_e * v->light_w;
}

/* ---- Reverse ------------------------------------------------------------------- */

static inline __attribute__((always_inline)) void
emitter_scatter(const struct imp_tracer *tracer, int emitter, struct imp_emission *x,
                struct imp_texcoord *at, imp_spec bar, struct imp_sink *sink)
{
    const struct imp_emitter *e = tracer->scene->emitters[emitter];
    imp_spec d[IMP_INPUTS_MAX];
    at->shape = e->shape; /* of a walk's light vertex, too */
    imp__emitter_place(e, x, at);
    emitter_d(e, tracer->active, x, at, d);
    for (int j = 0; j < e->n_in; j++) d[j] *= bar;
    imp__inputs_scatter(e->input, e->n_in, at, d, sink);
}
void imp__emitter_scatter(const struct imp_tracer *tracer, int emitter,
                          struct imp_emission *x, struct imp_texcoord *at, imp_spec bar,
                          struct imp_sink *sink)
{
    emitter_scatter(tracer, emitter, x, at, bar, sink);
}
static void met_scatter(const struct imp_tracer *tracer, const struct imp_vertex *v,
                        imp_spec bar, struct imp_sink *sink)
{
    struct imp_emission x = imp__vertex_met(v);
    struct imp_texcoord at = imp__vertex_at(v);
    emitter_scatter(tracer, v->d.met.emitter, &x, &at, bar, sink);
}
static void light_scatter(const struct imp_tracer *tracer, const struct imp_vertex *v,
                          imp_spec bar, struct imp_sink *sink)
{
    struct imp_emission x = imp__light_emission(&v->d.light);
    struct imp_texcoord at = imp__light_at(tracer->scene, v);
    emitter_scatter(tracer, v->d.light.emitter, &x, &at, bar, sink);
}

static inline void vertex_scatter(const struct imp_tracer *tracer,
                                  const struct imp_vertex *v, const imp_spec *bar,
                                  struct imp_sink *sink)
{
    const struct imp_bsdf *b = v->bsdf;
    const struct imp_texcoord at = imp__vertex_at(v);
    if (imp_unlikely(v->d.scatterer == IMP_IN_MEDIUM))
        imp__point_scatter(tracer, v, &at, bar, sink);
    else imp__inputs_scatter(b->input, b->n_in, &at, bar, sink);
}
void imp__vertex_scatter(const struct imp_tracer *tracer, const struct imp_vertex *v,
                         const imp_spec *bar, struct imp_sink *sink)
{
    vertex_scatter(tracer, v, bar, sink);
}

void imp__walk_sweep_values(const struct imp_tracer *tracer, const struct imp_walk *walk,
                            imp_spec adjoint, struct imp_sink *sink)
{
    const struct imp_active *active = tracer->active;
    if (walk->dropped || !walk->valid) return;
    if (imp_unlikely(walk->reduced != NULL)) {
        walk->reduced->sweep(tracer, walk, adjoint, sink);
        return;
    }
    imp_spec P = adjoint;
    int depth = walk->depth;
    for (const struct imp_vertex *v = walk->first; v; v = v->next, depth++) {
        const struct imp_bsdf *b = v->bsdf;
        /* The adjoints of the vertex's own light, and of its light sample. */
        const struct imp_entry *entry =
            imp_likely(!walk->entry) ? NULL : &walk->entry[depth - walk->depth];
        const imp_spec own = imp_likely(!entry) ? P : P * entry->e;
        const imp_spec lit = imp_likely(!entry) ? P : P * entry->b;
        for (const struct imp_side *s = v->side; s; s = s->next)
            imp__walk_sweep_values(tracer, &s->walk, P, sink);
        const struct imp_met *met = &v->d.met;
        const struct imp_light *light = &v->d.light;
        const bool connected = v->d.connection == IMP_CONNECTED;
        if (met->emitter >= 0 && active->emitter[met->emitter])
            met_scatter(tracer, v,
                        imp_likely(v->d.scatterer != IMP_AT_LIGHT)
                            ? own * met->weight
                            : P * v->beyond * v->scale,
                        sink);
        if (connected && light->emitter >= 0 && active->emitter[light->emitter])
            light_scatter(tracer, v, lit * v->light_f * v->light_w, sink);
        if (bsdf_active(tracer, v)) {
            imp_spec bar[IMP_INPUTS_MAX], d[IMP_INPUTS_MAX];
            bool any = false;
            for (int j = 0; j < b->n_in; j++) bar[j] = (imp_spec){0};
            if (v->d.glows) {
                glow_d(v, d);
                for (int j = 0; j < b->n_in; j++) bar[j] += d[j] * own;
                any = true;
            }
            if (connected) {
                light_d(v, d);
                for (int j = 0; j < b->n_in; j++) bar[j] += d[j] * lit;
                any = true;
            }
            const imp_spec arriving = P * v->beyond;
            if (v->d.goes_on && !imp__is_zero_used(arriving, v->carried)) {
                step_d(tracer, walk, v, depth, d);
                for (int j = 0; j < b->n_in; j++) bar[j] += d[j] * arriving;
                any = true;
            }
            if (any) vertex_scatter(tracer, v, bar, sink);
        }
        if (imp_unlikely(imp__vertex_crosses(v)))
            imp__media_scatter(tracer, v, P, lit, sink);
        P *= v->w;
        if (imp__is_zero_used(P, v->carried)) break;
    }
    if (walk->moving) walk->moving->sweep(tracer, walk, adjoint, sink);
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
    if (base < 0) return 0;
    return d->x_dot[imp__active_at(d->active, param, element)] *
           imp__active_slope(d->active, param, element);
}

imp_spec imp__emitter_tangent(const struct imp_tracer *tracer, int emitter,
                              struct imp_emission x, struct imp_texcoord at,
                              imp_dot_fn *dot, const void *x_dot)
{
    const struct imp_emitter *e = tracer->scene->emitters[emitter];
    imp_spec d[IMP_INPUTS_MAX], in_dot[IMP_INPUTS_MAX], sum = {0};
    at.shape = e->shape; /* of a walk's light vertex, too */
    imp__emitter_place(e, &x, &at);
    emitter_d(e, tracer->active, &x, &at, d);
    imp__inputs_tangent(e->input, e->n_in, &at, dot, x_dot, in_dot);
    for (int j = 0; j < e->n_in; j++) sum += d[j] * in_dot[j];
    return sum;
}

static imp_spec tangent(const struct imp_tracer *tracer, const struct imp_walk *walk,
                        const double *x_dot)
{
    const struct imp_active *active = tracer->active;
    const struct direction direction = {active, x_dot};
    imp_spec L_dot = {0};
    int depth = walk->depth + walk->n - 1;
    if (walk->dropped || !walk->valid) return L_dot;
    if (imp_unlikely(walk->reduced != NULL))
        return walk->reduced->tangent(tracer, walk, direction_at, &direction);
    for (const struct imp_vertex *v = walk->last; v; v = v->prev, depth--) {
        const struct imp_bsdf *b = v->bsdf;
        L_dot *= v->w;
        for (const struct imp_side *s = v->side; s; s = s->next)
            L_dot += tangent(tracer, &s->walk, x_dot);
        const struct imp_entry *entry =
            imp_likely(!walk->entry) ? NULL : &walk->entry[depth - walk->depth];
        const imp_spec own = imp_likely(!entry) ? imp__spec(1) : entry->e;
        const imp_spec lit = imp_likely(!entry) ? imp__spec(1) : entry->b;
        const struct imp_met *met = &v->d.met;
        const struct imp_light *light = &v->d.light;
        const bool connected = v->d.connection == IMP_CONNECTED;
        const struct imp_texcoord at = imp__vertex_at(v);
        if (met->emitter >= 0 && active->emitter[met->emitter])
            L_dot += imp__emitter_tangent(tracer, met->emitter, imp__vertex_met(v), at,
                                          direction_at, &direction) *
                     (imp_likely(v->d.scatterer != IMP_AT_LIGHT) ? met->weight * own
                                                                 : v->beyond * v->scale);
        if (connected && light->emitter >= 0 && active->emitter[light->emitter])
            L_dot += imp__emitter_tangent(
                         tracer, light->emitter, imp__light_emission(light),
                         imp__light_at(tracer->scene, v), direction_at, &direction) *
                     v->light_f * v->light_w * lit;
        if (imp_unlikely(imp__vertex_crosses(v)))
            L_dot += imp__media_tangent(tracer, v, lit, direction_at, &direction);
        if (!bsdf_active(tracer, v)) continue;
        imp_spec in_dot[IMP_INPUTS_MAX], d[IMP_INPUTS_MAX];
        imp__inputs_tangent(b->input, b->n_in, &at, direction_at, &direction, in_dot);
        imp__extinction_drop(tracer, v, in_dot);
        if (v->d.glows) {
            glow_d(v, d);
            for (int j = 0; j < b->n_in; j++) L_dot += d[j] * in_dot[j] * own;
        }
        if (connected) {
            light_d(v, d);
            for (int j = 0; j < b->n_in; j++) L_dot += d[j] * in_dot[j] * lit;
        }
        if (v->d.goes_on) {
            step_d(tracer, walk, v, depth, d);
            for (int j = 0; j < b->n_in; j++) L_dot += d[j] * in_dot[j] * v->beyond;
        }
    }
    if (walk->moving) L_dot += walk->moving->tangent(tracer, walk, x_dot);
    return L_dot;
}

void imp__vertex_tangent(const struct imp_tracer *tracer, const struct imp_vertex *v,
                         const double *x_dot, imp_spec *in_dot)
{
    const struct direction direction = {tracer->active, x_dot};
    const struct imp_texcoord at = imp__vertex_at(v);
    imp__inputs_tangent(v->bsdf->input, v->bsdf->n_in, &at, direction_at, &direction,
                        in_dot);
    imp__extinction_drop(tracer, v, in_dot);
}

imp_spec imp__track_tangent_along(const struct imp_tracer *tracer,
                                  const struct imp_track *track,
                                  const struct imp_carried *carried,
                                  const imp_spec *value, const double *x_dot)
{
    const struct direction direction = {tracer->active, x_dot};
    return imp__track_tangent(tracer, track, carried, value, direction_at, &direction);
}

imp_spec imp__walk_tangent_values(const struct imp_tracer *tracer,
                                  const struct imp_walk *walk, const double *x_dot)
{
    return tangent(tracer, walk, x_dot);
}

imp_spec imp__walk_tangent(const struct imp_tracer *tracer, const struct imp_walk *walk,
                           const double *x_dot)
{
    imp_spec L_dot = imp__walk_channels(tracer, walk, tangent(tracer, walk, x_dot));
    if (imp_unlikely(tracer->sensor->gain != NULL))
        L_dot += imp__gain_tangent(tracer, walk, x_dot);
    return L_dot;
}

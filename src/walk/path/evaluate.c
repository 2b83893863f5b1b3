/* SPDX-License-Identifier: Apache-2.0
 *
 * Values from decisions: what the scene's present parameters make of a walk whose
 * vertices, directions, densities, MIS weights and roulette are settled. */
#include "walk/core/vertex.h"
#include "walk/graded/graded.h"
#include "walk/media/tracking.h"

/* Where a vertex was decided. Member by member: clearing all of it would take as long as
 * what is done with it. */
static inline void place_set(const struct imp_decision *d, const struct imp_shape *shape,
                             const struct imp_carried *carried, struct imp_place *p)
{
    const struct imp_met *m = &d->met;
    p->at.uv[0] = d->uv[0];
    p->at.uv[1] = d->uv[1];
    p->at.p = imp__decided_v3(d->p);
    p->at.carried = carried;
    p->at.shape = shape;
    p->at.prim = d->located.prim;
    p->at.surface = NULL;
    p->dirs.wo = imp__decided_v3(d->wo);
    p->dirs.wi = imp__decided_v3(d->wi);
    p->dirs.lobe = d->lobe;
    p->dirs.derivative = 0;
    p->ratio = 1;
    if (m->emitter < 0 && d->scatterer != IMP_AT_LIGHT) return;
    p->met.uv[0] = d->uv[0];
    p->met.uv[1] = d->uv[1];
    p->met.dist = m->dist;
    p->met.cos_light = m->cos_light;
    p->met.d = imp__decided_v3(m->d);
}

static inline void place_decided(const struct imp_vertex *v, struct imp_place *p)
{
    place_set(&v->d, v->shape, v->carried, p);
    if (imp_likely(!v->segment->exact)) return;
    p->at = imp__vertex_at(v);
    p->dirs = imp__vertex_dirs(v);
    p->met = imp__vertex_met(v);
}

/* What a vertex's decisions are worth. */
struct values {
    imp_spec e, b;                      /* E_k, B_k */
    imp_spec light_f, light_e, light_w; /* factors of B_k */
    imp_spec f;                         /* of the continuation: w_k without T/(p s) */
};

/* What is evaluated: a vertex, or a kept decision of which none is made. */
struct decided {
    const struct imp_decision *d;
    const struct imp_bsdf *bsdf;
    const struct imp_shape *shape;
    const struct imp_carried *carried;
    const struct imp_track *to_light;
};

/* At place p; in: the inputs there. Lookups that nobody asks for are left out. */
static inline __attribute__((always_inline)) void
decided_values(const struct imp_scene *scene, const struct decided *v,
               const struct imp_place *p, imp_spec *in, struct values *x)
{
    const struct imp_decision *d = v->d;
    const struct imp_bsdf *b = v->bsdf;
    *x = (struct values){.e = {0}};
    if (b) imp__evaluate_inputs(b, v->shape, &p->at, in);
    if (d->glows) {
        imp_spec glow;
        b->ops->emit(b, in, &p->dirs.wo, &glow);
        x->e += glow * d->glow_weight;
    }
    const bool light = d->scatterer == IMP_AT_LIGHT;
    if (imp_unlikely(d->from_light)) x->e = imp__spec(d->met.weight);
    else if (d->met.emitter >= 0)
        x->e +=
            imp__emitter_radiance(scene, d->met.emitter, &p->met, p->at.p, v->carried) *
            d->met.weight;
    if (d->connection == IMP_CONNECTED) {
        const struct imp_emission to = imp__light_emission(&d->light);
        const imp_v3 wi = imp__decided_v3(d->light.wi);
        struct imp_dirs dirs = {p->dirs.wo, wi, IMP_SMOOTH, 0};
        if (imp_unlikely(d->from_light))
            dirs = (struct imp_dirs){wi, imp__decided_v3(d->wi), IMP_SMOOTH, 0};
        if (imp_likely(!light)) imp__bsdf_eval(b, v->carried, in, &dirs, &x->light_f);
        else x->light_f = imp__spec(1);
        x->light_e = imp_unlikely(d->light.emitter < 0)
                         ? imp__spec(1)
                         : imp__emitter_radiance(scene, d->light.emitter, &to,
                                                 imp__decided_v3(d->light.p), v->carried);
        x->light_w = imp__spec(d->light.weight);
        x->b = x->light_f * x->light_e * x->light_w;
        if (imp_unlikely(v->to_light != NULL)) {
            const imp_spec T = imp__track_eval(scene, v->to_light, v->carried);
            x->light_w *= T;
            x->b *= T; /* in the order of tracing, so that no bit differs */
        }
    }
    x->f = imp__spec(1);
    if (b && d->goes_on) imp__bsdf_eval(b, v->carried, in, &p->dirs, &x->f);
    if (imp_unlikely(light) && d->goes_on)
        in[0] = x->f =
            imp__emitter_radiance(scene, d->met.emitter, &p->met, p->at.p, v->carried);
}

/* The inputs of the vertex at place p. */
static void vertex_values(const struct imp_tracer *tracer, const struct imp_vertex *v,
                          const struct imp_place *p, imp_spec *in, struct values *x)
{
    const struct decided at = {&v->d, v->bsdf, v->shape, v->carried, v->to_light};
    decided_values(tracer->scene, &at, p, in, x);
}

void imp__decided_values(const struct imp_tracer *tracer, const struct imp_decision *d,
                         const struct imp_bsdf *b, const struct imp_carried *carried,
                         struct imp_values *out)
{
    const struct imp_scene *scene = tracer->scene;
    const struct imp_shape *shape =
        b && d->scatterer != IMP_IN_MEDIUM ? scene->shapes[d->shape] : NULL;
    const struct decided v = {d, b, shape, carried, NULL};
    struct imp_place p;
    place_set(d, shape, carried, &p);
    imp_spec in[IMP_INPUTS_MAX];
    struct values x;
    decided_values(scene, &v, &p, in, &x);
    out->e = x.e;
    out->b = x.b;
    out->w = (imp_spec){0};
    if (!d->goes_on) return;
    out->w = x.f * imp__spec(1 / ((double)d->pdf * (double)d->survive));
    out->w *= imp__spec((double)d->passes);
}

/* T of the segment that follows. */
static imp_spec passes(const struct imp_tracer *tracer, const struct imp_vertex *v)
{
    const double decided = v->d.passes;
    return imp_likely(!v->on)
               ? imp__spec(decided)
               : imp__track_eval(tracer->scene, v->on, v->carried) * decided;
}

void imp__walk_evaluate(const struct imp_tracer *tracer, struct imp_walk *walk)
{
    for (struct imp_vertex *v = walk->first; v; v = v->next) {
        const struct imp_decision *d = &v->d;
        struct imp_place p;
        struct values x;
        place_decided(v, &p);
        vertex_values(tracer, v, &p, v->in, &x);
        v->e = x.e;
        v->b = x.b;
        v->light_f = x.light_f;
        v->light_e = x.light_e;
        v->light_w = x.light_w;
        v->w = (imp_spec){0};
        v->scale = (imp_spec){0};
        for (struct imp_side *s = v->side; s; s = s->next)
            imp__walk_evaluate(tracer, &s->walk);
        if (!d->goes_on) continue;
        imp__step_weigh(v, x.f, d->pdf, d->survive);
        imp__step_pass(v, passes(tracer, v));
    }
}

static imp_spec frozen(const struct imp_tracer *tracer, const struct imp_walk *walk)
{
    imp_spec P = imp__spec(1), L = {0}, in[IMP_INPUTS_MAX];
    const struct imp_entry *entry = walk->entry;
    struct imp_moving moving = {{0}, {0}, {0}};
    struct imp_vertex now;
    if (walk->dropped || !walk->valid) return L;
    for (const struct imp_vertex *v = walk->first; v; v = v->next) {
        const struct imp_segment_ops *segment = v->segment->ops;
        struct imp_place p;
        struct values x;
        place_decided(v, &p);
        if (segment->place && !segment->place(tracer, v, &moving, &p))
            return imp__spec(NAN);
        vertex_values(tracer, v, &p, in, &x);
        P *= p.ratio * p.ratio;
        L += P * (entry ? x.e * entry->e + x.b * entry->b : x.e + x.b);
        if (entry) entry++;
        for (const struct imp_side *s = v->side; s; s = s->next)
            L += P * frozen(tracer, &s->walk);
        if (imp_likely(!v->on)) {
            P *= x.f * v->scale;
        } else {
            imp__step_weigh(&now, x.f, v->d.pdf, v->d.survive);
            imp__step_pass(&now, passes(tracer, v));
            P *= now.w;
        }
    }
    return L;
}

/* ---- In another scene ------------------------------------------------------------ */

/* Do the values of this vertex depend on no active parameter? */
static bool is_settled(const struct imp_active *active, const struct imp_vertex *v)
{
    const struct imp_decision *d = &v->d;
    if (v->on || v->to_light) return false;
    if (v->bsdf && v->bsdf->index >= 0 && active->bsdf[v->bsdf->index]) return false;
    if (d->met.emitter >= 0 && active->emitter[d->met.emitter]) return false;
    return d->connection != IMP_CONNECTED || d->light.emitter < 0 ||
           !active->emitter[d->light.emitter];
}

/* Evaluate and fold, in the order that gives the bits of both. */
static imp_spec elsewhere(const struct imp_tracer *there, const struct imp_walk *walk)
{
    const struct imp_scene *scene = there->scene;
    imp_spec L = {0}, in[IMP_INPUTS_MAX];
    for (const struct imp_vertex *v = walk->last; v; v = v->prev) {
        if (is_settled(there->active, v)) {
            L = v->e + v->w * L + v->b;
        } else {
            const struct imp_bsdf *bsdf = imp__decided_bsdf(scene, &v->d);
            const struct imp_shape *shape = v->shape ? scene->shapes[v->d.shape] : NULL;
            const struct decided at = {&v->d, bsdf, shape, v->carried, v->to_light};
            struct imp_vertex now;
            struct imp_place p;
            struct values x;
            place_set(&v->d, shape, v->carried, &p);
            decided_values(scene, &at, &p, in, &x);
            now.w = (imp_spec){0};
            if (v->d.goes_on) {
                imp__step_weigh(&now, x.f, v->d.pdf, v->d.survive);
                imp__step_pass(&now, passes(there, v));
            }
            L = x.e + now.w * L + x.b;
        }
        for (const struct imp_side *s = v->side; s; s = s->next)
            L += elsewhere(there, &s->walk);
    }
    return L;
}

imp_spec imp__walk_elsewhere(const struct imp_tracer *there, const struct imp_walk *walk)
{
    const imp_spec none = {0};
    if (walk->dropped || !walk->valid) return imp__walk_shown(there, walk, none);
    const imp_spec L = imp__walk_shown(there, walk, elsewhere(there, walk));
    for (int c = 0; c < 4; c++)
        if (!isfinite(L[c])) return imp__walk_shown(there, walk, none);
    return L;
}

imp_spec imp__walk_frozen(const struct imp_tracer *tracer, const struct imp_walk *walk)
{
    return imp__walk_channels(tracer, walk, frozen(tracer, walk));
}

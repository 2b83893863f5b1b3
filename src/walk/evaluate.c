/* SPDX-License-Identifier: Apache-2.0
 *
 * Values from decisions: what the scene's present parameters make of a walk whose
 * vertices, directions, densities, MIS weights and roulette are settled. */
#include "graded.h"

static void place_decided(const struct imp_vertex *v, struct imp_place *p)
{
    *p =
        (struct imp_place){imp__vertex_at(v), imp__vertex_dirs(v), imp__vertex_met(v), 1};
}

/* E + B of the vertex at place p, and the weight of its step. */
static imp_spec vertex_value(const struct imp_tracer *tracer, const struct imp_vertex *v,
                             const struct imp_place *p, imp_spec *w)
{
    const struct imp_scene *scene = tracer->scene;
    const struct imp_decision *d = &v->d;
    const struct imp_bsdf *b = v->bsdf;
    imp_spec in[IMP_INPUTS_MAX], f, sum = {0};
    *w = (imp_spec){0};
    if (b) imp__evaluate_inputs(b, v->shape, &p->at, in);
    if (d->glows) {
        b->ops->emit(b, in, &p->dirs.wo, &f);
        sum += f * d->glow_weight;
    }
    if (d->met.emitter >= 0)
        sum +=
            imp__emitter_radiance(scene, d->met.emitter, &p->met, p->at.p, v->carried) *
            d->met.weight;
    if (d->connection == IMP_CONNECTED) {
        const struct imp_emission x = imp__light_emission(&d->light);
        struct imp_dirs dirs = imp__light_dirs(v);
        dirs.wo = p->dirs.wo;
        b->ops->eval(b, in, &dirs, &f);
        sum += f *
               imp__emitter_radiance(scene, d->light.emitter, &x,
                                     imp__decided_v3(d->light.p), v->carried) *
               d->light.weight;
    }
    if (d->goes_on) {
        b->ops->eval(b, in, &p->dirs, &f);
        *w = f * v->scale;
    }
    return sum;
}

imp_spec imp__walk_frozen(const struct imp_tracer *tracer, const struct imp_walk *walk)
{
    imp_spec P = imp__spec(1), L = {0};
    const imp_spec *entry = walk->entry;
    struct imp_moving moving = {{0}, {0}, {0}};
    if (walk->dropped || !walk->valid) return L;
    for (const struct imp_vertex *v = walk->first; v; v = v->next) {
        const struct imp_segment_ops *segment = v->segment->ops;
        struct imp_place p;
        imp_spec w;
        place_decided(v, &p);
        if (segment->place && !segment->place(tracer, v, &moving, &p))
            return imp__spec(NAN);
        P *= p.ratio * p.ratio;
        const imp_spec own = vertex_value(tracer, v, &p, &w);
        L += P * (entry ? own * *entry++ : own);
        for (const struct imp_side *s = v->side; s; s = s->next)
            L += P * imp__walk_frozen(tracer, &s->walk);
        P *= w;
    }
    return L;
}

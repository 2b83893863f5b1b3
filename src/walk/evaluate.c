/* SPDX-License-Identifier: Apache-2.0
 *
 * Values from decisions: what the scene's present parameters make of a walk whose
 * vertices, directions, densities, MIS weights and roulette are settled. */
#include "graded.h"

void imp__evaluate_inputs(const struct imp_vertex *v, const struct imp_texcoord *at,
                          imp_spec *in)
{
    imp__inputs_eval(v->bsdf->input, v->bsdf->n_in, at, in);
    if (imp_unlikely(v->shape->interior != NULL)) imp__graded_inputs(v, at, in);
}

imp_spec imp__evaluate_glow(const struct imp_vertex *v, const imp_spec *in,
                            const imp_v3 *wo)
{
    imp_spec glow;
    v->bsdf->ops->emit(v->bsdf, in, wo, &glow);
    return glow * v->d.glow_weight;
}

void imp__step_weigh(struct imp_vertex *v, imp_spec f)
{
    v->scale = 1 / ((double)v->d.pdf * v->d.survive);
    v->w = f * v->scale;
}

void imp__step_pass(struct imp_vertex *v, double transmittance)
{
    v->scale *= transmittance;
    v->w *= transmittance;
}

imp_spec imp__emitter_radiance(const struct imp_scene *scene, int emitter,
                               const struct imp_emission *x, imp_v3 p)
{
    const struct imp_emitter *e = scene->emitters[emitter];
    const struct imp_texcoord at = {{x->uv[0], x->uv[1]}, p};
    imp_spec in[IMP_INPUTS_MAX], le;
    imp__inputs_eval(e->input, e->n_in, &at, in);
    e->ops->eval(e, in, x, &le);
    return le;
}

/* ---- Elsewhere -------------------------------------------------------------------- */

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
    if (b) imp__evaluate_inputs(v, &p->at, in);
    if (d->glows) sum += imp__evaluate_glow(v, in, &p->dirs.wo);
    if (d->met.emitter >= 0)
        sum += imp__emitter_radiance(scene, d->met.emitter, &p->met, p->at.p) *
               d->met.weight;
    if (d->connection == IMP_CONNECTED) {
        const struct imp_emission x = imp__light_emission(&d->light);
        struct imp_dirs dirs = imp__light_dirs(v);
        dirs.wo = p->dirs.wo;
        b->ops->eval(b, in, &dirs, &f);
        sum += f *
               imp__emitter_radiance(scene, d->light.emitter, &x,
                                     imp__decided_v3(d->light.p)) *
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
        L += P * vertex_value(tracer, v, &p, &w);
        P *= w;
    }
    return L;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Emission: met by chance, and asked for by light samples, each with the weight of the
 * power heuristic (Veach 1997) against the other. */
#include "step.h"

static double light_pmf(const struct imp_scene *s, int light)
{
    return s->light_cdf[light] - (light ? s->light_cdf[light - 1] : 0);
}

static double power_heuristic(double a, double b)
{
    const double a2 = a * a, b2 = b * b;
    return a2 > 0 ? a2 / (a2 + b2) : 0;
}

/* Probability with which light samples choose this light: at the vertex itself, or where
 * the ray in flight left. */
static double light_pmf_at(const struct imp_step *s, bool known,
                           const struct imp_guide_place *place, int light)
{
    const struct imp_guide *g = s->guided.guide;
    return imp_unlikely(known) ? g->light_pmf(g, place, light)
                               : light_pmf(s->scene, light);
}

void imp__emission_meet(struct imp_step *s, struct imp_vertex *v, int emitter,
                        const struct imp_hit *hit, const struct imp_surface *at)
{
    const struct imp_emitter *e = s->scene->emitters[emitter];
    struct imp_met *m = &v->d.met;
    m->emitter = emitter;
    m->dist = at ? (imp_decided)hit->t : (imp_decided)INFINITY;
    m->cos_light = at ? (imp_decided)-imp__dot(at->n, s->d) : 1;
    for (int k = 0; k < 3; k++) m->d[k] = (imp_decided)-s->d[k];
    if (s->pdf > 0 && imp__wants_lights(s->tracer->integrator)) {
        const double pmf = light_pmf_at(s, s->guided.left, &s->guided.from, emitter);
        const double pe = pmf * e->ops->pdf(e, &s->from, &s->d, hit, at);
        m->weight = (imp_decided)(m->weight * power_heuristic(s->pdf, pe));
    }
    const struct imp_emission x = imp__vertex_met(v);
    v->e +=
        imp__emitter_radiance(s->scene, emitter, &x, imp__decided_v3(v->d.p)) * m->weight;
}

/* A light, by sampling weights or as the guide says; its probability. */
static int light_choose(const struct imp_step *s, double u, double *pmf)
{
    const struct imp_scene *scene = s->scene;
    const struct imp_guided *g = &s->guided;
    int light = 0, above = scene->n_emitters - 1;
    if (imp_unlikely(g->here)) {
        light = g->guide->light(g->guide, &g->at, u);
    } else { /* the first whose cumulative weight exceeds u */
        while (light < above) {
            const int middle = (light + above) / 2;
            if (u < scene->light_cdf[middle]) above = middle;
            else light = middle + 1;
        }
    }
    *pmf = light_pmf_at(s, g->here, &g->at, light);
    return light;
}

static void decide_light(struct imp_vertex *v, int emitter, double weight,
                         const struct imp_light_sample *ls, imp_v3 wi)
{
    struct imp_light *l = &v->d.light;
    l->emitter = emitter;
    l->weight = (imp_decided)weight;
    l->uv[0] = (imp_decided)ls->uv[0];
    l->uv[1] = (imp_decided)ls->uv[1];
    l->dist = (imp_decided)ls->dist;
    l->cos_light = (imp_decided)ls->cos_light;
    for (int k = 0; k < 3; k++) {
        l->d[k] = (imp_decided)-ls->wi[k];
        l->p[k] = (imp_decided)ls->p[k];
        l->wi[k] = (imp_decided)wi[k];
    }
}

void imp__light_sample(struct imp_step *s, struct imp_vertex *v,
                       const struct imp_surface *at, const struct imp_frame *frame,
                       struct imp_shadow *shadow)
{
    const struct imp_scene *scene = s->scene;
    const struct imp_key key = s->walk->key;
    if (scene->n_emitters == 0) return;

    /* A light and a point on it. */
    double pmf;
    const int light =
        light_choose(s, imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT)), &pmf);
    if (!(pmf > 0)) return;
    const struct imp_emitter *e = scene->emitters[light];
    const double u[2] = {imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT_U)),
                         imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT_V))};
    struct imp_light_sample ls;
    if (!e->ops->sample(e, &at->p, u, &ls) || !(ls.pdf > 0)) return;

    /* Its weight against the continuation that could have met it. */
    const imp_v3 wi = imp__to_local(frame, ls.wi);
    const struct imp_dirs there = {imp__decided_v3(v->d.wo), wi, IMP_SMOOTH};
    const double kernel = v->bsdf->ops->pdf(v->bsdf, v->in, &there);
    if (!(kernel > 0)) return; /* structurally zero: nothing to see, no derivative */
    const double pdf = imp__direction_pdf(s, v->bsdf, kernel, ls.wi);
    const double p = ls.pdf * pmf;
    const bool alone =
        (e->ops->flags & IMP_EMITTER_DELTA) || s->tracer->integrator->bsdf_samples == 0;
    decide_light(v, light, (alone ? 1 : power_heuristic(p, pdf)) / p, &ls, wi);

    /* What it brings, if it is seen. */
    const struct imp_emission x = imp__light_emission(&v->d.light);
    const struct imp_dirs dirs = imp__light_dirs(v);
    v->light_e = imp__emitter_radiance(scene, light, &x, imp__decided_v3(v->d.light.p));
    v->bsdf->ops->eval(v->bsdf, v->in, &dirs, &v->light_f);
    const struct imp_active *active = s->tracer->active;
    const bool differentiable =
        active &&
        ((v->bsdf->index >= 0 && active->bsdf[v->bsdf->index]) || active->emitter[light]);
    if (imp__is_zero(v->light_f * v->light_e) && !differentiable) return;
    v->d.connection = IMP_OCCLUDED; /* until it is seen */

    /* Aimed from the moved origin at the point itself: a ray parallel to wi would meet a
     * concave light before its end. */
    const bool far = !isfinite(ls.dist);
    shadow->o = imp__offset(at->p, at->ng, ls.wi);
    shadow->d = far ? ls.wi : ls.p - shadow->o; /* then t = 1 is the light */
    shadow->reach = far ? INFINITY : 1 - 10 * IMP_RAY_EPSILON;
    shadow->wanted = true;
}

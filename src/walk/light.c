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

void imp__emission_meet(struct imp_step *s, struct imp_vertex *v, int emitter,
                        const struct imp_hit *hit, const struct imp_surface *at)
{
    const struct imp_emitter *e = s->scene->emitters[emitter];
    struct imp_emission *x = &v->e_at;
    *x = (struct imp_emission){{0, 0}, INFINITY, 1, -s->d};
    if (at) {
        x->uv[0] = at->uv[0];
        x->uv[1] = at->uv[1];
        x->dist = hit->t;
        x->cos_light = -imp__dot(at->n, s->d);
    }
    v->emitter = emitter;
    if (s->pdf > 0 && imp__wants_lights(s->tracer->integrator)) {
        const struct imp_guide *g = s->tracer->guide;
        const double pmf = imp_unlikely(s->left_known)
                               ? g->light_pmf(g, &s->left, emitter)
                               : light_pmf(s->scene, emitter);
        const double pe = pmf * e->ops->pdf(e, &s->from, &s->d, hit, at);
        v->e_weight *= power_heuristic(s->pdf, pe);
    }
    v->e += imp__emitter_radiance(s->scene, emitter, x, v->at.p) * v->e_weight;
}

void imp__light_sample(struct imp_step *s, struct imp_vertex *v,
                       const struct imp_surface *at, const struct imp_frame *frame,
                       struct imp_shadow *shadow)
{
    const struct imp_scene *scene = s->scene;
    const struct imp_key key = s->walk->key;
    const int n = scene->n_emitters;
    if (n == 0) return;
    const double choice = imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT));
    const struct imp_guide *g = s->tracer->guide;
    int light = 0, above = n - 1; /* the first whose cumulative weight exceeds choice */
    if (imp_unlikely(s->known)) light = above = g->light(g, &s->place, choice);
    while (light < above) {
        const int middle = (light + above) / 2;
        if (choice < scene->light_cdf[middle]) above = middle;
        else light = middle + 1;
    }
    const double pmf = imp_unlikely(s->known) ? g->light_pmf(g, &s->place, light)
                                              : light_pmf(scene, light);
    if (!(pmf > 0)) return;

    const struct imp_emitter *e = scene->emitters[light];
    const double u[2] = {imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT_U)),
                         imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT_V))};
    struct imp_light_sample ls;
    if (!e->ops->sample(e, &at->p, u, &ls) || !(ls.pdf > 0)) return;

    const struct imp_dirs dirs = {v->dirs.wo, imp__to_local(frame, ls.wi), IMP_SMOOTH};
    double pdf_bsdf = v->bsdf->ops->pdf(v->bsdf, v->in, &dirs);
    if (!(pdf_bsdf > 0)) return; /* structurally zero: nothing to see, no derivative */
    if (imp_unlikely(s->known) && imp__mixes(s, v->bsdf))
        pdf_bsdf = imp__mixture_pdf(s, pdf_bsdf, ls.wi);
    const struct imp_emission x = {{ls.uv[0], ls.uv[1]}, ls.dist, ls.cos_light, -ls.wi};
    const imp_spec le = imp__emitter_radiance(scene, light, &x, ls.p);
    imp_spec f;
    v->bsdf->ops->eval(v->bsdf, v->in, &dirs, &f);
    const struct imp_active *active = s->tracer->active;
    const bool differentiable =
        active &&
        ((v->bsdf->index >= 0 && active->bsdf[v->bsdf->index]) || active->emitter[light]);
    if (imp__is_zero(f * le) && !differentiable) return;

    /* Aimed from the moved origin at the point itself: a ray parallel to wi would meet a
     * concave light before its end. */
    const bool far = !isfinite(ls.dist);
    shadow->o = imp__offset(at->p, at->ng, ls.wi);
    shadow->d = far ? ls.wi : ls.p - shadow->o; /* then t = 1 is the light */
    shadow->reach = far ? INFINITY : 1 - 10 * IMP_RAY_EPSILON;
    shadow->light = light;

    const bool delta = e->ops->flags & IMP_EMITTER_DELTA;
    const bool bsdf_samples = s->tracer->integrator->bsdf_samples > 0;
    const double p = ls.pdf * pmf;
    v->l_at = x;
    v->l_wi = dirs.wi;
    v->l_p = ls.p;
    v->l_f = f;
    v->l_le = le;
    v->l_weight = (delta || !bsdf_samples ? 1 : power_heuristic(p, pdf_bsdf)) / p;
}

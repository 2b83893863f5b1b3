/* SPDX-License-Identifier: Apache-2.0
 *
 * Emission: met by chance, and asked for by light samples, each with the weight of the
 * power heuristic (Veach 1997) against the other. */
#include "drawn.h"
#include "light_point.h"
#include "scene/located.h"
#include "walk/both/both.h"

static double light_pmf(const struct imp_scene *s, int light)
{
    return s->light_cdf[light] - (light ? s->light_cdf[light - 1] : 0);
}

/* The weight of what density a drew and density b could have drawn; and that over a. */
static double power_heuristic(double a, double b)
{
    const double a2 = a * a, b2 = b * b;
    return a2 > 0 ? a2 / (a2 + b2) : 0;
}
static double power_heuristic_over(double a, double b)
{
    const double a2 = a * a, b2 = b * b;
    return a2 > 0 ? a / (a2 + b2) : 0;
}

/* By what the density of a point of this light is multiplied, since light samples choose
 * the light where the ray in flight left: its probability. prim: of the point that is met. */
static double choice_factor(const struct imp_step *s, int light, int prim)
{
    const struct imp_guided *g = &s->guided;
    if (imp_unlikely(g->left)) return g->guide->light_pmf(g->guide, &g->from, light);
    if (imp_unlikely(s->light_tree != NULL))
        return imp__light_tree_factor(s->light_tree, &s->left, light, prim);
    return light_pmf(s->scene, light);
}

void imp__emission_meet(struct imp_step *s, struct imp_vertex *v, int emitter,
                        double weight, const struct imp_hit *hit,
                        const struct imp_surface *at)
{
    const struct imp_emitter *e = s->scene->emitters[emitter];
    if (imp_unlikely(e->ops->flags & IMP_EMITTER_DELTA))
        return; /* no ray meets its light */
    const struct imp_emission x = {{s->at.uv[0], s->at.uv[1]},
                                   at ? imp__decide1(hit->t) : INFINITY,
                                   at ? imp__decide1(-imp__dot(at->n, s->d)) : 1,
                                   imp__decide(-s->d)};
    if (imp_unlikely(s->both != NULL)) {
        weight = imp__decide1(imp__both_met_weight(s, emitter, hit, at));
    } else if (s->pdf > 0 && s->tracer->integrator->lights &&
               !s->tracer->integrator->only_points) {
        const double factor = choice_factor(s, emitter, hit ? hit->prim : -1);
        const double pe = factor * e->ops->pdf(e, &s->from, &s->d, hit, at);
        weight = imp__decide1(weight * power_heuristic(s->pdf, pe));
    }
    weight = imp__emitter_timed(e, s->walk->time, weight);
    v->e += imp__emitter_radiance(s->scene, emitter, &x, s->at.p, s->at.carried) * weight;
    if (!s->recorded) return;
    struct imp_met *m = &v->d.met;
    m->emitter = emitter;
    m->weight = (imp_decided)weight;
    m->dist = (imp_decided)x.dist;
    m->cos_light = (imp_decided)x.cos_light;
    imp__store_v3(m->d, x.d);
}

/* A light, by sampling weights or as the guide says; its probability. */
static int light_choose(const struct imp_step *s, double u, double *pmf)
{
    const struct imp_guided *g = &s->guided;
    if (imp_likely(!g->here)) return imp__light_pick(s->scene, u, pmf);
    const int light = g->guide->light(g->guide, &g->at, u);
    *pmf = g->guide->light_pmf(g->guide, &g->at, light);
    return light;
}

/* A light and a point on it, for the vertex at `at`; *pmf: probability of the light, or of
 * the triangle that the density in `ls` is that of. -1: none. Of points in sets, the first
 * number chooses the light too: those that a light gets then cover it evenly. */
static __attribute__((noinline)) int tree_sample(const struct imp_step *s,
                                                 const struct imp_bsdf *b,
                                                 const struct imp_surface *at,
                                                 double u[2], double *pmf,
                                                 struct imp_light_sample *ls)
{
    const struct imp_light_place place = imp__light_place(s, b, at);
    const bool one = s->walk->point.points;
    double which = one ? u[0] : imp__step_number(s, IMP_DIM_LIGHT);
    int prim;
    *pmf = 0;
    const int light =
        imp__light_tree_choose(s->light_tree, &place, s->cut, &which, &prim, pmf);
    if (light < 0) return -1;
    if (one) u[0] = which;
    const struct imp_emitter *e = s->scene->emitters[light];
    const struct imp_shape *shape = e->shape;
    if (prim >= 0)
        return shape->ops->sample_triangle(shape, prim, &at->p, u, ls) ? light : -1;
    return e->ops->sample(e, &at->p, u, ls) ? light : -1;
}
static inline int weights_sample(const struct imp_step *s, const struct imp_surface *at,
                                 double u[2], double *pmf, struct imp_light_sample *ls)
{
    const bool one = s->walk->point.points && !s->guided.here;
    const int light =
        light_choose(s, one ? u[0] : imp__step_number(s, IMP_DIM_LIGHT), pmf);
    if (!(*pmf > 0)) return -1;
    if (one) u[0] = imp__light_part(s->scene, light, u[0], *pmf);
    const struct imp_emitter *e = s->scene->emitters[light];
    return e->ops->sample(e, &at->p, u, ls) ? light : -1;
}

/* noinline: of uneven lights, it would keep registers from the even ones. */
static __attribute__((noinline)) imp_spec
uneven_radiance(const struct imp_step *s, int light, const struct imp_light_sample *ls)
{
    return imp__light_point_radiance(s->scene, s->at.carried, light, ls);
}
static inline imp_spec sample_radiance(const struct imp_step *s, int light,
                                       const struct imp_light_sample *ls)
{
    const struct imp_emitter *e = s->scene->emitters[light];
    return imp_likely(imp__emitter_even(e, s->at.carried))
               ? imp__even_radiance(e, imp__decide1(ls->cos_light))
               : uneven_radiance(s, light, ls);
}

/* wi: towards it, in the frame of the vertex. */
static inline void record(struct imp_vertex *v, int emitter,
                          const struct imp_shape *shape, double weight,
                          const struct imp_light_sample *ls, imp_v3 wi)
{
    struct imp_light *l = &v->d.light;
    l->emitter = emitter;
    l->weight = (imp_decided)weight;
    const imp_float4 there =
        imp__narrow((imp_v3){ls->uv[0], ls->uv[1], ls->dist, ls->cos_light});
    l->uv[0] = there[0];
    l->uv[1] = there[1];
    l->dist = there[2];
    l->cos_light = there[3];
    imp__store_v3(l->d, -ls->wi);
    imp__store_v3(l->p, imp__light_place_of(ls));
    imp__store_v3(l->wi, wi);
    l->located = imp__located_drawn(shape, &ls->located, ls->uv);
    v->d.connection = IMP_OCCLUDED; /* until it is seen */
}

/* Density with which the continuation would be drawn along w; 0: structurally zero. f:
 * the value. */
static inline double continuation_pdf(const struct imp_step *s, const struct imp_bsdf *b,
                                      const struct imp_dirs *dirs, imp_v3 w, imp_spec *f)
{
    double competing;
    if (imp_likely(!b->shaped)) {
        const double kernel = imp__bsdf_pdf_eval(b, s->in, dirs, f);
        if (!(kernel > 0)) return 0;
        imp__direction_pdf(s, kernel, w, -1, IMP_SMOOTH, &competing);
        return competing;
    }
    imp_spec p;
    imp__shaped_pdf(b, s->at.carried, s->in, dirs, &p);
    imp__shaped_eval(b, s->at.carried, s->in, dirs, f);
    if (!(imp__lane_mis_density(s, p) > 0)) return 0;
    for (int j = 0; j < s->at.carried->n; j++) {
        imp__direction_pdf(s, p[j], w, -1, IMP_SMOOTH, &competing);
        p[j] = competing;
    }
    return s->mixed.splits ? p[imp__waves_drew(s->at.carried)]
                           : imp__lane_mis_density(s, p);
}

bool imp__light_point_of(const struct imp_step *s, const struct imp_bsdf *b,
                         const struct imp_surface *at, double u[2],
                         struct imp_light_point *out)
{
    out->there.located.prim = -1;
    out->light = imp_unlikely(s->light_tree != NULL && !s->guided.here)
                     ? tree_sample(s, b, at, u, &out->pmf, &out->there)
                     : weights_sample(s, at, u, &out->pmf, &out->there);
    return out->light >= 0 && out->there.pdf > 0;
}

void imp__light_sample(struct imp_step *s, struct imp_vertex *v,
                       const struct imp_surface *at, const struct imp_frame *frame,
                       const struct imp_light_point *to, struct imp_shadow *shadow)
{
    const struct imp_scene *scene = s->scene;
    const struct imp_bsdf *b = v->bsdf;
    const struct imp_light_sample *ls = &to->there;
    const int light = to->light;
    const double pmf = to->pmf;
    const struct imp_emitter *e = scene->emitters[light];
    if (imp_unlikely(s->tracer->integrator->only_points) &&
        !(e->ops->flags & IMP_EMITTER_DELTA))
        return;
    if ((e->ops->flags & IMP_EMITTER_AREA) && !(ls->cos_light > 0)) return; /* its back */

    /* Its weight against the continuation that could have met it. */
    const struct imp_dirs dirs = {s->wo, imp__decide(imp__to_local(frame, ls->wi)),
                                  IMP_SMOOTH, imp__derivative_wanted(s, b)};
    imp_spec f;
    const double pdf = continuation_pdf(s, b, &dirs, ls->wi, &f);
    if (!(pdf > 0)) return; /* structurally zero: nothing to see, no derivative */
    const double p = ls->pdf * pmf;
    const bool alone =
        (e->ops->flags & IMP_EMITTER_DELTA) || !s->tracer->integrator->directions;
    const double mis_over_p = imp_unlikely(s->both != NULL)
                                  ? imp__both_sample_weight(s, light, ls, b, &dirs) / p
                              : alone ? 1 / p
                                      : power_heuristic_over(p, pdf);
    const double weight = imp__emitter_timed(e, s->walk->time, imp__decide1(mis_over_p));

    /* What it brings, if it is seen. */
    const imp_spec le = sample_radiance(s, light, ls);
    const struct imp_active *active = s->tracer->active;
    const bool differentiable =
        active && ((b->index >= 0 && active->bsdf[b->index]) || active->emitter[light]);
    if (imp__is_zero_used(f * le, s->at.carried) && !differentiable) return;
    shadow->brings = f * le * weight;
    if (s->recorded) {
        record(v, light, e->shape, weight, ls, dirs.wi);
        v->light_f = f;
        v->light_e = le;
        v->light_w = imp__spec(weight);
    }

    /* Aimed from the moved origin at the point itself: a ray parallel to wi would meet a
     * concave light before its end. */
    const bool far = !isfinite(ls->dist);
    shadow->o = imp__offset(at->p, at->ng, ls->wi);
    shadow->d = far ? ls->wi : ls->p - shadow->o; /* then t = 1 is the light */
    shadow->reach = far ? INFINITY : 1 - 10 * IMP_RAY_EPSILON;
    shadow->wanted = true;
}

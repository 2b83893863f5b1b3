/* SPDX-License-Identifier: Apache-2.0
 *
 * Which point of a light a vertex samples: a point is drawn with the density that the draw
 * claims, per steradian at the vertex; q draws directions towards the light, and those count
 * whose ray meets it first. Sums as in check_directions.c. Where something was drawn, what the
 * draw claims and what weighs met light must agree. */
#include "check_lights.h"
#include "check_lobes.h"
#include "math/offset.h"
#include "math/rng.h"
#include "math/warp.h"
#include "scene/instances.h"
#include <math.h>
#include <stdio.h>

enum { QUARTERS = IMP_LIGHT_RATIOS + 6, SAME = QUARTERS + 4, NARROWLY };
#define GRAZES      0.05 /* cosine below which the rounding of a ray changes densities */
#define PASSED_MOST 16   /* surfaces without effect on the way */

/* Lights of one kind on shapes of one kind. */
struct points {
    struct imp__lit_places v;
    const struct imp_emitter **light; /* [n] */
    int n;
    bool triangles;               /* they are chosen one by one */
    double *area;                 /* [n] of these, all together */
    const struct imp__lobes *sky; /* [n] q of lights without end */
};

static bool in_triangles(const struct imp_emitter *e)
{
    return e->shape && imp__light_in_triangles(e);
}

/* What the ray from the vertex meets first: is it the light's front? */
static bool meets(const struct points *g, const struct imp_emitter *e, imp_v3 from,
                  imp_v3 ng, double time, imp_v3 d, struct imp_hit *hit,
                  struct imp_surface *at, double *t)
{
    const struct imp_scene *scene = g->v.places->tracer.scene;
    imp_v3 o = imp__offset(from, ng, d);
    double passed = 0;
    for (int k = 0; k < PASSED_MOST; k++) {
        if (!imp__intersect_at(scene, time, &o, &d, 0, INFINITY, hit)) return false;
        const struct imp_shape *shape = scene->shapes[hit->shape];
        imp__hit_surface(scene, hit, &o, &d, at);
        *t = hit->t = hit->t + passed;
        if (shape == e->shape) return -imp__dot(at->n, d) > 0;
        if (!(imp__shape_bsdf(scene, shape)->flags & IMP_BSDF_NULL)) return false;
        passed = hit->t;
        o = imp__offset(at->p, at->ng, d);
    }
    return false;
}

/* Directions towards a light: a cone about its box, or all of them. */
static void cone_of(const struct imp_shape *s, imp_v3 ref, struct imp_frame *frame,
                    double *height)
{
    const imp_v3 to = (s->lo + s->hi) * 0.5 - ref;
    const double d = imp__length(to), r = 0.5001 * imp__length(s->hi - s->lo);
    *height = d <= r ? 2 : 1 - sqrt(1 - imp__sqr(r / d));
    *frame = imp__frame_from_normal(d <= r ? imp__v3(0, 0, 1) : to * (1 / d));
}
static double cone_pdf(const struct imp_frame *frame, double height, imp_v3 w)
{
    return imp__dot(frame->n, w) >= 1 - height - 1e-12 ? 1 / (IMP_2PI * height) : 0;
}
static imp_v3 cone_sample(const struct imp_frame *frame, double height, const double u[2])
{
    const double away = height * u[0], s = sqrt(fmax(0, away * (2 - away)));
    return imp__to_world(
        frame, imp__v3(s * cos(IMP_2PI * u[1]), s * sin(IMP_2PI * u[1]), 1 - away));
}

static void point_add(struct imp__pair *p, double pdf, double q, const double uv[2],
                      bool drawn)
{
    const double part = (drawn ? q : pdf) / (q + pdf), d = drawn ? part : 0,
                 g = drawn ? 0 : part;
    const int quarter = (uv[0] > 0.5) + 2 * (uv[1] > 0.5);
    imp__pair_add(p, IMP_LIGHT_WHOLE, d, g);
    imp__pair_add(p, IMP_LIGHT_RATIOS + imp_min((int)(6 * pdf / (pdf + q)), 5), d, g);
    imp__pair_add(p, QUARTERS + quarter, d, g);
}

/* Density of a point that was met, where a triangle is drawn by chance and then a point of it. */
static double met_pdf(const struct points *g, int k, imp_v3 ref, imp_v3 w,
                      const struct imp_hit *hit, const struct imp_surface *at)
{
    const struct imp_emitter *e = g->light[k];
    const double pdf = e->ops->pdf(e, &ref, &w, hit, at);
    if (!g->triangles || hit->prim < 0) return pdf;
    const struct imp_triangles *all = &e->shape->triangles;
    return pdf * g->area[k] / imp__triangle_area(all, hit->prim) /
           (double)all->n_triangles;
}

static void area_pair(const struct points *g, int k, const struct imp__place *x,
                      struct imp_key key, struct imp__pair *p)
{
    const struct imp_emitter *e = g->light[k];
    const struct imp_shape *shape = e->shape;
    const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)},
                 v[2] = {imp__u01(key, 2), imp__u01(key, 3)};
    const imp_v3 ref = x->at.p;
    const double time = x->walk.time;
    const int n = g->triangles ? (int)shape->triangles.n_triangles : 1;
    const int prim = imp_min((int)(imp__u01(key, 4) * n), n - 1);
    struct imp_frame frame;
    struct imp_light_sample ls;
    struct imp_surface at;
    struct imp_hit hit;
    double height, t;
    cone_of(shape, ref, &frame, &height);
    ls.located.prim = -1;
    const bool drawn = g->triangles
                           ? shape->ops->sample_triangle(shape, prim, &ref, u, &ls)
                           : e->ops->sample(e, &ref, u, &ls);
    if (drawn && ls.pdf > 0 && ls.cos_light > 0 &&
        meets(g, e, ref, x->at.ng, time, ls.wi, &hit, &at, &t) &&
        fabs(t / ls.dist - 1) < 0.02) {
        point_add(p, ls.pdf / n, cone_pdf(&frame, height, ls.wi), at.uv, true);
        if (ls.cos_light > GRAZES && fabs(t / ls.dist - 1) < 1e-4)
            imp__agree_add(p, SAME, ls.pdf / n, met_pdf(g, k, ref, ls.wi, &hit, &at));
    }
    const imp_v3 w = cone_sample(&frame, height, v);
    if (!meets(g, e, ref, x->at.ng, time, w, &hit, &at, &t)) return;
    const double pdf = met_pdf(g, k, ref, w, &hit, &at);
    if (pdf > 0) point_add(p, pdf, cone_pdf(&frame, height, w), at.uv, false);
}

/* A small bright place is a part of its own: a sun, whose share may be wrong alone. */
static void sky_add(struct imp__pair *p, const struct imp__lobes *q, imp_v3 w, double pdf,
                    bool drawn)
{
    const double uv[2] = {0.5 + 0.5 * w[0], 0.5 + 0.5 * w[1]},
                 other = imp__lobes_pdf(q, w);
    const double part = (drawn ? other : pdf) / (other + pdf);
    point_add(p, pdf, other, uv, drawn);
    if (imp__lobes_narrowly(q, w))
        imp__pair_add(p, NARROWLY, drawn ? part : 0, drawn ? 0 : part);
}

static void sky_pair(const struct points *g, int k, const struct imp__place *x,
                     struct imp_key key, struct imp__pair *p)
{
    const struct imp_emitter *e = g->light[k];
    const struct imp__lobes *q = &g->sky[k];
    const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)},
                 v[3] = {imp__u01(key, 2), imp__u01(key, 3), imp__u01(key, 4)};
    struct imp_light_sample ls;
    if (e->ops->sample(e, &x->at.p, u, &ls) && ls.pdf > 0) {
        sky_add(p, q, ls.wi, ls.pdf, true);
        imp__agree_add(p, SAME, ls.pdf, e->ops->pdf(e, &x->at.p, &ls.wi, NULL, NULL));
    }
    const imp_v3 w = imp__lobes_sample(q, v);
    const double pdf = e->ops->pdf(e, &x->at.p, &w, NULL, NULL);
    if (pdf > 0) sky_add(p, q, w, pdf, false);
}

static void point_pair(const void *payload, uint64_t seed, int64_t i, struct imp__pair *p)
{
    const struct points *g = payload;
    const struct imp_key key = imp__key(seed, 0xb017, (uint64_t)i);
    const int k = (int)(i % g->n);
    const struct imp__place *x = g->v.at[(i / g->n) % g->v.n];
    if (g->light[k]->shape) area_pair(g, k, x, key, p);
    else sky_pair(g, k, x, key, p);
}

static bool alike(const struct imp_emitter *a, const struct imp_emitter *b)
{
    if (a->ops != b->ops || !a->shape != !b->shape) return false;
    return !a->shape ||
           (a->shape->ops == b->shape->ops && in_triangles(a) == in_triangles(b));
}
static bool has_density(const struct imp_emitter *e)
{
    return !(e->ops->flags & IMP_EMITTER_DELTA) && e->ops->sample && e->ops->pdf;
}

/* Is light k the first of those that are like it? */
static bool first_of_its_like(const struct imp_scene *scene, int k)
{
    bool first = has_density(scene->emitters[k]);
    for (int j = 0; j < k && first; j++)
        first = !has_density(scene->emitters[j]) ||
                !alike(scene->emitters[j], scene->emitters[k]);
    return first;
}

enum imp_status imp__check_points(struct imp__draw_list *l,
                                  const struct imp__lit_places *v, int first)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *scene = v->places->tracer.scene;
    if (!first_of_its_like(scene, first)) return IMP_OK;
    const struct imp_emitter *e = scene->emitters[first];
    const size_t most = (size_t)scene->n_emitters;
    struct points *g = imp__arena_array(&l->arena, 1, sizeof *g);
    const struct imp_emitter **light =
        imp__arena_array(&l->arena, most, sizeof(struct imp_emitter *));
    struct imp__lobes *sky =
        imp__arena_array(&l->arena, e->shape ? 1 : most, sizeof *sky);
    char *name = imp__arena_array(&l->arena, 160, 1);
    double *area = imp__arena_array(&l->arena, most, sizeof *area);
    if (!area || !g || !light || !sky || !name)
        IMP_TRY(imp__error(l->check->ctx, IMP_E_NOMEM, "no memory for a check"));
    *g = (struct points){.v = *v, .light = light, .sky = sky, .area = area};
    for (int k = first; k < scene->n_emitters; k++)
        if (has_density(scene->emitters[k]) && alike(e, scene->emitters[k]))
            light[g->n++] = scene->emitters[k];
    g->triangles =
        v->places->tracer.integrator->light_tree && scene->light_tree && in_triangles(e);
    for (int k = 0; k < g->n && g->triangles; k++)
        area[k] = imp__triangles_area(&light[k]->shape->triangles);
    for (int k = 0; k < g->n && !e->shape; k++)
        imp__lobes_of_sky(&sky[k], light[k], v->at[0]->at.p);
    const char *own = e->name ? e->name : e->ops->name;
    if (g->n == 1) snprintf(name, 160, "%s", own);
    else snprintf(name, 160, "%s and %d more", own, g->n - 1);
    st = imp__draw_add(l, &(struct imp__draw_row){.method = "points",
                                                  .name = name,
                                                  .pair = point_pair,
                                                  .payload = g,
                                                  .slack = 1e-3,
                                                  .fine = 1u << NARROWLY});
out:
    return st;
}

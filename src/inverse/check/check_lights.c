/* SPDX-License-Identifier: Apache-2.0
 *
 * Which light a vertex samples, and which point of it: what is drawn, against the
 * probabilities and densities that weigh it.
 *
 * choices: a light (of the tree: a light or a triangle of one) is drawn with the probability
 * that the draw itself claims, and q draws one of them by chance. points: a point is drawn with
 * the density that the draw claims, per steradian at the vertex; q draws directions towards
 * the light, and those count whose ray meets it first. Sums as in check_directions.c. Where
 * something was drawn, what the draw claims and what weighs met light must agree. */
#include "check_lobes.h"
#include "check_sources.h"
#include "math/offset.h"
#include "math/rng.h"
#include "math/warp.h"
#include "scene/instances.h"
#include <math.h>
#include <stdio.h>

/* Vertices that lights are asked for from, in the order of p->all. */
struct vertices {
    const struct imp__places *places;
    const struct imp__place **at; /* [n] */
    struct imp_light_place *lit;  /* [n] */
    int n;
};

static enum imp_status vertices_find(struct imp__draw_list *l,
                                     const struct imp__places *places, struct vertices *v)
{
    const size_t n = (size_t)places->n_all + 1;
    *v = (struct vertices){.places = places};
    v->at = imp__arena_array(&l->arena, n, sizeof(struct imp__place *));
    v->lit = imp__arena_array(&l->arena, n, sizeof *v->lit);
    if (!v->at || !v->lit)
        return imp__error(l->check->ctx, IMP_E_NOMEM, "no memory for a check");
    for (int i = 0; i < places->n_all; i++) {
        const struct imp__place *x = places->all[i];
        struct imp_step s;
        struct imp_walk walk;
        imp_spec scratch[IMP_INPUTS_MAX];
        if (!x->located || !(x->v->bsdf->flags & IMP_BSDF_SMOOTH)) continue;
        imp__place_step(places, x, &walk, scratch, &s);
        v->lit[v->n] = imp__light_place(&s, x->v->bsdf, &x->at);
        v->at[v->n++] = x;
    }
    return IMP_OK;
}

/* ---- Choices ------------------------------------------------------------------------- */

#define PILOTS 16
enum { WHOLE, RATIOS, GROUPS = RATIOS + 6, AGREE = GROUPS + 8, MET }; /* 8 groups */

struct choices {
    struct vertices v;
    const struct imp_scene *scene;
    const struct imp_light_tree *tree; /* NULL: by weights */
    int n;                             /* that can be chosen */
    const double *part;                /* [n] of the light's area, of triangles; else 1 */
    int32_t (*pilot)[PILOTS];          /* [v.n] */
};

/* Numbers: of items of the tree, then of lights without end; without a tree of lights. */
static int number_of(const struct choices *c, int light, int prim)
{
    const struct imp_light_tree *t = c->tree;
    if (!t) return light;
    const int first = t->first[light];
    if (first >= 0) return t->item[first].prim < 0 ? first : first + prim;
    for (int k = 0; k < t->n_far; k++)
        if (t->far_light[k] == light) return t->n_items + k;
    return -1;
}
static int choice_draw(const struct choices *c, int place, double u, double *chance)
{
    int prim = -1;
    if (!c->tree) return imp__light_pick(c->scene, u, chance);
    const int light =
        imp__light_tree_choose(c->tree, &c->v.lit[place], &u, &prim, chance);
    return light < 0 ? -1 : number_of(c, light, prim);
}
/* The chance that is claimed; `met`: by the factor that weighs light that was met. */
static double choice_chance(const struct choices *c, int place, int number, bool met)
{
    const struct imp_light_tree *t = c->tree;
    if (!t)
        return c->scene->light_cdf[number] -
               (number ? c->scene->light_cdf[number - 1] : 0);
    const bool far = number >= t->n_items;
    const int light = far ? t->far_light[number - t->n_items] : t->item[number].emitter,
              prim = far ? -1 : t->item[number].prim;
    return met ? imp__light_tree_factor(t, &c->v.lit[place], light, prim) *
                     c->part[number]
               : imp__light_tree_chance(t, &c->v.lit[place], light, prim);
}

/* q: half uniform, half one of the pilots. */
static double choice_q(const struct choices *c, int place, int number)
{
    int hits = 0;
    for (int k = 0; k < PILOTS; k++) hits += c->pilot[place][k] == number;
    return 0.5 / c->n + 0.5 * hits / PILOTS;
}

static void choice_add(struct imp__pair *p, int number, double chance, double q,
                       bool drawn)
{
    const double part = (drawn ? q : chance) / (q + chance), d = drawn ? part : 0,
                 g = drawn ? 0 : part;
    imp__pair_add(p, WHOLE, d, g);
    imp__pair_add(p, RATIOS + imp_min((int)(6 * chance / (chance + q)), 5), d, g);
    imp__pair_add(p, GROUPS + number % 8, d, g);
}

/* Two functions that must agree, at what was drawn. */
static void agree_add(struct imp__pair *p, int part, double claim, double other)
{
    imp__pair_add(p, part, other > 0 ? fmin(claim / other, 2) : 2, 1);
}

static void choice_pair(const void *payload, uint64_t seed, int64_t i,
                        struct imp__pair *p)
{
    const struct choices *c = payload;
    const struct imp_key key = imp__key(seed, 0xc401, (uint64_t)i);
    const int place = (int)(i % c->v.n);
    double chance;
    const int a = choice_draw(c, place, imp__u01(key, 0), &chance);
    if (a >= 0 && chance > 0) {
        choice_add(p, a, chance, choice_q(c, place, a), true);
        agree_add(p, AGREE, chance, choice_chance(c, place, a, false));
        agree_add(p, MET, chance, choice_chance(c, place, a, true));
    }
    const double u = imp__u01(key, 1), w = imp__u01(key, 2);
    const int b = u < 0.5 ? imp_min((int)(w * c->n), c->n - 1)
                          : c->pilot[place][imp_min((int)(w * PILOTS), PILOTS - 1)];
    if (b < 0) return;
    chance = choice_chance(c, place, b, false);
    if (chance > 0) choice_add(p, b, chance, choice_q(c, place, b), false);
}

static double triangle_area(const struct imp_triangles *t, int k)
{
    imp_v3 p[3];
    for (int j = 0; j < 3; j++) {
        const float *x = t->positions + 3 * (size_t)t->indices[3 * (size_t)k + (size_t)j];
        p[j] = (imp_v3){x[0], x[1], x[2]};
    }
    return 0.5 * imp__length(imp__cross(p[1] - p[0], p[2] - p[0]));
}
static double triangles_area(const struct imp_triangles *t)
{
    double sum = 0;
    for (size_t k = 0; k < t->n_triangles; k++) sum += triangle_area(t, (int)k);
    return sum;
}
/* Items of a light are next to each other. */
static void parts_set(const struct imp_light_tree *t, double *part)
{
    double sum = 0;
    for (int k = 0, last = -1; k < t->n_items; k++) {
        const struct imp_light_item *x = &t->item[k];
        if (x->prim < 0) continue;
        const struct imp_triangles *all =
            &t->scene->emitters[x->emitter]->shape->triangles;
        if (x->emitter != last) sum = triangles_area(all);
        last = x->emitter;
        part[k] = triangle_area(all, x->prim) / sum;
    }
}

static enum imp_status choices_add(struct imp__draw_list *l, const struct vertices *v)
{
    enum imp_status st = IMP_OK;
    const struct imp_tracer *t = &v->places->tracer;
    struct choices *c = imp__arena_array(&l->arena, 1, sizeof *c);
    if (!c) IMP_TRY(imp__error(l->check->ctx, IMP_E_NOMEM, "no memory for a check"));
    *c =
        (struct choices){.v = *v,
                         .scene = t->scene,
                         .tree = t->integrator->light_tree ? t->scene->light_tree : NULL};
    c->n = c->tree ? c->tree->n_items + c->tree->n_far : t->scene->n_emitters;
    if (c->n < 2) return IMP_OK;
    double *part = imp__arena_array(&l->arena, (size_t)c->n, sizeof *part);
    c->pilot = imp__arena_array(&l->arena, (size_t)v->n, sizeof *c->pilot);
    if (!part || !c->pilot)
        IMP_TRY(imp__error(l->check->ctx, IMP_E_NOMEM, "no memory for a check"));
    c->part = part;
    for (int k = 0; k < c->n; k++) part[k] = 1;
    if (c->tree) parts_set(c->tree, part);
    for (int i = 0; i < v->n; i++)
        for (int k = 0; k < PILOTS; k++) {
            double chance;
            const double u = imp__u01(imp__key(0x9107, (uint64_t)i, 3), (uint32_t)k);
            c->pilot[i][k] = choice_draw(c, i, u, &chance);
        }
    st = imp__draw_add(l,
                       &(struct imp__draw_row){.method = "choices",
                                               .name = c->tree ? "light tree" : "lights",
                                               .pair = choice_pair,
                                               .payload = c});
out:
    return st;
}

/* ---- Points ----------------------------------------------------------------------------- */

enum { QUARTERS = RATIOS + 6, SAME = QUARTERS + 4 };
#define GRAZES      0.05 /* cosine below which the rounding of a ray changes densities */
#define PASSED_MOST 16   /* surfaces without effect on the way */

/* Lights of one kind on shapes of one kind. */
struct points {
    struct vertices v;
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
    imp__pair_add(p, WHOLE, d, g);
    imp__pair_add(p, RATIOS + imp_min((int)(6 * pdf / (pdf + q)), 5), d, g);
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
    return pdf * g->area[k] / triangle_area(all, hit->prim) / (double)all->n_triangles;
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
            agree_add(p, SAME, ls.pdf / n, met_pdf(g, k, ref, ls.wi, &hit, &at));
    }
    const imp_v3 w = cone_sample(&frame, height, v);
    if (!meets(g, e, ref, x->at.ng, time, w, &hit, &at, &t)) return;
    const double pdf = met_pdf(g, k, ref, w, &hit, &at);
    if (pdf > 0) point_add(p, pdf, cone_pdf(&frame, height, w), at.uv, false);
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
        const double uv[2] = {0.5 + 0.5 * ls.wi[0], 0.5 + 0.5 * ls.wi[1]};
        point_add(p, ls.pdf, imp__lobes_pdf(q, ls.wi), uv, true);
        agree_add(p, SAME, ls.pdf, e->ops->pdf(e, &x->at.p, &ls.wi, NULL, NULL));
    }
    const imp_v3 w = imp__lobes_sample(q, v);
    const double pdf = e->ops->pdf(e, &x->at.p, &w, NULL, NULL);
    const double uv[2] = {0.5 + 0.5 * w[0], 0.5 + 0.5 * w[1]};
    if (pdf > 0) point_add(p, pdf, imp__lobes_pdf(q, w), uv, false);
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

/* The lights that are like light k, which is the first of them. */
static enum imp_status points_add(struct imp__draw_list *l, const struct vertices *v,
                                  int first)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *scene = v->places->tracer.scene;
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
        area[k] = triangles_area(&light[k]->shape->triangles);
    for (int k = 0; k < g->n && !e->shape; k++)
        for (uint32_t j = 0; j < IMP_LOBE_AXES; j++) {
            const struct imp_key key = imp__key(0x9107, (uint64_t)k, 5);
            const double u[2] = {imp__u01(key, 2 * j), imp__u01(key, 2 * j + 1)};
            struct imp_light_sample ls;
            if (light[k]->ops->sample(light[k], &v->at[0]->at.p, u, &ls))
                imp__lobes_add(&sky[k], ls.wi);
        }
    const char *own = e->name ? e->name : e->ops->name;
    if (g->n == 1) snprintf(name, 160, "%s", own);
    else snprintf(name, 160, "%s and %d more", own, g->n - 1);
    st = imp__draw_add(l, &(struct imp__draw_row){.method = "points",
                                                  .name = name,
                                                  .pair = point_pair,
                                                  .payload = g,
                                                  .slack = 1e-3});
out:
    return st;
}

enum imp_status imp__check_lights(struct imp__draw_list *l,
                                  const struct imp__places *places)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *scene = places->tracer.scene;
    struct vertices v;
    IMP_TRY(vertices_find(l, places, &v));
    if (v.n == 0 || !places->tracer.integrator->lights) return IMP_OK;
    IMP_TRY(choices_add(l, &v));
    for (int k = 0; k < scene->n_emitters; k++) {
        bool first = has_density(scene->emitters[k]);
        for (int j = 0; j < k && first; j++)
            first = !has_density(scene->emitters[j]) ||
                    !alike(scene->emitters[j], scene->emitters[k]);
        if (first) IMP_TRY(points_add(l, &v, k));
    }
out:
    return st;
}

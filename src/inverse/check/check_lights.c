/* SPDX-License-Identifier: Apache-2.0
 *
 * Which light a vertex samples: a light (of the tree: a light or a triangle of one) is drawn
 * with the probability that the draw itself claims, and q draws one of them by chance. Sums as
 * in check_directions.c. Where something was drawn, what the draw claims and what weighs met
 * light must agree. Points of lights: check_points.c. */
#include "check_lights.h"
#include "check_sources.h"
#include "math/rng.h"
#include <math.h>

static enum imp_status vertices_find(struct imp__draw_list *l,
                                     const struct imp__places *places,
                                     struct imp__lit_places *v)
{
    const size_t n = (size_t)places->n_all + 1;
    *v = (struct imp__lit_places){.places = places};
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

#define PILOTS 16
enum { GROUPS = IMP_LIGHT_RATIOS + 6, AGREE = GROUPS + 8, MET }; /* 8 groups */

struct choices {
    struct imp__lit_places v;
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
        imp__light_tree_choose(c->tree, &c->v.lit[place], NULL, &u, &prim, chance);
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
    imp__pair_add(p, IMP_LIGHT_WHOLE, d, g);
    imp__pair_add(p, IMP_LIGHT_RATIOS + imp_min((int)(6 * chance / (chance + q)), 5), d,
                  g);
    imp__pair_add(p, GROUPS + number % 8, d, g);
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
        imp__agree_add(p, AGREE, chance, choice_chance(c, place, a, false));
        imp__agree_add(p, MET, chance, choice_chance(c, place, a, true));
    }
    const double u = imp__u01(key, 1), w = imp__u01(key, 2);
    const int b = u < 0.5 ? imp_min((int)(w * c->n), c->n - 1)
                          : c->pilot[place][imp_min((int)(w * PILOTS), PILOTS - 1)];
    if (b < 0) return;
    chance = choice_chance(c, place, b, false);
    if (chance > 0) choice_add(p, b, chance, choice_q(c, place, b), false);
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
        if (x->emitter != last) sum = imp__triangles_area(all);
        last = x->emitter;
        part[k] = imp__triangle_area(all, x->prim) / sum;
    }
}

static enum imp_status choices_add(struct imp__draw_list *l,
                                   const struct imp__lit_places *v)
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

enum imp_status imp__check_lights(struct imp__draw_list *l,
                                  const struct imp__places *places)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *scene = places->tracer.scene;
    struct imp__lit_places v;
    IMP_TRY(vertices_find(l, places, &v));
    if (v.n == 0 || !places->tracer.integrator->lights) return IMP_OK;
    IMP_TRY(choices_add(l, &v));
    for (int k = 0; k < scene->n_emitters; k++) IMP_TRY(imp__check_points(l, &v, k));
out:
    return st;
}

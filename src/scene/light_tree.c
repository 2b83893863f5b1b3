/* SPDX-License-Identifier: Apache-2.0
 *
 * Choosing by the tree of lights. */
#include "light_lanes.h"
#include <math.h>
#include <string.h>

/* Angles and boxes are rounded: what is seen from nearly the edge of a bound still has a
 * probability. */
#define IMP_LIGHT_SLACK 1e-6
/* A node is opened where the place is nearer than so many half diagonals, squared. */
#define IMP_LIGHT_NEAR2 2.0
#define FEW             64 /* lights that are looked at one by one */

#define IMP_WIDE 1
#define IMP_TEXT "scene/light_importance_text.h"
#include "math/lane_text.h"
#define IMP_WIDE IMP_WIDE_LANES
#define IMP_TEXT "scene/light_importance_text.h"
#include "math/lane_text.h"

/* Where lights are chosen: a place, or lane k of several. */
struct here {
    const struct imp_light_place *place;
    struct imp_light_lanes *lanes; /* NULL: a place alone */
    int lane;
};

static double importance_alone(const struct imp_light_node *n,
                               const struct imp_light_place *at, bool *near)
{
    const double p[3] = {at->p[0], at->p[1], at->p[2]},
                 normal[3] = {at->n[0], at->n[1], at->n[2]};
    int so_near;
    const double w = imp__light_importance_1(n, p, normal, at->faces, &so_near);
    *near = so_near;
    return w;
}

/* All lanes have theirs when the first one asks: most ask for the same nodes. */
static double importance_in_lanes(const struct imp_light_tree *t, int32_t i,
                                  struct imp_light_lanes *l, int lane, bool *near)
{
    const int slot = i % IMP_LIGHT_NODES;
    if (l->node[slot] != i) {
        imp_wide_truth so_near;
        const imp_wide p[3] = {l->p.x, l->p.y, l->p.z}, n[3] = {l->n.x, l->n.y, l->n.z};
        l->importance[slot] =
            IMP_WIDE_OF(imp__light_importance)(&t->node[i], p, n, l->faces, &so_near);
        l->near[slot] = imp__wide_bits(so_near);
        l->node[slot] = i;
    }
    *near = l->near[slot] >> lane & 1;
    return l->importance[slot][lane];
}

/* *near: the place is so near that the node's box hardly bounds where its lights are. */
static inline double importance(const struct imp_light_tree *t, int32_t i,
                                const struct here *at, bool *near)
{
    *near = false;
    if (!(t->node[i].strength > 0)) return 0;
    return at->lanes ? importance_in_lanes(t, i, at->lanes, at->lane, near)
                     : importance_alone(&t->node[i], at->place, near);
}

/* The nodes among which the first choice is made: the root, opened where it is near, and
 * so on, as in the sums of Barnes and Hut (1986); of few lights, all leaves. */
static inline void cut_add(struct imp_light_cut *c, int32_t i, double importance)
{
    c->node[c->n] = i;
    c->importance[c->n++] = importance;
    c->sum += importance;
}
static inline void cut_make(const struct imp_light_tree *t, const struct here *at,
                            struct imp_light_cut *c)
{
    int32_t open[64];
    int n = 0;
    bool near;
    c->n = 0;
    c->sum = 0;
    if (t->n_items == 0) return;
    if (t->n_items <= FEW) {
        for (int32_t i = 0; i < t->n_nodes; i++) {
            const double w = t->node[i].second < 0 ? importance(t, i, at, &near) : 0;
            if (w > 0) cut_add(c, i, w);
        }
        return;
    }
    open[n++] = 0;
    while (n > 0) {
        const int32_t i = open[--n];
        const double w = importance(t, i, at, &near);
        if (!(w > 0)) continue;
        if (near && t->node[i].second >= 0 && n < 62 && c->n + n < IMP_LIGHT_CUT - 2) {
            open[n++] = t->node[i].second;
            open[n++] = i + 1;
            continue;
        }
        cut_add(c, i, w);
    }
}

/* Probability of the tree, against the lights without end. */
static double near_chance(const struct imp_light_tree *t, const struct imp_light_cut *c)
{
    return t->n_far == 0 ? c->sum > 0 : c->sum > 0 ? t->near_chance : 0;
}

/* Probability of the first child of node i; < 0: neither can count. */
static inline double first_chance(const struct imp_light_tree *t, int i,
                                  const struct here *at)
{
    bool near;
    const double a = importance(t, i + 1, at, &near),
                 b = importance(t, t->node[i].second, at, &near);
    return a + b > 0 ? a / (a + b) : -1;
}

/* u lies in [below, below + width): where in it, on [0, 1). */
static double part_of(double u, double below, double width)
{
    return imp_clamp((u - below) / width, 0.0, 0x1.fffffffffffffp-1);
}

static int far_choose(const struct imp_light_tree *t, double *u, double *chance)
{
    double below = 0;
    int k = 0;
    for (; k < t->n_far - 1 && !(*u < below + t->far_share[k]); k++)
        below += t->far_share[k];
    if (!(t->far_share[k] > 0)) return -1;
    *chance *= t->far_share[k];
    *u = part_of(*u, below, t->far_share[k]);
    return t->far_light[k];
}

static inline __attribute__((always_inline)) int
choose_at(const struct imp_light_tree *t, const struct here *at,
          const struct imp_light_cut *c, double *u, int *prim, double *chance)
{
    const double near = near_chance(t, c);
    *prim = -1;
    if (!(*u < near)) {
        if (t->n_far == 0) return -1;
        *chance = 1 - near;
        *u = part_of(*u, near, 1 - near);
        return far_choose(t, u, chance);
    }
    *u = part_of(*u, 0, near);
    int k = 0;
    double below = 0;
    while (k < c->n - 1 && !(*u < (below + c->importance[k]) / c->sum))
        below += c->importance[k++];
    *chance = near * (c->importance[k] / c->sum);
    *u = part_of(*u, below / c->sum, c->importance[k] / c->sum);
    int i = c->node[k];
    while (t->node[i].second >= 0) {
        const double first = first_chance(t, i, at);
        if (first < 0) return -1;
        if (*u < first) {
            *chance *= first;
            *u = part_of(*u, 0, first);
            i++;
        } else {
            *chance *= 1 - first;
            *u = part_of(*u, first, 1 - first);
            i = t->node[i].second;
        }
    }
    const struct imp_light_item *item = &t->item[-1 - t->node[i].second];
    *prim = item->prim;
    return item->emitter;
}

static bool is_at(const struct imp_light_cut *c, const struct imp_light_place *place)
{
    const struct imp_light_place *was = &c->place;
    bool same = c->made && was->faces == place->faces;
    for (int k = 0; k < 3; k++)
        same &= was->p[k] == place->p[k] && was->n[k] == place->n[k];
    return same;
}

int imp__light_tree_choose(const struct imp_light_tree *t,
                           const struct imp_light_place *place, struct imp_light_cut *cut,
                           double *u, int *prim, double *chance)
{
    const struct here at = {.place = place};
    struct imp_light_cut own;
    if (!cut) {
        cut_make(t, &at, &own);
        return choose_at(t, &at, &own, u, prim, chance);
    }
    if (!is_at(cut, place)) {
        cut_make(t, &at, cut);
        cut->place = *place;
        cut->made = true;
    }
    return choose_at(t, &at, cut, u, prim, chance);
}

/* choose_at of few lights, without any that has no end, for all lanes at once. */
static unsigned few_choose(const struct imp_light_tree *t,
                           const struct imp_light_lanes *lanes, imp_wide *u,
                           struct imp_lights_chosen *out)
{
    const imp_wide p[3] = {lanes->p.x, lanes->p.y, lanes->p.z},
                   n[3] = {lanes->n.x, lanes->n.y, lanes->n.z};
    const imp_wide zero = imp__wide(0);
    imp_wide weight[FEW], sum = zero, below = zero, before = zero, own = zero;
    imp_wide_truth decided = u[0] < zero, item = decided;
    int n_leaves = 0;
    const struct imp_light_node *leaf[FEW];
    for (int32_t i = 0; i < t->n_nodes; i++) {
        imp_wide_truth near;
        if (t->node[i].second >= 0 || !(t->node[i].strength > 0)) continue;
        leaf[n_leaves] = &t->node[i];
        weight[n_leaves] =
            IMP_WIDE_OF(imp__light_importance)(&t->node[i], p, n, lanes->faces, &near);
        sum += weight[n_leaves++];
    }
    for (int k = 0; k < n_leaves; k++) {
        const imp_wide_truth here = ~decided & (weight[k] > zero);
        before = imp__wide_choose(here, below, before);
        own = imp__wide_choose(here, weight[k], own);
        item = (here & (-1 - (int64_t)leaf[k]->second)) | (~here & item);
        below += weight[k];
        decided |= here & (*u < below / sum);
    }
    out->chance = own / sum;
    *u = imp__wide_larger(imp__wide_lesser((*u - before / sum) / out->chance,
                                           imp__wide(0x1.fffffffffffffp-1)),
                          zero);
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        const struct imp_light_item *x = &t->item[item[k]];
        out->light[k] = x->emitter;
        out->prim[k] = x->prim;
    }
    return imp__wide_bits(sum > zero);
}

unsigned imp__light_lanes_choose(const struct imp_light_tree *t, const imp_wide3 *p,
                                 const imp_wide3 *n, unsigned bits, imp_wide *u,
                                 struct imp_lights_chosen *out)
{
    struct imp_light_lanes lanes;
    unsigned lit = 0;
    lanes.p = *p;
    lanes.n = n ? *n : *p;
    lanes.faces = n != NULL;
    if (t->n_items > 0 && t->n_items <= FEW && t->n_far == 0)
        return bits & few_choose(t, &lanes, u, out);
    memset(lanes.node, -1, sizeof lanes.node);
    for (; bits; bits &= bits - 1) {
        const int k = __builtin_ctz(bits);
        const struct here at = {.lanes = &lanes, .lane = k};
        double by = (*u)[k], chance = 0;
        struct imp_light_cut cut;
        cut_make(t, &at, &cut);
        out->light[k] = choose_at(t, &at, &cut, &by, &out->prim[k], &chance);
        out->chance[k] = chance;
        (*u)[k] = by;
        lit |= (unsigned)(out->light[k] >= 0) << k;
    }
    return lit;
}

static double item_chance(const struct imp_light_tree *t,
                          const struct imp_light_place *place, int item)
{
    const struct here at = {.place = place};
    struct imp_light_cut c;
    int i = t->item[item].leaf, k = 0;
    if (!(t->node[i].strength > 0)) return 0;
    cut_make(t, &at, &c);
    /* The last node of the cut that does not come behind the leaf: it holds the leaf, or
     * none of them does. */
    while (k < c.n && c.node[k] <= i) k++;
    if (k-- == 0) return 0;
    double chance = near_chance(t, &c) * (c.importance[k] / c.sum);
    while (i > c.node[k] && chance > 0) {
        const int above = t->node[i].parent;
        const double first = first_chance(t, above, &at);
        if (first < 0) return 0;
        chance *= i == above + 1 ? first : 1 - first;
        i = above;
    }
    return i == c.node[k] ? chance : 0;
}

static int item_of(const struct imp_light_tree *t, int emitter, int prim)
{
    const int first = t->first[emitter];
    return t->item[first].prim < 0 ? first : first + prim;
}

double imp__light_tree_chance(const struct imp_light_tree *t,
                              const struct imp_light_place *place, int emitter, int prim)
{
    if (t->first[emitter] >= 0) return item_chance(t, place, item_of(t, emitter, prim));
    for (int k = 0; k < t->n_far; k++)
        if (t->far_light[k] == emitter) {
            const struct here at = {.place = place};
            struct imp_light_cut c;
            cut_make(t, &at, &c);
            return (1 - near_chance(t, &c)) * t->far_share[k];
        }
    return 0;
}

double imp__light_tree_factor(const struct imp_light_tree *t,
                              const struct imp_light_place *place, int emitter, int prim)
{
    if (t->first[emitter] < 0) return imp__light_tree_chance(t, place, emitter, prim);
    const int item = item_of(t, emitter, prim);
    const double part = t->item[item].part;
    return part > 0 ? item_chance(t, place, item) / part : 0;
}

size_t imp__light_tree_bytes(const struct imp_light_tree *t)
{
    return (size_t)t->n_items * sizeof *t->item + (size_t)t->n_nodes * sizeof *t->node +
           (size_t)t->scene->n_emitters * sizeof *t->first +
           (size_t)t->n_far * (sizeof *t->far_light + sizeof *t->far_share);
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Choosing by the tree of lights. */
#include "light_tree.h"

/* Angles and boxes are rounded: what is seen from nearly the edge of a bound still has a
 * probability. */
#define SLACK 1e-6
/* A node is opened where the place is nearer than so many half diagonals, squared. */
#define NEAR2 2.0
#define CUT   128 /* nodes, at most */

/* cos(max(0, a - b)) of angles within [0, pi], from their sines and cosines. */
static inline double cos_less(double sin_a, double cos_a, double sin_b, double cos_b)
{
    return cos_a > cos_b ? 1 : cos_a * cos_b + sin_a * sin_b;
}
static inline double sin_less(double sin_a, double cos_a, double sin_b, double cos_b)
{
    return cos_a > cos_b ? 0 : sin_a * cos_b - cos_a * sin_b;
}
static inline double sin_of(double cosine)
{
    return sqrt(imp_max(0.0, 1 - cosine * cosine));
}

/* Mean of max(0, x) where x lies evenly in [m - e, m + e]. */
static inline double mean_positive(double m, double e)
{
    return m >= e ? m : m <= -e ? 0 : (m + e) * (m + e) / (4 * e);
}

/* *near: the place is so near that the node's box hardly bounds where its lights are. */
static double importance(const struct imp_light_node *n, const struct imp_light_place *at,
                         bool *near)
{
    double d[3], d2 = 0, r2 = 0, front = 0, depth = 0, axis = 0, along = 0;
    *near = false;
    if (!(n->strength > 0)) return 0;
    for (int k = 0; k < 3; k++) {
        const double half = 0.5 * ((double)n->hi[k] - n->lo[k]);
        d[k] = 0.5 * ((double)n->lo[k] + n->hi[k]) - at->p[k];
        d2 += d[k] * d[k];
        r2 += half * half;
        front += d[k] * at->n[k];
        depth += half * fabs(at->n[k]);
        axis -= d[k] * n->axis[k];
        along += half * fabs((double)n->axis[k]);
    }
    *near = d2 < NEAR2 * r2;
    double out = n->strength * n->gain / imp_max(imp_max(d2, r2), 1e-60);
    const double inverse = d2 > 0 ? 1 / sqrt(d2) : 0;
    if (at->faces) {
        if (!(front > -(1 + SLACK) * depth)) return 0;
        const double cosine = mean_positive(front, depth) * inverse;
        out *= d2 > r2 ? imp_clamp(cosine, SLACK, 1.0) : 1;
    }
    if (n->cos_normals > -1 && d2 > r2) {
        const double cos_w = imp_clamp(axis * inverse, -1.0, 1.0), sin_w = sin_of(cos_w);
        const double cos_o = n->cos_normals, sin_o = sin_of(cos_o);
        const double sin2_b = r2 / d2, sin_b = sqrt(sin2_b), cos_b = sqrt(1 - sin2_b);
        const double cos_x = cos_less(sin_w, cos_w, sin_o, cos_o),
                     sin_x = sin_less(sin_w, cos_w, sin_o, cos_o);
        if (cos_less(sin_x, cos_x, sin_b, cos_b) < n->cos_reach - SLACK) return 0;
        if (n->cos_reach < 1)
            out *= imp_clamp(mean_positive(cos_x, along * inverse), SLACK, 1.0);
    }
    return out;
}

/* The nodes among which the first choice is made: the root, opened where it is near, and
 * so on, as in the sums of Barnes and Hut (1986). */
struct cut {
    int n;
    double sum;
    int32_t node[CUT];
    double importance[CUT];
};
static void cut_make(const struct imp_light_tree *t, const struct imp_light_place *place,
                     struct cut *c)
{
    int32_t open[64];
    int n = 0;
    c->n = 0;
    c->sum = 0;
    if (t->n_items == 0) return;
    open[n++] = 0;
    while (n > 0) {
        const int32_t i = open[--n];
        bool near;
        const double w = importance(&t->node[i], place, &near);
        if (!(w > 0)) continue;
        if (near && t->node[i].second >= 0 && n < 62 && c->n + n < CUT - 2) {
            open[n++] = t->node[i].second;
            open[n++] = i + 1;
            continue;
        }
        c->node[c->n] = i;
        c->importance[c->n++] = w;
        c->sum += w;
    }
}

/* Probability of the tree, against the lights without end. */
static double near_chance(const struct imp_light_tree *t, const struct cut *c)
{
    return t->n_far == 0 ? c->sum > 0 : c->sum > 0 ? t->near_chance : 0;
}

/* Probability of the first child of node i; < 0: neither can count. */
static double first_chance(const struct imp_light_tree *t, int i,
                           const struct imp_light_place *place)
{
    bool near;
    const double a = importance(&t->node[i + 1], place, &near),
                 b = importance(&t->node[t->node[i].second], place, &near);
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

int imp__light_tree_choose(const struct imp_light_tree *t,
                           const struct imp_light_place *place, double *u, int *prim,
                           double *chance)
{
    struct cut c;
    cut_make(t, place, &c);
    const double near = near_chance(t, &c);
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
    while (k < c.n - 1 && !(*u < (below + c.importance[k]) / c.sum))
        below += c.importance[k++];
    *chance = near * (c.importance[k] / c.sum);
    *u = part_of(*u, below / c.sum, c.importance[k] / c.sum);
    int i = c.node[k];
    while (t->node[i].second >= 0) {
        const double first = first_chance(t, i, place);
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

static double item_chance(const struct imp_light_tree *t,
                          const struct imp_light_place *place, int item)
{
    struct cut c;
    int i = t->item[item].leaf, k = 0;
    if (!(t->node[i].strength > 0)) return 0;
    cut_make(t, place, &c);
    /* The last node of the cut that does not come behind the leaf: it holds the leaf, or
     * none of them does. */
    while (k < c.n && c.node[k] <= i) k++;
    if (k-- == 0) return 0;
    double chance = near_chance(t, &c) * (c.importance[k] / c.sum);
    while (i > c.node[k] && chance > 0) {
        const int above = t->node[i].parent;
        const double first = first_chance(t, above, place);
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
            struct cut c;
            cut_make(t, place, &c);
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

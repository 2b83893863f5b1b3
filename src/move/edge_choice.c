/* SPDX-License-Identifier: Apache-2.0
 *
 * Points on edges by a measure, and by what a pilot has found in cells of it (edge_choice.h). */
#include "edge_choice.h"
#include "base/context.h"

enum imp_status imp__edge_choice_begin(const struct imp__edges *edges,
                                       const struct imp__edge_tree *tree,
                                       const double *measure, int n_cells,
                                       struct imp__edge_choice *out)
{
    const size_t n = edges->n;
    double sum = 0;
    *out = (struct imp__edge_choice){.edges = edges, .tree = tree, .n_cells = n_cells};
    out->until = imp__alloc(edges->ctx, n + 1, sizeof *out->until);
    out->chance = imp__alloc(edges->ctx, n + 1, sizeof *out->chance);
    out->cell = imp__alloc(edges->ctx, (size_t)n_cells + 1, sizeof *out->cell);
    if (!out->until || !out->chance || !out->cell) {
        imp__edge_choice_free(out);
        return imp__error(edges->ctx, IMP_E_NOMEM, "no memory for edges");
    }
    for (size_t k = 0; k < n; k++) {
        out->until[k] = sum;
        sum += measure ? measure[k] : imp__length(edges->edge[k].b - edges->edge[k].a);
    }
    for (size_t k = 0; k < n; k++)
        out->chance[k] = out->until[k] = imp_min(out->until[k] / sum, 1.0);
    out->chance[n] = out->until[n] = 1;
    for (int k = 0; k <= n_cells; k++) out->cell[k] = (double)k / n_cells;
    return IMP_OK;
}

void imp__edge_choice_free(struct imp__edge_choice *c)
{
    if (c->edges) {
        imp__release(c->edges->ctx, c->until);
        imp__release(c->edges->ctx, c->chance);
        imp__release(c->edges->ctx, c->cell);
    }
    *c = (struct imp__edge_choice){0};
}

static int cell_at(const struct imp__edge_choice *c, double measure)
{
    return imp_min((int)(measure * c->n_cells), c->n_cells - 1);
}

/* Probability of the list up to this measure. */
static double chance_at(const struct imp__edge_choice *c, double measure)
{
    const int k = cell_at(c, measure);
    return c->cell[k] + (c->cell[k + 1] - c->cell[k]) * (measure * c->n_cells - k);
}

/* Root of a cell's moment, with a share of its neighbours: what a few looks have found in one
 * cell may lie in the next. */
static double root_near(const struct imp__edge_choice *c, const double *moment, int k)
{
    const double before = moment[imp_max(k - 1, 0)];
    const double after = moment[imp_min(k + 1, c->n_cells - 1)];
    return sqrt(0.5 * moment[k] + 0.25 * (before + after));
}

void imp__edge_choice_learn(struct imp__edge_choice *c, const double *moment, double kept)
{
    double sum = 0, before = 0;
    for (int k = 0; k < c->n_cells; k++) sum += root_near(c, moment, k);
    if (!(sum > 0) || !(sum < INFINITY)) return;
    for (int k = 0; k < c->n_cells; k++) {
        before += kept / c->n_cells + (1 - kept) * root_near(c, moment, k) / sum;
        c->cell[k + 1] = before;
    }
    for (int k = 0; k <= c->n_cells; k++) c->cell[k] /= before;
    for (size_t k = 0; k < c->edges->n; k++) c->chance[k] = chance_at(c, c->until[k]);
}

/* The last entry but the end one that is at most x, of rising numbers [n + 1]. */
static size_t below(const double *rising, size_t n, double x)
{
    size_t lo = 0, hi = n - 1;
    while (lo < hi) {
        const size_t half = lo + (hi - lo + 1) / 2;
        if (rising[half] <= x) lo = half;
        else hi = half - 1;
    }
    return lo;
}

/* The point before which the list has this probability, on edge k, which is chosen with the
 * probability pmf and within it by its cells. */
static void point_at(const struct imp__edge_choice *c, size_t k, double chance,
                     double pmf, struct imp__edge_point *out)
{
    const struct imp__edge *e = &c->edges->edge[k];
    const double measure = c->until[k + 1] - c->until[k];
    const size_t cell = below(c->cell, (size_t)c->n_cells, chance);
    const double part = c->cell[cell + 1] - c->cell[cell];
    const double at = ((double)cell + (chance - c->cell[cell]) / part) / c->n_cells;
    const double t = imp_clamp((at - c->until[k]) / measure, 0.0, 1.0);
    /* Per measure of the edge alone: part n_cells over its own probability. */
    const double own = c->chance[k + 1] - c->chance[k];
    out->edge = e;
    out->p = e->a + (e->b - e->a) * t;
    out->cell = (int)cell;
    out->inv_pdf = imp__length(e->b - e->a) * own / (pmf * measure * part * c->n_cells);
}

void imp__edge_choice_draw(const struct imp__edge_choice *c, double u,
                           struct imp__edge_point *out)
{
    const size_t k = below(c->chance, c->edges->n, u);
    point_at(c, k, u, c->chance[k + 1] - c->chance[k], out);
}

int imp__edge_choice_run(const struct imp__edge_choice *c, double *u, double *chance)
{
    const struct imp__edges *edges = c->edges;
    int k = 0;
    *chance = 1;
    if (imp_likely(edges->n_runs == 1)) return 0;
    while (k < edges->n_runs - 1 && !(*u < c->chance[edges->run[k + 1].first])) k++;
    const double before = c->chance[edges->run[k].first];
    *chance = c->chance[edges->run[k + 1].first] - before;
    if (*chance > 0) *u = imp_clamp((*u - before) / *chance, 0.0, 1 - 0x1p-53);
    return k;
}

bool imp__edge_choice_silhouette(const struct imp__edge_choice *c, int run, imp_v3 from,
                                 bool parallel, double u, struct imp__edge_point *out)
{
    double pmf;
    const ptrdiff_t k =
        imp__edge_tree_choose(c->tree, run, c->chance, from, parallel, &u, &pmf);
    if (k < 0) return false;
    const double own = c->chance[k + 1] - c->chance[k];
    point_at(c, (size_t)k, c->chance[k] + u * own, pmf, out);
    return true;
}

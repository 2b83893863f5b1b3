/* SPDX-License-Identifier: Apache-2.0
 *
 * Symmetry: a grid whose coefficients are tied, theta = T p, one number p for all nodes
 * that mirrors and turns take into each other (an orbit). A cubic B-spline with
 * symmetric coefficients is symmetric, and so are its derivatives; the transpose adds up
 * over orbits, p_bar = T^T theta_bar (docs/bent-rays.md 3.6). */
#include "bend_rays.h"
#include <string.h>

#define AXIAL_MAX                                                                        \
    4096 /* nodes across, of continuous symmetry: a table of r^2 is made                 \
          */

const struct imp__grid *imp__field_nodes(const imp_field *f, const uint32_t **number)
{
    const bool tie = f->ops == &imp__field_tie;
    *number = tie ? ((const struct imp__tie *)f)->number : NULL;
    if (tie) f = ((const struct imp__tie *)f)->grid;
    return imp__field_is_grid(f) ? (const struct imp__grid *)f : NULL;
}

static void tie_changed(imp_field *f)
{
    struct imp__tie *t = (struct imp__tie *)f;
    for (size_t i = 0; i < t->grid->n_theta; i++)
        t->grid->theta[i] = f->theta[t->number[i]];
    t->grid->ops->changed(t->grid);
}
static void tie_destroy(imp_field *f)
{
    struct imp__tie *t = (struct imp__tie *)f;
    imp_field_destroy(t->grid);
    imp__release(f->ctx, t->number);
    imp__release(f->ctx, t->share);
}

static void tie_eval(const imp_field *f, int n, const imp_v3 *x, int order,
                     struct imp__jet *jet)
{
    const imp_field *grid = ((const struct imp__tie *)f)->grid;
    grid->ops->eval(grid, n, x, order, jet);
}

static inline size_t node_of(const struct imp__grid *g, const size_t corner[3], int side,
                             int k)
{
    return corner[0] + (size_t)(k % side) +
           (size_t)g->nodes[0] *
               (corner[1] + (size_t)(k / side % side) +
                (size_t)g->nodes[1] * (corner[2] + (size_t)(k / side / side)));
}

static void tie_splat(const imp_field *f, const imp_v3 *x, double a, const imp_v3 *b,
                      struct imp__bar *bar)
{
    const struct imp__tie *t = (const struct imp__tie *)f;
    const struct imp__grid *g = (const struct imp__grid *)t->grid;
    double none[64] = {0}, sum[64] = {0};
    size_t corner[3];
    imp_v3 gb = *b;
    struct imp__grid cell = imp__grid_cell(g, *x, none, corner);
    if (g->desc.param == IMP_FIELD_ETA2) {
        struct imp__jet at;
        imp__field_eval1(t->grid, x, 1, &at);
        imp__eta2_vjp(&at, &a, &gb);
        cell.desc.param = IMP_FIELD_ETA;
    }
    g->base.ops->splat(&cell.base, x, a, &gb, &(struct imp__bar){.theta = sum});
    const int side = cell.nodes[0];
    for (int k = 0; k < side * side * side; k++) {
        const size_t i = t->number[node_of(g, corner, side, k)];
        imp__bar_reach(bar, i, 1)[i] += sum[k];
    }
}

static void tie_tangent(const imp_field *f, const imp_v3 *x, const double *theta_dot,
                        double *eta_dot, imp_v3 *g_dot)
{
    const struct imp__tie *t = (const struct imp__tie *)f;
    const struct imp__grid *g = (const struct imp__grid *)t->grid;
    double local[64] = {0};
    size_t corner[3];
    struct imp__grid cell = imp__grid_cell(g, *x, local, corner);
    const int side = cell.nodes[0];
    for (int k = 0; k < side * side * side; k++)
        local[k] = theta_dot[t->number[node_of(g, corner, side, k)]];
    cell.desc.param = IMP_FIELD_ETA;
    struct imp__jet j;
    imp__field_eval1(&cell.base, x, 1, &j);
    if (g->desc.param == IMP_FIELD_ETA2) {
        struct imp__jet at;
        imp__field_eval1(t->grid, x, 1, &at);
        imp__eta2_jvp(&at, &j);
    }
    *eta_dot = j.eta;
    *g_dot = j.g;
}

const struct imp__field_ops imp__field_tie = {.name = "tied grid",
                                              .eval = tie_eval,
                                              .splat = tie_splat,
                                              .tangent = tie_tangent,
                                              .changed = tie_changed,
                                              .destroy = tie_destroy};

/* ---- Orbits -------------------------------------------------------------------- */

/* A quarter turn of (i, j) about the middle of a square of n nodes. */
static void quarter(int n, int *i, int *j)
{
    const int was = *i;
    *i = n - 1 - *j;
    *j = was;
}

/* The first node of the orbit of node p under mirrors and turns. */
static size_t least(const struct imp__grid *g, const struct imp_field_symmetry *s,
                    const int p[3])
{
    const int u = (s->axis + 1) % 3, v = (s->axis + 2) % 3, *n = g->nodes;
    size_t best = SIZE_MAX;
    for (int m = 0; m < 8; m++) { /* mirrors, then turns: all of the group */
        int q[3] = {p[0], p[1], p[2]};
        bool in = true;
        for (int k = 0; k < 3; k++)
            if (m >> k & 1) {
                in = in && s->mirror[k];
                q[k] = n[k] - 1 - q[k];
            }
        for (int turn = 0; in && turn < imp_max(s->fold, 1); turn++) {
            const size_t at = (size_t)q[0] +
                              (size_t)n[0] * ((size_t)q[1] + (size_t)n[1] * (size_t)q[2]);
            best = imp_min(best, at);
            if (s->fold == 2) q[u] = n[u] - 1 - q[u], q[v] = n[v] - 1 - q[v];
            if (s->fold == 4) quarter(n[u], &q[u], &q[v]);
        }
    }
    return best;
}

/* Continuous symmetry: nodes at one distance from the axis share a number. r^2 in units
 * of a quarter of the squared spacing is an integer. */
static enum imp_status rings(const struct imp__grid *g,
                             const struct imp_field_symmetry *s, uint32_t *number,
                             size_t *count)
{
    const int a = s->axis, u = (a + 1) % 3, v = (a + 2) % 3, n = g->nodes[u];
    imp_context *ctx = g->base.ctx;
    if (n > AXIAL_MAX)
        return imp__error(ctx, IMP_E_ARG, "axial symmetry of %d nodes: at most %d", n,
                          AXIAL_MAX);
    const size_t room = 2 * (size_t)(n - 1) * (size_t)(n - 1) + 1;
    uint32_t *ring = imp__alloc(ctx, room, sizeof *ring), n_rings = 0;
    if (!ring) return imp__error(ctx, IMP_E_NOMEM, "no memory for a symmetry");
    const int half = g->nodes[a] - 1;
    size_t at = 0;
    for (int pass = 0; pass < 2; pass++) /* layers need the count of rings */
        for (at = 0; at < g->base.n_theta; at++) {
            const int p[3] = {(int)(at % (size_t)g->nodes[0]),
                              (int)(at / (size_t)g->nodes[0] % (size_t)g->nodes[1]),
                              (int)(at / (size_t)g->nodes[0] / (size_t)g->nodes[1])};
            const int du = 2 * p[u] - (n - 1), dv = 2 * p[v] - (n - 1);
            const size_t r2 = (size_t)(du * du + dv * dv);
            if (pass == 0 && ring[r2] == 0) ring[r2] = ++n_rings;
            const int layer = s->mirror[a] ? imp_min(p[a], half - p[a]) : p[a];
            if (pass == 1) number[at] = (uint32_t)layer * n_rings + ring[r2] - 1;
        }
    *count = (size_t)n_rings * (size_t)(s->mirror[a] ? half / 2 + 1 : half + 1);
    imp__release(ctx, ring);
    return IMP_OK;
}

static enum imp_status orbits(const struct imp__grid *g,
                              const struct imp_field_symmetry *s, uint32_t *number,
                              size_t *count)
{
    size_t n = 0;
    int p[3];
    size_t at = 0;
    if (s->fold < 0) return rings(g, s, number, count);
    for (p[2] = 0; p[2] < g->nodes[2]; p[2]++)
        for (p[1] = 0; p[1] < g->nodes[1]; p[1]++)
            for (p[0] = 0; p[0] < g->nodes[0]; p[0]++, at++) {
                const size_t first = least(g, s, p); /* at or before this node */
                number[at] = first == at ? (uint32_t)n++ : number[first];
            }
    *count = n;
    return IMP_OK;
}

static void means(const struct imp__tie *t, const double *grid, double *theta)
{
    memset(theta, 0, t->base.n_theta * sizeof *theta);
    for (size_t i = 0; i < t->grid->n_theta; i++)
        theta[t->number[i]] += grid[i] * t->share[t->number[i]];
}

enum imp_status imp_field_tie_create(imp_context *ctx, imp_field *grid,
                                     const struct imp_field_symmetry *symmetry,
                                     imp_field **out)
{
    enum imp_status st = IMP_OK;
    struct imp_field_symmetry own = IMP_FIELD_SYMMETRY_INIT, *const s = &own;
    imp_field *f = NULL;
    uint32_t *number = NULL;
    size_t n = 0;
    IMP_FLOAT_MODE;
    IMP_REQUIRE(ctx, grid, "grid");
    if (!ctx || !symmetry || !out)
        IMP_TRY(imp__argument_missing(ctx, __func__,
                                      !ctx        ? "context"
                                      : !symmetry ? "symmetry"
                                                  : "out"));
    IMP_TRY(imp__options_take(ctx, __func__, "symmetry", symmetry, s, sizeof own));
    const struct imp__grid *g = (const struct imp__grid *)grid;
    if (!imp__field_is_grid(grid))
        IMP_TRY(imp__error(ctx, IMP_E_ARG, "symmetry of a %s field: of grids only",
                           grid->ops->name));
    if (s->axis < 0 || s->axis > 2 ||
        (s->fold != IMP_FIELD_AXIAL && s->fold != 0 && s->fold != 1 && s->fold != 2 &&
         s->fold != 4))
        IMP_TRY(imp__error(ctx, IMP_E_ARG,
                           "no %d-fold symmetry about axis %d: 1, 2, 4 "
                           "or all turns",
                           s->fold, s->axis));
    const int u = (s->axis + 1) % 3, v = (s->axis + 2) % 3;
    if ((s->fold == 4 || s->fold < 0) &&
        (g->nodes[u] != g->nodes[v] || fabs(g->inv_h[u] / g->inv_h[v] - 1) > 1e-12))
        IMP_TRY(imp__error(ctx, IMP_E_ARG,
                           "symmetry of quarter turns: the grid is not square"));
    number = imp__alloc(ctx, grid->n_theta, sizeof *number);
    if (!number) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a symmetry"));
    IMP_TRY(orbits(g, s, number, &n));
    IMP_TRY(imp__field_new(ctx, &imp__field_tie, sizeof(struct imp__tie), n, &f));
    struct imp__tie *t = (struct imp__tie *)f;
    t->desc = *s;
    t->desc.size = sizeof t->desc;
    t->grid = grid, grid = NULL;
    t->number = number, number = NULL;
    t->share = imp__alloc(ctx, n, sizeof *t->share);
    if (!t->share) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a symmetry"));
    for (size_t i = 0; i < t->grid->n_theta; i++) t->share[t->number[i]]++;
    for (size_t i = 0; i < n; i++) t->share[i] = 1 / t->share[i];
    f->lo = t->grid->lo, f->hi = t->grid->hi;
    f->spacing = t->grid->spacing;
    means(t, t->grid->theta, f->theta);
    tie_changed(f);
    *out = f;
    f = NULL;
out:
    imp_field_destroy(f);
    imp_field_destroy(grid);
    imp__release(ctx, number);
    return st;
}

/* ---- Levels -------------------------------------------------------------------- */

enum imp_status imp__field_prolong(const imp_field *f, const imp_field *finer,
                                   const double *coarse, double *fine)
{
    enum imp_status st = IMP_OK;
    if (f->ops != &imp__field_tie) return imp__grid_prolong(f, coarse, fine);
    const struct imp__tie *t = (const struct imp__tie *)f,
                          *to = (const struct imp__tie *)finer;
    double *a = imp__alloc(f->ctx, t->grid->n_theta, sizeof *a);
    double *b = imp__alloc(f->ctx, to->grid->n_theta, sizeof *b);
    if (!a || !b) IMP_TRY(imp__error(f->ctx, IMP_E_NOMEM, "no memory for a level"));
    for (size_t i = 0; i < t->grid->n_theta; i++) a[i] = coarse[t->number[i]];
    IMP_TRY(imp__grid_prolong(t->grid, a, b));
    means(to, b, fine);
out:
    imp__release(f->ctx, a);
    imp__release(f->ctx, b);
    return st;
}

enum imp_status imp__tie_refine(const imp_field *f, imp_field **out)
{
    const struct imp__tie *t = (const struct imp__tie *)f;
    imp_field *fine;
    const enum imp_status st = imp_field_refine(t->grid, &fine);
    return st == IMP_OK ? imp_field_tie_create(f->ctx, fine, &t->desc, out) : st;
}

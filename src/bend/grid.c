/* SPDX-License-Identifier: Apache-2.0
 *
 * Grids of coefficients: making them. The interpolation itself is in spline.c and
 * trilinear.c, samples and levels are in grid_levels.c. Along an axis of M cells a spline
 * has nodes -1 .. M+1, a trilinear grid 0 .. M; [z][y][x]. */
#include "bend_rays.h"
#include <string.h>

/* Edges of a cell: places in units of it, and floats of coefficients times them, stay finite. */
#define CELL_LEAST 1e-15
#define CELL_MOST  1e15

bool imp__field_is_grid(const imp_field *f)
{
    return f->ops == &imp__field_spline || f->ops == &imp__field_trilinear;
}

struct imp__grid imp__grid_cell(const struct imp__grid *g, imp_v3 x, double *local,
                                size_t corner[3])
{
    struct imp__grid cell = *g;
    const imp_v3 u = (x - g->origin) * g->inv_h;
    for (int k = 0; k < 3; k++) {
        const int i = (int)imp_clamp(u[k], 0.0, (double)(g->desc.cells[k] - 1));
        corner[k] = (size_t)i;
        cell.origin[k] += i / g->inv_h[k];
        cell.nodes[k] = g->desc.interp == IMP_FIELD_SPLINE ? 4 : 2;
        cell.desc.cells[k] = 1;
    }
    cell.base.theta = local;
    cell.single = NULL;
    return cell;
}

void imp__grid_tangent(const imp_field *f, const imp_v3 *x, const double *theta_dot,
                       double *eta_dot, imp_v3 *g_dot)
{
    const bool eta2 = ((const struct imp__grid *)f)->desc.param == IMP_FIELD_ETA2;
    struct imp__grid g = *(const struct imp__grid *)f; /* with coefficients theta_dot */
    struct imp__jet j;
    g.base.theta = (double *)(uintptr_t)theta_dot;
    g.single = NULL;
    g.desc.param = IMP_FIELD_ETA;
    f->ops->eval(&g.base, 1, x, 1, &j);
    if (eta2) {
        struct imp__jet at;
        imp__field_eval1(f, x, 1, &at);
        imp__eta2_jvp(&at, &j);
    }
    *eta_dot = j.eta;
    *g_dot = j.g;
}

void imp__grid_changed(imp_field *f)
{
    struct imp__grid *g = (struct imp__grid *)f;
    g->most = 0;
    for (size_t i = 0; i < f->n_theta; i++)
        g->most = g->most < f->theta[i] ? f->theta[i] : g->most;
    if (g->single)
        for (size_t i = 0; i < f->n_theta; i++) g->single[i] = (float)f->theta[i];
}
void imp__grid_destroy(imp_field *f)
{
    imp__release(f->ctx, ((struct imp__grid *)f)->single);
}

enum imp_status imp_field_grid_create(imp_context *ctx, const struct imp_field_grid *grid,
                                      double index, imp_field **out)
{
    struct imp_field_grid own = IMP_FIELD_GRID_INIT, *const desc = &own;
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, grid, "grid");
    IMP_REQUIRE(ctx, out, "out");
    IMP_OPTIONS(ctx, own, grid, "grid");
    IMP_FLOAT_MODE;
    const bool spline = desc->interp == IMP_FIELD_SPLINE;
    int nodes[3];
    size_t n = 1;
    if ((unsigned)desc->interp > IMP_FIELD_TRILINEAR ||
        (unsigned)desc->param > IMP_FIELD_ETA2)
        return imp__error(ctx, IMP_E_ARG, "index grid: no such interpolation");
    if (!(index > 0) || !isfinite(index))
        return imp__error(ctx, IMP_E_ARG, "index grid: index %g is not positive", index);
    if (!(desc->gladstone_dale >= 0) || !isfinite(desc->gladstone_dale))
        return imp__error(ctx, IMP_E_ARG, "index grid: Gladstone-Dale constant %g",
                          desc->gladstone_dale);
    for (int k = 0; k < 3; k++) {
        if (desc->cells[k] < 1 || desc->cells[k] > IMP_GRID_CELLS_MAX)
            return imp__error(ctx, IMP_E_ARG, "index grid: %d cells along axis %d",
                              desc->cells[k], k);
        if (!(desc->hi[k] > desc->lo[k]) || !isfinite(desc->lo[k]) ||
            !isfinite(desc->hi[k]))
            return imp__error(ctx, IMP_E_ARG,
                              "index grid: empty box, %g to %g along axis %d",
                              desc->lo[k], desc->hi[k], k);
        const double h = (desc->hi[k] - desc->lo[k]) / desc->cells[k];
        if (!(h >= CELL_LEAST && h <= CELL_MOST))
            return imp__error(ctx, IMP_E_ARG,
                              "index grid: cells of %g along axis %d: %g to %g are read",
                              h, k, CELL_LEAST, CELL_MOST);
        nodes[k] = desc->cells[k] + (spline ? 3 : 1);
        n *= (size_t)nodes[k];
    }
    if (n > IMP_FIELD_THETA_MAX)
        return imp__error(ctx, IMP_E_ARG, "index grid: more than 2^30 coefficients");

    enum imp_status st = IMP_OK;
    imp_field *f = NULL;
    IMP_TRY(imp__field_new(ctx, spline ? &imp__field_spline : &imp__field_trilinear,
                           sizeof(struct imp__grid), n, &f));
    struct imp__grid *g = (struct imp__grid *)f;
    g->desc = *desc;
    g->desc.size = sizeof g->desc;
    memcpy(g->nodes, nodes, sizeof nodes);
    f->lo = imp__v3_load(desc->lo);
    f->hi = imp__v3_load(desc->hi);
    f->spacing = INFINITY;
    g->origin = f->lo;
    for (int k = 0; k < 3; k++) {
        const double h = (desc->hi[k] - desc->lo[k]) / desc->cells[k];
        g->inv_h[k] = 1 / h;
        f->spacing = fmin(f->spacing, h);
    }
    if (desc->single) {
        g->single = imp__alloc(ctx, n, sizeof *g->single);
        if (!g->single)
            IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for %zu samples", n));
    }
    const double c = desc->param == IMP_FIELD_ETA2 ? index * index / 2 : index;
    for (size_t i = 0; i < n; i++) f->theta[i] = c;
    if (f->ops->changed) f->ops->changed(f);
    *out = f;
    f = NULL;
out:
    imp_field_destroy(f);
    return st;
}

enum imp_status imp_field_get_grid(const imp_field *f, struct imp_field_grid *grid)
{
    const uint32_t *number;
    IMP_REQUIRE(NULL, f, "field");
    IMP_REQUIRE(f->ctx, grid, "grid");
    const struct imp__grid *g = imp__field_nodes(f, &number);
    if (!g)
        return imp__error(f->ctx, IMP_E_ARG, "a %s field is not a grid", f->ops->name);
    IMP_GIVE(f->ctx, grid, g->desc, "grid");
    return IMP_OK;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Grids of coefficients as linear maps of numbers: from samples at the corners of cells,
 * to a grid of half the spacing, and the transposes of both. Each is a product of maps
 * along the three axes. */
#include "bend_rays.h"
#include <string.h>

/* ---- Lines along an axis ------------------------------------------------------- */

/* One linear map along each axis in turn: a line of n_in numbers gives n_out. */
typedef void line_fn(int n_in, const double *in, int n_out, double *out);

static enum imp_status along_axes(imp_context *ctx, line_fn *fn, const int n_in[3],
                                  const int n_out[3], const double *in, double *out)
{
    int n[3] = {n_in[0], n_in[1], n_in[2]};
    size_t widest = 1;
    for (int k = 0; k < 3; k++) widest *= (size_t)imp_max(n_in[k], n_out[k]);
    const int longest = imp_max(imp_max(imp_max(n_in[0], n_in[1]), n_in[2]),
                                imp_max(imp_max(n_out[0], n_out[1]), n_out[2]));
    double *a = imp__alloc(ctx, widest, sizeof *a),
           *b = imp__alloc(ctx, widest, sizeof *b);
    double *line = imp__alloc(ctx, 2 * (size_t)longest, sizeof *line);
    if (!a || !b || !line) {
        imp__release(ctx, a), imp__release(ctx, b), imp__release(ctx, line);
        return imp__error(ctx, IMP_E_NOMEM, "no memory to resample an index grid");
    }
    memcpy(a, in, (size_t)n[0] * n[1] * n[2] * sizeof *a);
    for (int k = 0; k < 3; k++) {
        int m[3] = {n[0], n[1], n[2]};
        m[k] = n_out[k];
        const size_t in_stride = k == 0 ? 1 : k == 1 ? (size_t)n[0] : (size_t)n[0] * n[1];
        const size_t out_stride = k == 0   ? 1
                                  : k == 1 ? (size_t)m[0]
                                           : (size_t)m[0] * m[1];
        const int u = k == 0 ? 1 : 0, w = k == 2 ? 1 : 2; /* the other two axes, u < w */
        for (int j = 0; j < n[w]; j++)
            for (int i = 0; i < n[u]; i++) {
                int p[3] = {0};
                p[u] = i, p[w] = j;
                const double *src =
                    a + p[0] + (size_t)n[0] * (p[1] + (size_t)n[1] * p[2]);
                double *dst = b + p[0] + (size_t)m[0] * (p[1] + (size_t)m[1] * p[2]);
                for (int q = 0; q < n[k]; q++) line[q] = src[(size_t)q * in_stride];
                fn(n[k], line, m[k], line + longest);
                for (int q = 0; q < m[k]; q++)
                    dst[(size_t)q * out_stride] = line[longest + q];
            }
        memcpy(n, m, sizeof n);
        double *swap = a;
        a = b, b = swap;
    }
    memcpy(out, a, (size_t)n[0] * n[1] * n[2] * sizeof *out);
    imp__release(ctx, a), imp__release(ctx, b), imp__release(ctx, line);
    return IMP_OK;
}

/* (y_{i-1} + 4 y_i + y_{i+1}) / 6 = r_i for i = 1 .. n, y_0 = y_{n+1} = 0. In place; `w`
 * [n]. The matrix is symmetric, so the transpose uses the same solve. */
static void thomas_141(int n, double *r, double *w)
{
    if (n < 1) return;
    double d = 4;
    r[0] = 6 * r[0] / d;
    for (int i = 1; i < n; i++) {
        w[i] = 1 / d;
        d = 4 - w[i];
        r[i] = (6 * r[i] - r[i - 1]) / d;
    }
    for (int i = n - 2; i >= 0; i--) r[i] -= w[i + 1] * r[i + 1];
}

/* f_0 .. f_M -> c_{-1} .. c_{M+1}, natural ends: c_0 = f_0, c_{-1} = 2 c_0 - c_1. */
static void line_from_samples(int n_in, const double *f, int n_out, double *c)
{
    const int M = n_in - 1;
    double w[IMP_GRID_CELLS_MAX];
    (void)n_out;
    for (int i = 0; i <= M; i++) c[i + 1] = f[i];
    if (M > 1) {
        c[2] -= c[1] / 6;
        c[M] -= c[M + 1] / 6;
        thomas_141(M - 1, c + 2, w);
    }
    c[0] = 2 * c[1] - c[2];
    c[M + 2] = 2 * c[M + 1] - c[M];
}
static void line_from_samples_vjp(int n_in, const double *c_bar, int n_out, double *f_bar)
{
    const int M = n_out - 1;
    double w[IMP_GRID_CELLS_MAX];
    (void)n_in;
    for (int i = 0; i <= M; i++) f_bar[i] = c_bar[i + 1];
    f_bar[0] += 2 * c_bar[0];
    f_bar[1] -= c_bar[0];
    f_bar[M] += 2 * c_bar[M + 2];
    f_bar[M - 1] -= c_bar[M + 2];
    if (M > 1) {
        thomas_141(M - 1, f_bar + 1, w);
        f_bar[0] -= f_bar[1] / 6;
        f_bar[M] -= f_bar[M - 1] / 6;
    }
}

/* Subdivision masks (1 4 6 4 1)/8 of the cubic spline and (1 2 1)/2 of the linear grid:
 * both keep the function. Fine node j is at coarse node j/2; arrays of a spline begin at
 * node -1. */
static void line_refine_spline(int n_in, const double *c, int n_out, double *fine)
{
    (void)n_in;
    for (int k = 0; k < n_out; k++) {
        const int i =
            k / 2; /* array index of the lower coarse node of the pair or triple */
        fine[k] = k % 2 ? (c[i] + 6 * c[i + 1] + c[i + 2]) / 8 : (c[i] + c[i + 1]) / 2;
    }
}
static void line_refine_spline_vjp(int n_in, const double *fine, int n_out, double *c)
{
    memset(c, 0, (size_t)n_out * sizeof *c);
    for (int k = 0; k < n_in; k++) {
        const int i = k / 2;
        if (k % 2)
            c[i] += fine[k] / 8, c[i + 1] += 6 * fine[k] / 8, c[i + 2] += fine[k] / 8;
        else c[i] += fine[k] / 2, c[i + 1] += fine[k] / 2;
    }
}
static void line_refine_linear(int n_in, const double *c, int n_out, double *fine)
{
    (void)n_in;
    for (int k = 0; k < n_out; k++)
        fine[k] = k % 2 ? (c[k / 2] + c[k / 2 + 1]) / 2 : c[k / 2];
}
static void line_refine_linear_vjp(int n_in, const double *fine, int n_out, double *c)
{
    memset(c, 0, (size_t)n_out * sizeof *c);
    for (int k = 0; k < n_in; k++)
        if (k % 2) c[k / 2] += fine[k] / 2, c[k / 2 + 1] += fine[k] / 2;
        else c[k / 2] += fine[k];
}

/* ---- Samples ------------------------------------------------------------------- */

static const struct imp__grid *grid_of(const imp_field *f, enum imp_status *st)
{
    *st = imp__field_is_grid(f)
              ? IMP_OK
              : imp__error(f->ctx, IMP_E_ARG, "a %s field is not a grid", f->ops->name);
    return (const struct imp__grid *)f;
}

enum imp_status imp_field_set_samples(imp_field *f, const double *samples)
{
    enum imp_status st;
    double *values = NULL, *theta = NULL;
    IMP_REQUIRE(NULL, f, "field");
    IMP_REQUIRE(f->ctx, samples, "samples");
    IMP_FLOAT_MODE;
    const struct imp__grid *g = grid_of(f, &st);
    if (st != IMP_OK) return st;
    const int *cells = g->desc.cells,
              corners[3] = {cells[0] + 1, cells[1] + 1, cells[2] + 1};
    const size_t n = (size_t)corners[0] * corners[1] * corners[2];

    values = imp__alloc(f->ctx, n, sizeof *values);
    theta = imp__alloc(f->ctx, f->n_theta, sizeof *theta);
    if (!values || !theta)
        IMP_TRY(imp__error(f->ctx, IMP_E_NOMEM, "no memory for %zu samples", n));
    for (size_t i = 0; i < n; i++) {
        const double K = g->desc.gladstone_dale,
                     eta = K > 0 ? 1 + K * samples[i] : samples[i];
        if (!isfinite(eta) || !(eta > 0))
            IMP_TRY(
                imp__error(f->ctx, IMP_E_ARG,
                           "samples[%zu] of the index grid is %g: an index is positive",
                           i, samples[i]));
        values[i] = g->desc.param == IMP_FIELD_ETA2 ? eta * eta / 2 : eta;
    }
    if (g->desc.interp == IMP_FIELD_SPLINE)
        IMP_TRY(along_axes(f->ctx, line_from_samples, corners, g->nodes, values, theta));
    else memcpy(theta, values, n * sizeof *theta);
    IMP_TRY(imp_field_set_theta(f, theta));
out:
    imp__release(f->ctx, values);
    imp__release(f->ctx, theta);
    return st;
}

enum imp_status imp_field_samples_vjp(const imp_field *f, const double *theta_bar,
                                      double *samples_bar)
{
    enum imp_status st;
    IMP_REQUIRE(NULL, f, "field");
    IMP_REQUIRE(f->ctx, theta_bar, "theta_bar");
    IMP_REQUIRE(f->ctx, samples_bar, "samples_bar");
    IMP_FLOAT_MODE;
    const struct imp__grid *g = grid_of(f, &st);
    if (st != IMP_OK) return st;
    IMP_FINITE_ALL(f->ctx, theta_bar, f->n_theta, "theta_bar");
    if (g->desc.param != IMP_FIELD_ETA)
        return imp__error(f->ctx, IMP_E_UNSUPPORTED,
                          "samples of eta^2 have no transpose here");
    const int *cells = g->desc.cells,
              corners[3] = {cells[0] + 1, cells[1] + 1, cells[2] + 1};
    if (g->desc.interp == IMP_FIELD_SPLINE)
        st = along_axes(f->ctx, line_from_samples_vjp, g->nodes, corners, theta_bar,
                        samples_bar);
    else memcpy(samples_bar, theta_bar, f->n_theta * sizeof *theta_bar);
    const size_t n = (size_t)corners[0] * corners[1] * corners[2];
    if (st == IMP_OK && g->desc.gladstone_dale > 0)
        for (size_t i = 0; i < n; i++) samples_bar[i] *= g->desc.gladstone_dale;
    return st;
}

/* ---- Levels -------------------------------------------------------------------- */

/* Nodes of the grid whose cells are half as large; true: splines. */
static bool fine_nodes(const struct imp__grid *g, int nodes[3])
{
    const bool spline = g->desc.interp == IMP_FIELD_SPLINE;
    for (int k = 0; k < 3; k++) nodes[k] = 2 * g->desc.cells[k] + (spline ? 3 : 1);
    return spline;
}

enum imp_status imp__grid_prolong(const imp_field *f, const double *coarse, double *fine)
{
    const struct imp__grid *g = (const struct imp__grid *)f;
    int nodes[3];
    const bool spline = fine_nodes(g, nodes);
    return along_axes(f->ctx, spline ? line_refine_spline : line_refine_linear, g->nodes,
                      nodes, coarse, fine);
}

enum imp_status imp_field_refine(const imp_field *f, imp_field **out)
{
    enum imp_status st;
    imp_field *fine = NULL;
    IMP_REQUIRE(NULL, f, "field");
    IMP_REQUIRE(f->ctx, out, "out");
    IMP_FLOAT_MODE;
    if (f->ops == &imp__field_tie) return imp__tie_refine(f, out);
    const struct imp__grid *g = grid_of(f, &st);
    if (st != IMP_OK) return st;
    struct imp_field_grid desc = g->desc;
    for (int k = 0; k < 3; k++) desc.cells[k] *= 2;
    IMP_TRY(imp_field_grid_create(f->ctx, &desc, 1, &fine));
    IMP_TRY(imp__grid_prolong(f, f->theta, fine->theta));
    if (fine->ops->changed) fine->ops->changed(fine);
    *out = fine;
    fine = NULL;
out:
    imp_field_destroy(fine);
    return st;
}

enum imp_status imp_field_refine_vjp(const imp_field *f, const double *fine_bar,
                                     double *coarse_bar)
{
    enum imp_status st;
    IMP_REQUIRE(NULL, f, "field");
    IMP_REQUIRE(f->ctx, fine_bar, "fine_bar");
    IMP_REQUIRE(f->ctx, coarse_bar, "coarse_bar");
    IMP_FLOAT_MODE;
    const struct imp__grid *g = grid_of(f, &st);
    if (st != IMP_OK) return st;
    int fine[3];
    const bool spline = fine_nodes(g, fine);
    IMP_FINITE_ALL(f->ctx, fine_bar, (size_t)fine[0] * (size_t)fine[1] * (size_t)fine[2],
                   "fine_bar");
    return along_axes(f->ctx, spline ? line_refine_spline_vjp : line_refine_linear_vjp,
                      fine, g->nodes, fine_bar, coarse_bar);
}

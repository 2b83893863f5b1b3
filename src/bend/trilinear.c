/* SPDX-License-Identifier: Apache-2.0
 *
 * Trilinear grid. The index is continuous, its gradient jumps at cell faces, and inside
 * cells the diagonal of the Hessian is zero: the derivative of the traced program is
 * exact, and not the macroscopic one (docs/bent-rays.md 3.3). */
#include "grid_back.h"

struct corners {
    double c[8];
    double u, v, w;
    size_t at;
};

static inline __attribute__((always_inline)) struct corners
corners_of(const struct imp__grid *g, imp_v3 x, bool single)
{
    const imp_v3 u = (x - g->origin) * g->inv_h;
    struct corners r;
    const int i = (int)imp_clamp(u[0], 0.0, (double)(g->desc.cells[0] - 1));
    const int j = (int)imp_clamp(u[1], 0.0, (double)(g->desc.cells[1] - 1));
    const int k = (int)imp_clamp(u[2], 0.0, (double)(g->desc.cells[2] - 1));
    const size_t sy = (size_t)g->nodes[0], sz = sy * (size_t)g->nodes[1];
    r.u = u[0] - i, r.v = u[1] - j, r.w = u[2] - k;
    r.at = (size_t)i + sy * (size_t)j + sz * (size_t)k;
    const size_t at[4] = {r.at, r.at + sy, r.at + sz, r.at + sz + sy};
    for (int p = 0; p < 4; p++)
        if (single) r.c[2 * p] = g->single[at[p]], r.c[2 * p + 1] = g->single[at[p] + 1];
        else r.c[2 * p] = g->base.theta[at[p]], r.c[2 * p + 1] = g->base.theta[at[p] + 1];
    return r;
}

static inline __attribute__((always_inline)) void
jet_of(const struct imp__grid *g, const struct corners *r, int order, struct imp__jet *j)
{
    const double *c = r->c, u = r->u, v = r->v, w = r->w;
    const double d0 = c[1] - c[0], d1 = c[3] - c[2], d2 = c[5] - c[4], d3 = c[7] - c[6];
    const double e0 = c[0] + u * d0, e1 = c[2] + u * d1, e2 = c[4] + u * d2,
                 e3 = c[6] + u * d3;
    const double f0 = e1 - e0, f1 = e3 - e2; /* along y, at w = 0 and 1 */
    const double s0 = e0 + v * f0, s1 = e2 + v * f1;
    const double dx0 = d0 + v * (d1 - d0), dx1 = d2 + v * (d3 - d2);
    j->eta = s0 + w * (s1 - s0);
    j->g = imp__v3(dx0 + w * (dx1 - dx0), f0 + w * (f1 - f0), s1 - s0) * g->inv_h;
    if (order < 2) return;
    const double ih[3] = {g->inv_h[0], g->inv_h[1], g->inv_h[2]};
    const double xy = ((d1 - d0) + w * ((d3 - d2) - (d1 - d0))) * ih[0] * ih[1];
    const double xz = (dx1 - dx0) * ih[0] * ih[2], yz = (f1 - f0) * ih[1] * ih[2];
    j->h[0] = imp__v3(0, xy, xz);
    j->h[1] = imp__v3(xy, 0, yz);
    j->h[2] = imp__v3(xz, yz, 0);
}

static inline __attribute__((always_inline)) void
eval_one(const struct imp__grid *g, imp_v3 x, bool single, int order, struct imp__jet *j)
{
    const struct corners r = corners_of(g, x, single);
    jet_of(g, &r, order, j);
}

static void trilinear_eval(const imp_field *f, int n, const imp_v3 *x, int order,
                           struct imp__jet *jet)
{
    const struct imp__grid *g = (const struct imp__grid *)f;
    if (g->single)
        for (int i = 0; i < n; i++) eval_one(g, x[i], true, order, &jet[i]);
    else
        for (int i = 0; i < n; i++) eval_one(g, x[i], false, order, &jet[i]);
    if (g->desc.param == IMP_FIELD_ETA2)
        for (int i = 0; i < n; i++) imp__jet_from_eta2(&jet[i], order);
}

static inline __attribute__((always_inline)) void splat_corners(const struct imp__grid *g,
                                                                const struct corners *r,
                                                                double a, imp_v3 b,
                                                                struct imp__bar *bar)
{
    const size_t sy = (size_t)g->nodes[0], sz = sy * (size_t)g->nodes[1];
    const double wx[2] = {1 - r->u, r->u}, wy[2] = {1 - r->v, r->v},
                 wz[2] = {1 - r->w, r->w};
    b *= g->inv_h;
    for (int k = 0; k < 2; k++) {
        const size_t at = r->at + (k ? sz : 0);
        double *row = imp__bar_reach(bar, at, sy + 2) + at;
        for (int i = 0; i < 2; i++, row += sy) {
            const double q = wy[i] * wz[k];
            const double p =
                a * q + (i ? b[1] : -b[1]) * wz[k] + wy[i] * (k ? b[2] : -b[2]);
            row[0] += p * wx[0] - b[0] * q;
            row[1] += p * wx[1] + b[0] * q;
        }
    }
}

static void trilinear_splat(const imp_field *f, const imp_v3 *x, double a,
                            const imp_v3 *b, struct imp__bar *bar)
{
    const struct imp__grid *g = (const struct imp__grid *)f;
    imp_v3 gb = *b;
    const struct corners r = corners_of(g, *x, false);
    if (g->desc.param == IMP_FIELD_ETA2) {
        struct imp__jet j;
        trilinear_eval(f, 1, x, 1, &j);
        imp__eta2_vjp(&j, &a, &gb);
    }
    splat_corners(g, &r, a, gb, bar);
}

static inline __attribute__((always_inline)) void
back_jet(const struct imp__grid *g, imp_v3 x, bool single, void *at, struct imp__jet *j)
{
    struct corners *r = at;
    *r = corners_of(g, x, single);
    jet_of(g, r, 2, j);
}
static inline __attribute__((always_inline)) void back_splat(const struct imp__grid *g,
                                                             const void *at, double a,
                                                             imp_v3 b,
                                                             struct imp__bar *bar)
{
    splat_corners(g, at, a, b, bar);
}
static void trilinear_kick_back(const imp_field *f, bool arc, double dt, int n,
                                struct imp__back *b, struct imp__bar *bar)
{
    struct corners at;
    imp__grid_kick_back(f, arc, dt, n, b, bar, back_jet, back_splat, &at);
}

const struct imp__field_ops imp__field_trilinear = {
    .name = "trilinear",
    .eval = trilinear_eval,
    .splat = trilinear_splat,
    .kick_back = trilinear_kick_back,
    .tangent = imp__grid_tangent,
    .changed = imp__grid_changed,
    .destroy = imp__grid_destroy,
    .jumps = "the gradient of a trilinear field jumps at cell faces; splines do not"};

/* SPDX-License-Identifier: Apache-2.0
 *
 * Tensor cubic B-spline: eta = sum theta_abc w_a(u) w_b(v) w_c(w). Twice differentiable,
 * so the adjoint of a traced ray is also the macroscopic derivative
 * (docs/bent-rays.md 3.1, 3.3). The x axis is contiguous: four coefficients along x are
 * one vector. Vectors are summed over y, then z, and multiplied by the weights of x last.
 */
#include "grid_back.h"

struct cell {      /* the cell that contains a point */
    size_t corner; /* index of the first coefficient */
    imp_v3 u;      /* local coordinates, in [0, 1) inside the domain */
};

static inline struct cell cell_of(const struct imp__grid *g, imp_v3 x)
{
    const imp_v3 u = (x - g->origin) * g->inv_h;
    struct cell c;
    int i[3];
    for (int k = 0; k < 3; k++) {
        /* Outside the grid the cell is clamped but not u: the outermost polynomial is
         * extrapolated. */
        const int top = g->desc.cells[k] - 1;
        const double f = imp_clamp(u[k], 0.0, (double)top);
        i[k] = (int)f;
    }
    c.u = imp__v3(u[0] - i[0], u[1] - i[1], u[2] - i[2]);
    c.corner =
        (size_t)i[0] + (size_t)g->nodes[0] * ((size_t)i[1] + (size_t)g->nodes[1] * i[2]);
    return c;
}

static inline imp_spec weights(double u)
{
    const double m = 1 - u, u2 = u * u, u3 = u2 * u;
    return (imp_spec){m * m * m, 3 * u3 - 6 * u2 + 4, -3 * u3 + 3 * u2 + 3 * u + 1, u3} *
           (1.0 / 6);
}
static inline imp_spec weights_d(double u, double inv_h)
{
    const double m = 1 - u, u2 = u * u;
    return (imp_spec){-m * m, 3 * u2 - 4 * u, -3 * u2 + 2 * u + 1, u2} * (0.5 * inv_h);
}
static inline imp_spec weights_dd(double u, double inv_h)
{
    return (imp_spec){1 - u, 3 * u - 2, 1 - 3 * u, u} * (inv_h * inv_h);
}

/* Weights along the axes at a point; derivatives include the factors 1/h and 1/h^2. */
struct basis {
    size_t corner;
    imp_spec wx, wy, wz, dx, dy, dz;
};
static inline __attribute__((always_inline)) struct basis basis_of(const struct cell *c,
                                                                   const imp_v3 inv_h)
{
    return (struct basis){c->corner,
                          weights(c->u[0]),
                          weights(c->u[1]),
                          weights(c->u[2]),
                          weights_d(c->u[0], inv_h[0]),
                          weights_d(c->u[1], inv_h[1]),
                          weights_d(c->u[2], inv_h[2])};
}

typedef float row_f __attribute__((vector_size(16)));

static inline imp_spec row_load(const struct imp__grid *g, size_t i, bool single)
{
    imp_spec r;
    if (single) {
        row_f f;
        __builtin_memcpy(&f, g->single + i, sizeof f);
        r = __builtin_convertvector(f, imp_spec);
    } else {
        __builtin_memcpy(&r, g->base.theta + i, sizeof r);
    }
    return r;
}
/* The sums of the lanes of four vectors: (a0 + a1) + (a2 + a3), ... */
static inline imp_spec sum4(imp_spec a, imp_spec b, imp_spec c, imp_spec d)
{
    const imp_spec ab = __builtin_shufflevector(a, b, 0, 4, 2, 6) +
                        __builtin_shufflevector(a, b, 1, 5, 3, 7);
    const imp_spec cd = __builtin_shufflevector(c, d, 0, 4, 2, 6) +
                        __builtin_shufflevector(c, d, 1, 5, 3, 7);
    return __builtin_shufflevector(ab, cd, 0, 1, 4, 5) +
           __builtin_shufflevector(ab, cd, 2, 3, 6, 7);
}

static inline __attribute__((always_inline)) void
eval_first(const struct imp__grid *g, imp_v3 x, bool single, struct imp__jet *j)
{
    const struct cell c = cell_of(g, x);
    const imp_spec wx = weights(c.u[0]), wy = weights(c.u[1]), wz = weights(c.u[2]);
    const imp_spec dx = weights_d(c.u[0], g->inv_h[0]),
                   dy = weights_d(c.u[1], g->inv_h[1]),
                   dz = weights_d(c.u[2], g->inv_h[2]);
    const size_t sy = (size_t)g->nodes[0], sz = sy * (size_t)g->nodes[1];
    imp_spec a = {0}, ay = {0}, az = {0};
#pragma GCC unroll 4
    for (int k = 0; k < 4; k++) {
        const size_t at = c.corner + (size_t)k * sz;
        const imp_spec r0 = row_load(g, at, single), r1 = row_load(g, at + sy, single),
                       r2 = row_load(g, at + 2 * sy, single),
                       r3 = row_load(g, at + 3 * sy, single);
        const imp_spec s = (wy[0] * r0 + wy[1] * r1) + (wy[2] * r2 + wy[3] * r3);
        const imp_spec sd = (dy[0] * r0 + dy[1] * r1) + (dy[2] * r2 + dy[3] * r3);
        a += wz[k] * s;
        ay += wz[k] * sd;
        az += dz[k] * s;
    }
    const imp_spec r = sum4(dx * a, wx * ay, wx * az, wx * a), zero = {0};
    j->eta = r[3];
    j->g = __builtin_shufflevector(r, zero, 0, 1, 2, 7);
}

static inline __attribute__((always_inline)) void second(const struct imp__grid *g,
                                                         const struct cell *c,
                                                         const struct basis *b,
                                                         bool single, struct imp__jet *j)
{
    const imp_spec wx = b->wx, wy = b->wy, wz = b->wz, dx = b->dx, dy = b->dy, dz = b->dz;
    const imp_spec ddx = weights_dd(c->u[0], g->inv_h[0]),
                   ddy = weights_dd(c->u[1], g->inv_h[1]),
                   ddz = weights_dd(c->u[2], g->inv_h[2]);
    const size_t sy = (size_t)g->nodes[0], sz = sy * (size_t)g->nodes[1];
    imp_spec a = {0}, ay = {0}, az = {0}, ayy = {0}, ayz = {0}, azz = {0};
#pragma GCC unroll 4
    for (int k = 0; k < 4; k++) {
        const size_t at = c->corner + (size_t)k * sz;
        const imp_spec r0 = row_load(g, at, single), r1 = row_load(g, at + sy, single),
                       r2 = row_load(g, at + 2 * sy, single),
                       r3 = row_load(g, at + 3 * sy, single);
        const imp_spec s = (wy[0] * r0 + wy[1] * r1) + (wy[2] * r2 + wy[3] * r3);
        const imp_spec sd = (dy[0] * r0 + dy[1] * r1) + (dy[2] * r2 + dy[3] * r3);
        const imp_spec sdd = (ddy[0] * r0 + ddy[1] * r1) + (ddy[2] * r2 + ddy[3] * r3);
        a += wz[k] * s;
        ay += wz[k] * sd;
        ayy += wz[k] * sdd;
        az += dz[k] * s;
        ayz += dz[k] * sd;
        azz += ddz[k] * s;
    }
    const imp_spec zero = {0};
    const imp_spec r = sum4(dx * a, wx * ay, wx * az, wx * a);
    const imp_spec h = sum4(ddx * a, dx * ay, dx * az, wx * ayy); /* xx xy xz yy */
    const imp_spec q = sum4(wx * ayz, wx * azz, zero, zero);      /* yz zz */
    j->eta = r[3];
    j->g = __builtin_shufflevector(r, zero, 0, 1, 2, 7);
    j->h[0] = __builtin_shufflevector(h, zero, 0, 1, 2, 7);
    j->h[1] = (imp_v3){h[1], h[3], q[0], 0};
    j->h[2] = (imp_v3){h[2], q[0], q[1], 0};
}

static inline __attribute__((always_inline)) void
eval_second(const struct imp__grid *g, imp_v3 x, bool single, struct imp__jet *j)
{
    const struct cell c = cell_of(g, x);
    const struct basis b = basis_of(&c, g->inv_h);
    second(g, &c, &b, single, j);
}

static void spline_eval(const imp_field *f, int n, const imp_v3 *x, int order,
                        struct imp__jet *jet)
{
    const struct imp__grid *g = (const struct imp__grid *)f;
    if (order < 2) {
        if (g->single)
            for (int i = 0; i < n; i++) eval_first(g, x[i], true, &jet[i]);
        else
            for (int i = 0; i < n; i++) eval_first(g, x[i], false, &jet[i]);
    } else {
        if (g->single)
            for (int i = 0; i < n; i++) eval_second(g, x[i], true, &jet[i]);
        else
            for (int i = 0; i < n; i++) eval_second(g, x[i], false, &jet[i]);
    }
    if (g->desc.param == IMP_FIELD_ETA2)
        for (int i = 0; i < n; i++) imp__jet_from_eta2(&jet[i], order);
}

/* theta_bar += a w_a w_b w_c + (1/h)(b_x w_a' w_b w_c + ...): each row gets the x weights
 * and their derivative, each times a number. */
static inline __attribute__((always_inline)) void splat_basis(const struct imp__grid *g,
                                                              const struct basis *s,
                                                              double va, imp_v3 b,
                                                              struct imp__bar *bar)
{
    const imp_spec wx = s->wx, wy = s->wy, wz = s->wz;
    const imp_spec dx = s->dx * b[0], dy = s->dy * b[1], dz = va * wz + s->dz * b[2];
    const size_t sy = (size_t)g->nodes[0], sz = sy * (size_t)g->nodes[1];
#pragma GCC unroll 4
    for (int k = 0; k < 4; k++) {
        const imp_spec q = wy * wz[k], p = wy * dz[k] + dy * wz[k];
        const size_t at = s->corner + (size_t)k * sz;
        double *row = imp__bar_reach(bar, at, 3 * sy + 4) + at;
#pragma GCC unroll 4
        for (int i = 0; i < 4; i++, row += sy) {
            imp_spec r;
            __builtin_memcpy(&r, row, sizeof r);
            r += wx * p[i] + dx * q[i];
            __builtin_memcpy(row, &r, sizeof r);
        }
    }
}

static void spline_splat(const imp_field *f, const imp_v3 *x, double a, const imp_v3 *b,
                         struct imp__bar *bar)
{
    const struct imp__grid *g = (const struct imp__grid *)f;
    const struct cell c = cell_of(g, *x);
    const struct basis s = basis_of(&c, g->inv_h);
    imp_v3 gb = *b;
    if (g->desc.param == IMP_FIELD_ETA2) {
        struct imp__jet j;
        spline_eval(f, 1, x, 1, &j);
        imp__eta2_vjp(&j, &a, &gb);
    }
    splat_basis(g, &s, a, gb, bar);
}

struct place {
    struct cell cell;
    struct basis basis;
};
static inline __attribute__((always_inline)) void
back_jet(const struct imp__grid *g, imp_v3 x, bool single, void *at, struct imp__jet *j)
{
    struct place *p = at;
    p->cell = cell_of(g, x);
    p->basis = basis_of(&p->cell, g->inv_h);
    second(g, &p->cell, &p->basis, single, j);
}
static inline __attribute__((always_inline)) void back_splat(const struct imp__grid *g,
                                                             const void *at, double a,
                                                             imp_v3 b,
                                                             struct imp__bar *bar)
{
    splat_basis(g, &((const struct place *)at)->basis, a, b, bar);
}
static void spline_kick_back(const imp_field *f, bool arc, double dt, int n,
                             struct imp__back *b, struct imp__bar *bar)
{
    struct place at;
    imp__grid_kick_back(f, arc, dt, n, b, bar, back_jet, back_splat, &at);
}

const struct imp__field_ops imp__field_spline = {.name = "spline",
                                                 .eval = spline_eval,
                                                 .splat = spline_splat,
                                                 .kick_back = spline_kick_back,
                                                 .tangent = imp__grid_tangent,
                                                 .changed = imp__grid_changed,
                                                 .destroy = imp__grid_destroy};

/* SPDX-License-Identifier: Apache-2.0
 *
 * Integrals over the sphere in (z, phi), where area is dz dphi, by adaptive
 * Gauss-Legendre, and a tree of cells for histograms of directions. The horizon is always
 * a cell border. */
#ifndef IMP_SPHERE_H
#define IMP_SPHERE_H

#include "math/quadrature.h"
#include "math/stat.h"
#include "math/vec.h"

typedef double sphere_fn(imp_v3 w, void *payload);

struct sphere_cell {
    double z0, z1, p0, p1;
    int child; /* index of the first of four, or 0 */
    int count; /* draws in it */
};

static inline imp_v3 sphere_direction(double z, double phi)
{
    const double r = sqrt(fmax(0, (1 - z) * (1 + z)));
    return imp__v3(r * cos(phi), r * sin(phi), z);
}

static inline double sphere_rule(const struct sphere_cell *c, sphere_fn *f, void *payload)
{
    enum { N = 5 };
    static double x[N], w[N];
    if (w[0] == 0) imp__gauss_legendre(N, 0, 1, x, w);
    const double dz = c->z1 - c->z0, dp = c->p1 - c->p0;
    double sum = 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++)
            sum += w[i] * w[j] *
                   f(sphere_direction(c->z0 + x[i] * dz, c->p0 + x[j] * dp), payload);
    return sum * dz * dp;
}
static inline struct sphere_cell sphere_quarter(const struct sphere_cell *c, int k)
{
    const double zm = 0.5 * (c->z0 + c->z1), pm = 0.5 * (c->p0 + c->p1);
    return (struct sphere_cell){.z0 = k & 1 ? zm : c->z0,
                                .z1 = k & 1 ? c->z1 : zm,
                                .p0 = k & 2 ? pm : c->p0,
                                .p1 = k & 2 ? c->p1 : pm};
}
/* Until halving changes less than `tolerance` (absolute, shared out by area). */
static inline double sphere_cell_integral(const struct sphere_cell *c, double whole,
                                          sphere_fn *f, void *payload, double tolerance,
                                          int depth)
{
    struct sphere_cell q[4];
    double part[4], sum = 0;
    for (int k = 0; k < 4; k++) {
        q[k] = sphere_quarter(c, k);
        part[k] = sphere_rule(&q[k], f, payload);
        sum += part[k];
    }
    /* Wide cells are always cut: a narrow lobe must not hide between the nodes. */
    if (depth == 0 || (c->z1 - c->z0 < 0.13 && fabs(sum - whole) <= tolerance))
        return sum;
    sum = 0;
    for (int k = 0; k < 4; k++)
        sum +=
            sphere_cell_integral(&q[k], part[k], f, payload, 0.5 * tolerance, depth - 1);
    return sum;
}
/* How often cells are cut at most: fewer times for functions that jump, where halving
 * never ends. */
static int sphere_depth = 12;
/* Over the whole sphere (lo = -1) or part of it; first cut into cells about 1/16 wide. */
static inline double sphere_integral(sphere_fn *f, void *payload, double lo, double hi,
                                     double tolerance)
{
    enum { NZ = 16, NP = 32 };
    double sum = 0;
    for (int i = 0; i < NZ; i++)
        for (int j = 0; j < NP; j++) {
            const struct sphere_cell c = {lo + (hi - lo) * i / NZ,
                                          lo + (hi - lo) * (i + 1) / NZ,
                                          IMP_2PI * j / NP,
                                          IMP_2PI * (j + 1) / NP,
                                          0,
                                          0};
            sum += sphere_cell_integral(&c, sphere_rule(&c, f, payload), f, payload,
                                        tolerance / 64, sphere_depth);
        }
    return sum;
}

/* ---- Histogram whose cells follow where draws fall ----------------------------- */

#define SPHERE_MAX_CELLS 4096
struct sphere_tree {
    int n;
    struct sphere_cell cell[SPHERE_MAX_CELLS];
};
static inline void sphere_tree_init(struct sphere_tree *t)
{
    t->n = 2;
    t->cell[0] = (struct sphere_cell){-1, 0, 0, IMP_2PI, 0, 0};
    t->cell[1] = (struct sphere_cell){0, 1, 0, IMP_2PI, 0, 0};
}
static inline struct sphere_cell *sphere_tree_find(struct sphere_tree *t, imp_v3 w)
{
    double phi = atan2(w[1], w[0]);
    if (phi < 0) phi += IMP_2PI;
    struct sphere_cell *c = &t->cell[w[2] >= 0];
    while (c->child) {
        const double zm = 0.5 * (c->z0 + c->z1), pm = 0.5 * (c->p0 + c->p1);
        c = &t->cell[c->child + (w[2] >= zm) + 2 * (phi >= pm)];
    }
    return c;
}
/* A pilot draw: cells that hold many are cut. The draws that are tested must be others.
 */
static inline void sphere_tree_pilot(struct sphere_tree *t, imp_v3 w, int limit)
{
    struct sphere_cell *c = sphere_tree_find(t, w);
    if (++c->count < limit || t->n + 4 > SPHERE_MAX_CELLS || c->z1 - c->z0 < 1e-4) return;
    c->child = t->n;
    for (int k = 0; k < 4; k++) t->cell[t->n++] = sphere_quarter(c, k);
}
static inline void sphere_tree_reset(struct sphere_tree *t)
{
    for (int i = 0; i < t->n; i++) t->cell[i].count = 0;
}

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Adaptive Gauss-Legendre over the sphere in (z, phi), and a tree of cells that is cut where pilot
 * draws fall. */
#include "sphere_cells.h"
#include "quadrature.h"

/* ---- Integrals ------------------------------------------------------------------- */

enum { NODES = 5 };
struct rule {
    double x[NODES], w[NODES];
};

static imp_v3 direction(double z, double phi)
{
    const double r = sqrt(fmax(0, (1 - z) * (1 + z)));
    return imp__v3(r * cos(phi), r * sin(phi), z);
}

static double rule_sum(const struct rule *q, const struct imp__sphere_cell *c,
                       imp__sphere_fn *f, void *payload)
{
    const double dz = c->z1 - c->z0, dp = c->p1 - c->p0;
    double sum = 0;
    for (int i = 0; i < NODES; i++)
        for (int j = 0; j < NODES; j++)
            sum += q->w[i] * q->w[j] *
                   f(direction(c->z0 + q->x[i] * dz, c->p0 + q->x[j] * dp), payload);
    return sum * dz * dp;
}
static struct imp__sphere_cell quarter(const struct imp__sphere_cell *c, int k)
{
    const double zm = 0.5 * (c->z0 + c->z1), pm = 0.5 * (c->p0 + c->p1);
    return (struct imp__sphere_cell){.z0 = k & 1 ? zm : c->z0,
                                     .z1 = k & 1 ? c->z1 : zm,
                                     .p0 = k & 2 ? pm : c->p0,
                                     .p1 = k & 2 ? c->p1 : pm};
}
static double adaptive(const struct rule *rule, const struct imp__sphere_cell *c,
                       double whole, imp__sphere_fn *f, void *payload, double tolerance,
                       int depth)
{
    struct imp__sphere_cell q[4];
    double part[4], sum = 0;
    for (int k = 0; k < 4; k++) {
        q[k] = quarter(c, k);
        part[k] = rule_sum(rule, &q[k], f, payload);
        sum += part[k];
    }
    /* Wide cells are always cut: a narrow lobe must not hide between the nodes. */
    if (depth == 0 || (c->z1 - c->z0 < 0.13 && fabs(sum - whole) <= tolerance))
        return sum;
    sum = 0;
    for (int k = 0; k < 4; k++)
        sum += adaptive(rule, &q[k], part[k], f, payload, 0.5 * tolerance, depth - 1);
    return sum;
}

double imp__sphere_cell_integral(const struct imp__sphere_cell *c, imp__sphere_fn *f,
                                 void *payload, double tolerance, int depth)
{
    struct rule rule;
    imp__gauss_legendre(NODES, 0, 1, rule.x, rule.w);
    return adaptive(&rule, c, rule_sum(&rule, c, f, payload), f, payload, tolerance,
                    depth);
}

double imp__sphere_cell_integral_cut(const struct imp__sphere_cell *c, imp__sphere_fn *f,
                                     void *payload, double tolerance, int depth, int cuts)
{
    double sum = 0;
    if (cuts == 0) return imp__sphere_cell_integral(c, f, payload, tolerance, depth);
    for (int k = 0; k < 4; k++) {
        const struct imp__sphere_cell q = quarter(c, k);
        sum += imp__sphere_cell_integral_cut(&q, f, payload, 0.5 * tolerance, depth,
                                             cuts - 1);
    }
    return sum;
}

double imp__sphere_integral(imp__sphere_fn *f, void *payload, double lo, double hi,
                            double tolerance, int depth)
{
    enum { NZ = 16, NP = 32 };
    double sum = 0;
    for (int i = 0; i < NZ; i++)
        for (int j = 0; j < NP; j++) {
            const struct imp__sphere_cell c = {.z0 = lo + (hi - lo) * i / NZ,
                                               .z1 = lo + (hi - lo) * (i + 1) / NZ,
                                               .p0 = IMP_2PI * j / NP,
                                               .p1 = IMP_2PI * (j + 1) / NP};
            sum += imp__sphere_cell_integral(&c, f, payload, tolerance / 64, depth);
        }
    return sum;
}

/* ---- Histogram whose cells follow where draws fall -------------------------------- */

void imp__sphere_tree_init(struct imp__sphere_tree *t)
{
    t->n = 2;
    t->cell[0] = (struct imp__sphere_cell){-1, 0, 0, IMP_2PI, 0, 0};
    t->cell[1] = (struct imp__sphere_cell){0, 1, 0, IMP_2PI, 0, 0};
}
struct imp__sphere_cell *imp__sphere_tree_find(struct imp__sphere_tree *t, imp_v3 w)
{
    double phi = atan2(w[1], w[0]);
    if (phi < 0) phi += IMP_2PI;
    struct imp__sphere_cell *c = &t->cell[w[2] >= 0];
    while (c->child) {
        const double zm = 0.5 * (c->z0 + c->z1), pm = 0.5 * (c->p0 + c->p1);
        c = &t->cell[c->child + (w[2] >= zm) + 2 * (phi >= pm)];
    }
    return c;
}
void imp__sphere_tree_pilot(struct imp__sphere_tree *t, imp_v3 w, int limit)
{
    struct imp__sphere_cell *c = imp__sphere_tree_find(t, w);
    if (++c->count < limit || t->n + 4 > IMP_SPHERE_CELLS_MAX || c->z1 - c->z0 < 1e-4)
        return;
    c->child = t->n;
    for (int k = 0; k < 4; k++) t->cell[t->n++] = quarter(c, k);
}
void imp__sphere_tree_reset(struct imp__sphere_tree *t)
{
    for (int i = 0; i < t->n; i++) t->cell[i].count = 0;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * M of sobolev.h. The matrix inside is symmetric and positive definite with a condition
 * number of at most 1 + 12 (l/h)^2, so that plain conjugate gradients (Hestenes, Stiefel
 * 1952) take some l/h iterations a digit, each much cheaper than a ray a number. */
#include "sobolev.h"
#include <string.h>

enum { MOST_ITERATIONS = 2000 };

enum imp_status imp__sobolev_create(const imp_bend *b, const uint8_t *held, double length,
                                    struct imp__sobolev *out)
{
    *out = (struct imp__sobolev){.b = b, .held = held, .length = length};
    out->work = imp__alloc(b->ctx, 4 * b->field->n_theta + 1, sizeof *out->work);
    if (!out->work)
        return imp__error(b->ctx, IMP_E_NOMEM, "no memory for the metric of a fit");
    return IMP_OK;
}

void imp__sobolev_destroy(struct imp__sobolev *m)
{
    if (m->b) imp__release(m->b->ctx, m->work);
    *m = (struct imp__sobolev){0};
}

struct product {
    const struct imp__sobolev *m;
    const double *x;
    double *y;
};

/* y += (l/h)^2 D^T D x of the nodes of a grid; other fields have no neighbours. */
static void leaf(imp_field *f, size_t offset, void *payload)
{
    const struct product *p = payload;
    const uint32_t *number; /* of a tied grid: a node's index in the gradient */
    const struct imp__grid *g = imp__field_nodes(f, &number);
    if (!g) return;
    const int *m = g->nodes;
    const double *x = p->x + offset;
    double *y = p->y + offset;
    const size_t stride[3] = {1, (size_t)m[0], (size_t)m[0] * (size_t)m[1]};
    for (int axis = 0; axis < 3; axis++) {
        const double cells = p->m->length * g->inv_h[axis], weight = cells * cells;
        const size_t s = stride[axis];
        size_t at = 0;
        for (int k = 0; k < m[2]; k++)
            for (int j = 0; j < m[1]; j++)
                for (int i = 0; i < m[0]; i++, at++) {
                    if ((axis == 0 ? i : axis == 1 ? j : k) + 1 == m[axis]) continue;
                    const size_t i0 = number ? number[at] : at,
                                 i1 = number ? number[at + s] : at + s;
                    const double d = weight * (x[i1] - x[i0]);
                    y[i0] -= d, y[i1] += d;
                }
    }
}

/* y = M^-1 x; x is 0 where numbers are held. */
static void inverse(const struct imp__sobolev *m, const double *x, double *y)
{
    const size_t n = m->b->field->n_theta;
    struct product p = {m, x, y};
    memcpy(y, x, n * sizeof *y);
    imp__field_leaves(m->b->field, 0, leaf, &p);
    for (size_t i = 0; i < n; i++)
        if (m->held[i]) y[i] = 0;
}

static double dot(size_t n, const double *a, const double *b)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += a[i] * b[i];
    return sum;
}

void imp__sobolev_apply(const struct imp__sobolev *m, double *x)
{
    const size_t n = m->b->field->n_theta;
    double *r = m->work, *p = r + n, *q = p + n, *u = q + n;
    for (size_t i = 0; i < n; i++) {
        r[i] = p[i] = m->held[i] ? 0 : x[i];
        u[i] = 0;
    }
    double rho = dot(n, r, r);
    const double enough = 1e-20 * rho;
    for (int k = 0; k < MOST_ITERATIONS && rho > enough; k++) {
        inverse(m, p, q);
        const double a = rho / dot(n, p, q);
        for (size_t i = 0; i < n; i++) u[i] += a * p[i], r[i] -= a * q[i];
        const double next = dot(n, r, r), b = next / rho;
        for (size_t i = 0; i < n; i++) p[i] = r[i] + b * p[i];
        rho = next;
    }
    memcpy(x, u, n * sizeof *x);
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Smoothness of grids (docs/bent-rays.md 3.6): differences D of first or second order
 * along each axis, weight/2 sum D^2, or weight sum sqrt(D^2 + edge^2), which keeps
 * edges. */
#include "bend_problem.h"

struct job {
    const struct imp__smooth *s;
    double *gradient, value;
};

static void leaf(imp_field *f, size_t offset, void *payload)
{
    struct job *j = payload;
    const uint32_t *number; /* of a tied grid: a node's index in the gradient */
    const struct imp__grid *g = imp__field_nodes(f, &number);
    if (!g) return;
    const double weight = j->s->weight, edge = j->s->edge;
    const int order = j->s->order, *m = g->nodes;
    const double *c = g->base.theta;
    double *bar = j->gradient ? j->gradient + offset : NULL;
    const size_t stride[3] = {1, (size_t)m[0], (size_t)m[0] * (size_t)m[1]};
    for (int axis = 0; axis < 3; axis++) {
        const size_t s = stride[axis];
        size_t at = 0;
        for (int z = 0; z < m[2]; z++)
            for (int y = 0; y < m[1]; y++)
                for (int x = 0; x < m[0]; x++, at++) {
                    const int i = axis == 0 ? x : axis == 1 ? y : z;
                    if (i + order >= m[axis]) continue;
                    const double d = order == 1 ? c[at + s] - c[at]
                                                : c[at] - 2 * c[at + s] + c[at + 2 * s];
                    const double root = edge > 0 ? sqrt(d * d + edge * edge) : 1;
                    j->value += edge > 0 ? weight * root : weight / 2 * d * d;
                    if (!bar) continue;
                    const double r = weight * d / root;
                    const size_t i0 = number ? number[at] : at,
                                 i1 = number ? number[at + s] : at + s;
                    if (order == 1) {
                        bar[i0] -= r, bar[i1] += r;
                    } else {
                        const size_t i2 = number ? number[at + 2 * s] : at + 2 * s;
                        bar[i0] += r, bar[i1] -= 2 * r, bar[i2] += r;
                    }
                }
    }
}

double imp__smooth_value(const imp_bend *b, double *gradient)
{
    double sum = 0;
    for (size_t i = 0; i < b->n_smooths; i++) {
        struct job j = {&b->smooths[i], gradient, 0};
        imp__field_leaves(b->field, 0, leaf, &j);
        sum += j.value;
    }
    return sum;
}

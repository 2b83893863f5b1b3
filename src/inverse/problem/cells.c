/* SPDX-License-Identifier: Apache-2.0
 *
 * Interpolation P from coarse to fine grids, its transpose, and the average over cells
 * (cells.h). */
#include "cells.h"
#include <math.h>
#include <string.h>

struct imp__cells imp__cells_of(const struct imp_param_info *p)
{
    struct imp__cells c = {{1, 1, p->count}, 1};
    if (p->layers > 0 && p->flags & IMP_PARAM_COLOR)
        c = (struct imp__cells){{p->layers, p->dims[0] / p->layers, p->dims[1]}, 3};
    else if (p->layers > 0)
        c = (struct imp__cells){{p->dims[0], p->dims[1], p->dims[2]}, 1};
    else if (imp__cells_are_many(p))
        c = (struct imp__cells){{1, p->dims[0], p->dims[1]},
                                p->n_dims > 2 ? p->dims[2] : 1};
    return c;
}

bool imp__cells_are_many(const struct imp_param_info *p)
{
    return p->layers > 0 || (p->n_dims >= 2 && !(p->flags & IMP_PARAM_LIST));
}

struct imp__cells imp__cells_coarse(const struct imp__cells *fine, int level)
{
    struct imp__cells c = *fine;
    for (int a = 0; a < 3; a++) c.n[a] = (fine->n[a] + ((size_t)1 << level) - 1) >> level;
    return c;
}

size_t imp__cells_count(const struct imp__cells *c)
{
    return c->n[0] * c->n[1] * c->n[2] * c->channels;
}

/* The two coarse cells between whose centres that of fine cell i lies, with the weights
 * of linear interpolation; n coarse cells along the axis. */
struct between {
    size_t at[2];
    double weight[2];
};
static struct between between(size_t i, size_t n, int level)
{
    const double u = ((double)i + .5) / (double)((size_t)1 << level) - .5;
    const double below = floor(u), last = (double)n - 1;
    return (struct between){
        {(size_t)fmin(fmax(below, 0), last), (size_t)fmin(fmax(below + 1, 0), last)},
        {1 - (u - below), u - below}};
}

/* Trilinear interpolation P from the coarse grid to the fine one. up: to += P from, else
 * the transpose, to += P^T from. */
static void visit(const struct imp__cells *fine, int level, const double *from,
                  double *to, bool up)
{
    const struct imp__cells coarse = imp__cells_coarse(fine, level);
    size_t here = 0;
    for (size_t z = 0; z < fine->n[0]; z++)
        for (size_t y = 0; y < fine->n[1]; y++)
            for (size_t x = 0; x < fine->n[2]; x++, here += fine->channels) {
                const struct between b[3] = {between(z, coarse.n[0], level),
                                             between(y, coarse.n[1], level),
                                             between(x, coarse.n[2], level)};
                for (int k = 0; k < 8; k++) {
                    const int i = k >> 2 & 1, j = k >> 1 & 1, l = k & 1;
                    const double w = b[0].weight[i] * b[1].weight[j] * b[2].weight[l];
                    const size_t there =
                        ((b[0].at[i] * coarse.n[1] + b[1].at[j]) * coarse.n[2] +
                         b[2].at[l]) *
                        fine->channels;
                    for (size_t c = 0; c < fine->channels; c++)
                        if (up) to[here + c] += w * from[there + c];
                        else to[there + c] += w * from[here + c];
                }
            }
}

void imp__cells_prolong(const struct imp__cells *fine, int level, const double *c,
                        double *x)
{
    memset(x, 0, imp__cells_count(fine) * sizeof *x);
    visit(fine, level, c, x, true);
}
void imp__cells_restrict(const struct imp__cells *fine, int level, const double *x,
                         double *c)
{
    const struct imp__cells coarse = imp__cells_coarse(fine, level);
    memset(c, 0, imp__cells_count(&coarse) * sizeof *c);
    visit(fine, level, x, c, false);
}

void imp__cells_average(const struct imp__cells *fine, int level, const double *x,
                        double *c)
{
    const struct imp__cells coarse = imp__cells_coarse(fine, level);
    const size_t side = (size_t)1 << level;
    for (size_t z = 0; z < coarse.n[0]; z++)
        for (size_t y = 0; y < coarse.n[1]; y++)
            for (size_t u = 0; u < coarse.n[2]; u++)
                for (size_t k = 0; k < fine->channels; k++) {
                    double sum = 0, n = 0;
                    for (size_t i = z * side; i < (z + 1) * side && i < fine->n[0]; i++)
                        for (size_t j = y * side; j < (y + 1) * side && j < fine->n[1];
                             j++)
                            for (size_t l = u * side;
                                 l < (u + 1) * side && l < fine->n[2]; l++, n++)
                                sum += x[((i * fine->n[1] + j) * fine->n[2] + l) *
                                             fine->channels +
                                         k];
                    *c++ = sum / n;
                }
}

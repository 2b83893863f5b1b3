/* SPDX-License-Identifier: Apache-2.0
 *
 * Regularisers: exact functions of x, added to the estimated data term. */
#include "base/arguments.h"
#include "cells.h"
#include "match.h"
#include "problem.h"
#include <math.h>
#include <string.h>

/* Texels of a picture, or the samples of a spectrum. */
static bool has_neighbours(const struct imp_param_info *info)
{
    return imp__cells_are_many(info) || info->wavelengths_nm;
}

static enum imp_status add(imp_problem *p, const char *glob, double weight, int kind,
                           bool from_here)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, glob, "glob");
    const struct imp_scene *s = p->scene;
    struct imp__regulariser r = {.kind = kind, .weight = weight};
    size_t met = 0, usable = 0;
    const char *list = NULL; /* name of one that is met */

    if (!*glob) return imp__error(p->ctx, IMP_E_ARG, "no parameter is named");
    if (!(weight >= 0) || !isfinite(weight))
        return imp__error(p->ctx, IMP_E_ARG, "weight %g must be finite and >= 0", weight);
    r.on = imp__alloc(p->ctx, imp_max(s->n_params, (size_t)1), 1);
    if (from_here)
        r.origin = imp__alloc(p->ctx, imp_max(s->n_theta, (size_t)1), sizeof(double));
    if (!r.on || (from_here && !r.origin))
        IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for a regulariser"));
    for (size_t k = 0; k < s->n_params; k++) {
        if (!imp__glob(glob, s->params[k].info.name)) continue;
        met++;
        if (s->params[k].info.flags & IMP_PARAM_LIST) list = s->params[k].info.name;
        if (kind == IMP_SMOOTHNESS && !has_neighbours(&s->params[k].info)) continue;
        usable++;
        r.on[k] = 1;
    }
    if (!met) IMP_TRY(imp__error(p->ctx, IMP_E_ARG, "no parameter matches '%s'", glob));
    if (!usable && list)
        IMP_TRY(imp__error(p->ctx, IMP_E_ARG,
                           "'%s' is a list of numbers without neighbours: smoothness "
                           "needs a texture or a spectrum",
                           list));
    if (!usable)
        IMP_TRY(
            imp__error(p->ctx, IMP_E_ARG,
                       "smoothness needs a texture or a spectrum: nothing that matches "
                       "'%s' has neighbours",
                       glob));
    if (from_here) imp_scene_get_theta(s, r.origin);

    struct imp__regulariser *grown =
        imp__grow(p->ctx, p->regularisers, &p->cap_regularisers, p->n_regularisers + 1,
                  sizeof *grown);
    if (!grown) IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for a regulariser"));
    p->regularisers = grown;
    p->regularisers[p->n_regularisers++] = r;
    return IMP_OK;
out:
    imp__release(p->ctx, r.on);
    imp__release(p->ctx, r.origin);
    return st;
}

enum imp_status imp_problem_add_tikhonov(imp_problem *p, const char *glob, double weight,
                                         bool from_here)
{
    return add(p, glob, weight, IMP_TIKHONOV, from_here);
}

enum imp_status imp_problem_add_smoothness(imp_problem *p, const char *glob,
                                           double weight)
{
    return add(p, glob, weight, IMP_SMOOTHNESS, false);
}

/* Numbers of a block: x, or where that is NULL those that the scene has now. */
struct numbers {
    const double *x;
    const struct imp_problem *problem;
    const struct imp__block *block;
};
static double at(const struct numbers *v, size_t e)
{
    return v->x ? v->x[e] : imp__block_get(v->problem, v->block, e);
}

/* x0 of element e: 0 without `origin` [n_theta], else its value there; a common factor
 * starts at 1. */
static double origin_of(const struct numbers *v, const double *origin, size_t e)
{
    const struct imp__block *b = v->block;
    if (!origin) return 0;
    if (imp__block_factor(v->problem, b)) return b->log ? 0 : 1;
    const double v0 = origin[v->problem->scene->params[b->param].info.offset + e];
    return b->log ? imp_clamp(log(v0), b->lo, b->hi) : v0;
}

/* 1/2 w sum (x - x0)^2 */
static double tikhonov(double w, const struct numbers *v, const double *origin, double *g)
{
    double sum = 0;
    for (size_t e = 0; e < v->block->count; e++) {
        const double d = at(v, e) - origin_of(v, origin, e);
        sum += d * d;
        if (g) g[e] += w * d;
    }
    return 0.5 * w * sum;
}

/* 1/2 w sum over neighbours of (x_q - x_p)^2, along the axes of [z][y][x][channels] */
static double smoothness(double weight, const struct imp__cells *n,
                         const struct numbers *v, double *g)
{
    const size_t c = n->channels, rows = n->n[0] * n->n[1];
    double sum = 0;
    for (size_t i = 0; i < rows; i++)
        for (size_t j = 0; j < n->n[2]; j++)
            for (size_t k = 0; k < c; k++) {
                const size_t here = (i * n->n[2] + j) * c + k;
                const size_t next[3] = {here + c, here + n->n[2] * c,
                                        here + n->n[1] * n->n[2] * c};
                const bool inside[3] = {j + 1 < n->n[2], (i + 1) % n->n[1] != 0,
                                        i + n->n[1] < rows};
                for (int a = 0; a < 3; a++) {
                    if (!inside[a]) continue;
                    const double d = at(v, next[a]) - at(v, here);
                    sum += d * d;
                    if (!g) continue;
                    g[next[a]] += weight * d;
                    g[here] -= weight * d;
                }
            }
    return 0.5 * weight * sum;
}

/* Numbers that are held have no derivatives. */
static void held_clear(const struct imp_problem *p, double *d)
{
    for (size_t k = 0; p->held && k < p->n_blocks; k++)
        for (size_t e = 0; e < p->blocks[k].count; e++)
            if (imp__block_held(p, &p->blocks[k], e)) d[p->blocks[k].first + e] = 0;
}

double imp__regularise(const struct imp_problem *p, const double *x, double *gradient)
{
    double value = 0;
    for (size_t i = 0; i < p->n_regularisers; i++) {
        const struct imp__regulariser *r = &p->regularisers[i];
        for (size_t k = 0; k < p->n_blocks; k++) {
            const struct imp__block *b = &p->blocks[k];
            const bool factor = imp__block_factor(p, b);
            if (!r->on[b->param]) continue;
            const struct numbers v = {x ? x + b->first : NULL, p, b};
            double *g = gradient ? gradient + b->first : NULL;
            if (r->kind == IMP_TIKHONOV) value += tikhonov(r->weight, &v, r->origin, g);
            else if (!factor) {
                const struct imp__cells cells =
                    imp__cells_of(&p->scene->params[b->param].info);
                value += smoothness(r->weight, &cells, &v, g);
            }
        }
    }
    if (gradient && p->n_regularisers > 0) held_clear(p, gradient);
    return value;
}

/* Adds the curvature of smoothness: a weight for each neighbour. */
static void neighbours_add(double weight, const struct imp__cells *n, double *d)
{
    const size_t c = n->channels, rows = n->n[0] * n->n[1];
    for (size_t i = 0; i < rows; i++)
        for (size_t j = 0; j < n->n[2]; j++) {
            const size_t y = i % n->n[1], z = i / n->n[1];
            const int count = (j > 0) + (j + 1 < n->n[2]) + (y > 0) + (y + 1 < n->n[1]) +
                              (z > 0) + (z + 1 < n->n[0]);
            for (size_t k = 0; k < c; k++) d[(i * n->n[2] + j) * c + k] += weight * count;
        }
}

void imp__regularise_diagonal(const struct imp_problem *p, double *d)
{
    for (size_t i = 0; i < p->n_regularisers; i++) {
        const struct imp__regulariser *r = &p->regularisers[i];
        for (size_t k = 0; k < p->n_blocks; k++) {
            const struct imp__block *b = &p->blocks[k];
            if (!r->on[b->param]) continue;
            if (r->kind == IMP_TIKHONOV) {
                for (size_t e = 0; e < b->count; e++) d[b->first + e] += r->weight;
            } else if (!imp__block_factor(p, b)) {
                const struct imp__cells cells =
                    imp__cells_of(&p->scene->params[b->param].info);
                neighbours_add(r->weight, &cells, d + b->first);
            }
        }
    }
    if (p->n_regularisers > 0) held_clear(p, d);
}

/* They are quadratic: column k is a difference of gradients, without error. */
enum imp_status imp__regularise_second(const struct imp_problem *p, double *H)
{
    const size_t n = p->n;
    double *x = imp__alloc(p->ctx, 2 * n, sizeof *x);
    if (!x) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for regularisers");
    double *g0 = x + n;
    memset(H, 0, n * n * sizeof *H);
    imp__regularise(p, x, g0);
    for (size_t k = 0; k < n; k++) {
        double *row = H + k * n;
        x[k] = 1;
        imp__regularise(p, x, row);
        x[k] = 0;
        for (size_t l = 0; l < n; l++) row[l] -= g0[l];
    }
    imp__release(p->ctx, x);
    return IMP_OK;
}

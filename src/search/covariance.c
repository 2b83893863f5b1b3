/* SPDX-License-Identifier: Apache-2.0
 *
 * With G the inverse of H = J^T W J (+ prior) in the directions that are determined,
 *
 *     measurement   G (J^T W Sigma W J) G      noise of the pictures
 *     Monte Carlo   G Cov(g) G                 noise of our own estimate of g
 *     prior         kappa G H_prior G          of directions that it alone determines
 *     undetermined  v v^T                      of each other direction v, of the variables' size
 *
 * where kappa is the variance of the pictures in units of 1/weight: J/kappa is then the
 * negative logarithm of the posterior density. What the pictures determine takes no part
 * of its interval from a prior.
 *
 * The error of the point x - G g, with g from random numbers that x does not depend on,
 * has the sum of these covariances, wherever in its neighbourhood x was. */
#include "covariance.h"
#include "answer.h"
#include "interval_row.h"
#include <math.h>
#include <string.h>

#define HIDDEN 0.1  /* of its size */
#define STEP   1e-2 /* of its scale: a step that far is told */

void imp__uncertainty_destroy(imp_context *ctx, struct imp__uncertainty *u)
{
    if (!u) return;
    imp__release(ctx, u->x);
    imp__release(ctx, u->measurement);
    imp__release(ctx, u->monte_carlo);
    imp__release(ctx, u->loosest);
    imp__release(ctx, u->G);
    *u = (struct imp__uncertainty){0};
}

/* By how much the loss at x is above its minimum: for our own noise over that for the data's. Before what is not
 * determined is added. */
static double own_part(size_t n, const double *H, const struct imp__uncertainty *u)
{
    double own = 0, data = 0;
    for (size_t k = 0; k < n; k++)
        for (size_t l = 0; l < n; l++) {
            own += H[k * n + l] * u->monte_carlo[l * n + k];
            data += H[k * n + l] * u->measurement[l * n + k];
        }
    return data > 0 && own >= 0 ? own / data : NAN;
}

static enum imp_status uncertainty_create(imp_context *ctx, size_t n,
                                          struct imp__uncertainty *u)
{
    u->n = n;
    u->x = imp__alloc(ctx, n, sizeof *u->x);
    u->loosest = imp__alloc(ctx, n, sizeof *u->loosest);
    u->measurement = imp__alloc(ctx, n * n, sizeof *u->measurement);
    u->monte_carlo = imp__alloc(ctx, n * n, sizeof *u->monte_carlo);
    u->G = imp__alloc(ctx, n * n, sizeof *u->G);
    return u->x && u->loosest && u->measurement && u->monte_carlo && u->G
               ? IMP_OK
               : imp__error(ctx, IMP_E_NOMEM, "no memory for a covariance");
}

static void square_add(size_t n, double factor, const double *v, double *sum)
{
    for (size_t k = 0; k < n; k++)
        for (size_t l = 0; l < n; l++) sum[k * n + l] += factor * v[k] * v[l];
}

/* Directions that are not determined stay where the search began, which is an error of all variables that
 * take part in them. They are known as well as the sizes of their variables, as in a plan. */
static void loose_add(const struct imp__sampled *s, const struct imp__directions *d,
                      double *v, double *measurement)
{
    const size_t n = s->n;
    for (size_t j = 0; j < d->m && !d->held; j++) {
        if (!d->loose[j]) continue;
        memset(v, 0, n * sizeof *v);
        for (size_t p = 0; p < d->m; p++)
            v[d->index[p]] = s->scale[d->index[p]] * d->vectors[j * d->m + p];
        square_add(n, 1, v, measurement);
    }
}

/* Eigenvalues are in units of kappa over the size of a direction squared. */
static bool is_hidden(const struct imp__directions *d, double kappa)
{
    bool hidden = false;
    for (size_t j = 0; j < d->m; j++)
        hidden |= d->loose[j] && d->values[j] + 2 * d->se[j] > kappa / (HIDDEN * HIDDEN);
    return hidden;
}

/* What else is not known of the variables that move. A step that was not taken is an error of
 * all that it would have moved. A variable that is held at a bound may be inside, and would take
 * the others along by -G H: with w the way from the bound inwards to where it wants to be and
 * s its error, the mean square of the way that it may be inside is that of N(w, s^2) beyond 0. */
static void unknown_add(const struct imp__goal *goal, const struct imp__sampled *s,
                        struct imp__answer *a, struct imp__uncertainty *u)
{
    const size_t n = s->n;
    double *v = a->step;
    square_add(n, 1, v, u->measurement);
    loose_add(s, &a->free, v, u->measurement);
    for (size_t b = 0; b < n; b++) {
        const int wall = imp__at_bound(goal, u->x, b);
        const double se =
            imp__interval_se(&a->every, n, b, a->measurement, a->monte_carlo);
        if (!a->fixed[b] || !wall || !(se > 0)) continue;
        const double inwards = (wall < 0 ? 1 : -1) * (a->wish[b] - u->x[b]);
        for (size_t k = 0; k < n; k++) {
            v[k] = 0;
            for (size_t l = 0; l < n; l++)
                v[k] += a->free.G[k * n + l] * s->mean.H[l * n + b];
        }
        square_add(n, se * se * imp__beyond_square(inwards / se), v, u->measurement);
    }
}

enum imp_status imp__covariance(const struct imp__goal *goal, const double *x,
                                const struct imp__rounds *rounds,
                                struct imp_fit_variable *variables,
                                struct imp__uncertainty *out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = goal->ctx;
    const size_t n = goal->n;
    struct imp__sampled s = {.ctx = ctx, .n = n};
    struct imp__answer a = {0};
    struct imp__uncertainty u = {0};

    *out = (struct imp__uncertainty){0};
    IMP_TRY(imp__answer_create(ctx, n, &a));
    memcpy(a.from, x, n * sizeof *x);
    IMP_TRY(uncertainty_create(ctx, n, &u));
    IMP_TRY(imp__sampled_create(goal, x, &s));
    IMP_TRY(imp__answer_here(goal, rounds, &s, &a, &u));
    if (!u.found) goto out;
    u.rounds = s.rounds;
    u.loss = imp__sampled_loss(&s, a.from, u.x, a.free.G, a.part);
    u.own_part = own_part(n, s.mean.H, &u);
    unknown_add(goal, &s, &a, &u);

    memcpy(u.G, a.free.G, n * n * sizeof *u.G);
    u.condition = a.every.values[0] > 0 && !a.every.loose[0]
                      ? a.every.values[n - 1] / a.every.values[0]
                      : INFINITY;
    u.n_loose = (int)a.every.n_loose;
    u.hidden = is_hidden(&a.every, a.kappa);
    memcpy(u.loosest, a.every.vectors, n * sizeof *u.loosest);
    for (size_t k = 0; k < n; k++) {
        struct imp_fit_variable *v = &variables[k];
        v->value = u.x[k];
        const bool held = imp__goal_held(goal, k);
        v->at_bound = held ? 0 : imp__at_bound(goal, u.x, k);
        v->determined = !imp__is_loose(a.fixed[k] ? &a.every : &a.free, k);
        if (held) imp__interval_free(goal, k, 0, v);
        else if (a.fixed[k])
            imp__interval_bound(
                goal, k, a.wish[k],
                imp__interval_se(&a.every, n, k, a.measurement, a.monte_carlo), v);
        else
            imp__interval_free(
                goal, k, imp__interval_se(&a.free, n, k, u.measurement, u.monte_carlo),
                v);
        const double away = fabs(u.x[k] - a.from[k]), step = away / v->se;
        if (rounds->at_newton || held || a.fixed[k] || !(away > STEP * s.scale[k]) ||
            !(step > u.step))
            continue;
        u.step = step;
        u.step_of = k;
    }
    *out = u;
    u = (struct imp__uncertainty){.found = true};
out:
    if (st == IMP_E_NUMERIC && rounds->at_newton && !u.found) st = IMP_OK;
    imp__uncertainty_destroy(ctx, &u);
    imp__answer_destroy(ctx, &a);
    imp__sampled_destroy(&s);
    return st;
}

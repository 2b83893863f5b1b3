/* SPDX-License-Identifier: Apache-2.0
 *
 * With G the inverse of H = J^T W J (+ prior) in the directions that are determined,
 *
 *     measurement   G (J^T W Sigma W J) G      noise of the pictures
 *     Monte Carlo   G Cov(g) G                 noise of our own estimate of g
 *     prior         kappa G H_prior G          of directions that it alone determines
 *
 * where kappa is the variance of the pictures in units of 1/weight: J/kappa is then the
 * negative logarithm of the posterior density. What the pictures determine takes no part
 * of its interval from a prior.
 *
 * The error of the point x - G g, with g from random numbers that x does not depend on,
 * has the sum of these covariances, wherever in its neighbourhood x was. */
#include "covariance.h"
#include "directions.h"
#include "excess.h"
#include <math.h>
#include <string.h>

#define Z_TWO_SIDED 1.959963984540054
#define Z_ONE_SIDED 1.6448536269514722
#define SEED_BASE   0x40000000 /* iteration numbers no search reaches */

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

static enum imp_status no_memory(imp_context *ctx)
{
    return imp__error(ctx, IMP_E_NOMEM, "no memory for a covariance");
}

/* ---- Replicates ---------------------------------------------------------------- */

static void sampled_destroy(struct imp__sampled *s)
{
    imp__normal_destroy(s->ctx, &s->mean);
    imp__release(s->ctx, s->H_each);
    imp__release(s->ctx, s->scale);
}

static enum imp_status sampled_create(const struct imp__goal *goal, const double *x,
                                      struct imp__sampled *s)
{
    const size_t n = s->n;
    const enum imp_status st = imp__normal_create(s->ctx, n, &s->mean);
    if (st != IMP_OK) return st;
    s->H_each = imp__alloc(s->ctx, (size_t)s->replicates * n * n, sizeof *s->H_each);
    s->scale = imp__alloc(s->ctx, n, sizeof *s->scale);
    if (!s->H_each || !s->scale) return no_memory(s->ctx);
    for (size_t k = 0; k < n; k++) s->scale[k] = fmax(fabs(x[k]), goal->scale[k]);
    return IMP_OK;
}

static enum imp_status sample(const struct imp__goal *goal, const double *x,
                              struct imp__sampled *s)
{
    enum imp_status st = IMP_OK;
    const size_t n = s->n, nn = n * n;
    const double r = 1.0 / s->replicates;
    struct imp__normal one = {0}, *sum = &s->mean;

    IMP_TRY(imp__normal_create(s->ctx, n, &one));
    for (int b = 0; b < s->replicates; b++) {
        IMP_TRY(
            goal->normal(x, imp__search_seed(goal, SEED_BASE, b), &one, goal->payload));
        for (size_t i = 0; i < nn; i++) {
            s->H_each[(size_t)b * nn + i] = one.H[i] - one.H_prior[i];
            sum->H[i] += r * one.H[i];
            sum->H_prior[i] += r * one.H_prior[i];
            sum->H_meas[i] += r * one.H_meas[i];
            sum->cov_g[i] += r * r * one.cov_g[i]; /* of the mean of independent ones */
            sum->cov_excess[i] += r * r * one.cov_excess[i];
        }
        for (size_t k = 0; k < n; k++) sum->g[k] += r * one.g[k];
        sum->chi2 += r * one.chi2;
        sum->n_residuals = one.n_residuals;
        sum->noise_known = one.noise_known;
    }
    IMP_TRY(imp__excess_take(s->ctx, n, sum->cov_g, sum->cov_excess));
out:
    imp__normal_destroy(s->ctx, &one);
    return st;
}

/* out = G C G^T */
static enum imp_status sandwich(imp_context *ctx, size_t n, const double *G,
                                const double *C, double *out)
{
    double *GC = imp__alloc(ctx, n * n, sizeof *GC);
    if (!GC) return no_memory(ctx);
    for (size_t k = 0; k < n; k++)
        for (size_t q = 0; q < n; q++)
            for (size_t l = 0; l < n; l++) GC[k * n + l] += G[k * n + q] * C[q * n + l];
    for (size_t k = 0; k < n; k++)
        for (size_t l = 0; l < n; l++) {
            double sum = 0;
            for (size_t q = 0; q < n; q++) sum += GC[k * n + q] * G[l * n + q];
            out[k * n + l] = sum;
        }
    imp__release(ctx, GC);
    return IMP_OK;
}

/* Estimate of s^2 where the data have unknown noise of variance s^2/w: chi2_min/(M - m),
 * with m determined variables and chi2_min the value at the minimum, g^T G g below that
 * at x. The part of g^T G g that is our own noise is subtracted from it first. */
static double noise_scale(const struct imp__sampled *s, const struct imp__directions *a)
{
    const size_t n = s->n;
    const struct imp__normal *e = &s->mean;
    double q = 0;
    for (size_t k = 0; k < n; k++)
        for (size_t l = 0; l < n; l++)
            q += a->G[k * n + l] * (e->g[k] * e->g[l] - e->cov_g[k * n + l]);
    const double freedom = e->n_residuals - (double)(a->m - a->n_loose);
    return freedom > 0 ? fmax((e->chi2 - fmax(q, 0)) / freedom, 0) : 0;
}

/* se NAN: there is no interval. */
static void interval_free(const struct imp__goal *goal, size_t k, double se,
                          struct imp_fit_variable *v)
{
    const bool open = isnan(se);
    v->se = se;
    v->lo95 = open ? NAN : imp__into_bounds(goal, k, v->value - Z_TWO_SIDED * se);
    v->hi95 = open ? NAN : imp__into_bounds(goal, k, v->value + Z_TWO_SIDED * se);
}

/* At a bound the interval is one-sided: from the bound to the 95 % limit about `u`, the
 * Newton point without bounds. */
static void interval_bound(const struct imp__goal *goal, size_t k, double u, double se,
                           struct imp_fit_variable *v)
{
    interval_free(goal, k, se, v);
    if (isnan(se)) return;
    if (v->at_bound < 0) {
        v->lo95 = goal->lo[k];
        v->hi95 = imp__into_bounds(goal, k, fmax(u, goal->lo[k]) + Z_ONE_SIDED * se);
    } else {
        v->hi95 = goal->hi[k];
        v->lo95 = imp__into_bounds(goal, k, fmin(u, goal->hi[k]) - Z_ONE_SIDED * se);
    }
}

static enum imp_status newton_point(const struct imp__sampled *s, const double *x,
                                    const struct imp__directions *a, double *out)
{
    const size_t n = s->n;
    for (size_t k = 0; k < n; k++) {
        double step = 0;
        for (size_t l = 0; l < n; l++) step += a->G[k * n + l] * s->mean.g[l];
        out[k] = x[k] - step;
        if (!isfinite(out[k]))
            return imp__error(s->ctx, IMP_E_NUMERIC, "no Newton point");
    }
    return IMP_OK;
}

/* Is q = g^T G g no more than noise of g alone makes it? Its mean is then tr(G C) and its
 * variance 2 tr((G C)^2), C the covariance of g. */
static bool within_noise(const struct imp__sampled *s, const struct imp__directions *a)
{
    const size_t n = s->n;
    const double *g = s->mean.g, *C = s->mean.cov_g;
    double q = 0, mean = 0, half_var = 0;
    for (size_t k = 0; k < n; k++)
        for (size_t l = 0; l < n; l++) {
            double kl = 0, lk = 0; /* of G C */
            for (size_t p = 0; p < n; p++) {
                kl += a->G[k * n + p] * C[p * n + l];
                lk += a->G[l * n + p] * C[p * n + k];
            }
            q += g[k] * a->G[k * n + l] * g[l];
            mean += k == l ? kl : 0;
            half_var += kl * lk;
        }
    return q <= mean + 2 * sqrt(2 * half_var);
}

/* Is the Newton point worth going to? A model that fails at x (not converged, far outside
 * its range) must not throw away what the search found. */
static enum imp_status accept(const struct imp__goal *goal, const double *x,
                              double *point, bool *yes)
{
    struct imp_estimate old, new;
    const uint64_t seed = imp__search_seed(goal, SEED_BASE, 63);
    enum imp_status st = IMP_OK;
    for (size_t k = 0; k < goal->n; k++) point[k] = imp__into_bounds(goal, k, point[k]);
    IMP_TRY(goal->eval(x, seed, &old, NULL, NULL, goal->payload));
    IMP_TRY(goal->eval(point, seed, &new, NULL, NULL, goal->payload));
    *yes = new.value <= old.value + 2 * sqrt(old.se * old.se + new.se *new.se);
out:
    return st;
}

/* Newton's point over the variables that are free to move. `fixed` [n]: variables that
 * the gradient presses against a bound, or that the step would push over theirs; the step
 * is then computed again without them. */
static enum imp_status newton_free(const struct imp__goal *goal,
                                   const struct imp__sampled *s, const double *x,
                                   bool *fixed, struct imp__directions *free,
                                   double *point)
{
    enum imp_status st = IMP_OK;
    for (size_t k = 0; k < s->n; k++) {
        const int wall = imp__at_bound(goal, x, k);
        const double g = s->mean.g[k];
        fixed[k] = (wall < 0 && g >= 0) || (wall > 0 && g <= 0);
    }
    for (bool more = true; more;) { /* at most n times: each fixes one more */
        imp__directions_destroy(s->ctx, free);
        IMP_TRY(imp__directions_find(s, fixed, free));
        IMP_TRY(newton_point(s, x, free, point));
        more = false;
        for (size_t k = 0; k < s->n; k++)
            if (!fixed[k] && (point[k] < goal->lo[k] || point[k] > goal->hi[k]) &&
                imp__at_bound(goal, x, k))
                fixed[k] = more = true;
    }
out:
    return st;
}

/* Standard error of variable k from the two covariances [n][n]; NAN: nothing determines
 * it. */
static double standard_error(const struct imp__directions *a, size_t n, size_t k,
                             const double *measurement, const double *monte_carlo)
{
    const size_t d = k * n + k;
    if (imp__is_loose(a, k) && !a->held) return NAN;
    return sqrt(fmax(measurement[d], 0) + fmax(monte_carlo[d], 0));
}

/* Variance of the data in units of 1/weight, where their noise is known: the ratio of the
 * traces of D H_meas D and D H_data D, which the best determined directions dominate. */
static double noise_ratio(const struct imp__sampled *s)
{
    double noise = 0, data = 0;
    for (size_t k = 0; k < s->n; k++) {
        const size_t d = k * s->n + k;
        const double square = s->scale[k] * s->scale[k];
        noise += square * s->mean.H_meas[d];
        data += square * (s->mean.H[d] - s->mean.H_prior[d]);
    }
    return data > 0 ? fmax(noise / data, 0) : 0;
}

/* measurement += kappa G H_prior G of directions that the prior alone determines. */
static enum imp_status prior_add(const struct imp__sampled *s,
                                 const struct imp__directions *a, double kappa,
                                 double *measurement)
{
    if (!a->held) return IMP_OK;
    const size_t nn = s->n * s->n;
    double *part = imp__alloc(s->ctx, nn, sizeof *part);
    if (!part) return no_memory(s->ctx);
    const enum imp_status st = sandwich(s->ctx, s->n, a->G, s->mean.H_prior, part);
    for (size_t i = 0; st == IMP_OK && i < nn; i++) measurement[i] += kappa * part[i];
    imp__release(s->ctx, part);
    return st;
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
               : no_memory(ctx);
}

enum imp_status imp__covariance(const struct imp__goal *goal, const double *x,
                                int replicates, double share,
                                struct imp_fit_variable *variables,
                                struct imp__uncertainty *out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = goal->ctx;
    const size_t n = goal->n;
    struct imp__sampled s = {.ctx = ctx, .n = n, .replicates = replicates};
    struct imp__directions every = {0}, free = {0};
    struct imp__uncertainty u = {0};
    bool *fixed = imp__alloc(ctx, n, sizeof *fixed), go = false;
    double *wish = imp__alloc(ctx, n + 2 * n * n, sizeof *wish); /* without the bounds */

    if (!fixed || !wish) IMP_TRY(no_memory(ctx));
    double *measurement = wish + n, *monte_carlo = measurement + n * n;
    IMP_TRY(uncertainty_create(ctx, n, &u));
    IMP_TRY(sampled_create(goal, x, &s));
    IMP_TRY(sample(goal, x, &s));

    /* All variables: for the condition, and for those that press against a bound. */
    IMP_TRY(imp__directions_find(&s, NULL, &every));
    IMP_TRY(newton_point(&s, x, &every, wish));
    IMP_TRY(newton_free(goal, &s, x, fixed, &free, u.x));
    if (share < 1 && within_noise(&s, &free))
        for (size_t k = 0; k < n; k++) u.x[k] = x[k] + share * (u.x[k] - x[k]);
    IMP_TRY(accept(goal, x, u.x, &go));
    if (!go) memcpy(u.x, x, n * sizeof *x);

    const double kappa = s.mean.noise_known ? noise_ratio(&s) : noise_scale(&s, &free);
    double *noise = s.mean.H_meas;
    if (!s.mean.noise_known) {
        u.noise_scale = kappa;
        for (size_t i = 0; i < n * n; i++)
            noise[i] = u.noise_scale * (s.mean.H[i] - s.mean.H_prior[i]);
    }
    IMP_TRY(sandwich(ctx, n, free.G, noise, u.measurement));
    IMP_TRY(sandwich(ctx, n, free.G, s.mean.cov_g, u.monte_carlo));
    IMP_TRY(sandwich(ctx, n, every.G, noise, measurement));
    IMP_TRY(sandwich(ctx, n, every.G, s.mean.cov_g, monte_carlo));
    IMP_TRY(prior_add(&s, &free, kappa, u.measurement));
    IMP_TRY(prior_add(&s, &every, kappa, measurement));

    memcpy(u.G, free.G, n * n * sizeof *u.G);
    u.condition = every.values[0] > 0 && !every.loose[0]
                      ? every.values[n - 1] / every.values[0]
                      : INFINITY;
    u.n_loose = (int)every.n_loose;
    memcpy(u.loosest, every.vectors, n * sizeof *u.loosest);
    for (size_t k = 0; k < n; k++) {
        struct imp_fit_variable *v = &variables[k];
        v->value = u.x[k];
        v->at_bound = imp__at_bound(goal, u.x, k);
        v->determined = !imp__is_loose(fixed[k] ? &every : &free, k);
        if (fixed[k])
            interval_bound(goal, k, wish[k],
                           standard_error(&every, n, k, measurement, monte_carlo), v);
        else
            interval_free(goal, k,
                          standard_error(&free, n, k, u.measurement, u.monte_carlo), v);
    }
    *out = u;
    u = (struct imp__uncertainty){0};
out:
    imp__uncertainty_destroy(ctx, &u);
    imp__directions_destroy(ctx, &every);
    imp__directions_destroy(ctx, &free);
    sampled_destroy(&s);
    imp__release(ctx, fixed);
    imp__release(ctx, wish);
    return st;
}

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
#include "interval_row.h"
#include "sampled.h"
#include <float.h>
#include <math.h>
#include <string.h>

#define SEED_BASE  0x40000000 /* iteration numbers no search reaches */
#define SEED_LAST  63
#define LOOK_SEEDS 256 /* iteration numbers from one look to the next */

/* Samples are taken in stages: FIRST rounds, and as many more as these show to be missing. */
#define FIRST  2
#define ENOUGH 0.2 /* Monte Carlo's variance over the measurement's: then no more */

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

/* q = g^T G g over the most that noise of g alone makes of it, two standard deviations
 * above its mean. The mean is tr(G C) and the variance 2 tr((G C)^2), C the covariance of
 * g. */
static double over_noise(size_t n, const double *G, const double *g, const double *C)
{
    double q = 0, mean = 0, half_var = 0;
    for (size_t k = 0; k < n; k++)
        for (size_t l = 0; l < n; l++) {
            double kl = 0, lk = 0; /* of G C */
            for (size_t p = 0; p < n; p++) {
                kl += G[k * n + p] * C[p * n + l];
                lk += G[l * n + p] * C[p * n + k];
            }
            q += g[k] * G[k * n + l] * g[l];
            mean += k == l ? kl : 0;
            half_var += kl * lk;
        }
    return q <= 0 ? 0 : q / fmax(mean + 2 * sqrt(fmax(2 * half_var, 0)), DBL_MIN);
}

/* Is the Newton point worth going to? A model that fails at x (not converged, far outside
 * its range) must not throw away what the search found. */
static enum imp_status accept(const struct imp__goal *goal, const double *x,
                              uint64_t seed, const double *point, bool *yes)
{
    struct imp_estimate old, new;
    enum imp_status st = IMP_OK;
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

/* What the samples so far say. */
struct answer {
    struct imp__directions every, free; /* of all variables; of those that may move */
    double *wish;                       /* [n] Newton's point without bounds */
    double *measurement, *monte_carlo;  /* [n][n] of `every`; u has those of `free` */
    bool *fixed;                        /* [n] */
    double kappa;
};

static void answer_destroy(imp_context *ctx, struct answer *a)
{
    imp__directions_destroy(ctx, &a->every);
    imp__directions_destroy(ctx, &a->free);
    imp__release(ctx, a->fixed);
    imp__release(ctx, a->wish);
}

static enum imp_status answer_create(imp_context *ctx, size_t n, struct answer *a)
{
    a->fixed = imp__alloc(ctx, n, sizeof *a->fixed);
    a->wish = imp__alloc(ctx, n + 2 * n * n, sizeof *a->wish);
    if (!a->fixed || !a->wish) return no_memory(ctx);
    a->measurement = a->wish + n;
    a->monte_carlo = a->measurement + n * n;
    return IMP_OK;
}

/* u->x: Newton's point, bounds kept, not looked at yet. */
static enum imp_status answer_find(const struct imp__goal *goal,
                                   const struct imp__sampled *s, const double *x,
                                   double *noise, struct answer *a,
                                   struct imp__uncertainty *u)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = goal->ctx;
    const size_t n = s->n;
    /* All variables: for the condition, and for those that press against a bound. */
    imp__directions_destroy(ctx, &a->every);
    IMP_TRY(imp__directions_find(s, NULL, &a->every));
    IMP_TRY(newton_point(s, x, &a->every, a->wish));
    IMP_TRY(newton_free(goal, s, x, a->fixed, &a->free, u->x));
    const bool known = s->mean.noise_known;
    a->kappa = known ? imp__sampled_noise(s) : noise_scale(s, &a->free);
    u->noise_scale = known ? 0 : a->kappa;
    for (size_t i = 0; i < n * n; i++)
        noise[i] = known ? s->mean.H_meas[i]
                         : u->noise_scale * (s->mean.H[i] - s->mean.H_prior[i]);
    IMP_TRY(sandwich(ctx, n, a->free.G, noise, u->measurement));
    IMP_TRY(sandwich(ctx, n, a->free.G, s->mean.cov_g, u->monte_carlo));
    IMP_TRY(sandwich(ctx, n, a->every.G, noise, a->measurement));
    IMP_TRY(sandwich(ctx, n, a->every.G, s->mean.cov_g, a->monte_carlo));
    IMP_TRY(prior_add(s, &a->free, a->kappa, u->measurement));
    IMP_TRY(prior_add(s, &a->every, a->kappa, a->measurement));
out:
    return st;
}

/* Rounds that are missing until no variable's variance is more than ENOUGH Monte Carlo's,
 * if that falls as 1/samples: 0 to `most`. */
static int rounds_missing(const struct imp__sampled *s, const struct answer *a,
                          const struct imp__uncertainty *u, int most)
{
    double worst = 0;
    for (size_t k = 0; k < s->n; k++) {
        const size_t d = k * s->n + k;
        const double *measurement = a->fixed[k] ? a->measurement : u->measurement;
        const double *monte_carlo = a->fixed[k] ? a->monte_carlo : u->monte_carlo;
        const struct imp__directions *of = a->fixed[k] ? &a->every : &a->free;
        if (imp__is_loose(of, k) && !of->held) return most; /* or is it noise? */
        if (monte_carlo[d] > 0)
            worst = fmax(worst, monte_carlo[d] / fmax(measurement[d], DBL_MIN));
    }
    if (worst <= ENOUGH) return 0;
    return (int)fmin(ceil(s->rounds * (worst / ENOUGH - 1)), most);
}

/* Rounds at x: two, and those that are missing. */
static enum imp_status samples_here(const struct imp__goal *goal, const double *x,
                                    int look, int most, struct imp__sampled *s,
                                    double *noise, struct answer *a,
                                    struct imp__uncertainty *u)
{
    enum imp_status st = IMP_OK;
    int missing = imp_min(FIRST, most);
    for (int k = 0; k < 2 && missing > 0; k++) {
        IMP_TRY(imp__sampled_take(
            goal, x, imp__search_seed(goal, SEED_BASE + LOOK_SEEDS * look, k), missing,
            s));
        IMP_TRY(imp__sampled_add(x, x, s));
        IMP_TRY(answer_find(goal, s, x, noise, a, u));
        missing = rounds_missing(s, a, u, most - s->rounds);
    }
    u->is_linear = true;
out:
    return st;
}

/* A round at x, and those that are missing at its Newton point. H0, a linear model: the
 * gradient there is the noise of both. u->is_linear: does H0 hold? */
static enum imp_status samples_ahead(const struct imp__goal *goal, const double *x,
                                     int look, int most, struct imp__sampled *s,
                                     double *noise, struct answer *a,
                                     struct imp__uncertainty *u)
{
    enum imp_status st = IMP_OK;
    const size_t n = s->n, nn = n * n;
    int missing = 1;
    double *work = imp__alloc(s->ctx, n + nn, sizeof *work);
    if (!work) IMP_TRY(no_memory(s->ctx));
    double *at = work, *C = work + n;
    memcpy(at, x, n * sizeof *at);
    for (int k = 0; missing > 0 && s->stages < IMP_SAMPLED_STAGES; k++) {
        IMP_TRY(imp__sampled_take(
            goal, at, imp__search_seed(goal, SEED_BASE + LOOK_SEEDS * look, k), missing,
            s));
        for (size_t i = 0; i < nn; i++) C[i] = s->mean.cov_g[i] + s->one_cov[i];
        if (s->stages > 0 && over_noise(n, a->free.G, s->one.g, C) > 1) goto out;
        IMP_TRY(imp__sampled_add(x, at, s));
        IMP_TRY(answer_find(goal, s, x, noise, a, u));
        missing = imp_max(rounds_missing(s, a, u, most - s->rounds), s->stages == 1);
        for (size_t i = 0; i < n; i++) at[i] = imp__into_bounds(goal, i, u->x[i]);
    }
    u->is_linear = true;
out:
    imp__release(s->ctx, work);
    return st;
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
    struct answer a = {0};
    struct imp__uncertainty u = {0};
    double *noise = imp__alloc(ctx, n * n, sizeof *noise);
    bool go = true;

    *out = (struct imp__uncertainty){0};
    if (!noise) IMP_TRY(no_memory(ctx));
    IMP_TRY(answer_create(ctx, n, &a));
    IMP_TRY(uncertainty_create(ctx, n, &u));
    IMP_TRY(imp__sampled_create(goal, x, &s));
    IMP_TRY((rounds->at_newton ? samples_ahead : samples_here)(
        goal, x, rounds->look, rounds->most, &s, noise, &a, &u));
    if (!u.is_linear) goto out;
    u.rounds = s.rounds;
    double part = s.rounds / (s.rounds + rounds->searched);
    if (part == 1 || over_noise(n, a.free.G, s.mean.g, s.mean.cov_g) > 1) part = 1;
    for (size_t k = 0; k < n; k++)
        u.x[k] =
            imp__into_bounds(goal, k, part < 1 ? x[k] + part * (u.x[k] - x[k]) : u.x[k]);
    if (!rounds->at_newton) {
        IMP_TRY(accept(
            goal, x,
            imp__search_seed(goal, SEED_BASE + LOOK_SEEDS * rounds->look, SEED_LAST), u.x,
            &go));
        if (!go) memcpy(u.x, x, n * sizeof *x);
    }
    u.loss = imp__sampled_loss(&s, x, u.x, a.free.G, go ? part : 0);

    memcpy(u.G, a.free.G, n * n * sizeof *u.G);
    u.condition = a.every.values[0] > 0 && !a.every.loose[0]
                      ? a.every.values[n - 1] / a.every.values[0]
                      : INFINITY;
    u.n_loose = (int)a.every.n_loose;
    memcpy(u.loosest, a.every.vectors, n * sizeof *u.loosest);
    for (size_t k = 0; k < n; k++) {
        struct imp_fit_variable *v = &variables[k];
        v->value = u.x[k];
        v->at_bound = imp__at_bound(goal, u.x, k);
        v->determined = !imp__is_loose(a.fixed[k] ? &a.every : &a.free, k);
        if (a.fixed[k])
            imp__interval_bound(
                goal, k, a.wish[k],
                imp__interval_se(&a.every, n, k, a.measurement, a.monte_carlo), v);
        else
            imp__interval_free(
                goal, k, imp__interval_se(&a.free, n, k, u.measurement, u.monte_carlo),
                v);
    }
    *out = u;
    u = (struct imp__uncertainty){.is_linear = true};
out:
    if (st == IMP_E_NUMERIC && rounds->at_newton && !u.is_linear) st = IMP_OK;
    imp__uncertainty_destroy(ctx, &u);
    answer_destroy(ctx, &a);
    imp__sampled_destroy(&s);
    imp__release(ctx, noise);
    return st;
}

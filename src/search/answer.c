/* SPDX-License-Identifier: Apache-2.0
 *
 * Newton's point after a search, accepted where the loss there is no higher, with the covariance
 * G C G^T of samples that the search did not use (docs/estimators.md 15). */
#include "answer.h"
#include <float.h>
#include <math.h>
#include <string.h>

#define SEED_BASE  0x40000000 /* iteration numbers no search reaches */
#define SEED_LAST  63
#define SEED_AHEAD 59  /* of the look ahead; those of halves are between */
#define LEAP_SEEDS 32  /* iteration numbers from samples at one x to those at the next, */
#define LOOK_SEEDS 256 /* and from one look to the next */

/* Samples are taken in stages: FIRST rounds, and as many more as these show to be missing. */
#define FIRST  2
#define ENOUGH 0.2 /* Monte Carlo's variance over the measurement's: then no more */

#define LEAPS  3 /* times that x moves to a lower loss, on the way to a Newton point */
#define HALVES 3 /* of the way, that are tried */
_Static_assert(LEAPS *LEAP_SEEDS + SEED_LAST < LOOK_SEEDS,
               "each look has numbers of its own");
_Static_assert(SEED_AHEAD + HALVES < SEED_LAST &&
                   IMP_SAMPLED_STAGES <= SEED_AHEAD - LEAP_SEEDS,
               "and each leap");

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

/* Is the Newton point to be taken? A model that fails at x (not converged, far outside
 * its range) must not throw away what the search found. */
static enum imp_status accept(const struct imp__goal *goal, const double *x,
                              uint64_t seed, const double *point, bool *yes)
{
    struct imp_estimate old, new;
    enum imp_status st = IMP_OK;
    IMP_TRY(goal->eval(x, seed, &old, NULL, NULL, goal->payload));
    IMP_TRY(goal->eval(point, seed, &new, NULL, NULL, goal->payload));
    *yes = new.value <= old.value + 2 * hypot(old.se, new.se);
out:
    return st;
}

/* The same by fewer samples: a model that is far from linear is found before more are spent. */
static enum imp_status accept_coarse(const struct imp__goal *goal, const double *x,
                                     uint64_t seed, const double *point, bool *yes)
{
    if (goal->coarsen) goal->coarsen(true, goal->payload);
    const enum imp_status st = accept(goal, x, seed, point, yes);
    if (goal->coarsen) goal->coarsen(false, goal->payload);
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

void imp__answer_destroy(imp_context *ctx, struct imp__answer *a)
{
    imp__directions_destroy(ctx, &a->every);
    imp__directions_destroy(ctx, &a->free);
    imp__release(ctx, a->fixed);
    imp__release(ctx, a->wish);
}

enum imp_status imp__answer_create(imp_context *ctx, size_t n, struct imp__answer *a)
{
    a->fixed = imp__alloc(ctx, n, sizeof *a->fixed);
    a->wish = imp__alloc(ctx, 3 * n + 3 * n * n, sizeof *a->wish);
    if (!a->fixed || !a->wish) return no_memory(ctx);
    a->from = a->wish + n;
    a->step = a->from + n;
    a->measurement = a->step + n;
    a->monte_carlo = a->measurement + n * n;
    a->noise = a->monte_carlo + n * n;
    a->part = 1;
    return IMP_OK;
}

/* u->x: Newton's point, within bounds, not evaluated yet. */
static enum imp_status answer_find(const struct imp__goal *goal,
                                   const struct imp__sampled *s, const double *x,
                                   struct imp__answer *a, struct imp__uncertainty *u)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = goal->ctx;
    const size_t n = s->n;
    /* All variables but those that are held: for the condition, and for those that press against
     * a bound. */
    imp__directions_destroy(ctx, &a->every);
    for (size_t k = 0; k < n; k++) a->fixed[k] = imp__goal_held(goal, k);
    IMP_TRY(imp__directions_find(s, a->fixed, &a->every));
    IMP_TRY(newton_point(s, x, &a->every, a->wish));
    IMP_TRY(newton_free(goal, s, x, a->fixed, &a->free, u->x));
    const bool known = s->mean.noise_known;
    a->kappa = known ? imp__sampled_noise(s) : noise_scale(s, &a->free);
    u->noise_scale = known ? 0 : a->kappa;
    for (size_t i = 0; i < n * n; i++)
        a->noise[i] = known ? s->mean.H_meas[i]
                            : u->noise_scale * (s->mean.H[i] - s->mean.H_prior[i]);
    IMP_TRY(sandwich(ctx, n, a->free.G, a->noise, u->measurement));
    IMP_TRY(sandwich(ctx, n, a->free.G, s->mean.cov_g, u->monte_carlo));
    IMP_TRY(sandwich(ctx, n, a->every.G, a->noise, a->measurement));
    IMP_TRY(sandwich(ctx, n, a->every.G, s->mean.cov_g, a->monte_carlo));
    IMP_TRY(prior_add(s, &a->free, a->kappa, u->measurement));
    IMP_TRY(prior_add(s, &a->every, a->kappa, a->measurement));
out:
    return st;
}

/* Rounds that are missing until no variable's variance is more than ENOUGH Monte Carlo's,
 * if that falls as 1/samples: 0 to `most`. */
static int rounds_missing(const struct imp__sampled *s, const struct imp__answer *a,
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
                                    uint64_t base, int most, struct imp__sampled *s,
                                    struct imp__answer *a, struct imp__uncertainty *u)
{
    enum imp_status st = IMP_OK;
    int missing = imp_min(FIRST, most);
    for (int k = 0; k < 2 && missing > 0; k++) {
        IMP_TRY(imp__sampled_take(goal, x, imp__search_seed(goal, base, k), missing, s));
        IMP_TRY(imp__sampled_add(x, x, s));
        IMP_TRY(answer_find(goal, s, x, a, u));
        missing = rounds_missing(s, a, u, most - s->rounds);
    }
out:
    return st;
}

/* What samples ahead have found. */
enum ahead {
    AHEAD_LINEAR, /* all of them count at x */
    AHEAD_MOVED,  /* x is the Newton point now, and those taken there count */
    AHEAD_HIGHER  /* the loss at the Newton point is higher: none were taken there */
};

/* A round at x, and those that are missing at its Newton point. H0, a linear model: the
 * gradient there is the noise of both. Elsewhere x moves there. It does not depend on the samples
 * there, but that they are kept does: where a linear model is taken for another, in 2 to 5 of
 * 100, their noise is larger than its estimate. */
static enum imp_status samples_ahead(const struct imp__goal *goal, double *x,
                                     uint64_t base, int most, struct imp__sampled *s,
                                     struct imp__answer *a, struct imp__uncertainty *u,
                                     enum ahead *end)
{
    enum imp_status st = IMP_OK;
    const size_t n = s->n, nn = n * n;
    int missing = 1;
    bool lower;
    double *work = imp__alloc(s->ctx, n + nn, sizeof *work);
    if (!work) IMP_TRY(no_memory(s->ctx));
    double *at = work, *C = work + n;
    memcpy(at, x, n * sizeof *at);
    *end = AHEAD_LINEAR;
    for (int k = 0; missing > 0 && k < IMP_SAMPLED_STAGES; k++) {
        IMP_TRY(imp__sampled_take(goal, at, imp__search_seed(goal, base, k), missing, s));
        for (size_t i = 0; i < nn; i++) C[i] = s->mean.cov_g[i] + s->one_cov[i];
        if (k > 0 && *end == AHEAD_LINEAR && over_noise(n, a->free.G, s->one.g, C) > 1) {
            *end = AHEAD_MOVED;
            memcpy(x, at, n * sizeof *x);
            imp__sampled_forget(s);
        }
        IMP_TRY(imp__sampled_add(x, at, s));
        IMP_TRY(answer_find(goal, s, x, a, u));
        missing = imp_max(rounds_missing(s, a, u, most - s->rounds), k == 0);
        if (*end == AHEAD_MOVED && missing < s->rounds) break;
        if (*end == AHEAD_LINEAR)
            for (size_t i = 0; i < n; i++) at[i] = imp__into_bounds(goal, i, u->x[i]);
        if (k > 0) continue;
        IMP_TRY(
            accept_coarse(goal, x, imp__search_seed(goal, base, SEED_AHEAD), at, &lower));
        if (!lower) {
            *end = AHEAD_HIGHER;
            break;
        }
    }
out:
    imp__release(s->ctx, work);
    return st;
}

/* Towards the Newton point: is the loss there no higher than at x, or half of the way, ..? x
 * moves that far. */
static enum imp_status leap(const struct imp__goal *goal, uint64_t base,
                            const double *newton, bool coarse, double *x, double *at,
                            bool *moved)
{
    enum imp_status st = IMP_OK;
    double part = 0.5;
    *moved = false;
    for (int k = 1; k <= HALVES && !*moved; k++, part /= 2) {
        for (size_t i = 0; i < goal->n; i++)
            at[i] = imp__into_bounds(goal, i, x[i] + part * (newton[i] - x[i]));
        const uint64_t seed = imp__search_seed(goal, base, SEED_LAST - k);
        IMP_TRY((coarse ? accept_coarse : accept)(goal, x, seed, at, moved));
    }
    if (*moved) memcpy(x, at, goal->n * sizeof *x);
out:
    return st;
}

enum imp_status imp__answer_here(const struct imp__goal *goal,
                                 const struct imp__rounds *rounds, struct imp__sampled *s,
                                 struct imp__answer *a, struct imp__uncertainty *u)
{
    enum imp_status st = IMP_OK;
    const size_t n = s->n;
    double *x = a->from, *step = a->step;
    bool go = true, moved = true, ahead = rounds->at_newton, leapt = false;
    for (int k = 0; k <= LEAPS && moved; k++) {
        const uint64_t base =
            SEED_BASE + LOOK_SEEDS * (uint64_t)rounds->look + LEAP_SEEDS * (uint64_t)k;
        enum ahead end = AHEAD_MOVED;
        imp__sampled_forget(s);
        if (ahead) IMP_TRY(samples_ahead(goal, x, base, rounds->most, s, a, u, &end));
        else IMP_TRY(samples_here(goal, x, base, rounds->most, s, a, u));
        if (end == AHEAD_HIGHER) {
            moved = false;
            if (k < LEAPS) IMP_TRY(leap(goal, base, u->x, true, x, step, &moved));
            if (!moved) goto out;
            continue;
        }
        ahead = false;
        a->part = s->rounds / (s->rounds + rounds->searched);
        const bool far = over_noise(n, a->free.G, s->mean.g, s->mean.cov_g) > 1;
        if (k > 0 || far) a->part = 1;
        for (size_t i = 0; i < n; i++)
            u->x[i] = imp__into_bounds(
                goal, i, a->part < 1 ? x[i] + a->part * (u->x[i] - x[i]) : u->x[i]);
        if (end == AHEAD_LINEAR) break;
        IMP_TRY(accept(goal, x, imp__search_seed(goal, base, SEED_LAST), u->x, &go));
        moved = go && far && leapt;
        leapt |= !go;
        if (k == LEAPS) break;
        if (moved) memcpy(x, u->x, n * sizeof *x);
        if (!go) IMP_TRY(leap(goal, base, u->x, false, x, step, &moved));
    }
    for (size_t i = 0; i < n; i++) step[i] = go ? 0 : u->x[i] - x[i];
    if (!go) {
        memcpy(u->x, x, n * sizeof *x);
        a->part = 0;
    }
    u->found = true;
out:
    return st;
}

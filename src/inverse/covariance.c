/* SPDX-License-Identifier: Apache-2.0
 *
 * With G the inverse of H = J^T W J (+ prior) in the directions that are determined,
 *
 *     measurement   G (J^T W Sigma W J) G      noise of the pictures
 *     Monte Carlo   G Cov(g) G                 noise of our own estimate of g
 *
 * and x - G g, from random numbers that x does not depend on, is a point whose error is
 * described by their sum, wherever in its neighbourhood x was. */
#include "covariance.h"
#include "math/linalg.h"
#include <math.h>
#include <string.h>

#define Z_TWO_SIDED 1.959963984540054
#define Z_ONE_SIDED 1.6448536269514722
#define LOOSE_SHARE                                                                      \
    0.1 /* part of a variable in a loose direction that makes it loose                   \
         */
#define SEED_BASE 0x40000000 /* iteration numbers no search reaches */

/* The analysis over a subset of the variables. */
struct analysis {
    size_t m;                 /* variables in it */
    size_t *index;            /* [m] */
    double *values, *vectors; /* [m], [m][m] of the scaled H, from data alone */
    double *se;               /* [m] of the eigenvalues */
    size_t n_loose;
    bool *loose; /* [m] eigenvalue not above its noise */
    double *G;   /* [n][n] generalised inverse, 0 outside */
};

struct all {
    const struct imp__goal *goal;
    size_t n;
    int replicates;
    struct imp__normal mean; /* over the replicates */
    double *H_each;          /* [replicates][n][n], data part */
    double *scale;           /* [n] max(|x|, goal's scale) */
};

void imp__uncertainty_destroy(imp_context *ctx, struct imp__uncertainty *u)
{
    if (!u) return;
    imp__release(ctx, u->x);
    imp__release(ctx, u->measurement);
    imp__release(ctx, u->monte_carlo);
    imp__release(ctx, u->loosest);
    *u = (struct imp__uncertainty){0};
}

static void analysis_destroy(imp_context *ctx, struct analysis *a)
{
    imp__release(ctx, a->index);
    imp__release(ctx, a->values);
    imp__release(ctx, a->vectors);
    imp__release(ctx, a->se);
    imp__release(ctx, a->loose);
    imp__release(ctx, a->G);
}

/* ---- Replicates ---------------------------------------------------------------- */

static enum imp_status replicate(struct all *a, const double *x)
{
    enum imp_status st = IMP_OK;
    const size_t nn = a->n * a->n;
    struct imp__normal one = {0}, *sum = &a->mean;
    double f_var = 0;

    IMP_TRY(imp__normal_create(a->goal->ctx, a->n, &one));
    for (int b = 0; b < a->replicates; b++) {
        const double r = 1.0 / a->replicates;
        IMP_TRY(a->goal->normal(x, imp__search_seed(a->goal, SEED_BASE, b), &one,
                                a->goal->payload));
        for (size_t i = 0; i < nn; i++) {
            a->H_each[(size_t)b * nn + i] = one.H[i] - one.H_prior[i];
            sum->H[i] += r * one.H[i];
            sum->H_prior[i] += r * one.H_prior[i];
            sum->H_same[i] += r * one.H_same[i];
            sum->H_meas[i] += r * one.H_meas[i];
            sum->cov_g[i] += r * r * one.cov_g[i]; /* of the mean of independent ones */
        }
        for (size_t k = 0; k < a->n; k++) sum->g[k] += r * one.g[k];
        sum->f.value += r * one.f.value;
        sum->f.bias_order = one.f.bias_order;
        f_var += r * r * one.f.se * one.f.se;
        sum->chi2 += r * one.chi2;
        sum->n_residuals = one.n_residuals;
        sum->noise_known = one.noise_known;
    }
    sum->f.se = sqrt(f_var);
out:
    imp__normal_destroy(a->goal->ctx, &one);
    return st;
}

/* ---- Directions ---------------------------------------------------------------- */

/* v^T D H D v over the subset, v row j of the eigenvectors. */
static double along(const struct all *all, const struct analysis *a, const double *H,
                    size_t j)
{
    double sum = 0;
    for (size_t p = 0; p < a->m; p++)
        for (size_t q = 0; q < a->m; q++) {
            const size_t k = a->index[p], l = a->index[q];
            sum += a->vectors[j * a->m + p] * a->vectors[j * a->m + q] * all->scale[k] *
                   all->scale[l] * H[k * all->n + l];
        }
    return sum;
}

/* Eigenvalues of the scaled data matrix, and which of them stand out of their noise. */
static enum imp_status directions(const struct all *all, struct analysis *a)
{
    enum imp_status st = IMP_OK;
    const size_t m = a->m, n = all->n;
    double *A = imp__alloc(all->goal->ctx, m * m, sizeof *A);

    if (!A)
        IMP_TRY(imp__error(all->goal->ctx, IMP_E_NOMEM, "no memory for a covariance"));
    for (size_t p = 0; p < m; p++)
        for (size_t q = 0; q < m; q++) {
            const size_t k = a->index[p], l = a->index[q];
            A[p * m + q] = all->scale[k] * all->scale[l] *
                           (all->mean.H[k * n + l] - all->mean.H_prior[k * n + l]);
        }
    if (!imp__eigen_symmetric(m, A, a->values, a->vectors))
        IMP_TRY(imp__error(all->goal->ctx, IMP_E_NUMERIC, "J^T J is not finite"));
    for (size_t j = 0; j < m; j++) {
        double sum = 0;
        for (int b = 0; b < all->replicates; b++) {
            const double d =
                along(all, a, all->H_each + (size_t)b * n * n, j) - a->values[j];
            sum += d * d;
        }
        a->se[j] = sqrt(sum / (all->replicates - 1) / all->replicates);
        a->loose[j] =
            !(a->values[j] > 2 * a->se[j]) || a->values[j] <= 1e-12 * a->values[m - 1];
        a->n_loose += a->loose[j];
    }
out:
    imp__release(all->goal->ctx, A);
    return st;
}

/* G = D V (V^T D H D V)^-1 V^T D, V the determined directions, H with its prior. */
static enum imp_status inverse(const struct all *all, struct analysis *a)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = all->goal->ctx;
    const size_t m = a->m, n = all->n, r = m - a->n_loose;
    double *V = imp__alloc(ctx, m * r + 1, sizeof *V); /* D V, [m][r] */
    double *HV = imp__alloc(ctx, m * r + 1, sizeof *HV);
    double *M = imp__alloc(ctx, r * r + 1, sizeof *M);
    double *row = imp__alloc(ctx, r + 1, sizeof *row);

    if (!V || !HV || !M || !row)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a covariance"));
    for (size_t j = 0, c = 0; j < m; j++) {
        if (a->loose[j]) continue;
        for (size_t p = 0; p < m; p++)
            V[p * r + c] = all->scale[a->index[p]] * a->vectors[j * m + p];
        c++;
    }
    for (size_t p = 0; p < m; p++)
        for (size_t q = 0; q < m; q++) {
            const double h = all->mean.H[a->index[p] * n + a->index[q]];
            for (size_t c = 0; c < r; c++) HV[p * r + c] += h * V[q * r + c];
        }
    for (size_t p = 0; p < m; p++)
        for (size_t c = 0; c < r; c++)
            for (size_t d = 0; d < r; d++) M[c * r + d] += V[p * r + c] * HV[p * r + d];
    if (r > 0 && !imp__cholesky(r, M))
        IMP_TRY(imp__error(ctx, IMP_E_NUMERIC,
                           "J^T J is not positive where it is determined"));
    for (size_t p = 0; p < m; p++) {
        memcpy(row, V + p * r, r * sizeof *row);
        imp__cholesky_solve(r, M, row);
        for (size_t q = 0; q < m; q++) {
            double sum = 0;
            for (size_t c = 0; c < r; c++) sum += row[c] * V[q * r + c];
            a->G[a->index[p] * n + a->index[q]] = sum;
        }
    }
out:
    imp__release(ctx, V);
    imp__release(ctx, HV);
    imp__release(ctx, M);
    imp__release(ctx, row);
    return st;
}

static enum imp_status analyse(const struct all *all, const bool *fixed,
                               struct analysis *a)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = all->goal->ctx;
    const size_t n = all->n;

    a->index = imp__alloc(ctx, n, sizeof *a->index);
    a->values = imp__alloc(ctx, n, sizeof *a->values);
    a->vectors = imp__alloc(ctx, n * n, sizeof *a->vectors);
    a->se = imp__alloc(ctx, n, sizeof *a->se);
    a->loose = imp__alloc(ctx, n, sizeof *a->loose);
    a->G = imp__alloc(ctx, n * n, sizeof *a->G);
    if (!a->index || !a->values || !a->vectors || !a->se || !a->loose || !a->G)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a covariance"));
    for (size_t k = 0; k < n; k++)
        if (!fixed || !fixed[k]) a->index[a->m++] = k;
    if (a->m == 0) goto out;
    IMP_TRY(directions(all, a));
    IMP_TRY(inverse(all, a));
out:
    return st;
}

/* Does variable k take part in a direction that is not determined? */
static bool loose(const struct analysis *a, size_t k)
{
    for (size_t p = 0; p < a->m; p++) {
        if (a->index[p] != k) continue;
        for (size_t j = 0; j < a->m; j++)
            if (a->loose[j] && fabs(a->vectors[j * a->m + p]) > LOOSE_SHARE) return true;
    }
    return false;
}

/* out = G C G^T */
static enum imp_status sandwich(imp_context *ctx, size_t n, const double *G,
                                const double *C, double *out)
{
    double *GC = imp__alloc(ctx, n * n, sizeof *GC);
    if (!GC) return imp__error(ctx, IMP_E_NOMEM, "no memory for a covariance");
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

/* Covariance of the gradient by noise of the data. With unknown noise of variance s^2/w
 * the best estimate is s^2 = chi2_min/(M - m), chi2_min the value at the minimum, reached
 * from here by the Newton step; the part of g^T G g that is our own noise is left in. */
static double noise_scale(const struct all *all, const struct analysis *a)
{
    const size_t n = all->n;
    const struct imp__normal *e = &all->mean;
    double q = 0;
    for (size_t k = 0; k < n; k++)
        for (size_t l = 0; l < n; l++)
            q += a->G[k * n + l] * (e->g[k] * e->g[l] - e->cov_g[k * n + l]);
    const double freedom = e->n_residuals - (double)(a->m - a->n_loose);
    return freedom > 0 ? fmax((e->chi2 - fmax(q, 0)) / freedom, 0) : 0;
}

static void interval_free(const struct imp__goal *goal, size_t k, bool is_loose,
                          double se, struct imp_fit_variable *v)
{
    v->determined = !is_loose;
    v->se = is_loose ? NAN : se;
    v->lo95 = is_loose ? NAN : imp__into_bounds(goal, k, v->value - Z_TWO_SIDED * se);
    v->hi95 = is_loose ? NAN : imp__into_bounds(goal, k, v->value + Z_TWO_SIDED * se);
}

/* At a bound the interval is one-sided: from the bound to what the data still allow,
 * about the point `u` that they would choose without it. */
static void interval_bound(const struct imp__goal *goal, size_t k, bool is_loose,
                           double u, double se, struct imp_fit_variable *v)
{
    interval_free(goal, k, is_loose, se, v);
    if (is_loose) return;
    if (v->at_bound < 0) {
        v->lo95 = goal->lo[k];
        v->hi95 = imp__into_bounds(goal, k, fmax(u, goal->lo[k]) + Z_ONE_SIDED * se);
    } else {
        v->hi95 = goal->hi[k];
        v->lo95 = imp__into_bounds(goal, k, fmin(u, goal->hi[k]) - Z_ONE_SIDED * se);
    }
}

static enum imp_status newton_point(const struct all *all, const double *x,
                                    const struct analysis *a, double *out)
{
    const struct imp__goal *goal = all->goal;
    const size_t n = all->n;
    for (size_t k = 0; k < n; k++) {
        double step = 0;
        for (size_t l = 0; l < n; l++) step += a->G[k * n + l] * all->mean.g[l];
        out[k] = x[k] - step;
        if (!isfinite(out[k]))
            return imp__error(goal->ctx, IMP_E_NUMERIC, "no Newton point");
    }
    return IMP_OK;
}

/* Is q = g^T G g no more than noise of g alone makes it? Its mean is then tr(G C) and its
 * variance 2 tr((G C)^2), C the covariance of g. */
static bool within_noise(const struct all *all, const struct analysis *a)
{
    const size_t n = all->n;
    const double *g = all->mean.g, *C = all->mean.cov_g;
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
static enum imp_status accept(const struct all *all, const double *x, double *point,
                              bool *yes)
{
    const struct imp__goal *goal = all->goal;
    struct imp_estimate old, new;
    const uint64_t seed = imp__search_seed(goal, SEED_BASE, 63);
    enum imp_status st = IMP_OK;
    for (size_t k = 0; k < all->n; k++) point[k] = imp__into_bounds(goal, k, point[k]);
    IMP_TRY(goal->eval(x, seed, &old, NULL, NULL, goal->payload));
    IMP_TRY(goal->eval(point, seed, &new, NULL, NULL, goal->payload));
    *yes = new.value <= old.value + 2 * sqrt(old.se * old.se + new.se *new.se);
out:
    return st;
}

enum imp_status imp__covariance(const struct imp__goal *goal, const double *x,
                                int replicates, double share,
                                struct imp_fit_variable *variables,
                                struct imp__uncertainty *out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = goal->ctx;
    const size_t n = goal->n;
    struct all all = {.goal = goal, .n = n, .replicates = replicates};
    struct analysis every = {0}, some = {0};
    struct imp__uncertainty u = {.n = n};
    bool *fixed = imp__alloc(ctx, n, sizeof *fixed), go = false, any_fixed = false;
    double *cov[2] = {imp__alloc(ctx, n * n, sizeof(double)),
                      imp__alloc(ctx, n * n, sizeof(double))};
    double *wish = imp__alloc(ctx, n, sizeof *wish);

    IMP_TRY(imp__normal_create(ctx, n, &all.mean));
    all.H_each = imp__alloc(ctx, (size_t)replicates * n * n, sizeof(double));
    all.scale = imp__alloc(ctx, n, sizeof(double));
    u.x = imp__alloc(ctx, n, sizeof(double));
    u.loosest = imp__alloc(ctx, n, sizeof(double));
    u.measurement = imp__alloc(ctx, n * n, sizeof(double));
    u.monte_carlo = imp__alloc(ctx, n * n, sizeof(double));
    if (!fixed || !cov[0] || !cov[1] || !wish || !all.H_each || !all.scale || !u.x ||
        !u.loosest || !u.measurement || !u.monte_carlo)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a covariance"));
    for (size_t k = 0; k < n; k++) all.scale[k] = fmax(fabs(x[k]), goal->scale[k]);
    IMP_TRY(replicate(&all, x));

    /* All variables: for the condition, and for those that press against a bound. */
    IMP_TRY(analyse(&all, NULL, &every));
    IMP_TRY(newton_point(&all, x, &every, wish));
    for (size_t k = 0; k < n; k++) {
        const int wall = imp__at_bound(goal, x, k);
        const double g = all.mean.g[k];
        fixed[k] = (wall < 0 && g >= 0) || (wall > 0 && g <= 0);
        any_fixed |= fixed[k];
    }
    IMP_TRY(analyse(&all, fixed, &some));
    IMP_TRY(newton_point(&all, x, &some, u.x));
    /* What the step pushes over a bound stays there, and the others go without it. */
    for (size_t round = 0; round < n; round++) {
        bool more = false;
        for (size_t k = 0; k < n; k++)
            if (!fixed[k] && (u.x[k] < goal->lo[k] || u.x[k] > goal->hi[k]) &&
                imp__at_bound(goal, x, k))
                fixed[k] = more = any_fixed = true;
        if (!more) break;
        analysis_destroy(ctx, &some);
        some = (struct analysis){0};
        IMP_TRY(analyse(&all, fixed, &some));
        IMP_TRY(newton_point(&all, x, &some, u.x));
    }
    if (share < 1 && within_noise(&all, &some))
        for (size_t k = 0; k < n; k++) u.x[k] = x[k] + share * (u.x[k] - x[k]);
    IMP_TRY(accept(&all, x, u.x, &go));
    if (!go) memcpy(u.x, x, n * sizeof *x);

    double *noise = all.mean.H_meas;
    if (!all.mean.noise_known) {
        u.noise_scale = noise_scale(&all, &some);
        for (size_t i = 0; i < n * n; i++)
            noise[i] = u.noise_scale * (all.mean.H[i] - all.mean.H_prior[i]);
    }
    IMP_TRY(sandwich(ctx, n, some.G, noise, u.measurement));
    IMP_TRY(sandwich(ctx, n, some.G, all.mean.cov_g, u.monte_carlo));
    IMP_TRY(sandwich(ctx, n, every.G, noise, cov[0]));
    IMP_TRY(sandwich(ctx, n, every.G, all.mean.cov_g, cov[1]));

    u.condition = every.values[0] > 0 && !every.loose[0]
                      ? every.values[n - 1] / every.values[0]
                      : INFINITY;
    u.n_loose = (int)every.n_loose;
    for (size_t k = 0; k < n; k++) {
        struct imp_fit_variable *v = &variables[k];
        const size_t d = k * n + k;
        u.loosest[k] = every.vectors[k];
        v->value = u.x[k];
        v->at_bound = imp__at_bound(goal, u.x, k);
        if (fixed[k])
            interval_bound(goal, k, loose(&every, k), wish[k],
                           sqrt(fmax(cov[0][d], 0) + fmax(cov[1][d], 0)), v);
        else
            interval_free(goal, k, loose(&some, k),
                          sqrt(fmax(u.measurement[d], 0) + fmax(u.monte_carlo[d], 0)), v);
    }
    *out = u;
    u = (struct imp__uncertainty){0};
out:
    imp__uncertainty_destroy(ctx, &u);
    analysis_destroy(ctx, &every);
    analysis_destroy(ctx, &some);
    imp__normal_destroy(ctx, &all.mean);
    imp__release(ctx, all.H_each);
    imp__release(ctx, all.scale);
    imp__release(ctx, fixed);
    imp__release(ctx, cov[0]);
    imp__release(ctx, cov[1]);
    imp__release(ctx, wish);
    return st;
}

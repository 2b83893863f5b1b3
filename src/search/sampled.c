/* SPDX-License-Identifier: Apache-2.0
 *
 * Samples of the normal equations, put together by their numbers. Those of another point
 * are moved to x by the quadratic that they are the coefficients of:
 *
 *     g(x) = g(at) + H (x - at)
 *     chi2(x) = chi2(at) + (2 g(at) + H (x - at)).(x - at) */
#include "sampled.h"
#include "excess.h"
#include <math.h>
#include <string.h>

void imp__sampled_destroy(struct imp__sampled *s)
{
    imp__normal_destroy(s->ctx, &s->mean);
    imp__normal_destroy(s->ctx, &s->one);
    imp__release(s->ctx, s->cov);
    imp__release(s->ctx, s->deviations);
    imp__release(s->ctx, s->scale);
}

enum imp_status imp__sampled_create(const struct imp__goal *goal, const double *x,
                                    struct imp__sampled *s)
{
    const size_t n = s->n;
    enum imp_status st = imp__normal_create(s->ctx, n, false, &s->mean);
    if (st == IMP_OK) st = imp__normal_create(s->ctx, n, true, &s->one);
    if (st != IMP_OK) return st;
    s->cov = imp__alloc(s->ctx, 3 * n * n, sizeof *s->cov);
    s->deviations =
        imp__alloc(s->ctx, IMP_SAMPLED_STAGES * IMP_DEVIATIONS * n * n, sizeof(double));
    s->scale = imp__alloc(s->ctx, n, sizeof *s->scale);
    if (!s->cov || !s->deviations || !s->scale)
        return imp__error(s->ctx, IMP_E_NOMEM, "no memory for a covariance");
    s->excess = s->cov + n * n;
    s->one_cov = s->excess + n * n;
    for (size_t k = 0; k < n; k++) s->scale[k] = fmax(fabs(x[k]), goal->scale[k]);
    return IMP_OK;
}

static void mix(size_t count, double own, double *mean, double part, const double *more)
{
    for (size_t i = 0; i < count; i++) mean[i] = own * mean[i] + part * more[i];
}

/* From the quadratic at `at` to the same at x. */
static void shift(size_t n, const double *x, const double *at, struct imp__normal *e)
{
    double gain = 0;
    for (size_t k = 0; k < n; k++) {
        double change = 0;
        for (size_t l = 0; l < n; l++) change += e->H[k * n + l] * (x[l] - at[l]);
        gain += (2 * e->g[k] + change) * (x[k] - at[k]);
    }
    e->chi2 += gain;
    e->pairs.value += 0.5 * gain;
    for (size_t k = 0; k < n; k++)
        for (size_t l = 0; l < n; l++) e->g[k] += e->H[k * n + l] * (x[l] - at[l]);
}

enum imp_status imp__sampled_take(const struct imp__goal *goal, const double *at,
                                  uint64_t seed, int rounds, struct imp__sampled *s)
{
    enum imp_status st = IMP_OK;
    IMP_TRY(goal->normal(at, seed, rounds, &s->one, goal->payload));
    memcpy(s->one_cov, s->one.cov_g, s->n * s->n * sizeof *s->one_cov);
    IMP_TRY(imp__excess_take(s->ctx, s->n, s->one_cov, s->one.cov_excess));
    s->taken = rounds;
out:
    return st;
}

enum imp_status imp__sampled_add(const double *x, const double *at,
                                 struct imp__sampled *s)
{
    const size_t n = s->n, nn = n * n, block = IMP_DEVIATIONS * nn;
    const double part = (double)s->taken / (s->rounds + s->taken), own = 1 - part;
    struct imp__normal *one = &s->one, *mean = &s->mean;
    double *deviations = s->deviations + (size_t)s->stages * block;

    if (at != x) shift(n, x, at, one);
    mix(nn, own, mean->H, part, one->H);
    mix(nn, own, mean->H_prior, part, one->H_prior);
    mix(nn, own, mean->H_meas, part, one->H_meas);
    mix(n, own, mean->g, part, one->g);
    mix(1, own, &mean->chi2, part, &one->chi2);
    mix(1, own, &mean->pairs.value, part, &one->pairs.value);
    mean->pairs.se = hypot(own * mean->pairs.se, part * one->pairs.se);
    mean->pairs.bias_order = one->pairs.bias_order;
    mix(nn, own * own, s->cov, part * part, one->cov_g);
    mix(nn, own * own, s->excess, part * part, one->cov_excess);
    for (size_t i = 0; i < (size_t)s->stages * block; i++) s->deviations[i] *= own;
    for (size_t i = 0; i < block; i++) deviations[i] = part * one->deviations[i];
    s->stages++;
    s->rounds += s->taken;
    s->taken = 0;
    mean->n_residuals = one->n_residuals;
    mean->noise_known = one->noise_known;
    memcpy(mean->cov_g, s->cov, nn * sizeof *s->cov);
    return imp__excess_take(s->ctx, n, mean->cov_g, s->excess);
}

/* The next have weight 1 in every mean. */
void imp__sampled_forget(struct imp__sampled *s) { s->rounds = s->stages = 0; }

/* The step follows the noise of g, so that the quadratic is low there by part tr(G C). */
struct imp_estimate imp__sampled_loss(const struct imp__sampled *s, const double *x,
                                      const double *to, const double *G, double part)
{
    const size_t n = s->n;
    struct imp_estimate loss = s->mean.pairs;
    for (size_t k = 0; k < n; k++) {
        double change = 0;
        for (size_t l = 0; l < n; l++) {
            change += s->mean.H[k * n + l] * (to[l] - x[l]);
            loss.value += part * G[k * n + l] * s->mean.cov_g[l * n + k];
        }
        loss.value += (s->mean.g[k] + 0.5 * change) * (to[k] - x[k]);
    }
    return loss;
}

double imp__sampled_noise(const struct imp__sampled *s)
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

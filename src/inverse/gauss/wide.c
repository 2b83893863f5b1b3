/* SPDX-License-Identifier: Apache-2.0
 *
 * J^T W J where a walk has a part in several pixels and pixels share walks: with filters
 * wider than a pixel, light walks or bidirectional walks; and of poses, whose draws from edges may
 * lie in any pixel. R independent replicates, each
 * a picture L and a derivative picture X_k for every value, are used in place of walks
 * (docs/estimators.md 15):
 *
 *     (J^T J)_kl ~ w [ (sum_b X_k)(sum_b X_l) - sum_b X_k X_l ] / (R)
 *     (J^T r)_k  ~ w [ (sum_b L)(sum_b X_k) - sum_b L X_k ] / (R) - w T mean(X_k)
 *
 * unbiased but for the pixel itself, a ratio of sums (splat.h).
 *
 * Covariance of the gradient: pair_noise.h. Noise of the target: wide_noise.c. */
#include "wide.h"
#include "film/film_picture.h"
#include "gauss_newton.h"
#include "inverse/estimate/moved_pictures.h"
#include "inverse/gradient/light_gradient.h"
#include "inverse/problem/loss.h"
#include <stdio.h>
#include <string.h>

/* ---- Replicates ---------------------------------------------------------------- */

struct pass {
    const struct imp_tracer *tracer;
    const struct imp__moved_gradient *moved; /* NULL: no pose is active */
    const struct imp_run *run;
    double lo, hi;
};

static void sample(const void *payload, struct imp_sample *s)
{
    const struct pass *p = payload;
    imp__moved_sample(p->moved, p->tracer, s);
}

static int progress(const struct imp_progress *p, void *payload)
{
    const struct pass *pass = payload;
    struct imp_progress own = *p;
    own.fraction = pass->lo + (pass->hi - pass->lo) * p->fraction;
    return pass->run->progress(&own, pass->run->progress_payload);
}

/* What poses have at edges, of replicate b: from draws of its own, as many as it has walks. */
static enum imp_status edges_add(struct imp__wide *w, const struct imp_run *run, int b,
                                 int n)
{
    const size_t values =
        (size_t)w->width * (size_t)w->height * w->K * (size_t)w->channels;
    if (imp_likely(!w->moved)) return IMP_OK;
    double *mean = imp__alloc(w->ctx, values, sizeof *mean);
    if (!mean)
        return imp__error(w->ctx, IMP_E_NOMEM, "no memory for derivative pictures");
    struct imp_run own = *run;
    own.progress = NULL; /* it is that of the walks */
    const struct imp__moved_run r = {&own, "gauss-newton", (int64_t)b * n, n};
    const enum imp_status st = imp__moved_pictures(w->moved, &r, NULL, mean, NULL);
    for (size_t k = 0; st == IMP_OK && k < w->K; k++)
        imp__moved_film_add(w->films[b], (int)(k + 1) * w->channels, w->channels, k, w->K,
                            mean, NULL);
    imp__release(w->ctx, mean);
    return st;
}

static enum imp_status replicates(struct imp__wide *w, const struct imp_tracer *tracer,
                                  const struct imp_run *run, int rounds, double lo,
                                  double hi)
{
    enum imp_status st = IMP_OK;
    const int n = (int)(w->K + 1) * w->channels;
    const struct imp__replicates plan =
        imp__replicates_pictures(tracer->scene, w->of, run, rounds);
    w->R = plan.R;
    char *names = imp__alloc(w->ctx, (size_t)n, 12);
    if (!names) IMP_TRY(imp__error(w->ctx, IMP_E_NOMEM, "no memory"));
    for (int k = 0, used = 0; k < n; k++)
        used += snprintf(names + used, 12, "%s%d", k ? "," : "", k);
    for (int b = 0; b < w->R; b++) {
        struct imp_run own = *run;
        own.spp = plan.n;
        own.time_limit_s = 0;
        own.walks = NULL; /* the tracer has them */
        const struct pass pass = {tracer, w->moved, run, lo + (hi - lo) * b / w->R,
                                  lo + (hi - lo) * (b + 1) / w->R};
        if (run->progress) {
            own.progress = progress;
            own.progress_payload = (void *)&pass;
        }
        const struct imp_picture picture = {.sensor = tracer->sensor,
                                            .stage = "gauss-newton",
                                            .names = names,
                                            .n = n,
                                            .walks = imp__bundle_use(tracer),
                                            .sample = sample,
                                            .payload = &pass,
                                            .first = imp__replicates_first(plan, b, 0)};
        IMP_TRY(imp__picture_make(w->ctx, &picture, &own, &w->films[b]));
        IMP_TRY(edges_add(w, run, b, plan.n));
    }
out:
    imp__release(w->ctx, names);
    return st;
}

static int64_t light_spp(const struct imp_tracer *tracer, const struct imp_run *run,
                         int rounds)
{
    return (int64_t)imp_max(run->spp > 0 ? run->spp : tracer->sensor->spp, 4) * rounds;
}

/* How many replicates there are, and whether their pictures, and those of `buffers`, fit
 * into memory: before anything is taken. */
static enum imp_status light_plan(struct imp__wide *w, const struct imp_tracer *tracer,
                                  const struct imp_run *run, int rounds)
{
    const double pixels = (double)w->width * w->height, K = (double)w->K;
    w->R = light_spp(tracer, run, rounds) < 8 ? 4 : IMP_WIDE_REPLICATES;
    return imp__memory_check(
        w->ctx, pixels * (w->R * (K + 1) * w->channels + 2 * K + 1) * sizeof(double),
        "derivative pictures of light walks");
}

/* A walk from a light reaches many pixels, whatever the filter. */
static enum imp_status light_replicates(struct imp__wide *w,
                                        const struct imp_tracer *tracer,
                                        const struct imp_run *run, int rounds, double lo,
                                        double hi)
{
    const size_t pixels = (size_t)w->width * (size_t)w->height;
    const int64_t spp = light_spp(tracer, run, rounds);
    struct imp_run own = *run;
    own.time_limit_s = 0;
    const int64_t walks = ((spp - 1) / w->R + 1) * (int64_t)pixels;
    const size_t n = pixels * (w->K + 1) * (size_t)w->channels;
    for (int b = 0; b < w->R; b++) {
        w->rows[b] = imp__alloc(w->ctx, n, sizeof(double));
        if (!w->rows[b])
            return imp__error(w->ctx, IMP_E_NOMEM, "no memory for derivative pictures");
        const enum imp_status st =
            imp__light_rows(tracer, &own, b * walks, walks, lo + (hi - lo) * b / w->R,
                            lo + (hi - lo) * (b + 1) / w->R, w->rows[b]);
        if (st != IMP_OK) return st;
    }
    return IMP_OK;
}

/* Value k of a pixel as the target sees it, 0: the radiance, in replicate b. */
static inline double seen_of(const struct imp__wide *w, size_t pixel, int c, int b,
                             size_t k)
{
    const size_t at = pixel * (w->K + 1) * (size_t)w->channels + k * (size_t)w->channels;
    double lanes[3];
    for (size_t l = 0; l < (size_t)w->channels; l++)
        lanes[l] = w->films[b] ? (double)w->films[b]->mean[at + l] : w->rows[b][at + l];
    return imp__seen(w->luminance, lanes, c);
}

void imp__wide_radiances(const struct imp__wide *w, size_t pixel, int c,
                         double L[IMP_WIDE_REPLICATES])
{
    for (int b = 0; b < w->R; b++) L[b] = seen_of(w, pixel, c, b, 0);
}

void imp__wide_gather(struct imp__wide *w, size_t pixel, int c)
{
    imp__wide_radiances(w, pixel, c, w->L);
    for (int b = 0; b < w->R; b++)
        for (size_t k = 0; k < w->K; k++)
            w->X[(size_t)b * w->K + k] = seen_of(w, pixel, c, b, k + 1);
}

double imp__wide_weight(const struct imp__wide *w, size_t pixel, int c, double mean,
                        double *T)
{
    const struct imp_target *t = w->target;
    const double scale = imp__target_weight(w->of, pixel, c);
    *T = t->pixels[pixel * (size_t)w->seen + (size_t)c];
    if (imp__loss_quadratic(t->loss))
        return imp__loss_weight(t->loss, scale, t->epsilon, *T);
    struct imp__loss_at at;
    imp__loss_eval(t->loss, scale, t->epsilon, mean, *T, &at);
    const double weight = imp__loss_gauss_newton(t->loss, scale, t->epsilon, mean, *T);
    if (weight > 0) *T = mean - at.d1 / weight;
    return weight;
}

/* Factor of the derivative of replicate b where the loss is not quadratic,
 * by the jackknife over replicates (adjoint.c). */
static void jackknife(const struct imp__wide *w, size_t pixel, int c, double S,
                      double *factor)
{
    const struct imp_target *t = w->target;
    const double scale = imp__target_weight(w->of, pixel, c), R = w->R;
    const double T = t->pixels[pixel * (size_t)w->seen + (size_t)c];
    struct imp__loss_at at;
    double A = 0;
    for (int b = 0; b < w->R; b++) {
        imp__loss_eval(t->loss, scale, t->epsilon, (S - w->L[b]) / (R - 1), T, &at);
        factor[b] = at.d1;
        A += at.d1;
    }
    imp__loss_eval(t->loss, scale, t->epsilon, S / R, T, &at);
    for (int b = 0; b < w->R; b++) factor[b] = at.d1 - (A - factor[b]) / R;
}

/* ---- H, g, and the gradient's own noise ---------------------------------------- */

/* ((R - 1)/R)^(1/2) times the change of H when one replicate is left out; pairs: sum of
 * X_k X_m over pairs of replicates. */
static void deviations_add(const struct imp__wide *w, size_t k, size_t m, double weight,
                           double pairs, double *deviations)
{
    const size_t K = w->K;
    const double R = w->R, scale = weight * sqrt((R - 1) / R);
    for (int b = 0; b < w->R; b++) {
        const double xk = w->X[(size_t)b * K + k], xm = w->X[(size_t)b * K + m];
        const double without = pairs - xk * (w->sum[m] - xm) - xm * (w->sum[k] - xk);
        deviations[((size_t)b * K + k) * K + m] +=
            scale * (without / ((R - 1) * (R - 2)) - pairs / (R * (R - 1)));
    }
}

static void pixel_add(struct imp__wide *w, int px, int py, int c,
                      struct imp__normal_sums *out)
{
    const size_t pixel = (size_t)py * (size_t)w->width + (size_t)px;
    const size_t K = w->K;
    const double R = w->R;
    double S = 0, S2 = 0, T;
    imp__wide_gather(w, pixel, c);
    memset(w->sum, 0, K * sizeof *w->sum);
    for (int b = 0; b < w->R; b++) {
        S += w->L[b];
        S2 += w->L[b] * w->L[b];
        for (size_t k = 0; k < K; k++) w->sum[k] += w->X[(size_t)b * K + k];
    }
    const double weight = imp__wide_weight(w, pixel, c, S / R, &T);
    if (weight == 0) return;
    const bool quadratic = imp__loss_quadratic(w->target->loss);
    double factor[IMP_WIDE_REPLICATES];
    if (!quadratic) jackknife(w, pixel, c, S, factor);
    out->scalars[IMP_NORMAL_CHI2] += 2 * imp__loss_unbiased(weight, T, R, S, S2);
    double residual[IMP_WIDE_REPLICATES];
    for (int b = 0; b < w->R; b++) residual[b] = w->L[b] - T;
    const bool apart = w->rows[0] == NULL; /* else all pixels share walks */
    imp__pair_noise_add(&w->noise, apart ? px : 0, apart ? py : 0, weight, residual,
                        w->X);
    imp__pair_noise_add(&w->loss_noise, apart ? px : 0, apart ? py : 0, weight, residual,
                        residual);
    for (size_t k = 0; k < K; k++) {
        double lx = 0;
        for (int b = 0; b < w->R; b++) lx += w->L[b] * w->X[(size_t)b * K + k];
        if (quadratic)
            out->g[k] +=
                weight * ((S * w->sum[k] - lx) / (R * (R - 1)) - T * w->sum[k] / R);
        else
            for (int b = 0; b < w->R; b++)
                out->g[k] += factor[b] * w->X[(size_t)b * K + k];
        for (size_t m = 0; m <= k; m++) {
            double xx = 0;
            for (int b = 0; b < w->R; b++)
                xx += w->X[(size_t)b * K + k] * w->X[(size_t)b * K + m];
            const double product = w->sum[k] * w->sum[m];
            out->H[k * K + m] += weight * (product - xx) / (R * (R - 1));
            out->H_same[k * K + m] += weight * product / (R * R);
            if (out->deviations)
                deviations_add(w, k, m, weight, product - xx, out->deviations);
        }
    }
}

static void normal_add(struct imp__wide *w, struct imp__normal_sums *out)
{
    for (int y = 0; y < w->height; y++)
        for (int x = 0; x < w->width; x++)
            for (int c = 0; c < w->seen; c++) pixel_add(w, x, y, c, out);
}

/* ---- All ----------------------------------------------------------------------- */

static enum imp_status buffers(struct imp__wide *w)
{
    const size_t K = w->K, pixels = (size_t)w->width * (size_t)w->height;
    w->L = imp__alloc(w->ctx, IMP_WIDE_REPLICATES + (IMP_WIDE_REPLICATES + 1) * K,
                      sizeof(double));
    w->sigma2 = imp__alloc(w->ctx, pixels, (2 * K + 1) * sizeof(double));
    w->row = imp__alloc(w->ctx, (size_t)imp_max(w->width, w->height), sizeof(double));
    if (!w->L || !w->sigma2 || !w->row)
        return imp__error(w->ctx, IMP_E_NOMEM,
                          "no memory for %zu derivative pictures of %d x %d", K, w->width,
                          w->height);
    w->X = w->L + IMP_WIDE_REPLICATES;
    w->sum = w->X + IMP_WIDE_REPLICATES * K;
    w->Xc = w->sigma2 + pixels;
    w->Xd = w->Xc + K * pixels;
    return IMP_OK;
}

enum imp_status imp__gauss_newton_wide(const struct imp_problem *p,
                                       const struct imp_tracer *tracer,
                                       const struct imp__moved_gradient *moved,
                                       const struct imp__target *target,
                                       const struct imp_run *run, int rounds, bool pairs,
                                       double lo, double hi, struct imp__normal_sums *out)
{
    enum imp_status st = IMP_OK;
    struct imp__wide w = {.ctx = p->ctx,
                          .of = target,
                          .moved = moved,
                          .target = &target->desc,
                          .noise_se = target->noise_se,
                          .film = &tracer->sensor->film,
                          .width = tracer->sensor->film.crop_w,
                          .height = tracer->sensor->film.crop_h,
                          .channels = p->scene->channels,
                          .seen = target->desc.channels,
                          .luminance = imp__sees_luminance(target, p->scene->channels),
                          .pairs = pairs,
                          .K = p->n};
    const bool lights = tracer->integrator->from_lights;
    if (lights) IMP_TRY(light_plan(&w, tracer, run, rounds));
    IMP_TRY(buffers(&w));
    IMP_TRY(lights ? light_replicates(&w, tracer, run, rounds, lo, hi)
                   : replicates(&w, tracer, run, rounds, lo, hi));
    IMP_TRY(imp__pair_noise_create(w.ctx, lights ? 1 : w.width, lights ? 1 : w.height,
                                   w.R, w.K, &w.noise));
    IMP_TRY(imp__pair_noise_create(w.ctx, lights ? 1 : w.width, lights ? 1 : w.height,
                                   w.R, 1, &w.loss_noise));
    normal_add(&w, out);
    IMP_TRY(imp__pair_noise_covariance(&w.noise, 2 * imp__film_border(w.film), out->cov_g,
                                       out->cov_excess));
    double variance = 0, excess = 0;
    IMP_TRY(imp__pair_noise_covariance(&w.loss_noise, 2 * imp__film_border(w.film),
                                       &variance, &excess));
    out->scalars[IMP_NORMAL_CHI2_VARIANCE] += variance;
    out->scalars[IMP_NORMAL_CHI2_EXCESS] += excess;
    imp__wide_measurement(&w, out);
out:
    for (int b = 0; b < IMP_WIDE_REPLICATES; b++) {
        imp_film_destroy(w.films[b]);
        imp__release(w.ctx, w.rows[b]);
    }
    imp__release(w.ctx, w.L);
    imp__pair_noise_destroy(&w.noise);
    imp__pair_noise_destroy(&w.loss_noise);
    imp__release(w.ctx, w.sigma2);
    imp__release(w.ctx, w.row);
    return st;
}

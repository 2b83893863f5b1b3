/* SPDX-License-Identifier: Apache-2.0
 *
 * J^T W J and J^T W r without bias (docs/estimators.md 15). With x_ik = dL_i/dx_k of walk
 * i and a replicate of n walks in one pixel and channel,
 *
 *     (J^T J)_kl ~ w [ (sum_i x_ik)(sum_i x_il) - sum_i x_ik x_il ] / (n (n-1))
 *     (J^T r)_k  ~ w { [S/(n-1) - T] mean(x_k) - sum_i L_i x_ik / (n (n-1)) }
 *
 * (products of two different walks, i != j; the mean of the others, leave-one-out),
 * averaged over replicates; of points in sets, L and x are those of a set. The same-sample matrix, which a naive product of mean
 * pictures would give, comes along for damping. Losses that are not quadratic enter with
 * Gauss and Newton's w at the mean, and with the gradient of adjoint.c: r = l'/w at the
 * mean of a few walks would have the bias that the jackknife takes off.
 *
 * Noise of the pictures themselves: sum w^2 sigma^2 J^T J is the gradient's covariance by
 * it. Where sigma is not given, the squared residual stands in for sigma^2, pixel by
 * pixel, which holds however the noise differs between pixels (White, Econometrica 48,
 * 1980); residual and J^T J come from different replicates, so that their own noise is
 * not correlated. */
#include "gauss_newton.h"
#include "adjoint.h"
#include "film/film_filter.h"
#include "film/film_tiles.h"

#include "lanes.h"
#include "loss.h"
#include <string.h>

#define GAUSS_NEWTON_MAX 256

struct job {
    const struct imp_problem *problem;
    const struct imp__target *target;
    struct imp_tracer tracer;
    struct imp__replicates plan;
    int width, channels;
    size_t K;
    struct imp_tiles tiles;
    struct worker {
        double *x;      /* [K][channels] of one walk, or set: mean */
        double *sum_x;  /* [K][seen] of a replicate */
        double *sum_lx; /* [K][seen] */
        double *sum_xx; /* [seen][K*K] */
        double *g;      /* [R][K] of a pixel */
        double *u, *au; /* [seen][K*K] of a pixel: sums over its replicates of w^2 J^T J,
                           and of that times the replicate's squared residual */
        double a[3];    /* sum over replicates of squared residuals */
        double *each_x; /* [n][K][channels] of all walks, for losses that are not
                           quadratic; NULL: there are none */
        imp_spec L[IMP_BATCH_MAX], P[IMP_BATCH_MAX];
    } * workers;
    double *total; /* [sums_count] */
};

static size_t sums_count(size_t K) { return 4 * K * K + K + IMP_NORMAL_SCALARS; }

static struct imp__normal_sums sums_at(double *p, size_t K)
{
    return (struct imp__normal_sums){.H = p,
                                     .H_same = p + K * K,
                                     .H_meas = p + 2 * K * K,
                                     .cov_g = p + 3 * K * K,
                                     .g = p + 4 * K * K,
                                     .scalars = p + 4 * K * K + K};
}

/* A walk's L and x as the target sees them: its channels, or their luminance. */
static int seen_channels(const struct job *j) { return j->target->desc.channels; }
static double seen(const struct job *j, const double *lanes, int c)
{
    return imp__seen(imp__sees_luminance(j->target, j->channels), lanes, c);
}

/* Set s of a replicate: its mean radiance, and x, the mean of its derivatives. */
static imp_spec set_mean(const struct job *j, struct imp_tile_worker *tile, int x, int y,
                         int b, int s)
{
    double *sum_x = j->workers[tile->index].x;
    const size_t width = j->K * (size_t)j->channels;
    const int64_t number = imp__replicates_first(j->plan, b, s);
    const int n = imp__replicates_set(j->plan, s + 1) - imp__replicates_set(j->plan, s);
    imp_spec L = {0};
    memset(sum_x, 0, width * sizeof *sum_x);
    for (int64_t sample = number; sample < number + n; sample++) {
        const struct imp_arena_mark mark = imp__arena_mark(&tile->arena);
        struct imp_walk walk;
        imp__walk_trace(&j->tracer, &tile->arena, x, y, sample, &walk);
        imp__tile_drop(tile, walk.dropped, x, y, sample);
        imp__lanes_sweep(&j->tracer, &walk, sum_x);
        imp__arena_rewind(&tile->arena, mark);
        L += walk.L;
    }
    if (n == 1) return L;
    for (size_t k = 0; k < width; k++) sum_x[k] /= n;
    return L / imp__spec(n);
}

/* One replicate of a pixel: adds to the tile's matrices with factor `share`, writes its
 * gradient, returns its loss. */
static double replicate(const struct job *j, struct imp_tile_worker *tile,
                        struct imp__normal_sums *out, int x, int y, int b, double share,
                        double *g)
{
    struct worker *w = &j->workers[tile->index];
    const size_t K = j->K, S = (size_t)seen_channels(j);
    const struct imp_target *t = &j->target->desc;
    const int m = j->plan.m;
    const double N = m;
    const size_t width = K * (size_t)j->channels;
    const bool quadratic = imp__loss_quadratic(t->loss);
    double sum[3] = {0}, square[3] = {0}, value = 0;
    memset(w->sum_x, 0, K * S * sizeof(double));
    memset(w->sum_lx, 0, K * S * sizeof(double));
    memset(w->sum_xx, 0, K * K * S * sizeof(double));
    memset(g, 0, K * sizeof *g);

    for (int i = 0; i < m; i++) {
        const imp_spec mean = set_mean(j, tile, x, y, b, i);
        if (!quadratic) {
            memcpy(w->each_x + (size_t)i * width, w->x, width * sizeof(double));
            w->L[i] = mean;
        }
        const double L[3] = {mean[0], mean[1], mean[2]};
        for (size_t c = 0; c < S; c++) {
            const double l = seen(j, L, (int)c);
            double *xx = w->sum_xx + c * K * K;
            sum[c] += l;
            square[c] += l * l;
            for (size_t k = 0; k < K; k++) {
                const double xk = seen(j, w->x + k * (size_t)j->channels, (int)c);
                if (xk == 0) continue;
                w->sum_x[k * S + c] += xk;
                w->sum_lx[k * S + c] += l * xk;
                for (size_t l = 0; l <= k; l++)
                    xx[k * K + l] += xk * seen(j, w->x + l * (size_t)j->channels, (int)c);
            }
        }
    }

    const size_t pixel = (size_t)y * (size_t)j->width + (size_t)x;
    if (!quadratic) {
        value = imp__replicate_adjoints(j->target, j->channels, pixel, m, w->L, w->P);
        for (int i = 0; i < m; i++)
            for (size_t k = 0; k < width; k++)
                g[k / (size_t)j->channels] +=
                    w->P[i][k % (size_t)j->channels] * w->each_x[(size_t)i * width + k];
    }
    const double scale = t->scale * (j->target->weights ? j->target->weights[pixel] : 1);
    for (size_t c = 0; c < S; c++) {
        const double T = j->target->pixels[pixel * S + c];
        const double weight =
            imp__loss_gauss_newton(t->loss, scale, t->epsilon, sum[c] / N, T);
        double T_eff = T;
        if (quadratic) {
            value += imp__loss_unbiased(weight, T, N, sum[c], square[c]);
        } else {
            struct imp__loss_at at;
            imp__loss_eval(t->loss, scale, t->epsilon, sum[c] / N, T, &at);
            T_eff = weight > 0 ? sum[c] / N - at.d1 / weight : T;
        }
        const bool known = j->target->noise_se != NULL;
        const double sigma = known ? j->target->noise_se[pixel * S + c] : 0;
        const double residual = 2 * imp__loss_unbiased(1, T_eff, N, sum[c], square[c]);
        const double square_w = weight * weight / (N * (N - 1));
        double *U = w->u + c * K * K, *AU = w->au + c * K * K;
        w->a[c] += residual;
        const double a = weight * share / (N * (N - 1)), same = weight * share / (N * N);
        const double meas = weight * weight * sigma * sigma * share / (N * (N - 1));
        const double *xx = w->sum_xx + c * K * K;
        out->scalars[IMP_NORMAL_CHI2] +=
            2 * share * imp__loss_unbiased(weight, T_eff, N, sum[c], square[c]);
        for (size_t k = 0; k < K; k++) {
            const double xk = w->sum_x[k * S + c];
            if (quadratic)
                g[k] += weight * ((sum[c] / (N - 1) - T) * xk / N -
                                  w->sum_lx[k * S + c] / (N * (N - 1)));
            for (size_t l = 0; l <= k; l++) {
                const double product = xk * w->sum_x[l * S + c],
                             u = product - xx[k * K + l];
                out->H[k * K + l] += a * u;
                out->H_same[k * K + l] += same * product;
                out->H_meas[k * K + l] += meas * u;
                if (known) continue;
                U[k * K + l] += square_w * u;
                AU[k * K + l] += square_w * residual * u;
            }
        }
    }
    return value;
}

static enum imp_status tile_work(const struct imp_tile *t, struct imp_tile_worker *tile,
                                 void *result, void *payload)
{
    struct job *j = payload;
    struct worker *w = &j->workers[tile->index];
    const size_t K = j->K;
    struct imp__normal_sums sums = sums_at(result, K), *out = &sums;
    const int b0 = imp__replicates_begin(j->plan, (int)t->part);
    const int b1 = imp__replicates_begin(j->plan, (int)t->part + 1);
    const double R = b1 - b0, all = j->plan.R;
    memset(result, 0, sums_count(K) * sizeof(double));
    for (int y = t->y0; y < t->y1; y++)
        for (int x = t->x0; x < t->x1; x++) {
            double sum = 0, square = 0;
            memset(w->u, 0, 2 * (size_t)seen_channels(j) * K * K * sizeof(double));
            memset(w->a, 0, sizeof w->a);
            for (int b = b0; b < b1; b++) {
                const double v = replicate(j, tile, out, x, y, b, 1 / all,
                                           w->g + (size_t)(b - b0) * K);
                sum += v;
                square += v * v;
            }
            const enum imp_status st = imp__tile_check(tile);
            if (st != IMP_OK) return st;
            const double spread = R / ((R - 1) * all * all);
            if (!j->target->noise_se)
                for (size_t i = 0; i < (size_t)seen_channels(j) * K * K; i++)
                    out->H_meas[i % (K * K)] +=
                        (w->a[i / (K * K)] * w->u[i] - w->au[i]) / ((R - 1) * all);
            out->scalars[IMP_NORMAL_OBJECTIVE] += sum / all;
            out->scalars[IMP_NORMAL_VARIANCE] += (square - sum * sum / R) * spread;
            for (size_t k = 0; k < K; k++) {
                double mean_k = 0;
                for (int b = 0; b < (int)R; b++) mean_k += w->g[(size_t)b * K + k] / R;
                out->g[k] += mean_k * R / all;
                for (size_t m = 0; m <= k; m++) {
                    double s = 0, mean_m = 0;
                    for (int b = 0; b < (int)R; b++) {
                        s += w->g[(size_t)b * K + k] * w->g[(size_t)b * K + m];
                        mean_m += w->g[(size_t)b * K + m] / R;
                    }
                    out->cov_g[k * K + m] += (s - R * mean_k * mean_m) * spread;
                }
            }
        }
    return IMP_OK;
}

static void tile_add(void *into, const void *from, void *payload)
{
    const struct job *j = payload;
    double *a = into;
    const double *b = from;
    for (size_t k = 0; k < sums_count(j->K); k++) a[k] += b[k];
}

static enum imp_status tile_take(size_t group, const void *sum, void *payload)
{
    struct job *j = payload;
    (void)group;
    tile_add(j->total, sum, j);
    return IMP_OK;
}

static enum imp_status workers_create(struct job *j, imp_context *ctx)
{
    const size_t K = j->K, S = 3, R = 2 * IMP_BATCHES_PER_ITEM + 2;
    bool quadratic = true;
    for (size_t t = 0; t < j->problem->n_targets; t++)
        quadratic &= imp__loss_quadratic(j->problem->targets[t].desc.loss);
    for (int k = 0; k < ctx->threads; k++) {
        struct worker *w = &j->workers[k];
        w->x = imp__alloc(ctx, K * (3 + 2 * S + R) + 3 * S * K * K, sizeof(double));
        if (!w->x) return imp__error(ctx, IMP_E_NOMEM, "no memory for derivatives");
        w->sum_x = w->x + 3 * K;
        w->sum_lx = w->sum_x + S * K;
        w->g = w->sum_lx + S * K;
        w->sum_xx = w->g + R * K;
        w->u = w->sum_xx + S * K * K;
        w->au = w->u + S * K * K;
        if (quadratic) continue;
        w->each_x = imp__alloc(ctx, IMP_BATCH_MAX, 3 * K * sizeof(double));
        if (!w->each_x) return imp__error(ctx, IMP_E_NOMEM, "no memory for derivatives");
    }
    return IMP_OK;
}

static enum imp_status target_add(struct job *j, const struct imp__target *target,
                                  int part, const struct imp_run *run, double lo,
                                  double hi, double start)
{
    const struct imp_problem *p = j->problem;
    struct imp_run own = *run;
    j->target = target;
    enum imp_status st = imp__target_tracer(p, target, part, false, &own, &j->tracer);
    if (st != IMP_OK) return st;
    const struct imp_film_desc *film = &j->tracer.sensor->film;
    if (imp__film_border(film) > 0) {
        struct imp__normal_sums total = sums_at(j->total, j->K);
        return imp__gauss_newton_wide(p, &j->tracer, target, &own, lo, hi, &total);
    }
    j->width = film->crop_w;
    j->plan = imp__replicates_normal(p->scene, target, &own);
    const double walks = (double)film->crop_w * film->crop_h * j->plan.n * j->plan.R;
    j->tiles = (struct imp_tiles){.ctx = p->ctx,
                                  .run = &own,
                                  .walks = walks,
                                  .width = film->crop_w,
                                  .height = film->crop_h,
                                  .work = tile_work,
                                  .size = sums_count(j->K) * sizeof(double),
                                  .add = tile_add,
                                  .take = tile_take,
                                  .payload = j};
    const struct imp_tiles_pass pass = {.stage = "gauss-newton",
                                        .rate_unit = "walks",
                                        .units = walks,
                                        .fraction_lo = lo,
                                        .fraction_hi = hi,
                                        .start_s = start,
                                        .parts = (size_t)j->plan.chunks};
    st = imp__tiles_create(&j->tiles);
    if (st == IMP_OK) st = imp__tiles_run(&j->tiles, &pass);
    imp__tiles_destroy(&j->tiles);
    return st;
}

/* Number of pixels whose weight is not 0. */
static double pixels_in_use(const struct imp__target *t)
{
    const size_t n = (size_t)t->desc.width * (size_t)t->desc.height;
    double count = 0;
    for (size_t i = 0; i < n; i++) count += !t->weights || t->weights[i] > 0;
    return count;
}

static void matrix_copy(double *to, const double *lower, size_t K)
{
    if (!to) return;
    for (size_t k = 0; k < K; k++)
        for (size_t m = 0; m <= k; m++) to[k * K + m] = to[m * K + k] = lower[k * K + m];
}

static enum imp_status data_term(struct imp_problem *p, const struct imp_run *run,
                                 struct imp_estimate *out)
{
    double *x = imp__alloc(p->ctx, p->n, sizeof *x);
    if (!x) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for %zu variables", p->n);
    imp_problem_get_x(p, x);
    const enum imp_status st = imp_problem_objective(p, NULL, run, out, NULL, NULL);
    if (st == IMP_OK) out->value -= imp__regularise(p, x, NULL);
    imp__release(p->ctx, x);
    return st;
}

enum imp_status imp__gauss_newton(struct imp_problem *p, const double *x,
                                  const struct imp_run *run,
                                  struct imp__gauss_newton *out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = p->ctx;
    struct imp_run own = IMP_RUN_INIT;
    if (run) own = *run;
    struct job j = {.problem = p, .K = p->n, .channels = p->scene->channels};
    double residuals = 0;
    int bias_order = 0;
    bool wide = false;
    if (p->n == 0 || p->n > GAUSS_NEWTON_MAX)
        IMP_TRY(imp__error(ctx, IMP_E_ARG,
                           "%zu numbers are active; Gauss-Newton takes 1 to %d", p->n,
                           GAUSS_NEWTON_MAX));
    if (x) IMP_TRY(imp_problem_set_x(p, x));
    j.workers = imp__alloc(ctx, (size_t)ctx->threads, sizeof *j.workers);
    j.total = imp__alloc(ctx, sums_count(j.K), sizeof *j.total);
    if (!j.workers || !j.total)
        IMP_TRY(
            imp__error(ctx, IMP_E_NOMEM, "no memory for %zu x %zu matrices", j.K, j.K));
    IMP_TRY(workers_create(&j, ctx));

    const double start = imp__now(), targets = (double)p->n_targets;
    for (size_t t = 0; t < p->n_targets; t++) {
        const int parts = imp__target_parts(&p->targets[t]);
        for (int k = 0; k < parts; k++)
            IMP_TRY(target_add(&j, imp__target_part(&p->targets[t], k), k, &own,
                               ((double)t + (double)k / parts) / targets,
                               ((double)t + (double)(k + 1) / parts) / targets, start));
        residuals +=
            (double)(p->targets[t].desc.channels) * pixels_in_use(&p->targets[t]);
        const int bias = imp__loss_bias_order(p->targets[t].desc.loss);
        if (bias && (!bias_order || bias < bias_order)) bias_order = bias;
        wide |= imp__film_border(&j.tracer.sensor->film) > 0;
    }
    /* With wide filters, the same estimate as that of trial steps from the same walks. */
    const struct imp__normal_sums total = sums_at(j.total, j.K);
    struct imp_estimate objective = {total.scalars[IMP_NORMAL_OBJECTIVE],
                                     sqrt(fmax(0, total.scalars[IMP_NORMAL_VARIANCE])),
                                     bias_order};
    if (wide) IMP_TRY(data_term(p, &own, &objective));
    matrix_copy(out->H, total.H, j.K);
    matrix_copy(out->H_same, total.H_same, j.K);
    matrix_copy(out->H_meas, total.H_meas, j.K);
    matrix_copy(out->cov_g, total.cov_g, j.K);
    for (size_t k = 0; k < j.K; k++) {
        if (out->g) out->g[k] = total.g[k];
        if (out->g_se) out->g_se[k] = sqrt(fmax(0, total.cov_g[k * j.K + k]));
    }
    out->objective = objective;
    out->chi2 = total.scalars[IMP_NORMAL_CHI2];
    out->n_residuals = residuals;
out:
    for (int k = 0; j.workers && k < ctx->threads; k++) {
        imp__release(ctx, j.workers[k].x);
        imp__release(ctx, j.workers[k].each_x);
    }
    imp__release(ctx, j.workers);
    imp__release(ctx, j.total);
    return st;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * One pixel and one tile of the normal equations with a filter no wider than a pixel
 * (gauss_newton.c has the formulas). */
#include "normal_tiles.h"
#include "adjoint.h"

#include "lanes.h"
#include "loss.h"
#include <string.h>

/* A walk's L and x as the target sees them: its channels, or their luminance. */
static int seen_channels(const struct imp__normal_job *j)
{
    return j->target->desc.channels;
}
static double seen(const struct imp__normal_job *j, const double *lanes, int c)
{
    return imp__seen(imp__sees_luminance(j->target, j->channels), lanes, c);
}

/* Set s of a replicate: its mean radiance, and x, the mean of its derivatives. */
static imp_spec set_mean(const struct imp__normal_job *j, struct imp_tile_worker *tile,
                         int x, int y, int b, int s)
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
static double replicate(const struct imp__normal_job *j, struct imp_tile_worker *tile,
                        struct imp__normal_sums *out, int x, int y, int b, double share,
                        double *g)
{
    struct imp__normal_worker *w = &j->workers[tile->index];
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

enum imp_status imp__normal_work(const struct imp_tile *t, struct imp_tile_worker *tile,
                                 void *result, void *payload)
{
    struct imp__normal_job *j = payload;
    struct imp__normal_worker *w = &j->workers[tile->index];
    const size_t K = j->K;
    struct imp__normal_sums sums = imp__normal_at(result, K), *out = &sums;
    const int b0 = imp__replicates_begin(j->plan, (int)t->part);
    const int b1 = imp__replicates_begin(j->plan, (int)t->part + 1);
    const double R = b1 - b0, all = j->plan.R;
    memset(result, 0, imp__normal_count(K) * sizeof(double));
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

void imp__normal_add(void *into, const void *from, void *payload)
{
    const struct imp__normal_job *j = payload;
    double *a = into;
    const double *b = from;
    for (size_t k = 0; k < imp__normal_count(j->K); k++) a[k] += b[k];
}

enum imp_status imp__normal_take(size_t group, const void *sum, void *payload)
{
    struct imp__normal_job *j = payload;
    (void)group;
    imp__normal_add(j->total, sum, j);
    return IMP_OK;
}

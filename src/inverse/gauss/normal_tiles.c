/* SPDX-License-Identifier: Apache-2.0
 *
 * One pixel and one tile of the normal equations with a filter no wider than a pixel
 * (gauss_newton.c has the formulas). */
#include "normal_tiles.h"
#include "inverse/estimate/adjoint.h"

#include "inverse/estimate/channel_sink.h"
#include "inverse/estimate/tile_walks.h"
#include "inverse/problem/loss.h"
#include <math.h>
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
                         struct imp__tile_walks *walks, int x, int y, int b, int s)
{
    double *sum_x = j->workers[tile->index].x;
    const size_t width = j->K * (size_t)j->channels;
    const int64_t number = imp__replicates_first(j->plan, b, s);
    const int n = imp__replicates_set(j->plan, s + 1) - imp__replicates_set(j->plan, s);
    imp_spec L = {0};
    memset(sum_x, 0, width * sizeof *sum_x);
    for (int64_t sample = number; sample < number + n; sample++) {
        imp__tile_walks_ready(walks);
        const struct imp_arena_mark mark = imp__arena_mark(&tile->arena);
        struct imp_walk walk;
        imp__tile_walk(walks, x, y, sample, &walk);
        imp__tile_drop(tile, walk.dropped, x, y, sample);
        imp__lanes_sweep(&j->tracer, &walk, sum_x);
        imp__arena_rewind(&tile->arena, mark);
        L += walk.L;
    }
    if (n == 1) return L;
    for (size_t k = 0; k < width; k++) sum_x[k] /= n;
    return L / imp__spec(n);
}

/* ---- The units of a pixel ------------------------------------------------------- */

struct pixel {
    struct imp__normal_worker *w;
    struct imp__tile_walks *walks;
    size_t index;         /* of the pixel */
    int M;                /* units */
    size_t T;             /* values touched */
    double share;         /* of the samples of the pixel that these are */
    double value, square; /* sums over replicates of the loss, and of its square */
};

/* Replicates [b0, b1) of a pixel as units; their losses are those of the objective. */
static void units_gather(const struct imp__normal_job *j, struct imp_tile_worker *tile,
                         int x, int y, int b0, int b1, struct pixel *p)
{
    struct imp__normal_worker *w = p->w;
    const size_t K = j->K, S = (size_t)seen_channels(j);
    const int m = j->plan.m, sets = (b1 - b0) * m;
    memset(w->X, 0, (size_t)p->M * K * S * sizeof *w->X);
    memset(w->r, 0, sizeof w->r);
    for (int i = 0; i < sets; i++) {
        const int u = (int)((int64_t)i * p->M / sets);
        const int u1 = (int)(((int64_t)(u + 1) * sets + p->M - 1) / p->M);
        const int u0 = (int)(((int64_t)u * sets + p->M - 1) / p->M);
        const double part = 1.0 / (u1 - u0);
        const imp_spec mean = set_mean(j, tile, p->walks, x, y, b0 + i / m, i % m);
        const double L[3] = {mean[0], mean[1], mean[2]};
        double *X = w->X + (size_t)u * K * S;
        for (size_t c = 0; c < S; c++) w->r[u][c] += part * seen(j, L, (int)c);
        for (size_t k = 0; k < K; k++)
            for (size_t c = 0; c < S; c++)
                X[c * K + k] += part * seen(j, w->x + k * (size_t)j->channels, (int)c);
        w->L[i % m] = mean;
        if (i % m < m - 1) continue;
        const double v = imp__replicate_adjoints(j->target, j->channels, p->index, m,
                                                 w->L, w->L, w->P);
        p->value += v;
        p->square += v * v;
    }
}

/* X without the values whose entries are 0 in all units. */
static void touched_find(const struct imp__normal_job *j, struct pixel *p)
{
    struct imp__normal_worker *w = p->w;
    const size_t K = j->K, rows = (size_t)p->M * (size_t)seen_channels(j);
    p->T = 0;
    for (size_t k = 0; k < K; k++) {
        bool any = false;
        for (size_t i = 0; i < rows && !any; i++) any = w->X[i * K + k] != 0;
        if (any) w->touched[p->T++] = k;
    }
    if (p->T == K) return;
    double *to = w->X;
    for (size_t i = 0; i < rows; i++) /* never ahead of what is read */
        for (size_t t = 0; t < p->T; t++) *to++ = w->X[i * K + w->touched[t]];
}

/* ---- One channel ---------------------------------------------------------------- */

/* Mean over pairs of different units of [a0, a1) of the residuals' product, of two channels. */
static double residual_product(const struct pixel *p, size_t c, size_t d, int a0, int a1)
{
    const double n = a1 - a0;
    double sc = 0, sd = 0, both = 0;
    for (int a = a0; a < a1; a++) {
        sc += p->w->r[a][c];
        sd += p->w->r[a][d];
        both += p->w->r[a][c] * p->w->r[a][d];
    }
    return (sc * sd - both) / (n * (n - 1));
}
static double square_residual(const struct pixel *p, size_t c, int a0, int a1)
{
    return residual_product(p, c, c, a0, a1);
}

/* Sums of x and x x^T over units [a0, a1). */
static void products(const struct imp__normal_job *j, const struct pixel *p, size_t c,
                     int a0, int a1, double *sum, double *xx)
{
    const size_t T = p->T, S = (size_t)seen_channels(j);
    memset(sum, 0, T * sizeof *sum);
    memset(xx, 0, T * T * sizeof *xx);
    for (int a = a0; a < a1; a++) {
        const double *x = p->w->X + ((size_t)a * S + c) * T;
        for (size_t k = 0; k < T; k++) {
            if (x[k] == 0) continue;
            sum[k] += x[k];
            for (size_t l = 0; l <= k; l++) xx[k * T + l] += x[k] * x[l];
        }
    }
}

/* What the jackknife over groups of units g makes of J^T W J: ((M - u)/M)^(1/2) times its
 * change when group g, u of the M units, is left out. */
static void deviations_add(const struct imp__normal_job *j, const struct pixel *p,
                           size_t c, double weight, const double *sum, const double *xx,
                           double *deviations)
{
    const size_t K = j->K, T = p->T, *touched = p->w->touched;
    const double M = p->M;
    double *own = p->w->own, *own_xx = own + T;
    for (int g = 0; g < IMP_DEVIATIONS; g++) {
        const int a0 = g * p->M / IMP_DEVIATIONS, a1 = (g + 1) * p->M / IMP_DEVIATIONS;
        const double n = M - (a1 - a0), scale = weight * p->share * sqrt(n / M);
        const double f = scale / (n * (n - 1)), all = scale / (M * (M - 1));
        double *H = deviations + (size_t)g * K * K;
        products(j, p, c, a0, a1, own, own_xx);
        for (size_t k = 0; k < T; k++) {
            const double xk = sum[k] - own[k];
            double *row = H + touched[k] * K;
            for (size_t l = 0; l <= k; l++) {
                const size_t kl = k * T + l;
                row[touched[l]] += f * (xk * (sum[l] - own[l]) - (xx[kl] - own_xx[kl])) -
                                   all * (sum[k] * sum[l] - xx[kl]);
            }
        }
    }
}

static void channel_add(const struct imp__normal_job *j, const struct pixel *p, size_t c,
                        struct imp__normal_sums *out)
{
    struct imp__normal_worker *w = p->w;
    const size_t K = j->K, S = (size_t)seen_channels(j), T = p->T;
    const size_t *touched = w->touched;
    const int half = p->M / 2;
    const double M = p->M, pairs = M * (M - 1), n0 = half, n1 = M - half;
    double factor[IMP_NORMAL_UNITS];
    const double weight =
        imp__normal_residuals(j->target, p->index, c, p->M, p->w->r, factor);
    const bool quadratic = imp__loss_quadratic(j->target->desc.loss);
    const bool known = j->target->noise_se != NULL;
    const double sigma = known ? j->target->noise_se[p->index * S + c] : 0;
    double *sum = w->sum, *xx = w->sum_xx, *sum1 = w->sum1, *xx1 = w->sum1_xx;
    w->weight[c] = weight;
    products(j, p, c, 0, half, sum, xx);
    products(j, p, c, half, p->M, sum1, xx1);
    /* Cross-fitted: J^T J of each half times the squared residual of the other. */
    const double meas = 0.5 * weight * weight * p->share;
    const double m0 =
        known ? 0 : meas / (n0 * (n0 - 1)) * square_residual(p, c, half, p->M);
    const double m1 = known ? 0 : meas / (n1 * (n1 - 1)) * square_residual(p, c, 0, half);
    const double m = 2 * meas * sigma * sigma / pairs;
    const double h = weight * p->share / pairs, same = weight * p->share / (M * M);
    for (size_t k = 0; k < T; k++)
        for (size_t l = 0; l <= k; l++) {
            const size_t kl = k * T + l, to = touched[k] * K + touched[l];
            const double u0 = sum[k] * sum[l] - xx[kl], u1 = sum1[k] * sum1[l] - xx1[kl];
            const double all = (sum[k] + sum1[k]) * (sum[l] + sum1[l]);
            const double u = all - xx[kl] - xx1[kl];
            out->H[to] += h * u;
            out->H_same[to] += same * all;
            out->H_meas[to] += known ? m * u : m0 * u0 + m1 * u1;
        }
    out->scalars[IMP_NORMAL_CHI2] += weight * p->share * square_residual(p, c, 0, p->M);
    for (size_t i = 0; i < T * T; i++) xx[i] += xx1[i];
    for (size_t k = 0; k < T; k++) sum[k] += sum1[k];
    if (out->deviations) deviations_add(j, p, c, weight, sum, xx, out->deviations);
    for (size_t k = 0; !quadratic && k < T; k++)
        for (int a = 0; a < p->M; a++)
            out->g[touched[k]] +=
                p->share * factor[a] * w->X[((size_t)a * S + c) * T + k];
}

/* ---- Two channels ------------------------------------------------------------------ */

/* Sums of x of two channels, and of x_c x_d^T, over units [a0, a1). */
static void pair_products(const struct imp__normal_job *j, const struct pixel *p,
                          size_t c, size_t d, int a0, int a1, double *sum_c,
                          double *sum_d, double *xx)
{
    const size_t T = p->T, S = (size_t)seen_channels(j);
    memset(sum_c, 0, T * sizeof *sum_c);
    memset(sum_d, 0, T * sizeof *sum_d);
    memset(xx, 0, T * T * sizeof *xx);
    for (int a = a0; a < a1; a++) {
        const double *xc = p->w->X + ((size_t)a * S + c) * T;
        const double *xd = p->w->X + ((size_t)a * S + d) * T;
        for (size_t k = 0; k < T; k++) {
            sum_c[k] += xc[k];
            sum_d[k] += xd[k];
            if (xc[k] == 0) continue;
            for (size_t l = 0; l < T; l++) xx[k * T + l] += xc[k] * xd[l];
        }
    }
}

/* What the noise of channels c < d has together: the cross-fitted product of residuals in place of
 * sigma^2; with given sigmas these, for a correlation that is known at the end. */
static void pair_add(const struct imp__normal_job *j, const struct pixel *p, size_t c,
                     size_t d, struct imp__normal_sums *out)
{
    const struct imp__normal_worker *w = p->w;
    const size_t K = j->K, S = (size_t)seen_channels(j), T = p->T;
    const float *se = j->target->noise_se;
    const int half = p->M / 2;
    const double M = p->M, n0 = half, n1 = M - half;
    const double weight = w->weight[c] * w->weight[d] * p->share;
    double *c0 = w->sum, *c1 = w->sum1, *d0 = w->e, *d1 = w->e + T, *xx0 = w->sum_xx,
           *xx1 = w->sum1_xx, *to = out->H_meas, m0 = 0, m1 = 0, m = 0;
    if (weight == 0) return;
    if (se) {
        const double sc = se[p->index * S + c], sd = se[p->index * S + d];
        const double share = p->share;
        double *z = out->scalars + IMP_NORMAL_CHANNELS + 6 * (c + d - 1);
        z[0] += share * square_residual(p, c, 0, p->M);
        z[1] += share * square_residual(p, d, 0, p->M);
        z[2] += share * residual_product(p, c, d, 0, p->M);
        z[3] += share * sc * sc;
        z[4] += share * sd * sd;
        z[5] += share;
        m = weight * sc * sd / (M * (M - 1));
        to = out->cross + (c + d - 1) * K * K;
    } else {
        m0 = 0.5 * weight / (n0 * (n0 - 1)) * residual_product(p, c, d, half, p->M);
        m1 = 0.5 * weight / (n1 * (n1 - 1)) * residual_product(p, c, d, 0, half);
    }
    pair_products(j, p, c, d, 0, half, c0, d0, xx0);
    pair_products(j, p, c, d, half, p->M, c1, d1, xx1);
    for (size_t k = 0; k < T; k++)
        for (size_t l = 0; l <= k; l++) {
            const size_t kl = k * T + l, lk = l * T + k;
            const double same0 = xx0[kl] + xx0[lk], same1 = xx1[kl] + xx1[lk];
            const double u0 = c0[k] * d0[l] + c0[l] * d0[k] - same0,
                         u1 = c1[k] * d1[l] + c1[l] * d1[k] - same1;
            const double u = (c0[k] + c1[k]) * (d0[l] + d1[l]) +
                             (c0[l] + c1[l]) * (d0[k] + d1[k]) - same0 - same1;
            to[w->touched[k] * K + w->touched[l]] += se ? m * u : m0 * u0 + m1 * u1;
        }
}

static void pairs_add(const struct imp__normal_job *j, const struct pixel *p,
                      struct imp__normal_sums *out)
{
    const size_t S = (size_t)seen_channels(j);
    for (size_t c = 0; j->pairs && c < S; c++)
        for (size_t d = c + 1; d < S; d++) pair_add(j, p, c, d, out);
}

void imp__normal_cross(const struct imp__normal_job *j, struct imp__normal_sums *sums)
{
    const size_t KK = j->K * j->K;
    for (size_t pair = 0; sums->cross && pair < 3; pair++) {
        struct imp__channel_pair z;
        memcpy(&z, sums->scalars + IMP_NORMAL_CHANNELS + 6 * pair, sizeof z);
        const double rho = imp__channel_correlation(&z);
        for (size_t i = 0; i < KK; i++)
            sums->H_meas[i] += rho * sums->cross[pair * KK + i];
    }
}

/* ---- The gradient and its noise --------------------------------------------------- */

/* v += 1/2 sum over channels of w (r_a x_b + r_b x_a). */
static void pair(const struct imp__normal_job *j, const struct pixel *p, int a, int b,
                 double *v)
{
    const struct imp__normal_worker *w = p->w;
    const size_t T = p->T, S = (size_t)seen_channels(j);
    for (size_t c = 0; c < S; c++) {
        const double *xa = w->X + ((size_t)a * S + c) * T;
        const double *xb = w->X + ((size_t)b * S + c) * T;
        const double ra = 0.5 * w->weight[c] * w->r[a][c];
        const double rb = 0.5 * w->weight[c] * w->r[b][c];
        for (size_t k = 0; k < T; k++) v[k] += ra * xb[k] + rb * xa[k];
    }
}

/* Adds v v^T over the values touched, v [T]. */
static void square_add(const struct imp__normal_job *j, const struct pixel *p,
                       double scale, const double *v, double *out)
{
    const size_t *touched = p->w->touched;
    for (size_t k = 0; k < p->T; k++) {
        if (v[k] == 0) continue;
        const double f = scale * v[k];
        double *row = out + touched[k] * j->K;
        for (size_t l = 0; l <= k; l++) row[touched[l]] += f * v[l];
    }
}

/* The mean over pairs, its jackknife, and what that has too much (pair_noise.h). */
static void gradient_add(const struct imp__normal_job *j, const struct pixel *p,
                         struct imp__normal_sums *out)
{
    struct imp__normal_worker *w = p->w;
    const size_t T = p->T;
    const double M = p->M, s2 = p->share * p->share;
    double *h = w->h, *e = w->e, *total = w->total;
    memset(h, 0, IMP_NORMAL_PAIRS * T * sizeof *h);
    memset(e, 0, IMP_NORMAL_UNITS * T * sizeof *e);
    memset(total, 0, T * sizeof *total);
    for (int a = 0; a < p->M; a++)
        for (int b = a + 1; b < p->M; b++, h += T) {
            pair(j, p, a, b, h);
            for (size_t k = 0; k < T; k++) {
                e[(size_t)a * T + k] += h[k];
                e[(size_t)b * T + k] += h[k];
                total[k] += h[k];
            }
        }
    if (imp__loss_quadratic(j->target->desc.loss))
        for (size_t k = 0; k < T; k++)
            out->g[w->touched[k]] += p->share * total[k] / (M * (M - 1) / 2);
    for (int a = 0; a < p->M; a++) {
        double *own = e + (size_t)a * T;
        for (size_t k = 0; k < T; k++) own[k] = (own[k] - 2 * total[k] / M) / (M - 2);
        square_add(j, p, s2 * 4 / (M * (M - 1)), own, out->cov_g);
    }
    const double scale = s2 * 4 / (M * (M - 1) * (M - 2) * (M - 3));
    h = w->h;
    for (int a = 0; a < p->M; a++)
        for (int b = a + 1; b < p->M; b++, h += T) {
            for (size_t k = 0; k < T; k++)
                h[k] -= total[k] / (M * (M - 1) / 2) + e[(size_t)a * T + k] +
                        e[(size_t)b * T + k];
            square_add(j, p, scale, h, out->cov_excess);
        }
}

/* Variance of chi^2, of the mean over pairs of sum over channels of w r_a r_b: its
 * jackknife, and what that has too much. */
static void chi2_variance_add(const struct imp__normal_job *j, const struct pixel *p,
                              double *variance, double *excess)
{
    const struct imp__normal_worker *w = p->w;
    const size_t S = (size_t)seen_channels(j);
    const double M = p->M;
    double h[IMP_NORMAL_UNITS][IMP_NORMAL_UNITS], e[IMP_NORMAL_UNITS] = {0}, total = 0;
    double first = 0, second = 0;
    for (int a = 0; a < p->M; a++)
        for (int b = a + 1; b < p->M; b++) {
            double product = 0;
            for (size_t c = 0; c < S; c++)
                product += w->weight[c] * w->r[a][c] * w->r[b][c];
            h[a][b] = product;
            e[a] += product;
            e[b] += product;
            total += product;
        }
    for (int a = 0; a < p->M; a++) {
        e[a] = (e[a] - 2 * total / M) / (M - 2);
        first += e[a] * e[a];
    }
    for (int a = 0; a < p->M; a++)
        for (int b = a + 1; b < p->M; b++)
            second += imp__sqr(h[a][b] - total / (M * (M - 1) / 2) - e[a] - e[b]);
    const double scale = p->share * p->share * 4 / (M * (M - 1));
    *variance += scale * first;
    *excess += scale * second / ((M - 2) * (M - 3));
}

/* ---- Tiles ------------------------------------------------------------------------ */

static bool counts(const void *job, int x, int y)
{
    const struct imp__normal_job *j = job;
    return imp__target_counts(j->target, (size_t)y * (size_t)j->width + (size_t)x);
}

enum imp_status imp__normal_work(const struct imp_tile *t, struct imp_tile_worker *tile,
                                 void *result, void *payload)
{
    struct imp__normal_job *j = payload;
    struct imp__normal_sums out = imp__normal_at(j, result);
    const int b0 = imp__replicates_begin(j->plan, (int)t->part);
    const int b1 = imp__replicates_begin(j->plan, (int)t->part + 1);
    const double R = b1 - b0, all = j->plan.R;
    struct imp__tile_walks walks;
    memset(result, 0, imp__normal_count(j) * sizeof(double));
    imp__tile_walks_begin(&j->tracer, t, tile, j->plan, b0, b1, 1, counts, j, &walks);
    for (int y = t->y0; y < t->y1; y++)
        for (int x = t->x0; x < t->x1; x++) {
            struct pixel p = {.w = &j->workers[tile->index],
                              .walks = &walks,
                              .index = (size_t)y * (size_t)j->width + (size_t)x,
                              .M = imp__normal_units((b1 - b0) * j->plan.m),
                              .share = R / all};
            if (!counts(j, x, y)) continue;
            units_gather(j, tile, x, y, b0, b1, &p);
            const enum imp_status st = imp__tile_check(tile);
            if (st != IMP_OK) return st;
            touched_find(j, &p);
            for (size_t c = 0; c < (size_t)seen_channels(j); c++)
                channel_add(j, &p, c, &out);
            pairs_add(j, &p, &out);
            gradient_add(j, &p, &out);
            chi2_variance_add(j, &p, &out.scalars[IMP_NORMAL_CHI2_VARIANCE],
                              &out.scalars[IMP_NORMAL_CHI2_EXCESS]);
            out.scalars[IMP_NORMAL_OBJECTIVE] += p.value / all;
            out.scalars[IMP_NORMAL_VARIANCE] +=
                (p.square - p.value * p.value / R) * R / ((R - 1) * all * all);
        }
    return IMP_OK;
}

void imp__normal_add(void *into, const void *from, void *payload)
{
    const struct imp__normal_job *j = payload;
    double *a = into;
    const double *b = from;
    for (size_t k = 0; k < imp__normal_count(j); k++) a[k] += b[k];
}

enum imp_status imp__normal_take(size_t group, const void *sum, void *payload)
{
    struct imp__normal_job *j = payload;
    (void)group;
    imp__normal_add(j->total, sum, j);
    return IMP_OK;
}

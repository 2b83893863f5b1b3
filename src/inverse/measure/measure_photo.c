/* SPDX-License-Identifier: Apache-2.0
 *
 * What a scene leaves over of a photograph. */
#include "base/arguments.h"
#include "math/rng.h"
#include "measuring.h"
#include <math.h>
#include <stdlib.h>

#define HUBER 2.5
#define SLACK                                                                            \
    0.1         /* of a pixel: by so much an edge may be off while places are measured */
#define LOOK 64 /* samples per pixel of the pictures that are compared, at least */

static int ascending(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* The power of the film's curve: its values are M^(1/gamma). */
static double gamma_of(const struct imp__measure *m, const struct imp__photo *p)
{
    size_t index;
    const struct imp_param *q = imp__measure_film_number(m, p, "gamma", &index);
    return q ? imp__param_get(q, 0) : 1;
}

/* A value of a photograph beside the picture's. */
struct compared {
    double residual; /* NAN: it is not compared */
    double own;      /* variance of the picture's */
};

static struct compared value_compare(const struct imp__photo *p, double noise, double T,
                                     double lift, double M, double M_se, double gamma)
{
    const bool curve = gamma != 1;
    struct compared v = {NAN, 0};
    if (curve && T < IMP_PHOTOGRAPH_LEAST) return v;
    const double V = curve ? pow(fmax(M, 0), 1 / gamma) : M;
    const double slope = curve ? V / (gamma * fmax(M, 1e-12)) : 1;
    v.own = isfinite(M_se) ? imp__sqr(slope * M_se) : 0;
    const double doubt = 3 * sqrt(noise * noise + v.own);
    if (p->desc.clipped && T >= p->desc.high)
        v.residual = V > p->desc.high - doubt ? NAN : p->desc.high - V;
    else if (p->desc.clipped && T <= p->desc.low)
        v.residual = V < p->desc.low + doubt ? NAN : p->desc.low - V;
    else v.residual = T - lift - V;
    return v;
}

/* Sums over the pixels that have a weight. The expectation of squared residuals contains the variance
 * of the picture, which is taken off: chi2 = sum w (r^2 - own)/noise^2 / sum w, with a variance of
 * 2 sum w^2 (1 + own/noise^2)^2 for Gaussian residuals, which w = (noise^2/(noise^2 + own))^2 makes least.
 * Without w, a few pixels that a lamp covers in part would be most of it. */
struct sums {
    double square, own, variance, weights;
    size_t n;
};

/* The mean of the picture's variances around a pixel: its own goes with its residual, as both are of
 * the same walks, and weights by it would prefer residuals that are small by chance. */
static double own_around(const struct imp__photo *p, size_t pixel, int c)
{
    const int w = p->desc.width, h = p->desc.height, C = p->desc.channels;
    const int x = (int)(pixel % (size_t)w), y = (int)(pixel / (size_t)w);
    double sum = 0;
    int n = 0;
    for (int j = imp_max(0, y - 1); j <= imp_min(h - 1, y + 1); j++)
        for (int i = imp_max(0, x - 1); i <= imp_min(w - 1, x + 1); i++) {
            if (i == x && j == y) continue;
            sum +=
                (double)
                    p->own[((size_t)j * (size_t)w + (size_t)i) * (size_t)C + (size_t)c];
            n++;
        }
    return n > 0 ? sum / n : 0;
}

static void pixel_add(struct imp__photo *p, size_t i, struct sums *s)
{
    double square = 0, expected = 0;
    const int C = p->desc.channels;
    for (int c = 0; c < C; c++) {
        const size_t at = i * (size_t)C + (size_t)c;
        const double residual = (double)p->left[at], own = (double)p->own[at];
        if (isnan(residual)) continue;
        const double noise2 = imp__sqr((double)p->noise_se[at]), both = noise2 + own;
        square += imp__sqr(residual);
        expected += both;
        if (!(p->weights[i] > 0)) continue;
        const double w = imp__sqr(noise2 / (noise2 + own_around(p, i, c)));
        s->square += w * imp__sqr(residual) / noise2;
        s->own += w * own / noise2;
        s->variance += 2 * imp__sqr(w * both / noise2);
        s->weights += w;
        s->n++;
    }
    p->square[i] = (float)square;
    p->expected[i] = (float)expected;
}

/* A value of the picture as the photograph would have it. */
static double value_of(const struct imp__photo *p, const float *mean, size_t pixel, int c,
                       double gamma)
{
    const double M = fmax((double)mean[pixel * (size_t)p->desc.channels + (size_t)c], 0);
    const double V = gamma == 1 ? M : pow(M, 1 / gamma);
    return p->desc.clipped ? fmin(V, p->desc.high) : V;
}

/* An edge that is off by a part of a pixel, where a place is not yet right, makes residuals of that part of its
 * height: those of a lamp's edge are many times the noise, are no outliers, and tell most of the
 * place. mean: the picture. */
static void edges_set(const struct imp__measure *m, struct imp__photo *p,
                      const float *mean, double gamma)
{
    const int w = p->desc.width, h = p->desc.height, C = p->desc.channels;
    const bool moves = imp__measure_count(m, IMP_MEASURE_CAMERAS) +
                           imp__measure_count(m, IMP_MEASURE_LENS) >
                       0;
    for (size_t i = 0; i < p->n_pixels; i++) p->edges[i] = 0;
    for (int y = 0; y < h && moves; y++)
        for (int x = 0; x < w; x++)
            for (int c = 0; c < C; c++) {
                const size_t at = (size_t)y * (size_t)w + (size_t)x;
                const double here = value_of(p, mean, at, c, gamma);
                double most = 0; /* between neighbours */
                if (x > 0)
                    most = fmax(most, fabs(here - value_of(p, mean, at - 1, c, gamma)));
                if (x + 1 < w)
                    most = fmax(most, fabs(here - value_of(p, mean, at + 1, c, gamma)));
                if (y > 0)
                    most = fmax(most,
                                fabs(here - value_of(p, mean, at - (size_t)w, c, gamma)));
                if (y + 1 < h)
                    most = fmax(most,
                                fabs(here - value_of(p, mean, at + (size_t)w, c, gamma)));
                p->edges[at] += (float)imp__sqr(SLACK * most);
            }
}

/* Weights by which single pixels that are far off do not lead a fit (Huber, Ann. Math. Statist. 35,
 * 1964: above HUBER robust standard deviations a residual counts by its magnitude). */
static enum imp_status robust_set(struct imp__measure *m, struct imp__photo *p)
{
    size_t n = 0;
    float *list = imp__alloc(m->ctx, p->n_pixels, sizeof *list);
    if (!list) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for %s", p->name);
    for (size_t i = 0; i < p->n_pixels; i++)
        if (p->expected[i] > 0) list[n++] = p->square[i] / (p->expected[i] + p->edges[i]);
    qsort(list, n, sizeof *list, ascending);
    const double middle = n > 0 ? sqrt((double)list[n / 2]) / 0.6745 : 0;
    for (size_t i = 0; i < p->n_pixels; i++) {
        p->robust[i] = 1;
        if (!(p->expected[i] > 0)) continue;
        const double r = sqrt((double)(p->square[i] / (p->expected[i] + p->edges[i])));
        if (r > HUBER * middle) p->robust[i] = (float)(HUBER * middle / r);
    }
    imp__release(m->ctx, list);
    return IMP_OK;
}

enum imp_status imp__measure_residual(struct imp__measure *m, struct imp__photo *p,
                                      uint64_t seed)
{
    enum imp_status st = IMP_OK;
    imp_problem *blank = NULL;
    imp_film *film = NULL;
    struct imp_run run = m->run;
    struct sums sums = {0};
    const int C = p->desc.channels;
    const double gamma = gamma_of(m, p);
    run.sensor = p->desc.sensor;
    run.spp = imp_max(LOOK, run.spp);
    run.seed = imp__mix64(m->run.seed ^ seed);
    run.time_limit_s = 0;
    run.preview = NULL;
    IMP_TRY(imp_problem_create(m->scene, &blank));
    IMP_TRY(imp_problem_jacobian(blank, &run, &film, NULL));
    const float *mean = imp_film_mean(film), *se = imp_film_se(film);
    if (imp__measure_noise_varies(p)) imp__measure_noise_by_light(p, mean, gamma);
    for (size_t i = 0; i < p->n_pixels; i++) {
        for (int c = 0; c < C; c++) {
            const size_t at = i * (size_t)C + (size_t)c;
            const struct compared v = value_compare(
                p, (double)p->noise_se[at], (double)p->desc.pixels[at],
                (double)p->lift[at], (double)mean[at], se ? (double)se[at] : 0, gamma);
            p->left[at] = (float)v.residual;
            p->own[at] = (float)v.own;
        }
    }
    for (size_t i = 0; i < p->n_pixels; i++) pixel_add(p, i, &sums);
    edges_set(m, p, mean, gamma);
    IMP_TRY(robust_set(m, p));
    p->n_compared = sums.n;
    p->chi2 = sums.n > 0 ? (sums.square - sums.own) / sums.weights : NAN;
    p->chi2_se = sums.n > 0 ? sqrt(sums.variance) / sums.weights : NAN;
out:
    imp_film_destroy(film);
    imp_problem_destroy(blank);
    return st;
}

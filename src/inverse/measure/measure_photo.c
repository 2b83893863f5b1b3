/* SPDX-License-Identifier: Apache-2.0
 *
 * What a scene leaves over of a photograph. */
#include "base/arguments.h"
#include "math/rng.h"
#include "measuring.h"
#include <math.h>
#include <stdlib.h>

#define HUBER 2.5
#define LOOK  64 /* samples per pixel of the pictures that are compared, at least */

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
    double expanded; /* what a loss takes for gamma times the residual */
};

static struct compared value_compare(const struct imp__photo *p, double T, double M,
                                     double M_se, double gamma)
{
    const bool curve = gamma != 1;
    struct compared v = {NAN, 0, 0};
    if (curve && T < IMP_PHOTOGRAPH_LEAST) return v;
    const double V = curve ? pow(fmax(M, 0), 1 / gamma) : M;
    const double slope = curve ? V / (gamma * fmax(M, 1e-12)) : 1;
    v.own = isfinite(M_se) ? imp__sqr(slope * M_se) : 0;
    const double doubt = 3 * sqrt(imp__sqr(p->noise) + v.own);
    if (p->desc.clipped && T >= p->desc.high)
        v.residual = V > p->desc.high - doubt ? NAN : p->desc.high - V;
    else if (p->desc.clipped && T <= p->desc.low)
        v.residual = V < p->desc.low + doubt ? NAN : p->desc.low - V;
    else v.residual = T - V;
    v.expanded = curve ? pow(T, 1 - gamma) * M - T : v.residual;
    return v;
}

/* Sums over the pixels that have a weight. The expectation of squared residuals contains the variance
 * of the picture, which is taken off: chi2 = (sum r^2 - sum own)/(n noise^2), with a variance of
 * 2 sum (noise^2 + own)^2 for Gaussian residuals. */
struct sums {
    double square, own, variance;
    size_t n;
};

static void pixel_add(struct imp__photo *p, size_t i, const struct compared *v,
                      double gamma, struct sums *s)
{
    double square = 0, expected = 0, expanded = 0;
    for (int c = 0; c < p->desc.channels; c++) {
        if (isnan(v[c].residual)) continue;
        const double both = imp__sqr(p->noise) + v[c].own;
        square += imp__sqr(v[c].residual);
        expected += both;
        expanded += imp__sqr(v[c].expanded);
        if (!(p->weights[i] > 0)) continue;
        s->square += imp__sqr(v[c].residual);
        s->own += v[c].own;
        s->variance += 2 * both * both;
        s->n++;
    }
    p->square[i] = (float)square;
    p->expected[i] = (float)expected;
    p->robust[i] = gamma * gamma * square < expanded
                       ? (float)(gamma * gamma * square / expanded)
                       : 1;
}

/* Weights by which single pixels that are far off do not lead a fit (Huber, Ann. Math. Statist. 35,
 * 1964: above HUBER robust standard deviations a residual counts by its magnitude), and have the residual
 * that they have: T^(1 - gamma) M - T of a dark value where the picture is bright is many times
 * gamma times that. */
static enum imp_status robust_set(struct imp__measure *m, struct imp__photo *p)
{
    size_t n = 0;
    float *list = imp__alloc(m->ctx, p->n_pixels, sizeof *list);
    if (!list) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for %s", p->name);
    for (size_t i = 0; i < p->n_pixels; i++)
        if (p->expected[i] > 0) list[n++] = p->square[i] / p->expected[i];
    qsort(list, n, sizeof *list, ascending);
    const double middle = n > 0 ? sqrt((double)list[n / 2]) / 0.6745 : 0;
    for (size_t i = 0; i < p->n_pixels; i++) {
        if (!(p->expected[i] > 0)) continue;
        const double r = sqrt((double)(p->square[i] / p->expected[i]));
        if (r > HUBER * middle) p->robust[i] *= (float)(HUBER * middle / r);
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
    for (size_t i = 0; i < p->n_pixels; i++) {
        struct compared v[3];
        for (int c = 0; c < C; c++) {
            const size_t at = i * (size_t)C + (size_t)c;
            v[c] = value_compare(p, (double)p->desc.pixels[at], (double)mean[at],
                                 se ? (double)se[at] : 0, gamma);
            p->left[at] = (float)v[c].residual;
            p->own[at] = (float)v[c].own;
        }
        pixel_add(p, i, v, gamma, &sums);
    }
    IMP_TRY(robust_set(m, p));
    const double unit = (double)sums.n * imp__sqr(p->noise);
    p->n_compared = sums.n;
    p->chi2 = sums.n > 0 ? (sums.square - sums.own) / unit : NAN;
    p->chi2_se = sums.n > 0 ? sqrt(sums.variance) / unit : NAN;
out:
    imp_film_destroy(film);
    imp_problem_destroy(blank);
    return st;
}

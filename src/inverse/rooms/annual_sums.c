/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers of a year from the illuminances of its hours, by groups of walks.
 *
 * Most of them count hours. Their errors come from halves of the groups: with x_g the
 * illuminance of an hour by group g, and s_cg = +-1 the rows of Hadamard's matrix of order 16 (in
 * Walsh's way by g & c), the mean of one half and that of the other are
 *
 *     x +- d_c,   x = sum_g x_g / 16,   d_c = sum_g s_cg x_g / 16,   c = 1 ... 15
 *
 * Let u_c = (T(x + d_c) - T(x - d_c))/2 and v_c = (T(x + d_c) + T(x - d_c))/2 - T(x) for a number T of
 * the year. Noise makes min(E, wanted) smaller, and carries hours over a bound to the side that
 * has fewer: the mean of v_c is as far from 0 as T(x) is from the truth on average, and is
 * taken off. What is left has the variance
 *
 *     sum_c (u_c^2 + 11 (v_c - v)^2) / 15 + v^2,   v = sum_c v_c / 15
 *
 * For a mean v_c is 0, and that is s^2/16 exactly. For a count that many hours near a bound change
 * together, u_c is consistent, since d_c is as large as the error of x (balanced half-samples:
 * McCarthy 1969; Shao and Wu 1992). A single hour at its bound is counted as 2 [e > 0] - P(e),
 * with e the normal error of x and P its distribution: the variance is 7/12, u_c^2 is 1/8 and
 * (v_c - v)^2 is 1/24 on average, hence the factor 11. The correction v, an estimate of second
 * order, is itself a part of the error. */
#include "annual.h"
#include <math.h>

/* x [16] becomes sum_g s_cg x_g. */
static inline void walsh(double x[IMP__GROUPS])
{
    for (int step = 1; step < IMP__GROUPS; step *= 2)
        for (int i = 0; i < IMP__GROUPS; i += 2 * step)
            for (int k = i; k < i + step; k++) {
                const double a = x[k], b = x[k + step];
                x[k] = a + b;
                x[k + step] = a - b;
            }
}

/* The mean of the groups, and of the halves. */
static inline void variants_of(const double group[IMP__GROUPS], double out[IMP__VARIANTS])
{
    double x[IMP__GROUPS];
    for (int g = 0; g < IMP__GROUPS; g++) x[g] = group[g] * (1. / IMP__GROUPS);
    walsh(x);
    out[0] = x[0];
    for (int c = 1; c < IMP__GROUPS; c++) {
        out[c] = x[0] + x[c];
        out[IMP__GROUPS - 1 + c] = x[0] - x[c];
    }
}

struct imp_estimate imp__annual_estimate(const double v[IMP__VARIANTS])
{
    double across = 0, along = 0, bias = 0;
    for (int c = 1; c < IMP__GROUPS; c++) {
        const double up = v[c] - v[0], down = v[IMP__GROUPS - 1 + c] - v[0];
        across += imp__sqr((up - down) / 2);
        along += imp__sqr((up + down) / 2);
        bias += (up + down) / 2;
    }
    const double n = IMP__GROUPS - 1;
    bias /= n;
    return (struct imp_estimate){
        v[0] - bias,
        sqrt(across / n + 11 * imp_max(along / n - bias * bias, 0.0) + bias * bias), 2};
}

/* A part of the hours. */
static struct imp_estimate part_of(const double v[IMP__VARIANTS])
{
    struct imp_estimate e = imp__annual_estimate(v);
    e.value = imp_clamp(e.value, 0.0, 1.0);
    return e;
}

struct imp_estimate imp__annual_mean(const double group[IMP__GROUPS])
{
    double v[IMP__VARIANTS];
    variants_of(group, v);
    return imp__annual_estimate(v);
}

/* An hour of use with the illuminances E. */
static void hour_add(const struct imp_annual_options *o, const double E[IMP__VARIANTS],
                     struct imp__annual_numbers *x)
{
    const double wanted = o->wanted, each = 1 / wanted;
    for (int v = 0; v < IMP__VARIANTS; v++) {
        x->of[IMP__AUTONOMY][v] += E[v] >= wanted;
        x->of[IMP__CONTINUOUS][v] += imp_min(E[v] * each, 1.0);
        x->of[IMP__USEFUL][v] += E[v] < o->useful[0];
        x->of[IMP__USEFUL + 1][v] += E[v] >= o->useful[0] && E[v] < o->useful[1];
        x->of[IMP__USEFUL + 2][v] += E[v] >= o->useful[1] && E[v] <= o->useful[2];
        x->of[IMP__USEFUL + 3][v] += E[v] > o->useful[2];
    }
}

static void dark_add(const struct imp_annual_options *o, size_t hours,
                     struct imp__annual_numbers *x)
{
    static const double dark[IMP__VARIANTS] = {0};
    struct imp__annual_numbers one = {{{0}}};
    hour_add(o, dark, &one);
    for (int m = 0; m < IMP__ANNUAL_NUMBERS; m++)
        for (int v = 0; v < IMP__VARIANTS; v++)
            x->of[m][v] += (double)hours * one.of[m][v];
}

void imp__annual_add(const struct imp__annual *a, const struct imp_annual_options *o,
                     const bool *used, size_t all, const struct imp__annual_worker *w,
                     struct imp__annual_numbers *out)
{
    const struct imp__annual_hours *h = &a->hours;
    double mean[IMP__GROUPS] = {0}, exposure[IMP__GROUPS] = {0};
    size_t lit = 0;
    *out = (struct imp__annual_numbers){{{0}}};
    for (size_t k = 0; k < h->n; k++) {
        for (int g = 0; g < IMP__GROUPS; g++) exposure[g] += w->E[k][g];
        if (!used[k]) continue;
        lit++;
        double E[IMP__VARIANTS], S[IMP__VARIANTS];
        for (int g = 0; g < IMP__GROUPS; g++) mean[g] += w->E[k][g];
        variants_of(w->E[k], E);
        hour_add(o, E, out);
        if (!(h->sun[k] > 0)) continue;
        variants_of(w->S[k], S);
        for (int v = 0; v < IMP__VARIANTS; v++)
            out->of[IMP__SUNLIT][v] += S[v] >= o->sunlit;
    }
    dark_add(o, all - lit, out);
    variants_of(mean, out->of[IMP__MEAN]);
    variants_of(exposure, out->of[IMP__EXPOSURE]);
    const double part = all > 0 ? 1 / (double)all : 0;
    for (int m = 0; m <= IMP__MEAN; m++)
        for (int v = 0; v < IMP__VARIANTS; v++) out->of[m][v] *= part;
}

void imp__annual_point_set(const struct imp__annual_numbers *x,
                           struct imp_annual_point *out)
{
    out->autonomy = part_of(x->of[IMP__AUTONOMY]);
    out->continuous = part_of(x->of[IMP__CONTINUOUS]);
    for (int k = 0; k < 4; k++) out->useful[k] = part_of(x->of[IMP__USEFUL + k]);
    out->mean = imp__annual_estimate(x->of[IMP__MEAN]);
    out->exposure = imp__annual_estimate(x->of[IMP__EXPOSURE]);
    out->sunlit_hours = imp__annual_estimate(x->of[IMP__SUNLIT]);
}

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
#include <string.h>

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

/* ---- Hours ------------------------------------------------------------------------- */

enum { BLOCKS = 8 }; /* whose sums are floats */

typedef imp__annual_lanes lanes;
typedef imp__annual_mask mask;

static inline lanes splat(double x)
{
    const float f = (float)x;
    return (lanes){f, f, f, f, f, f, f, f};
}

/* x as it is in lanes where m is -1, else 0. */
static inline lanes only(mask m, lanes x) { return (lanes)((mask)x & m); }

/* As variants_of, of the hours of a block. */
static inline void variants_at_once(const lanes group[IMP__GROUPS],
                                    lanes out[IMP__VARIANTS])
{
    lanes x[IMP__GROUPS];
    for (int g = 0; g < IMP__GROUPS; g++) x[g] = group[g] * (1.f / IMP__GROUPS);
    for (int step = 1; step < IMP__GROUPS; step *= 2)
        for (int i = 0; i < IMP__GROUPS; i += 2 * step)
            for (int k = i; k < i + step; k++) {
                const lanes a = x[k], b = x[k + step];
                x[k] = a + b;
                x[k + step] = a - b;
            }
    out[0] = x[0];
    for (int c = 1; c < IMP__GROUPS; c++) {
        out[c] = x[0] + x[c];
        out[IMP__GROUPS - 1 + c] = x[0] - x[c];
    }
}

/* Sums over some blocks, by lanes: counts, and numbers of hours that are not whole. */
struct sums {
    mask count[IMP__ANNUAL_NUMBERS][IMP__VARIANTS];
    lanes part[IMP__VARIANTS], mean[IMP__GROUPS], exposure[IMP__GROUPS];
};

static void block_add(const struct imp_annual_options *o, const lanes all[IMP__GROUPS],
                      const lanes straight[IMP__GROUPS], mask used, struct sums *s)
{
    const lanes wanted = splat(o->wanted), each = splat(1 / o->wanted), one = splat(1);
    const lanes lo = splat(o->useful[0]), middle = splat(o->useful[1]),
                hi = splat(o->useful[2]), sunlit = splat(o->sunlit);
    lanes E[IMP__VARIANTS], S[IMP__VARIANTS];
    variants_at_once(all, E);
    variants_at_once(straight, S);
    for (int g = 0; g < IMP__GROUPS; g++) {
        s->mean[g] += only(used, all[g]);
        s->exposure[g] += all[g];
    }
    for (int v = 0; v < IMP__VARIANTS; v++) {
        const lanes part = E[v] * each;
        s->count[IMP__AUTONOMY][v] -= (E[v] >= wanted) & used;
        s->part[v] += only((part < one) & used, part) + only((part >= one) & used, one);
        s->count[IMP__USEFUL][v] -= (E[v] < lo) & used;
        s->count[IMP__USEFUL + 1][v] -= (E[v] >= lo) & (E[v] < middle) & used;
        s->count[IMP__USEFUL + 2][v] -= (E[v] >= middle) & (E[v] <= hi) & used;
        s->count[IMP__USEFUL + 3][v] -= (E[v] > hi) & used;
        s->count[IMP__SUNLIT][v] -= (S[v] >= sunlit) & used;
    }
}

static void groups_flush(lanes x[IMP__GROUPS], double sum[IMP__GROUPS])
{
    for (int g = 0; g < IMP__GROUPS; g++) {
        for (int t = 0; t < IMP__AT_ONCE; t++) sum[g] += (double)x[g][t];
        x[g] = splat(0);
    }
}

void imp__annual_add(const struct imp__annual *a, const struct imp_annual_options *o,
                     const imp__annual_mask *used, size_t all,
                     const struct imp__annual_worker *w, struct imp__annual_numbers *out)
{
    const struct imp__annual_hours *h = &a->hours;
    double mean[IMP__GROUPS] = {0}, exposure[IMP__GROUPS] = {0};
    struct sums s;
    size_t lit = 0;
    memset(&s, 0, sizeof s);
    *out = (struct imp__annual_numbers){{{0}}};
    for (size_t b = 0; b < h->blocks; b++) {
        block_add(o, w->E[b], w->S[b], used[b], &s);
        for (int t = 0; t < IMP__AT_ONCE; t++) lit += used[b][t] != 0;
        if ((b + 1) % BLOCKS != 0 && b + 1 < h->blocks) continue;
        groups_flush(s.mean, mean);
        groups_flush(s.exposure, exposure);
        for (int v = 0; v < IMP__VARIANTS; v++) {
            for (int t = 0; t < IMP__AT_ONCE; t++)
                out->of[IMP__CONTINUOUS][v] += (double)s.part[v][t];
            s.part[v] = splat(0);
        }
    }
    for (int m = 0; m < IMP__ANNUAL_NUMBERS; m++)
        for (int v = 0; v < IMP__VARIANTS; v++)
            for (int t = 0; t < IMP__AT_ONCE; t++) out->of[m][v] += s.count[m][v][t];
    if (o->useful[0] > 0) /* hours without light */
        for (int v = 0; v < IMP__VARIANTS; v++)
            out->of[IMP__USEFUL][v] += (double)(all - lit);
    else
        for (int v = 0; v < IMP__VARIANTS; v++)
            out->of[IMP__USEFUL + 1][v] += (double)(all - lit);
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

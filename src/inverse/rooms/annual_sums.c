/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers of a year from the illuminances of its hours, by groups of walks.
 *
 * Most of them count hours, and noise makes them wrong on average: it makes min(E, wanted) smaller,
 * and carries hours over a bound to the side that has fewer. Let T be such a number of the mean
 * of all 16 groups, and T2 its mean over halves of the groups, whose readings have twice the
 * variance. An error in proportion to the variance cancels in
 *
 *     Q = 2 T - T2
 *
 * (Richardson 1911), and one in proportion to its square, too, in (8 T - 6 T2 + T4) / 3, with T4 of
 * quarters. What this has more, (2 T - 3 T2 + T4) / 3, is taken as the error of the extrapolation;
 * as the value it would have more noise where single hours decide.
 *
 * The groups' readings x_g of an hour make halves by the rows of Hadamard's matrix of order 16,
 * s_cg = +-1 (in Walsh's way by g & c), c = 1 ... 15:
 *
 *     x +- d_c,   x = sum_g x_g / 16,   d_c = sum_g s_cg x_g / 16
 *
 * The product of two rows is the row a ^ b, so the rows a, b, a ^ b make quarters,
 * x + s d_a + t d_b + s t d_(a ^ b) with s, t = +-1. Five such triples have every row once: each of
 * the 15 pairs of halves is divided into quarters, once. With Q+ and Q- of a pair, each half
 * and its quarters by themselves, u_c = (Q+ - Q-) / 2 has the variance that Q has of all groups
 * where variances go with 1/groups: that of a mean does, and of a count that many hours near a
 * bound change together, since halves move as many hours as the noise does, with the covariance
 * of hours and points in it (balanced half-samples: McCarthy 1969; Shao and Wu 1992). Where hours
 * are counted one by one it falls more slowly: the variances V2 and V4 of T over halves and over
 * quarters say how much, and the mean of u_c^2 counts 2 V2 / V4 times. For a single hour at its
 * bound that is twice; T has the variance 1/4 there, Q 7/12, and the mean of u_c^2 is 5/16. */
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

/* Rows whose products are the third, every row in one of them. */
static const uint8_t triple[IMP__QUARTERED][3] = {
    {1, 2, 3}, {4, 8, 12}, {5, 10, 15}, {6, 11, 13}, {7, 9, 14}};

/* Where the variants are: of half `sign` (0: x + d) by row c from 1 on; of quarter k of triple q,
 * in the half 0 of the first row if k < 2, of the second if k is even. */
static inline int half_at(int c, int sign) { return sign * IMP__HALVES + c; }
static inline int quarter_at(int q, int k) { return 1 + 2 * IMP__HALVES + 4 * q + k; }

/* The mean of the groups, of the halves and of the quarters, from sums by rows: x[0] the mean, x[c]
 * what is d_c above. */
#define VARIANTS_FILL(x, out)                                                            \
    do {                                                                                 \
        (out)[0] = (x)[0];                                                               \
        for (int c_ = 1; c_ < IMP__GROUPS; c_++) {                                       \
            (out)[half_at(c_, 0)] = (x)[0] + (x)[c_];                                    \
            (out)[half_at(c_, 1)] = (x)[0] - (x)[c_];                                    \
        }                                                                                \
        for (int q_ = 0; q_ < IMP__QUARTERED; q_++) {                                    \
            const uint8_t *r_ = triple[q_];                                              \
            const int at_ = quarter_at(q_, 0);                                           \
            (out)[at_] = (out)[half_at(r_[0], 0)] + ((x)[r_[1]] + (x)[r_[2]]);           \
            (out)[at_ + 1] = (out)[half_at(r_[0], 0)] - ((x)[r_[1]] + (x)[r_[2]]);       \
            (out)[at_ + 2] = (out)[half_at(r_[0], 1)] + ((x)[r_[1]] - (x)[r_[2]]);       \
            (out)[at_ + 3] = (out)[half_at(r_[0], 1)] - ((x)[r_[1]] - (x)[r_[2]]);       \
        }                                                                                \
    } while (0)

static inline void variants_of(const double group[IMP__GROUPS], double out[IMP__VARIANTS])
{
    double x[IMP__GROUPS];
    for (int g = 0; g < IMP__GROUPS; g++) x[g] = group[g] * (1. / IMP__GROUPS);
    walsh(x);
    VARIANTS_FILL(x, out);
}

/* Quarters of the halves of row j of a triple. */
static double quarters_mean(const double v[IMP__VARIANTS], int q, int j, int sign)
{
    static const uint8_t in[3][2][2] = {
        {{0, 1}, {2, 3}}, {{0, 2}, {1, 3}}, {{0, 3}, {1, 2}}};
    const uint8_t *k = in[j][sign];
    return (v[quarter_at(q, k[0])] + v[quarter_at(q, k[1])]) / 2;
}

/* Sums over a triple's halves and quarters, of what they have more than all groups. */
struct spread {
    double half, quarter; /* means over all */
    double own, halves,
        quarters; /* means of u_c^2, and variances of T(half) and T(quarter) */
};
static void triple_add(const double v[IMP__VARIANTS], int q, struct spread *s)
{
    double mean = 0;
    for (int k = 0; k < 4; k++) mean += v[quarter_at(q, k)] / 4;
    for (int k = 0; k < 4; k++)
        s->quarters += imp__sqr(v[quarter_at(q, k)] - mean) / (3 * IMP__QUARTERED);
    s->quarter += (mean - v[0]) / IMP__QUARTERED;
    for (int j = 0; j < 3; j++) {
        double T[2], Q[2];
        for (int sign = 0; sign < 2; sign++) {
            T[sign] = v[half_at(triple[q][j], sign)] - v[0];
            Q[sign] = 2 * T[sign] - (quarters_mean(v, q, j, sign) - v[0]);
            s->half += T[sign] / (2 * IMP__HALVES);
        }
        s->own += imp__sqr((Q[0] - Q[1]) / 2) / IMP__HALVES;
        s->halves += imp__sqr(T[0] - T[1]) / (2 * IMP__HALVES);
    }
}

struct imp_estimate imp__annual_estimate(const double v[IMP__VARIANTS])
{
    struct spread s = {0};
    for (int q = 0; q < IMP__QUARTERED; q++) triple_add(v, q, &s);
    const double next = (s.quarter - 3 * s.half) / 3;
    const double slower =
        s.quarters > 0 ? imp_clamp(2 * s.halves / s.quarters, 1.0, 2.0) : 1;
    return (struct imp_estimate){.value = v[0] - s.half,
                                 .se = sqrt(slower * s.own + imp__sqr(next)),
                                 .bias_order = 2};
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

typedef imp__annual_lanes lanes;
typedef imp__annual_mask mask;

static inline lanes splat(double x)
{
    const float f = (float)x;
    return (lanes){f, f, f, f, f, f, f, f};
}

/* x as it is in lanes where m is -1, else 0. */
static inline lanes only(mask m, lanes x) { return (lanes)((mask)x & m); }
static inline lanes lesser(lanes a, lanes b)
{
    const mask m = a < b;
    return (lanes)(((mask)a & m) | ((mask)b & ~m));
}

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
    VARIANTS_FILL(x, out);
}

/* Sums over a batch, by lanes. Counts of useful daylight are of what is below each bound, until the
 * last block is there. */
struct sums {
    lanes part[IMP__VARIANTS], mean[IMP__GROUPS], exposure[IMP__GROUPS];
};

/* straight: NULL if no hour has a sun. */
static void block_add(const struct imp_annual_options *o, const lanes all[IMP__GROUPS],
                      const lanes *straight, mask used, struct sums *s,
                      mask count[IMP__ANNUAL_NUMBERS][IMP__VARIANTS])
{
    const lanes wanted = splat(o->wanted), each = splat(1 / o->wanted), one = splat(1);
    const lanes lo = splat(o->useful[0]), middle = splat(o->useful[1]),
                hi = splat(o->useful[2]), sunlit = splat(o->sunlit);
    lanes E[IMP__VARIANTS], S[IMP__VARIANTS];
    variants_at_once(all, E);
    if (straight) variants_at_once(straight, S);
    for (int g = 0; g < IMP__GROUPS; g++) {
        s->mean[g] += only(used, all[g]);
        s->exposure[g] += all[g];
    }
    for (int v = 0; v < IMP__VARIANTS; v++) {
        count[IMP__AUTONOMY][v] -= (E[v] >= wanted) & used;
        s->part[v] += only(used, lesser(one, E[v] * each));
        count[IMP__USEFUL][v] -= (E[v] < lo) & used;
        count[IMP__USEFUL + 1][v] -= (E[v] < middle) & used;
        count[IMP__USEFUL + 2][v] -= (E[v] <= hi) & used;
    }
    for (int v = 0; straight && v < IMP__VARIANTS; v++)
        count[IMP__SUNLIT][v] -= (S[v] >= sunlit) & used;
}

static double lanes_sum(double sum, lanes x)
{
    for (int t = 0; t < IMP__AT_ONCE; t++) sum += (double)x[t];
    return sum;
}

void imp__annual_add(const struct imp_annual_options *o, const mask *used, size_t blocks,
                     const lanes (*E)[IMP__GROUPS], const lanes (*S)[IMP__GROUPS],
                     const bool *sun, struct imp__annual_counts *counts,
                     struct imp__annual_numbers *out)
{
    struct sums s;
    memset(&s, 0, sizeof s);
    for (size_t b = 0; b < blocks; b++)
        block_add(o, E[b], sun[b] ? S[b] : NULL, used[b], &s, counts->of);
    for (int g = 0; g < IMP__GROUPS; g++) {
        out->mean[g] = lanes_sum(out->mean[g], s.mean[g]);
        out->exposure[g] = lanes_sum(out->exposure[g], s.exposure[g]);
    }
    for (int v = 0; v < IMP__VARIANTS; v++)
        out->of[IMP__CONTINUOUS][v] = lanes_sum(out->of[IMP__CONTINUOUS][v], s.part[v]);
}

void imp__annual_count(const struct imp__annual_counts *counts,
                       struct imp__annual_numbers *out)
{
    for (int m = 0; m < IMP__ANNUAL_NUMBERS; m++)
        for (int v = 0; v < IMP__VARIANTS; v++)
            for (int t = 0; t < IMP__AT_ONCE; t++) out->of[m][v] += counts->of[m][v][t];
}

void imp__annual_end(const struct imp_annual_options *o, size_t all, size_t lit,
                     struct imp__annual_numbers *out)
{
    for (int v = 0; v < IMP__VARIANTS; v++) { /* what is between the bounds */
        double *of[4];
        for (int k = 0; k < 4; k++) of[k] = &out->of[IMP__USEFUL + k][v];
        *of[3] = (double)lit - *of[2];
        *of[2] -= *of[1];
        *of[1] -= *of[0];
    }
    if (o->useful[0] > 0) /* hours without light */
        for (int v = 0; v < IMP__VARIANTS; v++)
            out->of[IMP__USEFUL][v] += (double)(all - lit);
    else
        for (int v = 0; v < IMP__VARIANTS; v++)
            out->of[IMP__USEFUL + 1][v] += (double)(all - lit);
    variants_of(out->mean, out->of[IMP__MEAN]);
    variants_of(out->exposure, out->of[IMP__EXPOSURE]);
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

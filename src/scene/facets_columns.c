/* SPDX-License-Identifier: Apache-2.0
 *
 * Intersection of a block of rays with one facet after the other: the floats of facets.c, with
 * rays and facets exchanged, and its confirmation in double. */
#include "facets_columns.h"
#include "facets_lanes.h"

/* Floats of the rays of a block. */
typedef float block __attribute__((vector_size(4 * IMP_RAY_BLOCK)));
typedef int32_t whole __attribute__((vector_size(4 * IMP_RAY_BLOCK)));

static inline block splat(float x) { return x - (block){0}; }
static inline block magnitude(block a) { return (block)((whole)a & INT32_MAX); }

/* Conditions of rays, and choice by them: with AVX-512 GCC 12 takes two operations for what has
 * one. */
#if IMP_WIDE_LANES == 8
typedef __mmask16 truth;
static inline truth at_most(block a, block b)
{
    return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LE_OQ);
}
static inline truth below(block a, block b)
{
    return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LT_OQ);
}
static inline block pick(truth m, block a, block b)
{
    return (block)_mm512_mask_blend_ps(m, (__m512)b, (__m512)a);
}
static inline unsigned bits(truth m) { return m; }
#else
typedef mask truth;
static inline truth at_most(block a, block b) { return a <= b; }
static inline truth below(block a, block b) { return a < b; }
static inline block pick(truth m, block a, block b) { return imp__lanes_choose(m, a, b); }
static inline unsigned bits(truth m) { return imp__lanes_bits(m); }
#endif

/* Rays about the facets' centre. */
struct rays {
    block o[3], d[3];
    block lo, hi;
    block stretch, least; /* as of one ray (facets.c) */
    unsigned comes;       /* a bit for each that may meet something */
    unsigned away;        /* for those that begin far away, which go one by one */
};

/* Numbers of the rays of part p, as floats. */
static inline void narrow(block *to, int p, imp_wide x)
{
    const imp_wide_float f = imp__wide_narrow(x);
    memcpy((char *)to + (size_t)p * sizeof f, &f, sizeof f);
}
static inline void narrow3(block to[3], int p, imp_wide3 v)
{
    narrow(&to[0], p, v.x);
    narrow(&to[1], p, v.y);
    narrow(&to[2], p, v.z);
}
static inline imp_wide3 magnitudes(imp_wide3 v)
{
    return (imp_wide3){imp__wide_magnitude(v.x), imp__wide_magnitude(v.y),
                       imp__wide_magnitude(v.z)};
}

static inline struct rays rays_of(const struct imp_facets *f,
                                  const struct imp_ray_block *b, unsigned on)
{
    const imp_wide3 centre = imp__wide3_of(f->centre), half = imp__wide3_of(f->half),
                    near = imp__wide3_of(f->near);
    const imp_wide zero = imp__wide(0);
    struct rays r;
    unsigned gone = 0;
    r.away = 0;
    for (int p = 0; p < IMP_RAY_PARTS; p++) {
        const imp_wide3 from = imp__wide3_minus(b->o[p], centre), d = b->d[p],
                        step = magnitudes(d),
                        outside = imp__wide3_minus(magnitudes(from), half);
        const imp_wide length = (step.x + step.y) + step.z;
        const imp_wide_truth goes = ((outside.x > zero) & (from.x * d.x > zero)) |
                                    ((outside.y > zero) & (from.y * d.y > zero)) |
                                    ((outside.z > zero) & (from.z * d.z > zero)),
                             away = (outside.x > near.x) | (outside.y > near.y) |
                                    (outside.z > near.z);
        gone |= imp__wide_bits(goes) << p * IMP_WIDE_LANES;
        r.away |= imp__wide_bits(away) << p * IMP_WIDE_LANES;
        narrow3(r.o, p, from);
        narrow3(r.d, p, d);
        narrow(&r.lo, p, b->near[p]);
        narrow(&r.hi, p, b->far[p]);
        narrow(&r.stretch, p, length);
        narrow(&r.least, p, length * 0x1p-23);
    }
    r.away &= on & ~gone;
    r.comes = on & ~gone & ~r.away;
    return r;
}

/* Which rays may meet facet k of a group, and where. */
static inline truth facet_met(const struct group *g, int k, const struct rays *r,
                              float slack, block *t, block *sum)
{
    const block nd = g->n[0][k] * r->d[0] + g->n[1][k] * r->d[1] + g->n[2][k] * r->d[2];
    const block inv = -1 / pick(below(magnitude(nd), r->least), r->least, nd);
    const block size = magnitude(inv), aside = r->stretch * size * g->slack[k];
    const block far = size * slack, side = 1 + aside;
    *t = (g->n[0][k] * r->o[0] + g->n[1][k] * r->o[1] + g->n[2][k] * r->o[2] +
          g->n[3][k]) *
         inv;
    const block x = r->o[0] + *t * r->d[0], y = r->o[1] + *t * r->d[1],
                z = r->o[2] + *t * r->d[2];
    const block u = g->u[0][k] * x + g->u[1][k] * y + g->u[2][k] * z + g->u[3][k];
    const block v = g->v[0][k] * x + g->v[1][k] * y + g->v[2][k] * z + g->v[3][k];
    *sum = u + v;
    return (truth)(at_most(magnitude(u), side) & at_most(magnitude(v), side) &
                   at_most(*sum, g->sum[k] + aside) & below(r->lo - far, *t) &
                   below(*t, r->hi + 4 * far));
}

/* Places without a facet come last, and have no slack. */
static inline bool is_facet(const struct group *g, int k) { return g->slack[k] > 0; }

unsigned imp__facets_nearest_block(const struct imp_facets *f,
                                   const struct imp_ray_block *b, unsigned on,
                                   struct imp_hit hit[IMP_RAY_BLOCK])
{
    const struct rays r = rays_of(f, b, on);
    block best = splat(INFINITY), in = splat(0), half = splat(0);
    const block never = best;
    unsigned met = 0;
    for (int g = 0; g < f->n_groups; g++) {
        block at = splat((float)(LANES * g));
        for (int k = 0; k < LANES && is_facet(&f->group[g], k); k++, at += 1) {
            /* What one facet waits for of the one before is `best` alone. */
            block t, sum;
            const truth m = facet_met(&f->group[g], k, &r, f->slack, &t, &sum);
            const block here = pick(m, t, never);
            const truth nearer = below(here, best);
            best = pick(nearer, here, best);
            in = pick(nearer, at, in);
            half = pick(nearer, sum, half);
        }
    }
    const unsigned some = bits(below(best, never)) & r.comes;
    unsigned alone = r.away;
    for (unsigned left = some; left; left &= left - 1) {
        const int k = __builtin_ctz(left);
        if (imp_likely(imp__facet_met(f->facet[(int)in[k]], half[k] > 0,
                                      imp__block_origin(b, k) - f->centre,
                                      imp__block_direction(b, k), imp__block_near(b, k),
                                      imp__block_far(b, k), &hit[k])))
            met |= 1u << k;
        else alone |= 1u << k;
    }
    for (; imp_unlikely(alone); alone &= alone - 1) {
        const int k = __builtin_ctz(alone);
        const imp_v3 o = imp__block_origin(b, k), d = imp__block_direction(b, k);
        if (imp__facets_nearest(f, &o, &d, imp__block_near(b, k), imp__block_far(b, k),
                                &hit[k]))
            met |= 1u << k;
    }
    return met;
}

unsigned imp__facets_occluded_block(const struct imp_facets *f,
                                    const struct imp_ray_block *b, unsigned on)
{
    const struct rays r = rays_of(f, b, on);
    struct imp_hit hit;
    unsigned hidden = 0, left = r.comes;
    for (int g = 0; g < f->n_groups && left; g++)
        for (int k = 0; k < LANES && left && is_facet(&f->group[g], k); k++) {
            block t, sum;
            unsigned ask =
                left & bits(facet_met(&f->group[g], k, &r, f->slack, &t, &sum));
            for (; ask; ask &= ask - 1) {
                const int i = __builtin_ctz(ask);
                if (imp__facet_met(f->facet[LANES * g + k], 0,
                                   imp__block_origin(b, i) - f->centre,
                                   imp__block_direction(b, i), imp__block_near(b, i),
                                   imp__block_far(b, i), &hit))
                    hidden |= 1u << i;
            }
            left &= ~hidden;
        }
    for (unsigned away = r.away; imp_unlikely(away); away &= away - 1) {
        const int k = __builtin_ctz(away);
        const imp_v3 o = imp__block_origin(b, k), d = imp__block_direction(b, k);
        if (imp__facets_occluded(f, &o, &d, imp__block_near(b, k), imp__block_far(b, k)))
            hidden |= 1u << k;
    }
    return hidden;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Intersection of a ray with eight facets at a time in float, confirmed triangle by triangle in
 * double (facets.h). */
#include "facets_lanes.h"

_Static_assert(IMP_FACETS <= 32, "a facet is a bit");

static inline lanes lesser(lanes a, lanes b) { return imp__lanes_choose(a < b, a, b); }
static inline float least(lanes a)
{
    a = lesser(a, __builtin_shufflevector(a, a, 4, 5, 6, 7, 0, 1, 2, 3));
    a = lesser(a, __builtin_shufflevector(a, a, 2, 3, 0, 1, 6, 7, 4, 5));
    return imp_min(a[0], a[1]);
}
/* A ray for floats, from a point that is not far away; distances count from there. */
struct ray {
    lanes o[3], d[3];
    lanes lo, hi;
    lanes stretch; /* |x| + |y| + |z| of d, not less than its length */
    lanes least;   /* of n.d */
};
/* From far away: false if the ray does not come to the ball around all facets; *t is a distance,
 * in units of d, at which it has not come there yet, but is near. length: |x| + |y| + |z| of d,
 * by which the way that is left to the ball's centre is 1.15 to 2 reaches. */
static inline bool ray_comes(const struct imp_facets *f, imp_v3 from, imp_v3 d,
                             double length, double *t)
{
    const double reach = (double)f->reach * (1 + 1e-6), square = imp__dot(d, d);
    const double ahead = -imp__dot(from, d);
    const double out = imp__dot(from, from) * (1 - 1e-14) - reach * reach;
    if (!(ahead > 0) || ahead * ahead < square * out) return false;
    *t = imp_max((ahead * length - NEAR * reach * square) / (square * length), 0);
    return true;
}
/* False: it meets nothing. */
static inline bool ray_of(const struct imp_facets *f, imp_v3 from, const imp_v3 *d,
                          double tmin, double tmax, struct ray *out)
{
    struct ray r;
    const imp_v3 step = imp__abs(*d), outside = imp__abs(from) - f->half;
    const double length = (step[0] + step[1]) + step[2];
    if (imp__lanes_of((outside > 0) & (from * *d > 0))) return false; /* it goes away */
    if (imp_unlikely(imp__lanes_of(outside > f->near))) {
        double t;
        if (!ray_comes(f, from, *d, length, &t)) return false;
        from += t * *d;
        tmin -= t;
        tmax -= t;
    }
    for (int k = 0; k < 3; k++) {
        r.o[k] = imp__splat((float)from[k]);
        r.d[k] = imp__splat((float)(*d)[k]);
    }
    r.lo = imp__splat((float)tmin);
    r.hi = imp__splat((float)tmax);
    r.stretch = imp__splat((float)length);
    r.least = imp__splat((float)(length * 0x1p-23));
    *out = r;
    return true;
}

/* Which facets may be met, and where. With the rounding unit e and the reach R of all facets,
 * n.o is known to some 6 e R; the distance t, which divides it by n.d, to 3 e t |d| / n.d more,
 * and t is at most 4 R / |d| in the box. The point moves with t. Where n.d is less than its own
 * rounding, that replaces it, and the slack is as large as the box. */
static inline mask group_met(const struct group *g, const struct ray *r, float slack,
                             lanes *t, lanes *sum)
{
    const lanes nd = g->n[0] * r->d[0] + g->n[1] * r->d[1] + g->n[2] * r->d[2];
    const lanes inv =
        -1 / imp__lanes_choose(imp__lanes_magnitude(nd) < r->least, r->least, nd);
    const lanes size = imp__lanes_magnitude(inv), aside = r->stretch * size * g->slack;
    const lanes far = size * slack, side = 1 + aside;
    *t = (g->n[0] * r->o[0] + g->n[1] * r->o[1] + g->n[2] * r->o[2] + g->n[3]) * inv;
    const lanes x = r->o[0] + *t * r->d[0], y = r->o[1] + *t * r->d[1],
                z = r->o[2] + *t * r->d[2];
    const lanes u = g->u[0] * x + g->u[1] * y + g->u[2] * z + g->u[3];
    const lanes v = g->v[0] * x + g->v[1] * y + g->v[2] * z + g->v[3];
    *sum = u + v;
    return (imp__lanes_magnitude(u) <= side) & (imp__lanes_magnitude(v) <= side) &
           (*sum <= g->sum + aside) & (*t > r->lo - far) & (*t < r->hi + 4 * far);
}

/* Where the facet that floats chose is not met, as that which a ray has just left: of the others. */
static __attribute__((noinline)) bool nearest_of(const struct imp_facets *f, uint32_t ask,
                                                 imp_v3 from, imp_v3 d, double tmin,
                                                 double tmax, struct imp_hit *hit)
{
    bool met = false;
    for (; ask; ask &= ask - 1)
        if (imp__facet_met(f->facet[__builtin_ctz(ask)], 0, from, d, tmin, tmax, hit)) {
            tmax = hit->t;
            met = true;
        }
    return met;
}

bool imp__facets_nearest(const struct imp_facets *f, const imp_v3 *o, const imp_v3 *d,
                         double tmin, double tmax, struct imp_hit *hit)
{
    const imp_v3 from = *o - f->centre;
    struct ray r;
    if (!ray_of(f, from, d, tmin, tmax, &r)) return false;
    lanes best = imp__splat(INFINITY), in = imp__splat(0), half = imp__splat(0);
    uint32_t ask = 0; /* facets that may be met */
    for (int g = 0; g < f->n_groups; g++) {
        lanes t, sum;
        const mask may = group_met(&f->group[g], &r, f->slack, &t, &sum),
                   m = may & (t < best);
        ask |= (uint32_t)imp__lanes_bits(may) << (LANES * g);
        best = imp__lanes_choose(m, t, best);
        in = imp__lanes_choose(m, imp__splat((float)g), in);
        half = imp__lanes_choose(m, sum, half);
    }
    const float first = least(best);
    if (!(first < INFINITY)) return false;
    unsigned equal = imp__lanes_bits(best == imp__splat(first));
    int k = __builtin_ctz(equal);
    while (imp_unlikely(equal &= equal - 1)) { /* at one place */
        const int other = __builtin_ctz(equal);
        if (in[other] < in[k]) k = other;
    }
    const int chosen = LANES * (int)in[k] + k;
    if (imp_likely(
            imp__facet_met(f->facet[chosen], half[k] > 0, from, *d, tmin, tmax, hit)))
        return true;
    return nearest_of(f, ask & ~(1u << chosen), from, *d, tmin, tmax, hit);
}

bool imp__facets_occluded(const struct imp_facets *f, const imp_v3 *o, const imp_v3 *d,
                          double tmin, double tmax)
{
    const imp_v3 from = *o - f->centre;
    struct ray r;
    if (!ray_of(f, from, d, tmin, tmax, &r)) return false;
    for (int g = 0; g < f->n_groups; g++) {
        lanes t, sum;
        struct imp_hit hit;
        unsigned ask = imp__lanes_bits(group_met(&f->group[g], &r, f->slack, &t, &sum));
        for (; ask; ask &= ask - 1)
            if (imp__facet_met(f->facet[LANES * g + __builtin_ctz(ask)], 0, from, *d,
                               tmin, tmax, &hit))
                return true;
    }
    return false;
}

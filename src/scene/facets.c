/* SPDX-License-Identifier: Apache-2.0 */
#include "facets.h"
#include "base/context.h"

/* ---- one triangle, in double ------------------------------------------------------------------ */

/* Planes of a triangle with corners A, B, C, as numbers of (x, y, z, 1):
 *
 *     n = (e x f, -A.(e x f))          e = B - A,  f = C - A
 *     u = (f x n, ..) / n.n            1 at B, 0 at A and C
 *     v = (n x e, ..) / n.n            1 at C, 0 at A and B */
struct planes {
    imp_v3 n, u, v;
};
/* The same by columns: of (n, u, v) what x, y, z and 1 are multiplied by. */
struct triangle {
    imp_v3 x, y, z, one;
    int shape, prim;
};

static imp_v3 plane(imp_v3 normal, imp_v3 zero)
{
    normal[3] = -imp__dot(normal, zero);
    return normal;
}

/* Of a triangle without area they are not finite or not numbers, and it is never met. */
static struct planes planes_of(const imp_v3 corner[3])
{
    const imp_v3 e = corner[1] - corner[0], f = corner[2] - corner[0];
    const imp_v3 n = imp__cross(e, f);
    const double scale = 1 / imp__dot(n, n);
    return (struct planes){plane(n, corner[0]),
                           plane(imp__cross(f, n) * scale, corner[0]),
                           plane(imp__cross(n, e) * scale, corner[0])};
}

/* Triangles that share an edge overlap by this part of their sides: more than what is rounded
 * off, and far less than what a picture shows. */
#define OVERLAP 1e-10
static inline bool triangle_met(const struct triangle *s, imp_v3 o, imp_v3 d, double tmin,
                                double tmax, struct imp_hit *hit)
{
    const imp_v3 from = (s->x * o[0] + s->y * o[1]) + (s->z * o[2] + s->one);
    const imp_v3 step = (s->x * d[0] + s->y * d[1]) + s->z * d[2];
    const double t = -from[0] / step[0];
    const imp_v3 p = from + t * step;
    const double u = p[1], v = p[2];
    if (!(t > tmin && t < tmax && u >= -OVERLAP && v >= -OVERLAP && u + v <= 1 + OVERLAP))
        return false;
    hit->t = t;
    hit->u = imp_clamp(u, 0, 1);
    hit->v = imp_clamp(v, 0, 1 - hit->u);
    hit->shape = s->shape;
    hit->prim = s->prim;
    hit->place = 0;
    return true;
}

/* ---- eight facets, in float ------------------------------------------------------------------- */

enum { LANES = 8 };
typedef float lanes __attribute__((vector_size(4 * LANES)));
typedef int32_t mask __attribute__((vector_size(4 * LANES)));

/* Of the triangle of a facet's corner A and its neighbours B and C, about the centre of all
 * facets: the plane with a unit normal, and u and v, which go from -1 to 1 in the facet: from A
 * to B or C, or to the fourth corner, if it lies farther off. */
struct group {
    lanes n[4], u[4], v[4];
    lanes sum;   /* of u and v, at most: 0 in a triangle, 2 in a quadrilateral */
    lanes slack; /* of u and v where the ray meets the facet at a right angle */
};

struct imp_facets {
    int n_groups;
    imp_v3 centre, half; /* of the box of all */
    imp_v3 near;         /* of rays' origins to the box, at most */
    float reach;         /* of all corners from there */
    float slack;         /* of distances */
    struct group *group; /* [n_groups] */
    /* [LANES n_groups] by group and lane; the second may be nothing but zeros, which no ray
     * meets */
    struct triangle (*facet)[2];
};

static inline lanes splat(float x) { return (lanes){x, x, x, x, x, x, x, x}; }
static inline lanes choose(mask m, lanes a, lanes b)
{
    return (lanes)((m & (mask)a) | (~m & (mask)b));
}
static inline lanes lesser(lanes a, lanes b) { return choose(a < b, a, b); }
static inline lanes magnitude(lanes a) { return (lanes)((mask)a & INT32_MAX); }
static inline float least(lanes a)
{
    a = lesser(a, __builtin_shufflevector(a, a, 4, 5, 6, 7, 0, 1, 2, 3));
    a = lesser(a, __builtin_shufflevector(a, a, 2, 3, 0, 1, 6, 7, 4, 5));
    return imp_min(a[0], a[1]);
}
static inline unsigned bits_of(mask m)
{
#ifdef __AVX__
    return (unsigned)__builtin_ia32_movmskps256((lanes)m);
#else
    unsigned bits = 0;
    for (int k = 0; k < LANES; k++) bits |= (m[k] & 1u) << k;
    return bits;
#endif
}

/* A ray for floats, from a point that is not far away; distances count from there. */
struct ray {
    lanes o[3], d[3];
    lanes lo, hi;
    lanes stretch; /* of slacks, by the length of d */
};
#define NEAR 2 /* reaches */
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
static inline bool ray_of(const struct imp_facets *f, const imp_v3 *o, const imp_v3 *d,
                          double tmin, double tmax, struct ray *out)
{
    struct ray r;
    imp_v3 from = *o - f->centre;
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
        r.o[k] = splat((float)from[k]);
        r.d[k] = splat((float)(*d)[k]);
    }
    r.lo = splat((float)tmin);
    r.hi = splat((float)tmax);
    r.stretch = splat((float)length);
    *out = r;
    return true;
}

/* Which facets may be met, and where. With the rounding unit e and the reach R of all facets,
 * n.o is known to some 6 e R; the distance t, which divides it by n.d, to 3 e t |d| / n.d more,
 * and t is at most 4 R / |d| in the box. The point moves with t. */
static inline mask group_met(const struct group *g, const struct ray *r, float slack,
                             lanes *t, lanes *sum)
{
    const lanes inv = -1 / (g->n[0] * r->d[0] + g->n[1] * r->d[1] + g->n[2] * r->d[2]);
    const lanes grow = r->stretch * magnitude(inv);
    const lanes far = grow * slack, aside = grow * g->slack, side = 1 + aside;
    *t = (g->n[0] * r->o[0] + g->n[1] * r->o[1] + g->n[2] * r->o[2] + g->n[3]) * inv;
    const lanes x = r->o[0] + *t * r->d[0], y = r->o[1] + *t * r->d[1],
                z = r->o[2] + *t * r->d[2];
    const lanes u = g->u[0] * x + g->u[1] * y + g->u[2] * z + g->u[3];
    const lanes v = g->v[0] * x + g->v[1] * y + g->v[2] * z + g->v[3];
    *sum = u + v;
    return (magnitude(u) <= side) & (magnitude(v) <= side) & (*sum <= g->sum + aside) &
           (*t > r->lo - far) & (*t < r->hi + 4 * far);
}

/* first: the half that is asked first. */
static inline bool facet_met(const struct triangle half[2], int first, imp_v3 o, imp_v3 d,
                             double tmin, double tmax, struct imp_hit *hit)
{
    return triangle_met(&half[first], o, d, tmin, tmax, hit) ||
           triangle_met(&half[1 - first], o, d, tmin, tmax, hit);
}

/* Where the facet that floats chose is not met. */
static IMP_COLD bool nearest_of_all(const struct imp_facets *f, const struct ray *r,
                                    imp_v3 o, imp_v3 d, double tmin, double tmax,
                                    struct imp_hit *hit)
{
    bool met = false;
    for (int g = 0; g < f->n_groups; g++) {
        lanes t, sum;
        unsigned ask = bits_of(group_met(&f->group[g], r, f->slack, &t, &sum));
        for (; ask; ask &= ask - 1)
            if (facet_met(f->facet[LANES * g + __builtin_ctz(ask)], 0, o, d, tmin, tmax,
                          hit)) {
                tmax = hit->t;
                met = true;
            }
    }
    return met;
}

bool imp__facets_nearest(const struct imp_facets *f, const imp_v3 *o, const imp_v3 *d,
                         double tmin, double tmax, struct imp_hit *hit)
{
    struct ray r;
    if (!ray_of(f, o, d, tmin, tmax, &r)) return false;
    lanes best = splat(INFINITY), in = splat(0), half = splat(0);
    for (int g = 0; g < f->n_groups; g++) {
        lanes t, sum;
        const mask m = group_met(&f->group[g], &r, f->slack, &t, &sum) & (t < best);
        best = choose(m, t, best);
        in = choose(m, splat((float)g), in);
        half = choose(m, sum, half);
    }
    const float first = least(best);
    if (!(first < INFINITY)) return false;
    const int k = __builtin_ctz(bits_of(best == splat(first)));
    if (imp_likely(facet_met(f->facet[LANES * (int)in[k] + k], half[k] > 0, *o, *d, tmin,
                             tmax, hit)))
        return true;
    return nearest_of_all(f, &r, *o, *d, tmin, tmax, hit);
}

bool imp__facets_occluded(const struct imp_facets *f, const imp_v3 *o, const imp_v3 *d,
                          double tmin, double tmax)
{
    struct ray r;
    if (!ray_of(f, o, d, tmin, tmax, &r)) return false;
    for (int g = 0; g < f->n_groups; g++) {
        lanes t, sum;
        struct imp_hit hit;
        unsigned ask = bits_of(group_met(&f->group[g], &r, f->slack, &t, &sum));
        for (; ask; ask &= ask - 1)
            if (facet_met(f->facet[LANES * g + __builtin_ctz(ask)], 0, *o, *d, tmin, tmax,
                          &hit))
                return true;
    }
    return false;
}

/* ---- build -------------------------------------------------------------------------------------- */

/* In units of R, and of what u and v change over R: see group_met. */
#define SLACK_DISTANCE (8 * 0x1p-24)
#define SLACK_ASIDE    (32 * 0x1p-24)

static void corners_of(const struct imp_triangles *t, size_t prim, imp_v3 corner[3])
{
    for (int k = 0; k < 3; k++) {
        const float *p = &t->positions[3 * (size_t)t->indices[3 * prim + (size_t)k]];
        corner[k] = imp__v3((double)p[0], (double)p[1], (double)p[2]);
    }
}

static bool same(imp_v3 a, imp_v3 b)
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* Which corner of a is none of b's, if the other two are; else -1. */
static int corner_alone(const imp_v3 a[3], const imp_v3 b[3])
{
    int alone = -1;
    for (int k = 0; k < 3; k++)
        if (!same(a[k], b[0]) && !same(a[k], b[1]) && !same(a[k], b[2])) {
            if (alone >= 0) return -1;
            alone = k;
        }
    return alone;
}

static double at(imp_v3 plane, imp_v3 point) { return imp__dot(plane, point) + plane[3]; }

/* What floats are asked of a facet: of the triangle a and of b, if it is the other half of a
 * quadrilateral: flat, as far as floats can tell, and nearly a parallelogram. False: it is not.
 * b may be NULL. */
static bool lane_fill(const struct imp_facets *f, struct group *g, int lane,
                      const imp_v3 a[3], const imp_v3 *b)
{
    const int first = b ? corner_alone(a, b) : 0, other = b ? corner_alone(b, a) : 0;
    if (first < 0 || other < 0) return false;
    imp_v3 corner[3];
    for (int k = 0; k < 3; k++) corner[k] = a[(first + k) % 3] - f->centre;
    const struct planes p = planes_of(corner);
    const double length = sqrt(imp__dot(p.n, p.n)), reach = (double)f->reach;
    double u = 1, v = 1;
    if (b) {
        const imp_v3 last = b[other] - f->centre;
        u = at(p.u, last);
        v = at(p.v, last);
        /* Above the edge BC, in and across the plane; n has the length of e x f. */
        const double up = (u + v - 1) * length / imp__length(corner[2] - corner[1]);
        const double off = fabs(at(p.n, last)) / length;
        if (!(off <= 0x1p-22 * up && u > .5 && u < 1.5 && v > .5 && v < 1.5))
            return false;
        u = imp_max(u, 1);
        v = imp_max(v, 1);
    }
    for (int k = 0; k < 4; k++) {
        g->n[k][lane] = (float)(p.n[k] / length);
        g->u[k][lane] = (float)(2 * p.u[k] / u - (k == 3));
        g->v[k][lane] = (float)(2 * p.v[k] / v - (k == 3));
    }
    g->sum[lane] = b ? 2 : 0;
    g->slack[lane] =
        (float)(2 * SLACK_ASIDE * (1 + reach * (imp__length(p.u) + imp__length(p.v))));
    return true;
}

static void triangle_set(struct triangle *s, const imp_v3 corner[3], int shape, int prim)
{
    const struct planes p = planes_of(corner);
    imp_v3 *const column[4] = {&s->x, &s->y, &s->z, &s->one};
    for (int k = 0; k < 4; k++) *column[k] = imp__v3(p.n[k], p.u[k], p.v[k]);
    s->shape = shape;
    s->prim = prim;
}

/* Facets of a mesh from number `lane` on; returns the number behind them. Where there is no room
 * for any yet they are counted. */
static int mesh_add(struct imp_facets *f, const struct imp_shape *s, int lane)
{
    const struct imp_triangles *t = &s->triangles;
    struct group counted;
    for (size_t i = 0; i < t->n_triangles; i++, lane++) {
        struct group *g = f->group ? &f->group[lane / LANES] : &counted;
        struct triangle *half = f->group ? f->facet[lane] : NULL;
        imp_v3 a[3], b[3];
        corners_of(t, i, a);
        if (half) triangle_set(&half[0], a, s->index, (int)i);
        if (i + 1 < t->n_triangles) {
            corners_of(t, i + 1, b);
            if (lane_fill(f, g, lane % LANES, a, b)) {
                i++;
                if (half) triangle_set(&half[1], b, s->index, (int)i);
                continue;
            }
        }
        lane_fill(f, g, lane % LANES, a, NULL);
    }
    return lane;
}

static int meshes_add(struct imp_facets *f, struct imp_shape *const *shapes, int n)
{
    int lane = 0;
    for (int i = 0; i < n; i++)
        if (shapes[i]->geometry == IMP_TRIANGLES) lane = mesh_add(f, shapes[i], lane);
    return lane;
}

bool imp__facets_create(imp_context *ctx, struct imp_shape *const *shapes, int n,
                        struct imp_facets **out, int64_t *bytes)
{
    size_t triangles = 0;
    imp_v3 lo = imp__spec(INFINITY), hi = imp__spec(-INFINITY);
    *out = NULL;
    for (int i = 0; i < n; i++) {
        if (shapes[i]->geometry != IMP_TRIANGLES) continue;
        triangles += shapes[i]->triangles.n_triangles;
        for (int k = 0; k < 3; k++) {
            lo[k] = fmin(lo[k], shapes[i]->lo[k]);
            hi[k] = fmax(hi[k], shapes[i]->hi[k]);
        }
    }
    if (triangles == 0 || triangles > 2 * IMP_FACETS) return true;
    struct imp_facets head = {.centre = (lo + hi) * .5, .half = (hi - lo) * .5};
    head.centre[3] = head.half[3] = 0;
    head.reach = (float)imp__length(head.half);
    head.near = imp__spec(NEAR * (double)head.reach);
    head.slack = (float)(SLACK_DISTANCE * (double)head.reach);
    const int n_facets = meshes_add(&head, shapes, n);
    if (n_facets > IMP_FACETS) return true;

    const size_t groups = (size_t)(n_facets + LANES - 1) / LANES;
    const size_t size = sizeof head + groups * sizeof(struct group) +
                        LANES * groups * sizeof(struct triangle[2]);
    struct imp_facets *f = imp__alloc(ctx, 1, size);
    if (!f) return false;
    *f = head;
    f->n_groups = (int)groups;
    f->group = (struct group *)(f + 1);
    f->facet = (struct triangle(*)[2])(f->group + groups);
    for (size_t g = 0; g < groups; g++) f->group[g].n[3] = splat(NAN); /* never met */
    meshes_add(f, shapes, n);
    *bytes += (int64_t)size;
    *out = f;
    return true;
}

void imp__facets_destroy(imp_context *ctx, struct imp_facets *f) { imp__release(ctx, f); }

/* SPDX-License-Identifier: Apache-2.0
 *
 * Rays in columns, a block at a time: few analytic shapes one by one, facets together (facets_columns.c),
 * and Embree's triangles in its packets of eight. Where Embree calls back, rays go one by one. */
#include "ray_columns.h"
#include "facets_columns.h"
#include "intersector.h"
#include <string.h>

static inline imp_v3 at(double *const c[3], int i)
{
    return imp__v3(c[0][i], c[1][i], c[2][i]);
}
static inline double time_of(const struct imp_ray_columns *rays, int i)
{
    return rays->time ? rays->time[i] : rays->instant;
}

/* ---- One by one -------------------------------------------------------------------------- */

static void intersect_alone(const struct imp_scene *scene,
                            const struct imp_ray_columns *rays,
                            const struct imp_hit_columns *hits)
{
    for (int i = 0; i < rays->n; i++) {
        const imp_v3 o = at(rays->o, i), d = at(rays->d, i);
        struct imp_hit hit;
        hits->shape[i] = -1;
        if (imp__intersect_at(scene, time_of(rays, i), &o, &d,
                              rays->near ? rays->near[i] : 0, rays->far[i], &hit))
            imp__hit_put(hits, i, &hit);
    }
}

static void occluded_alone(const struct imp_scene *scene,
                           const struct imp_ray_columns *rays, bool *hidden)
{
    for (int i = 0; i < rays->n; i++) {
        const imp_v3 o = at(rays->o, i), d = at(rays->d, i);
        hidden[i] = imp__occluded_at(scene, time_of(rays, i), &o, &d,
                                     rays->near ? rays->near[i] : 0, rays->far[i]);
    }
}

/* ---- A block at a time --------------------------------------------------------------------- */

/* Rays i and on; a bit for each that is there and within Embree's numbers (imp__ray_valid). */
static inline unsigned block_of(const struct imp_ray_columns *rays, int i,
                                struct imp_ray_block *b)
{
    unsigned on = 0;
    for (int p = 0; p < IMP_RAY_PARTS; p++) {
        const int at = i + p * IMP_WIDE_LANES;
        const imp_wide3 o = {imp__wide_load(&rays->o[0][at]),
                             imp__wide_load(&rays->o[1][at]),
                             imp__wide_load(&rays->o[2][at])},
                        d = {imp__wide_load(&rays->d[0][at]),
                             imp__wide_load(&rays->d[1][at]),
                             imp__wide_load(&rays->d[2][at])};
        b->o[p] = o;
        b->d[p] = d;
        b->near[p] = rays->near ? imp__wide_load(&rays->near[at]) : imp__wide(0);
        b->far[p] = imp__wide_load(&rays->far[at]);
        const imp_wide size = ((imp__wide_magnitude(o.x) + imp__wide_magnitude(d.x)) +
                               (imp__wide_magnitude(o.y) + imp__wide_magnitude(d.y))) +
                              (imp__wide_magnitude(o.z) + imp__wide_magnitude(d.z));
        on |= imp__wide_bits((size < imp__wide(IMP_REACH_MAX)) &
                             (b->near[p] >= imp__wide(0)) & (b->near[p] < b->far[p]))
              << p * IMP_WIDE_LANES;
    }
    return on & (rays->n - i >= IMP_RAY_BLOCK ? ~0u : (1u << (rays->n - i)) - 1);
}

static inline void block_put(imp_wide x, float *to)
{
    const imp_wide_float f = imp__wide_narrow(x);
    memcpy(to, &f, sizeof f);
}

enum { PACKET = 8, PACKET_BITS = 0xff };
#define PACKET_PUT(field, value)                                                         \
    for (int k = 0; k < PACKET; k++) field[k] = (value)

/* The rays of a block from `first` on, eight of them. */
static void packet_fill(struct RTCRay8 *r, const struct imp_ray_block *b, int first)
{
    for (int k = 0; k < PACKET; k += IMP_WIDE_LANES) {
        const int p = (first + k) / IMP_WIDE_LANES;
        block_put(b->o[p].x, &r->org_x[k]);
        block_put(b->o[p].y, &r->org_y[k]);
        block_put(b->o[p].z, &r->org_z[k]);
        block_put(b->d[p].x, &r->dir_x[k]);
        block_put(b->d[p].y, &r->dir_y[k]);
        block_put(b->d[p].z, &r->dir_z[k]);
        block_put(b->near[p], &r->tnear[k]);
    }
    PACKET_PUT(r->time, 0);
    PACKET_PUT(r->mask, ~0u);
    PACKET_PUT(r->id, 0);
    PACKET_PUT(r->flags, 0);
}
static void packet_valid(unsigned on, int valid[PACKET])
{
    for (int k = 0; k < PACKET; k++) valid[k] = on >> k & 1 ? -1 : 0;
}

static unsigned packet_nearest(const struct imp_intersector *x,
                               const struct imp_ray_block *b, int first,
                               const float far[], unsigned on, struct imp_hit hit[])
{
    struct RTCIntersectContext context;
    struct RTCRayHit8 r;
    int valid[PACKET] __attribute__((aligned(32)));
    unsigned met = 0;
    rtcInitIntersectContext(&context);
    packet_fill(&r.ray, b, first);
    packet_valid(on, valid);
    PACKET_PUT(r.ray.tfar, far[k]);
    PACKET_PUT(r.hit.geomID, RTC_INVALID_GEOMETRY_ID);
    PACKET_PUT(r.hit.instID[0], RTC_INVALID_GEOMETRY_ID);
    rtcIntersect8(valid, x->rtc, &context, &r);
    for (; on; on &= on - 1) {
        const int k = __builtin_ctz(on);
        if (r.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID) continue;
        hit[k] = (struct imp_hit){.place = 0};
        imp__mesh_hit(x, imp__block_origin(b, first + k),
                      imp__block_direction(b, first + k), imp__block_near(b, first + k),
                      r.hit.geomID[k], r.hit.primID[k], r.ray.tfar[k], r.hit.u[k],
                      r.hit.v[k], &hit[k]);
        met |= 1u << k;
    }
    return met;
}

static unsigned packet_occluded(const struct imp_intersector *x,
                                const struct imp_ray_block *b, int first, unsigned on)
{
    struct RTCIntersectContext context;
    struct RTCRay8 r;
    int valid[PACKET] __attribute__((aligned(32)));
    unsigned hidden = 0;
    rtcInitIntersectContext(&context);
    packet_fill(&r, b, first);
    packet_valid(on, valid);
    for (int k = 0; k < PACKET; k += IMP_WIDE_LANES)
        block_put(b->far[(first + k) / IMP_WIDE_LANES], &r.tfar[k]);
    rtcOccluded8(valid, x->rtc, &context, &r);
    for (int k = 0; k < PACKET; k++) hidden |= (unsigned)(r.tfar[k] < 0) << k;
    return hidden & on;
}

/* Those of the rays that may meet a ball (imp__shape_balls_met), in lanes. */
static unsigned balls_met(const struct imp_shape_balls *f, const struct imp_ray_block *b,
                          unsigned on)
{
    unsigned met = 0;
    for (int k = 0; k < f->n; k++) {
        const int g = k / 4, j = k % 4;
        for (int p = 0; p < IMP_RAY_PARTS; p++) {
            const imp_wide3 o = b->o[p], d = b->d[p];
            const imp_wide x = f->x[g][j] - o.x, y = f->y[g][j] - o.y,
                           z = f->z[g][j] - o.z;
            const imp_wide along = x * d.x + y * d.y + z * d.z,
                           out = (x * x + y * y + z * z) * (1 - 1e-14) - f->r2[g][j],
                           zero = imp__wide(0);
            met |= imp__wide_bits((along * along >= out * imp__wide3_inner(d, d)) &
                                  ((along >= zero) | (out <= zero)))
                   << p * IMP_WIDE_LANES;
        }
    }
    return met & on;
}

/* As imp__intersect_at, of a block of rays. */
static void nearest_block(const struct imp_intersector *x,
                          const struct imp_ray_columns *rays, int i,
                          const struct imp_hit_columns *hits)
{
    struct imp_ray_block b;
    struct imp_hit hit[IMP_RAY_BLOCK];
    const unsigned on = block_of(rays, i, &b);
    unsigned met = 0;
    float far[IMP_RAY_BLOCK];
    for (int p = 0; p < IMP_RAY_PARTS; p++) block_put(b.far[p], &far[p * IMP_WIDE_LANES]);
    for (unsigned left = balls_met(&x->balls, &b, on); left; left &= left - 1) {
        const int k = __builtin_ctz(left);
        const imp_v3 o = imp__block_origin(&b, k), d = imp__block_direction(&b, k);
        double end = imp__block_far(&b, k);
        if (!imp__shape_balls_nearest(&x->balls, &o, &d, imp__block_near(&b, k), &end,
                                      &hit[k]))
            continue;
        far[k] = imp__triangle_far(&o, &d, end);
        b.far[k / IMP_WIDE_LANES][k % IMP_WIDE_LANES] = (double)far[k];
        met |= 1u << k;
    }
    if (x->facets) {
        const unsigned more = imp__facets_nearest_block(x->facets, &b, on, hit);
        for (unsigned left = x->holds ? more : 0; left; left &= left - 1) {
            const int k = __builtin_ctz(left);
            far[k] = (float)hit[k].t;
        }
        met |= more;
    }
    for (int k = 0; x->holds && k < IMP_RAY_BLOCK; k += PACKET)
        if (on >> k & PACKET_BITS)
            met |= packet_nearest(x, &b, k, far + k, on >> k & PACKET_BITS, hit + k) << k;
    const int n = imp_min(rays->n - i, (int)IMP_RAY_BLOCK);
    for (int k = 0; k < n; k++)
        if (met >> k & 1) imp__hit_put(hits, i + k, &hit[k]);
        else hits->shape[i + k] = -1;
}

static void occluded_block(const struct imp_intersector *x,
                           const struct imp_ray_columns *rays, int i, bool *hidden)
{
    struct imp_ray_block b;
    const unsigned on = block_of(rays, i, &b);
    unsigned behind = 0;
    for (unsigned left = balls_met(&x->balls, &b, on); left; left &= left - 1) {
        const int k = __builtin_ctz(left);
        const imp_v3 o = imp__block_origin(&b, k), d = imp__block_direction(&b, k);
        if (imp__shape_balls_occluded(&x->balls, &o, &d, imp__block_near(&b, k),
                                      imp__block_far(&b, k)))
            behind |= 1u << k;
    }
    if (x->facets && (on & ~behind))
        behind |= imp__facets_occluded_block(x->facets, &b, on & ~behind);
    for (int k = 0; x->holds && k < IMP_RAY_BLOCK; k += PACKET) {
        const unsigned left = (on & ~behind) >> k & PACKET_BITS;
        if (left) behind |= packet_occluded(x, &b, k, left) << k;
    }
    const int n = imp_min(rays->n - i, (int)IMP_RAY_BLOCK);
    for (int k = 0; k < n; k++) hidden[i + k] = behind >> k & 1;
}

/* ---- All --------------------------------------------------------------------------------- */

static bool goes_alone(const struct imp_intersector *x)
{
    return x->holds && !x->packets;
}

void imp__intersect_columns(const struct imp_scene *scene,
                            const struct imp_ray_columns *rays,
                            const struct imp_hit_columns *hits)
{
    const struct imp_intersector *x = scene->intersector;
    if (goes_alone(x)) {
        intersect_alone(scene, rays, hits);
        return;
    }
    for (int i = 0; i < rays->n; i += IMP_RAY_BLOCK) nearest_block(x, rays, i, hits);
}

void imp__occluded_columns(const struct imp_scene *scene,
                           const struct imp_ray_columns *rays, bool *hidden)
{
    const struct imp_intersector *x = scene->intersector;
    if (goes_alone(x)) {
        occluded_alone(scene, rays, hidden);
        return;
    }
    for (int i = 0; i < rays->n; i += IMP_RAY_BLOCK) occluded_block(x, rays, i, hidden);
}

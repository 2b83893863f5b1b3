/* SPDX-License-Identifier: Apache-2.0
 *
 * Facets of a scene's meshes: pairs of triangles that are halves of a flat quadrilateral, as planes
 * in float about the centre of the scene, and the triangles in double. */
#include "base/context.h"
#include "facets_lanes.h"
#include "kind/sensor/receiver.h"

static imp_v3 plane(imp_v3 normal, imp_v3 zero)
{
    normal[3] = -imp__dot(normal, zero);
    return normal;
}

/* The planes of a triangle without area are infinite or NAN, and it is never met. */
static struct planes planes_of(const imp_v3 corner[3])
{
    const imp_v3 e = corner[1] - corner[0], f = corner[2] - corner[0];
    const imp_v3 n = imp__cross(e, f);
    const double scale = 1 / imp__dot(n, n);
    return (struct planes){plane(n, corner[0]),
                           plane(imp__cross(f, n) * scale, corner[0]),
                           plane(imp__cross(n, e) * scale, corner[0])};
}

/* In units of R, and of what u and v change over R: see group_met. */
#define SLACK_DISTANCE (16 * 0x1p-24)
#define SLACK_ASIDE    (32 * 0x1p-24)
/* Facets are Embree's where one is so small beside all of them that floats about the centre
 * hardly resolve its position. */
#define BLUR_MAX 0.1f

/* About a centre. */
static void corners_of(const struct imp_triangles *t, size_t prim, imp_v3 centre,
                       imp_v3 corner[3])
{
    for (int k = 0; k < 3; k++) {
        const float *p = &t->positions[3 * (size_t)t->indices[3 * prim + (size_t)k]];
        corner[k] = imp__v3((double)p[0], (double)p[1], (double)p[2]) - centre;
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

/* Planes in float of a facet: of the triangle a, and of b, if it is the other half of a
 * quadrilateral: flat to the precision of floats, and nearly a parallelogram. False: it is not.
 * b may be NULL. */
static bool lane_fill(struct imp_facets *f, struct group *g, int lane, const imp_v3 a[3],
                      const imp_v3 *b)
{
    const int first = b ? corner_alone(a, b) : 0, other = b ? corner_alone(b, a) : 0;
    if (first < 0 || other < 0) return false;
    imp_v3 corner[3];
    for (int k = 0; k < 3; k++) corner[k] = a[(first + k) % 3];
    const struct planes p = planes_of(corner);
    const double length = sqrt(imp__dot(p.n, p.n)), reach = (double)f->reach;
    double u = 1, v = 1;
    if (b) {
        const imp_v3 last = b[other];
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
    if (length > 0) f->blur = imp_max(f->blur, g->slack[lane]);
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
        corners_of(t, i, f->centre, a);
        if (half) triangle_set(&half[0], a, s->index, (int)i);
        if (i + 1 < t->n_triangles) {
            corners_of(t, i + 1, f->centre, b);
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

static bool has_facets(const struct imp_shape *s)
{
    return s->geometry == IMP_TRIANGLES && !imp__shape_is_absent(s);
}

static int meshes_add(struct imp_facets *f, struct imp_shape *const *shapes, int n)
{
    int lane = 0;
    for (int i = 0; i < n; i++)
        if (has_facets(shapes[i])) lane = mesh_add(f, shapes[i], lane);
    return lane;
}

static void box_add(const struct imp_triangles *t, imp_v3 *lo, imp_v3 *hi)
{
    for (size_t i = 0; i < t->n_triangles; i++) {
        imp_v3 corner[3];
        corners_of(t, i, (imp_v3){0}, corner);
        for (int k = 0; k < 9; k++) {
            (*lo)[k % 3] = fmin((*lo)[k % 3], corner[k / 3][k % 3]);
            (*hi)[k % 3] = fmax((*hi)[k % 3], corner[k / 3][k % 3]);
        }
    }
}

bool imp__facets_create(imp_context *ctx, struct imp_shape *const *shapes, int n,
                        struct imp_facets **out, int64_t *bytes)
{
    size_t triangles = 0;
    imp_v3 lo = imp__spec(INFINITY), hi = imp__spec(-INFINITY);
    *out = NULL;
    for (int i = 0; i < n; i++) {
        if (has_facets(shapes[i])) triangles += shapes[i]->triangles.n_triangles;
    }
    if (triangles == 0 || triangles > 2 * IMP_FACETS) return true;
    for (int i = 0; i < n; i++)
        if (has_facets(shapes[i])) box_add(&shapes[i]->triangles, &lo, &hi);
    struct imp_facets head = {.centre = (lo + hi) * .5, .half = (hi - lo) * .5};
    head.centre[3] = head.half[3] = 0;
    head.reach = (float)imp__length(head.half);
    head.near = imp__spec(NEAR * (double)head.reach);
    head.slack = (float)(SLACK_DISTANCE * (double)head.reach);
    const int n_facets = meshes_add(&head, shapes, n);
    if (n_facets > IMP_FACETS || head.blur > BLUR_MAX) return true;

    const size_t groups = (size_t)(n_facets + LANES - 1) / LANES;
    const size_t size = sizeof head + groups * sizeof(struct group) +
                        LANES * groups * sizeof(struct triangle[2]);
    struct imp_facets *f = imp__alloc(ctx, 1, size);
    if (!f) return false;
    *f = head;
    f->n_groups = (int)groups;
    f->group = (struct group *)(f + 1);
    f->facet = (struct triangle(*)[2])(f->group + groups);
    for (size_t g = 0; g < groups; g++)
        f->group[g].n[3] = imp__splat(NAN); /* never met */
    meshes_add(f, shapes, n);
    *bytes += (int64_t)size;
    *out = f;
    return true;
}

void imp__facets_destroy(imp_context *ctx, struct imp_facets *f) { imp__release(ctx, f); }

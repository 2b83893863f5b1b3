/* SPDX-License-Identifier: Apache-2.0
 *
 * Points of a mesh with vertex normals (boundary.h): by area, and on the curve N.(eye - p) = 0, which is
 * met by random lines through triangles. Lines through a triangle have the measure of its perimeter,
 * and of a curve within (Crofton)
 *
 *     int F dl = 1/2 int dline sum over crossings of F */
#include "base/context.h"
#include "boundary_parts.h"
#include "math/warp.h"
#include "scene/pose.h"

/* ---- Lists ------------------------------------------------------------------------------ */

static struct imp__corners corners(const struct imp__boundary *b,
                                   const struct imp__edge_item *item, size_t prim)
{
    return imp__corners(b->tracer->scene, item->shape, (int)prim, item->place, 0);
}

/* From p to the eye, of any length. */
static imp_v3 towards(const struct imp__boundary *b, imp_v3 eye, imp_v3 p)
{
    return b->parallel ? -eye : eye - p;
}

/* May N.(eye - p) vanish in the triangle, for an eye within `radius` of the camera? It is a quadratic
 * form of the weights, between the least and the largest of its Bezier coefficients. */
static bool may_turn(const struct imp__boundary *boundary, const struct imp__corners *c,
                     double radius)
{
    double lo = INFINITY, hi = -INFINITY, most = 0;
    imp_v3 to[3];
    for (int i = 0; i < 3; i++) to[i] = towards(boundary, boundary->camera, c->p[i]);
    for (int i = 0; i < 3; i++) most = imp_max(most, imp__length(c->n[i]));
    for (int i = 0; i < 3; i++)
        for (int j = 0; j <= i; j++) {
            const double b = 0.5 * (imp__dot(c->n[i], to[j]) + imp__dot(c->n[j], to[i]));
            lo = imp_min(lo, b);
            hi = imp_max(hi, b);
        }
    return lo <= most * radius && hi >= -most * radius;
}

static double perimeter(const struct imp__corners *c)
{
    return imp__length(c->p[1] - c->p[0]) + imp__length(c->p[2] - c->p[1]) +
           imp__length(c->p[0] - c->p[2]);
}

/* How far the points through which it sees, or of rays those that they look at, are from the middle. */
static double eye_radius(const struct imp__boundary *b)
{
    const struct imp_sensor *s = b->tracer->sensor;
    const double rim[2] = {1, 0.5};
    if (b->rays) return s->film.width * s->film.height > 1 ? INFINITY : 0;
    if (s->shape) return 0.5 * imp__length(s->shape->hi - s->shape->lo);
    imp_v3 point = b->camera;
    imp__lens_point(s, rim, &point);
    return imp__length(point - b->camera);
}

static enum imp_status seen_find(const struct imp__boundary *b,
                                 struct imp__edge_item *item)
{
    imp_context *ctx = b->tracer->scene->ctx;
    const struct imp_shape *s = b->tracer->scene->shapes[item->shape];
    const size_t n = s->triangles.n_triangles;
    item->seen = imp__alloc(ctx, n, sizeof *item->seen);
    item->seen_until = imp__alloc(ctx, n + 1, sizeof *item->seen_until);
    if (!item->seen || !item->seen_until)
        return imp__error(ctx, IMP_E_NOMEM, "no memory for vertex normals");
    item->seen_until[0] = 0;
    const double radius = b->wide ? eye_radius(b) : 0;
    for (size_t k = 0; k < n; k++) {
        const struct imp__corners c = corners(b, item, k);
        const double distance =
            imp__length(towards(b, b->camera, c.p[0])) + 1e-6 * b->size;
        if (!may_turn(b, &c, radius) || !(item->until[k + 1] > item->until[k])) continue;
        item->seen[item->n_seen] = (int)k;
        item->seen_until[item->n_seen + 1] =
            item->seen_until[item->n_seen] + perimeter(&c) / distance;
        item->n_seen++;
    }
    return IMP_OK;
}

enum imp_status imp__edge_item_measure(const struct imp__boundary *b,
                                       struct imp__edge_item *item)
{
    imp_context *ctx = b->tracer->scene->ctx;
    const struct imp_shape *s = b->tracer->scene->shapes[item->shape];
    const size_t n = s->triangles.n_triangles;
    item->until = imp__alloc(ctx, n + 1, sizeof *item->until);
    if (!item->until) return imp__error(ctx, IMP_E_NOMEM, "no memory for vertex normals");
    item->until[0] = 0;
    for (size_t k = 0; k < n; k++) {
        const struct imp__corners c = corners(b, item, k);
        item->until[k + 1] =
            item->until[k] +
            0.5 * imp__length(imp__cross(c.p[1] - c.p[0], c.p[2] - c.p[0]));
    }
    return item->kind == IMP_ITEM_SHADING ? seen_find(b, item) : IMP_OK;
}

void imp__edge_item_free(imp_context *ctx, struct imp__edge_item *item)
{
    imp__release(ctx, item->until);
    imp__release(ctx, item->seen);
    imp__release(ctx, item->seen_until);
}

/* The entry of rising sums [n + 1] that u chooses; u is uniform again, *chance its probability. */
static size_t entry_choose(const double *until, size_t n, double *u, double *chance)
{
    const double x = *u * until[n];
    size_t lo = 0, hi = n - 1;
    while (lo < hi) {
        const size_t half = lo + (hi - lo + 1) / 2;
        if (until[half] <= x) lo = half;
        else hi = half - 1;
    }
    const double own = until[lo + 1] - until[lo];
    *chance = own / until[n];
    *u = imp_clamp((x - until[lo]) / own, 0.0, 1 - 0x1p-53);
    return lo;
}

void imp__edge_item_surface(const struct imp__edge_draw *d, struct imp_hit *hit,
                            struct imp_surface *at)
{
    const imp_v3 unused = {0};
    hit->shape = d->item->shape;
    hit->place = d->item->place;
    imp__hit_surface(d->b->tracer->scene, hit, &unused, &unused, at);
}

bool imp__edge_item_point(struct imp__edge_draw *d, unsigned dim, struct imp_hit *hit,
                          struct imp_surface *at)
{
    const struct imp_shape *s = d->b->tracer->scene->shapes[d->item->shape];
    const size_t n = s->triangles.n_triangles;
    double chance, b[2], u = d->u;
    if (!(d->item->until[n] > 0)) return false;
    const size_t prim = entry_choose(d->item->until, n, &u, &chance);
    const double v[2] = {u, imp__u01(d->key, dim)};
    imp__uniform_triangle(v, b);
    *hit = (struct imp_hit){.prim = (int)prim, .u = b[0], .v = b[1]};
    imp__edge_item_surface(d, hit, at);
    d->p = at->p;
    d->inv_pdf = d->item->until[n] / d->chance;
    return true;
}

/* ---- Points ------------------------------------------------------------------------------ */

bool imp__edge_turning_point(struct imp__edge_draw *d, imp_v3 eye, bool mirrored,
                             struct imp_hit *hit)
{
    const struct imp__edge_item *item = d->item;
    const struct imp_shape *s = d->b->tracer->scene->shapes[item->shape];
    const size_t n_all = s->triangles.n_triangles;
    double chance, u = d->u;
    if (!(mirrored ? item->until[n_all] > 0 : item->n_seen > 0)) return false;
    const int prim =
        mirrored ? (int)entry_choose(item->until, n_all, &u, &chance)
                 : item->seen[entry_choose(item->seen_until, item->n_seen, &u, &chance)];
    const struct imp__corners c = corners(d->b, item, (size_t)prim);
    const double round = perimeter(&c);

    /* A point of the perimeter, on side k, and a direction by the cosine to the side's normal. */
    double x = imp__u01(d->key, IMP_EDGE_DIR_U) * round, length = 0;
    int k = 0;
    for (; k < 3; k++) {
        length = imp__length(c.p[(k + 1) % 3] - c.p[k]);
        if (x < length || k == 2) break;
        x -= length;
    }
    const double t = imp_min(x / length, 1.0);
    const imp_v3 along = (c.p[(k + 1) % 3] - c.p[k]) * (1 / length);
    const imp_v3 apex = c.p[(k + 2) % 3] - c.p[k];
    const imp_v3 in = imp__normalize(apex - along * imp__dot(apex, along));
    const double sine = 2 * imp__u01(d->key, IMP_EDGE_DIR_V) - 1;
    const imp_v3 q = in * sqrt(imp_max(1 - sine * sine, 0.0)) + along * sine;

    /* Weights along the line, and where it leaves the triangle. */
    const imp_v3 e1 = c.p[1] - c.p[0], e2 = c.p[2] - c.p[0];
    const double aa = imp__dot(e1, e1), ab = imp__dot(e1, e2), bb = imp__dot(e2, e2);
    const double det = aa * bb - ab * ab, qa = imp__dot(q, e1), qb = imp__dot(q, e2);
    double b[3] = {0}, rate[3], until = INFINITY;
    b[k] = 1 - t;
    b[(k + 1) % 3] = t;
    rate[1] = (bb * qa - ab * qb) / det;
    rate[2] = (aa * qb - ab * qa) / det;
    rate[0] = -rate[1] - rate[2];
    for (int i = 0; i < 3; i++)
        if (i != (k + 2) % 3 && rate[i] < 0) until = imp_min(until, -b[i] / rate[i]);

    /* N.(eye - p) along it: a quadratic. */
    imp_v3 N = {0}, turn = {0}, p = {0};
    for (int i = 0; i < 3; i++) {
        N += c.n[i] * b[i];
        turn += c.n[i] * rate[i];
        p += c.p[i] * b[i];
    }
    const imp_v3 r = towards(d->b, eye, p), moves = d->b->parallel ? (imp_v3){0} : -q;
    const double g0 = imp__dot(N, r), g1 = imp__dot(turn, r) + imp__dot(N, moves),
                 g2 = imp__dot(turn, moves), square = g1 * g1 - 4 * g0 * g2;
    if (!(square >= 0) || !(until < INFINITY)) return false;
    const double half = -0.5 * (g1 + copysign(sqrt(square), g1));
    const double all[2] = {half / g2, g0 / half};
    double root[2];
    int n = 0;
    for (int i = 0; i < 2; i++)
        if (all[i] > 0 && all[i] < until) root[n++] = all[i];
    if (n == 0) return false;
    const double at = root[n == 2 && imp__u01(d->key, IMP_EDGE_LIGHT) >= 0.5];
    *hit = (struct imp_hit){
        .prim = prim, .u = b[1] + rate[1] * at, .v = b[2] + rate[2] * at};
    d->inv_pdf = 0.5 * round * n / (chance * d->chance);
    return true;
}

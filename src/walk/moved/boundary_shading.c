/* SPDX-License-Identifier: Apache-2.0
 *
 * Where the shading normal of a mesh turns away from the direction in which light is scattered
 * (boundary.h): kernels vanish there, in the middle of a triangle. On it
 *
 *     g = n_s.wo,  grad g = sum_k slope[k] (turn[k].wo) - n_s/t  in the surface, t the distance.
 *
 * The curve g = 0 as the camera sees it is met by random lines through its triangles. Lines
 * through a triangle have the measure of its perimeter, and of a curve within (Crofton)
 *
 *     int F dl = 1/2 int dline sum over crossings of F */
#include "base/context.h"
#include "boundary_parts.h"
#include "kind/cleared.h"
#include "math/warp.h"
#include "scene/pose.h"
#include "walk/core/step.h"
#include "walk/lights/light_step.h"

/* ---- Lists ------------------------------------------------------------------------------ */

static struct imp__corners corners(const struct imp__boundary *b,
                                   const struct imp__edge_item *item, size_t prim)
{
    return imp__corners(b->tracer->scene, item->shape, (int)prim, item->place);
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

/* How far the points through which it sees are from the middle. */
static double eye_radius(const struct imp__boundary *b)
{
    const struct imp_sensor *s = b->tracer->sensor;
    const double rim[2] = {1, 0.5};
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

static void surface_at(const struct imp__edge_draw *d, struct imp_hit *hit,
                       struct imp_surface *at)
{
    const imp_v3 unused = {0};
    hit->shape = d->item->shape;
    hit->place = d->item->place;
    imp__hit_surface(d->b->tracer->scene, hit, &unused, &unused, at);
}

bool imp__edge_item_point(struct imp__edge_draw *d, struct imp_hit *hit,
                          struct imp_surface *at)
{
    const struct imp_shape *s = d->b->tracer->scene->shapes[d->item->shape];
    const size_t n = s->triangles.n_triangles;
    double chance, b[2], u = d->u;
    if (!(d->item->until[n] > 0)) return false;
    const size_t prim = entry_choose(d->item->until, n, &u, &chance);
    const double v[2] = {u, imp__u01(d->key, IMP_EDGE_LIGHT_U)};
    imp__uniform_triangle(v, b);
    *hit = (struct imp_hit){.prim = (int)prim, .u = b[0], .v = b[1]};
    surface_at(d, hit, at);
    d->p = at->p;
    d->inv_pdf = d->item->until[n] / d->chance;
    return true;
}

/* ---- To the sensor ---------------------------------------------------------------------- */

/* A point of the curve on a random line; false: the line does not cross it. Sets d->inv_pdf, per
 * length of the curve. */
static bool seen_point(struct imp__edge_draw *d, struct imp_hit *hit)
{
    const struct imp__edge_item *item = d->item;
    double chance, u = d->u;
    const int prim =
        item->seen[entry_choose(item->seen_until, item->n_seen, &u, &chance)];
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
    const imp_v3 r = towards(d->b, d->eye, p), moves = d->b->parallel ? (imp_v3){0} : -q;
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

#define NEXT 0.3 /* as of edges (boundary_beside.c) */

/* How far the triangle goes on from a point of it along D, and against D. */
static double room_along(const struct imp__glued *x, imp_v3 D)
{
    const double b1 = imp__dot(x->slope[0], D), b2 = imp__dot(x->slope[1], D);
    const double rate[3] = {-b1 - b2, b1, b2};
    double room = INFINITY;
    for (int k = 0; k < 3; k++)
        if (rate[k] != 0) room = imp_min(room, imp_max(x->b[k], 0.0) / fabs(rate[k]));
    return room;
}

/* A point where the shading normal turns away from w, at which something is t away; `far`: in a
 * direction that is the same from everywhere. */
struct turning {
    struct imp__glued x;
    imp_v3 beside; /* to the lit side of it, so far that a look is not lost in rounding */
    double slope;  /* |grad g| */
    imp_v3 next;   /* to that side, much nearer */
};
static bool turning_at(const struct imp__edge_draw *d, const struct imp_hit *hit,
                       const struct imp_surface *at, imp_v3 w, double t, bool far,
                       struct turning *out)
{
    const struct imp_located located = {hit->prim, {(float)hit->u, (float)hit->v}};
    out->x = imp__glued_at(d->b->tracer->scene, hit->shape, &located, hit->place, at->ng);
    if (!out->x.smooth) return false;
    const imp_v3 n = out->x.shade - out->x.n * imp__dot(out->x.n, out->x.shade);
    const imp_v3 grad = out->x.slope[0] * imp__dot(out->x.turn[0], w) +
                        out->x.slope[1] * imp__dot(out->x.turn[1], w) -
                        n * (far ? 0 : 1 / t);
    out->slope = imp__length(grad);
    if (!(out->slope > 0)) return false;
    const imp_v3 D = grad * (1 / out->slope), across = D - w * imp__dot(w, D);
    const double seen = imp__length(across);
    if (!(seen > IMP_GRAZING)) return false;
    const double apart = IMP_BESIDE * (t + imp__length(at->p)) / seen;
    const double room = 0.5 * room_along(&out->x, D);
    out->beside = D * imp_min(apart, room);
    out->next = D * imp_min(NEXT * apart * seen, room);
    return true;
}

/* From o, beside the curve on the lit side (sign 1) or the dark one: where a ray there meets its
 * triangle, the walk begins at it, next to the curve. */
static bool look_next(struct imp__edge_draw *d, const struct turning *x, double sign,
                      imp_v3 o, int before, struct imp_walk *walk)
{
    struct imp_hit hit;
    const imp_v3 r = imp__normalize(x->x.p + x->beside * sign - o), by = x->next * sign;
    const struct imp__edge_face face = {
        .shape = x->x.shape, .prim = x->x.prim, .place = x->x.place};
    if (!imp__intersect(d->b->tracer->scene, &o, &r, d->near, INFINITY, &hit) ||
        !imp__edge_face_hit(d, &face, &hit))
        return false;
    hit.u = x->x.b[1] + imp__dot(x->x.slope[0], by);
    hit.v = x->x.b[2] + imp__dot(x->x.slope[1], by);
    imp__look_at(d, o, &hit, before, walk);
    return true;
}

/* What is seen beside the curve, from o: `from` of a meter, else through the film. */
static imp_spec look_beside(struct imp__edge_draw *d, const struct turning *x,
                            double sign, imp_v3 o, const struct imp_surface *from)
{
    const imp_v3 q = x->x.p + x->beside * sign;
    struct imp_sensor_sample at;
    struct imp_walk walk;
    const imp_v3 own = d->b->parallel ? o + x->next * sign : o;
    if (look_next(d, x, sign, own, 0, &walk)) return walk.values;
    if (from) {
        imp__look_from(d, from, q, 0, &walk);
        return walk.values;
    }
    if (!imp__sensor_connect(d->b->tracer->sensor, &q, false, d->lens, &at))
        return imp__spec(0);
    return imp__look_through(d, at.px, at.py);
}

void imp__draw_shading_film(struct imp__edge_draw *d)
{
    const struct imp_sensor *sensor = d->b->tracer->sensor;
    const bool meter = sensor->shape != NULL, parallel = d->b->parallel;
    struct imp_sensor_sample to;
    struct imp_surface at, from = {.uv = {0}};
    struct imp_hit hit;
    struct turning x;
    struct imp__line line;
    if (meter) imp__meter_draw(sensor, d->lens, &from);
    if (meter) d->eye = from.p;
    if (!sensor->ops->connect || !seen_point(d, &hit)) return;
    surface_at(d, &hit, &at);
    d->p = at.p;
    if (!imp__sensor_connect(sensor, &at.p, false, d->lens, &to) ||
        !imp__light_on_film(sensor, &to))
        return;
    const imp_v3 o = meter ? imp__offset(from.p, from.ng, at.p - from.p) : to.p,
                 r = at.p - o;
    const double t = imp__length(r);
    if (!imp__edge_line(d, o, r, 1 - IMP_BESIDE, &line)) return;
    if (!turning_at(d, &hit, &at, to.wo, t, parallel, &x)) return;
    if (imp_unlikely(d->b->fog != NULL))
        line.T *= imp__edge_cleared(d, -imp__edge_clip(d, &to));
    const imp_spec T = imp__edge_near(d, t, IMP_BESIDE * (t + imp__length(at.p)), line.T);
    const imp_spec jump = look_beside(d, &x, 1, o, meter ? &from : NULL) -
                          look_beside(d, &x, -1, o, meter ? &from : NULL);
    const double times = fabs(imp__dot(at.ng, to.wo)) * to.weight * d->inv_pdf / x.slope;
    struct imp__flux *f = imp__jump_add(d, &to, T * jump * times, 3);
    if (!f) return;
    /* g' = n_s'.wo + n_s.wo', and a camera's ray turns by (u(p) - u(o))/t, against wo. */
    struct imp__link_point p = {.x = x.x, .bar = {.shade = to.wo}};
    const imp_v3 shift = imp__slide_bar(&p, to.wo, NULL), turn = x.x.shade * (1 / t);
    const struct imp__glued eye = {.p = to.p};
    f->end[f->n_ends++] = (struct imp__flux_end){p.x, p.bar, false, 0, {0}};
    if (meter) {
        f->end[f->n_ends++] = imp__meter_end(d, &to, shift);
        return;
    }
    f->end[f->n_ends++] = imp__flux_camera(d, &p.x, shift - turn);
    f->end[f->n_ends++] = imp__flux_camera(d, &eye, turn);
}

/* ---- To a vertex ------------------------------------------------------------------------ */

void imp__draw_shading_scatter(struct imp__edge_draw *d)
{
    const int max = d->b->tracer->integrator->max_depth;
    struct imp_hit from, hit;
    struct imp_surface p, at;
    struct turning x;
    struct imp_walk lit, dark;
    if ((max >= 0 && max < 2) || !imp__edge_item_point(d, &from, &p)) return;
    const double psi = IMP_2PI * imp__u01(d->key, IMP_EDGE_DIR_U);
    const struct imp_frame f = imp__frame_from_normal(p.n);
    const imp_v3 w = f.s * cos(psi) + f.t * sin(psi);
    const imp_v3 o = imp__offset(p.p, p.ng, w);
    struct imp__line line;
    if (!imp__edge_follow(d, o, w, 0, 0, &hit, &at, &line)) return;
    if (!turning_at(d, &from, &p, w, imp__length(at.p - p.p), false, &x)) return;
    const imp_spec T =
        imp__edge_near(d, hit.t, IMP_BESIDE * (hit.t + imp__length(p.p)), line.T);
    const imp_v3 back = imp__offset(at.p, at.ng, -w);
    if (!look_next(d, &x, 1, back, 1, &lit))
        imp__look_from(d, &at, p.p + x.beside, 1, &lit);
    if (!look_next(d, &x, -1, back, 1, &dark))
        imp__look_from(d, &at, p.p - x.beside, 1, &dark);
    int depths;
    const imp_spec times =
        T * (fabs(imp__dot(p.ng, w)) * IMP_2PI * d->inv_pdf * line.times);
    imp_spec *jump = imp__jumps(
        d, &lit, &dark, times, (struct imp__seen_from){.floats = hit.shape < 0}, &depths);
    if (!jump) return;
    struct imp__edge_light light = {.w = w, .light = jump[0], .n_ends = 1};
    if (max >= 0) {
        light.by_depth = jump;
        light.n_depths = depths;
    }
    struct imp__link_point slides = {.x = x.x, .bar = {.shade = w}};
    light.slide = imp__slide_bar(&slides, w, NULL);
    light.end[0] = (struct imp__flux_end){slides.x, slides.bar, false, 0, {0}};
    imp__edge_reach(d, &hit, &at, &light);
}

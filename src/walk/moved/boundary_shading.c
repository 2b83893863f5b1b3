/* SPDX-License-Identifier: Apache-2.0
 *
 * Where the shading normal of a mesh turns away from the direction in which light is scattered
 * (boundary.h): kernels vanish there, in the middle of a triangle. On it
 *
 *     g = n_s.wo,  grad g = sum_k slope[k] (turn[k].wo) - n_s/t  in the surface, t the distance.
 *
 * Points on the curve g = 0 as the camera sees it: boundary_turning.c. */
#include "boundary_parts.h"
#include "kind/cleared.h"
#include "math/warp.h"
#include "walk/core/step.h"
#include "walk/lights/light_step.h"

/* ---- To the sensor ---------------------------------------------------------------------- */

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
    out->x = imp__glued_at(d->b->tracer->scene, hit->shape, &located, hit->place, d->time,
                           at->ng);
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
    if (!imp__intersect_at(d->b->tracer->scene, d->time, &o, &r, d->near, INFINITY,
                           &hit) ||
        !imp__edge_face_hit(d, &face, &hit))
        return false;
    hit.u = x->x.b[1] + imp__dot(x->x.slope[0], by);
    hit.v = x->x.b[2] + imp__dot(x->x.slope[1], by);
    imp__look_at(d, o, &hit, before, walk);
    return true;
}

/* What is seen beside the curve, from o: `from` of a meter, or of a mirror behind so many vertices, else
 * through the film. */
static imp_spec look_beside(struct imp__edge_draw *d, const struct turning *x,
                            double sign, imp_v3 o, const struct imp_surface *from,
                            int before)
{
    const imp_v3 q = x->x.p + x->beside * sign;
    struct imp_sensor_sample at;
    struct imp_walk walk;
    const imp_v3 own = d->b->parallel ? o + x->next * sign : o;
    if (look_next(d, x, sign, own, before, &walk)) return walk.values;
    if (from) {
        imp__look_from(d, from, q, before, &walk);
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
    if (!sensor->ops->connect || !imp__edge_turning_point(d, d->eye, false, &hit)) return;
    imp__edge_item_surface(d, &hit, &at);
    d->p = at.p;
    if (!imp__sensor_connect(sensor, &at.p, false, d->lens, &to) ||
        !imp__light_on_film(sensor, &to))
        return;
    const imp_v3 o = meter ? imp__offset(from.p, from.ng, at.p - from.p) : to.p,
                 r = at.p - o;
    const double t = imp__length(r);
    if (!imp__edge_line(d, o, r, 1 - IMP_BESIDE, &line)) return;
    if (!turning_at(d, &hit, &at, to.wo, t, parallel, &x)) return;
    if (imp_unlikely(imp__edge_fades(d))) line.T *= imp__edge_unclipped(d, &to);
    const imp_spec T =
        imp__edge_near(d, r * (1 / t), t, IMP_BESIDE * (t + imp__length(at.p)), line.T);
    const imp_spec jump = look_beside(d, &x, 1, o, meter ? &from : NULL, 0) -
                          look_beside(d, &x, -1, o, meter ? &from : NULL, 0);
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

void imp__draw_shading_ray(struct imp__edge_draw *d)
{
    const struct imp_film_desc *film = &d->b->tracer->sensor->film;
    const int max = d->b->tracer->integrator->max_depth;
    const struct imp_surface *viewer = &d->ray.at;
    struct imp_surface at;
    struct imp_hit hit;
    struct turning x;
    struct imp__line line;
    struct imp_walk lit, dark;
    if (!d->ray.meets || (max >= 0 && max < 2) ||
        !imp__edge_turning_point(d, viewer->p, false, &hit))
        return;
    imp__edge_item_surface(d, &hit, &at);
    d->p = at.p;
    const imp_v3 o = imp__offset(viewer->p, viewer->ng, at.p - viewer->p), r = at.p - o,
                 wo = imp__normalize(-r);
    const double t = imp__length(r);
    const imp_spec times =
        imp__ray_receives(d, -wo) *
        (film->width * film->height * fabs(imp__dot(at.ng, wo)) * d->inv_pdf / (t * t));
    if (imp__is_zero_used(times, d->waves) ||
        !imp__edge_line(d, o, r, 1 - IMP_BESIDE, &line) ||
        !turning_at(d, &hit, &at, wo, t, false, &x))
        return;
    if (!look_next(d, &x, 1, o, 1, &lit))
        imp__look_from(d, viewer, x.x.p + x.beside, 1, &lit);
    if (!look_next(d, &x, -1, o, 1, &dark))
        imp__look_from(d, viewer, x.x.p - x.beside, 1, &dark);
    const struct imp__seen_from from = {.before = 1};
    const imp_spec jump =
        imp__arrives(d->b, &lit, from) - imp__arrives(d->b, &dark, from);
    struct imp__flux *f = imp__ray_jump_add(d, jump * times * (1 / x.slope));
    if (!f) return;
    struct imp__link_point p = {.x = x.x, .bar = {.shade = wo}};
    const imp_v3 shift = imp__slide_bar(&p, wo, NULL);
    f->end[f->n_ends++] = (struct imp__flux_end){p.x, p.bar, false, 0, {0}};
    imp__ray_point_ends(d, shift, f);
}

/* A ray over mirrors leads to p and comes from its image t away along wo. What its shift at p, and its
 * turn times n, count: to the mirrors, and (at, bar) to two points of the ray at its other end. */
struct ray_ends {
    imp_v3 at[2], bar[2];
};
static struct ray_ends ray_ends(const struct imp__mirrors *mirrors, imp_v3 p, imp_v3 wo,
                                double t, imp_v3 shift, imp_v3 n,
                                struct imp__flux_end *end, int *n_ends)
{
    const imp_v3 turn = n * (1 / t);
    struct ray_ends out = {{p, p + wo * t}, {shift - turn, turn}};
    for (int k = 0; k < 2; k++)
        out.bar[k] = imp__mirrors_bar(mirrors, &out.at[k], out.bar[k], end, n_ends);
    return out;
}

void imp__draw_shading_mirrored(struct imp__edge_draw *d)
{
    struct imp__sight s;
    struct imp_surface at;
    struct imp_hit hit;
    struct turning x;
    struct imp__line line;
    if (!d->b->tracer->sensor->ops->connect || !imp__sight_draw(d, 0, &s) ||
        !imp__edge_turning_point(d, s.eye, true, &hit))
        return;
    imp__edge_item_surface(d, &hit, &at);
    d->p = at.p;
    if (!imp__sight_reach(d, &s, at.p)) return;
    const struct imp_surface *mirror = &s.mirrors.first->at;
    const imp_v3 o = imp__offset(mirror->p, mirror->ng, at.p - mirror->p), r = at.p - o,
                 wo = imp__normalize(mirror->p - at.p);
    const double apart = IMP_BESIDE * (imp__length(r) + imp__length(at.p));
    if (imp__length(r) < IMP_SHORT_OF * apart ||
        !imp__edge_line(d, o, r, 1 - IMP_BESIDE, &line) ||
        !turning_at(d, &hit, &at, wo, s.to.dist, d->b->parallel, &x))
        return;
    const imp_spec jump = look_beside(d, &x, 1, o, mirror, s.bounces) -
                          look_beside(d, &x, -1, o, mirror, s.bounces);
    const double times =
        fabs(imp__dot(at.ng, wo)) * s.to.weight * d->inv_pdf / (x.slope * s.chance);
    struct imp__flux *f = imp__jump_add(d, &s.to, s.T * jump * times, 3 + 2 * s.n);
    if (!f) return;
    struct imp__link_point p = {.x = x.x, .bar = {.shade = wo}};
    const imp_v3 shift = imp__slide_bar(&p, wo, NULL);
    f->end[f->n_ends++] = (struct imp__flux_end){p.x, p.bar, false, 0, {0}};
    const struct ray_ends ray =
        ray_ends(&s.mirrors, p.x.p, wo, s.to.dist, shift, x.x.shade, f->end, &f->n_ends);
    if (d->b->tracer->sensor->shape) {
        f->end[f->n_ends++] = imp__meter_end(d, &s.to, ray.bar[0] + ray.bar[1]);
        return;
    }
    for (int k = 0; k < 2; k++) {
        const struct imp__glued at_camera = {.p = ray.at[k]};
        f->end[f->n_ends++] = imp__flux_camera(d, &at_camera, ray.bar[k]);
    }
}

/* ---- To a vertex ------------------------------------------------------------------------ */

void imp__draw_shading_scatter(struct imp__edge_draw *d)
{
    const int max = d->b->tracer->integrator->max_depth;
    struct imp_hit from, hit;
    struct imp_surface p, at;
    struct turning x;
    struct imp_walk lit, dark;
    if ((max >= 0 && max < 2) || !imp__edge_item_point(d, IMP_EDGE_LIGHT_U, &from, &p))
        return;
    const double psi = IMP_2PI * imp__u01(d->key, IMP_EDGE_DIR_U);
    const struct imp_frame f = imp__frame_from_normal(p.n);
    const imp_v3 w = f.s * cos(psi) + f.t * sin(psi);
    const imp_v3 o = imp__offset(p.p, p.ng, w);
    struct imp__line line;
    if (!imp__edge_follow(d, o, w, 0, 0, &hit, &at, &line)) return;
    const bool mirrored = line.mirrors.n > 0;
    const struct imp_surface *viewer = mirrored ? &line.mirrors.first->at : &at;
    const int between = mirrored ? line.bounces_mirrored : 0;
    const double t = mirrored ? hit.t : imp__length(at.p - p.p);
    const double apart = IMP_BESIDE * (hit.t + imp__length(p.p));
    if (!turning_at(d, &from, &p, w, t, false, &x) ||
        (mirrored && imp__length(viewer->p - p.p) < IMP_SHORT_OF * apart))
        return;
    const imp_spec T = imp_unlikely(mirrored)
                           ? line.T_mirrored
                           : imp__edge_near(d, -w, hit.t, apart, line.T);
    const imp_v3 back = imp__offset(viewer->p, viewer->ng, -w);
    if (!look_next(d, &x, 1, back, 1 + between, &lit))
        imp__look_from(d, viewer, p.p + x.beside, 1 + between, &lit);
    if (!look_next(d, &x, -1, back, 1 + between, &dark))
        imp__look_from(d, viewer, p.p - x.beside, 1 + between, &dark);
    int depths;
    const imp_spec times =
        T * (fabs(imp__dot(p.ng, w)) * IMP_2PI * d->inv_pdf * line.times);
    imp_spec *jump =
        imp__jumps(d, &lit, &dark, times, imp__spec(0),
                   (struct imp__seen_from){
                       .before = between, .floats = hit.shape < 0, .mirrored = mirrored},
                   &depths);
    if (!jump) return;
    struct imp__edge_light light = {.w = line.w, .light = jump[0], .n_ends = 1};
    if (max >= 0) {
        light.by_depth = jump;
        light.n_depths = depths;
    }
    struct imp__link_point slides = {.x = x.x, .bar = {.shade = w}};
    light.slide = imp__slide_bar(&slides, w, NULL);
    light.end[0] = (struct imp__flux_end){slides.x, slides.bar, false, 0, {0}};
    if (mirrored) {
        struct imp__flux_end *end =
            imp__arena_take(d->arena, 2 * (size_t)line.mirrors.n, sizeof *end);
        d->no_memory |= end == NULL;
        if (!end) return;
        const struct ray_ends ray = ray_ends(&line.mirrors, slides.x.p, w, t, light.slide,
                                             x.x.shade, end, &light.n_mirror_ends);
        light.mirror_end = end;
        light.slide = ray.bar[0] + ray.bar[1];
    }
    imp__edge_reach(d, &hit, &at, &light);
}

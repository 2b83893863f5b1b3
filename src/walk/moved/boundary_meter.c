/* SPDX-License-Identifier: Apache-2.0
 *
 * Edges as a meter sees them (boundary.h): a point x of it, glued to its shape, with a density of
 * directions K. Where x is drawn, and the edge by its length,
 *
 *     dI = int dl sin(phi) K/r^2 [L(-) - L(+)] m.(V - V_line),   r = |p - x|.
 *
 * What a light without a recorded kernel sends (emission at the first vertex) is glued to the light, and
 * V_line is as between a light and what it lights; of all other light V_line = x'. A meter with an
 * area is met by lines from lights past silhouettes, too (boundary_light.c), and has emission from
 * there, where small lamps are found. A meter at points is met by no line. */
#include "boundary_parts.h"
#include "kind/cleared.h"
#include "kind/sensor/receiver.h"
#include "scene/located.h"
#include "walk/core/step.h"
#include "walk/lights/light_step.h"

bool imp__meter_is_points(const struct imp_sensor *s)
{
    return s->receiver && s->receiver->points;
}

void imp__meter_draw(const struct imp_sensor *s, const double u[4],
                     struct imp_surface *at)
{
    double on[2];
    imp__receiver_uv(s, u[0] * s->film.width, u[1] * s->film.height, on);
    at->located.prim = -1;
    s->shape->ops->sample_area(s->shape, on, at);
}

struct imp__flux_end imp__meter_end(const struct imp__edge_draw *d,
                                    const struct imp_sensor_sample *to, imp_v3 bar)
{
    const struct imp_sensor *s = d->b->tracer->sensor;
    const struct imp__glued x = imp__glued_at(d->b->tracer->scene, s->shape->index,
                                              &to->located, 0, d->time, to->ng);
    return imp__flux_glued(&x, bar);
}

/* Emission that a look past the edge meets first, of a light at y:
 * V_line = (t_y x' + t_x V_y)/(t_x + t_y), of distances from the edge. */
static void emission_add(struct imp__edge_draw *d, const struct imp_sensor_sample *to,
                         const struct imp_walk *walk, imp_v3 m, double times)
{
    imp_spec T;
    const struct imp_vertex *v = imp__walk_met(d, walk, &T);
    if (!v || d->b->tracer->integrator->max_depth == 0) return;
    struct imp__flux *f = imp__jump_add(d, to, T * v->e * times, 2 + IMP_EDGE_ENDS);
    if (!f) return;
    f->n_ends = imp__edge_ends(d, m, f->end);
    const struct imp__glued y =
        imp__glued_at(d->b->tracer->scene, v->d.shape, &v->d.located, 0, d->time, v->ng);
    const double t_x = imp__length(d->p - to->p),
                 far = imp_clamp(1 - t_x / imp__length(y.p - to->p), 0.0, 1.0);
    f->end[f->n_ends++] = imp__meter_end(d, to, m * -far);
    f->end[f->n_ends++] = imp__flux_glued(&y, m * (far - 1));
}

static void look_beside(struct imp__edge_draw *d, const struct imp_surface *at, imp_v3 o,
                        imp_v3 m, double apart, struct imp_walk *walk)
{
    if (imp__edge_face_look(d, o, false, m, apart, 0, walk)) return;
    imp__look_from(d, at, imp__edge_beside(d, d->p - o, m, apart), 0, walk);
}

void imp__draw_meter(struct imp__edge_draw *d)
{
    const struct imp_tracer *t = d->b->tracer;
    const bool points = imp__meter_is_points(t->sensor);
    struct imp_sensor_sample to;
    struct imp_surface at = {.uv = {0}};
    imp_spec T;
    imp__meter_draw(t->sensor, d->lens, &at);
    if (!imp__edge_any(d, at.p, false) ||
        !imp__sensor_connect(t->sensor, &d->p, false, d->lens, &to) ||
        !imp__light_on_film(t->sensor, &to))
        return;
    const imp_v3 o = imp__offset(at.p, at.ng, d->p - at.p);
    const imp_v3 r = imp__edge_clear(d) - o;
    const double apart = IMP_BESIDE * (imp__length(r) + imp__length(d->p));
    const imp_v3 turned = imp__cross(d->along, d->p - to.p);
    if (!(imp__length(turned) > 0) || imp__edge_merges(d, r, apart) ||
        imp__edge_is_hidden(d, o, r, &T))
        return;
    const imp_v3 m = imp__normalize(turned);
    const double times = to.weight * d->inv_pdf * imp__length(turned) / to.dist;
    struct imp_walk lo, hi;
    imp_spec R;
    const int limb = imp__edge_limb(d, m, &R);
    look_beside(d, &at, o, limb < 0 ? m : -m, apart, &lo);
    look_beside(d, &at, o, limb > 0 ? -m : m, apart, &hi);
    const struct imp__seen_from x = {.drawn = points ? NULL : d->b->drawn_to_meter};
    const imp_spec jump = imp__arrives_limb(d->b, &lo, x, limb < 0 ? &R : NULL) -
                          imp__arrives_limb(d->b, &hi, x, limb > 0 ? &R : NULL);
    struct imp__flux *f = imp__jump_add(d, &to, jump * times, 1 + IMP_EDGE_ENDS);
    if (f) {
        f->n_ends = imp__edge_ends(d, m, f->end);
        f->end[f->n_ends++] = imp__meter_end(d, &to, -m);
    }
    /* Silhouettes before lights are found from there, unless it has no area; seams of lights are not. */
    if (points || imp__seam_side(d, &lo) >= 0) emission_add(d, &to, &lo, m, times);
    if (points || imp__seam_side(d, &hi) >= 0) emission_add(d, &to, &hi, m, -times);
}

bool imp__meter_meet(const struct imp__edge_draw *d, imp_v3 o, imp_v3 to,
                     const struct imp_hit *hit, struct imp__meter_point *x)
{
    const struct imp_sensor *s = d->b->tracer->sensor;
    const double middle[2] = {0.5, 0.5},
                 most = hit ? hit->t * (1 + IMP_BESIDE) : INFINITY;
    imp_v3 grad[2];
    *x = (struct imp__meter_point){.film = {0.5, 0.5}};
    if (d->b->tracer->integrator->max_depth == 0 || imp__meter_is_points(s)) return false;
    if (!(s->shape->ops->flags & IMP_SHAPE_SQUARE)) { /* one pixel, and it is there */
        if (!hit || hit->shape != s->shape->index || hit->place != 0) return false;
        imp__hit_surface(d->b->tracer->scene, hit, &o, &to, &x->at);
        return imp__dot(x->at.ng, to) < 0;
    }
    x->at.located.prim = -1;
    s->shape->ops->sample_area(s->shape, middle, &x->at);
    const imp_v3 n = x->at.ng;
    const double across = imp__dot(n, to), t = imp__dot(x->at.p - o, n) / across;
    const bool both = s->receiver && s->receiver->bsdf.flags & IMP_BSDF_TRANSMIT;
    if (!(across < 0 || (both && across > 0)) || !(t > 1) || !(t <= most)) return false;
    imp__surface_grad(&x->at, grad);
    const imp_v3 r = o + to * t - x->at.p;
    double uv[2];
    for (int k = 0; k < 2; k++) {
        uv[k] = x->at.uv[k] + imp__dot(grad[k], r);
        x->film[k] = uv[k];
        if (s->receiver)
            x->film[k] = (uv[k] - s->receiver->first[k]) / s->receiver->span[k];
        if (!(x->film[k] >= 0) || !(x->film[k] < 1)) return false;
    }
    x->at.located.prim = -1;
    s->shape->ops->sample_area(s->shape, uv, &x->at);
    return true;
}

void imp__meter_reach(struct imp__edge_draw *d, const struct imp__meter_point *x,
                      const struct imp__edge_light *light)
{
    const struct imp_sensor *s = d->b->tracer->sensor;
    const struct imp_receiver *r = s->receiver;
    const imp_v3 w = -light->w;
    const double cosine = fabs(imp__dot(x->at.ng, w));
    const double density =
        r ? IMP_PI * imp__receiver_density(r, imp__to_local(&r->frame, w)) : cosine;
    const double area = s->shape->area * (r ? r->span[0] * r->span[1] : 1);
    const double pixels = (double)s->film.width * s->film.height;
    const struct imp_sensor_sample on = {.px = x->film[0] * s->film.width,
                                         .py = x->film[1] * s->film.height};
    if (!(density > 0) || !imp__light_on_film(s, &on)) return;
    struct imp__flux *f = imp__flux_add(d, light->n_ends + 1);
    if (!f) return;
    f->px = on.px;
    f->py = on.py;
    f->L = light->light * (pixels * density / (area * cosine));
    for (int k = 0; k < light->n_ends; k++) f->end[f->n_ends++] = light->end[k];
    const struct imp_located located =
        imp__located_drawn(s->shape, &x->at.located, x->at.uv);
    const struct imp__glued at = imp__glued_at(d->b->tracer->scene, s->shape->index,
                                               &located, 0, d->time, x->at.ng);
    f->end[f->n_ends++] = imp__flux_glued(&at, light->slide);
}

/* ---- Inside ------------------------------------------------------------------------------- */

struct imp__kernel_bar imp__meter_times(const struct imp_sensor *s, imp_v3 n, imp_v3 w,
                                        double bar)
{
    const struct imp_receiver *r = s->receiver;
    if (!r) return imp__lambert_times(n, w, bar);
    struct imp__kernel_bar out = {{0}, {0}, {0}, 0, {0}};
    const imp_v3 axis = r->frame.n, f = imp__to_world(&r->frame, r->facing);
    imp_v3 slope = f; /* of the density p, times a constant */
    double p = imp__dot(f, w);
    if (r->kind != IMP_PLANAR) {
        /* sin(e) is the part of w across the axis, and its gradient along that. */
        const imp_v3 across = w - axis * imp__dot(axis, w);
        const double sine = imp__length(across);
        if (!(sine > 0)) return out;
        slope = across * (1 / sine);
        if (r->kind == IMP_SEMICYLINDRICAL) slope += f;
        p = imp__dot(slope, w);
    }
    if (bar == 0 || !(p > 0)) return out;
    out.wi = slope * (bar / p);
    /* p is of w in the frame, which turns with the shape (moved_kernel.h). */
    const imp_v3 by_frame = imp__cross(out.wi, w);
    out.n = imp__cross(by_frame, n);
    out.turn = imp__dot(by_frame, n);
    return out;
}

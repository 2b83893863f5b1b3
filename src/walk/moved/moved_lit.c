/* SPDX-License-Identifier: Apache-2.0
 *
 * Light that vertices scatter, in the interior derivative (moved_sweep.h): their kernels, and light samples
 * of all kinds. */
#include "kind/emitter/from_point.h"
#include "moved_sky.h"
#include "moved_sweep.h"

extern const struct imp_emitter_ops imp__projector;

/* Is it the point of a meter, in whose place a white surface is? */
static bool is_meter(const struct imp__sweep *s, int k)
{
    return s->meter && k == s->first;
}

bool imp__sweep_kernel(const struct imp__sweep *s, int k, const struct imp_vertex *v,
                       imp_v3 w, int lobe, struct imp__kernel_d *out)
{
    struct imp_surface at = {.s = {1, 0, 0, 0}, .t = {0, 1, 0, 0}, .n = {0, 0, 1, 0}};
    if (imp_likely(imp__is_plain(v->bsdf)) || is_meter(s, k) ||
        (imp_likely(!s->at[k].floats) &&
         !imp__decided_surface(s->tracer->scene, &v->d, s->walk->time, &at)))
        return false;
    const imp_v3 from = k > s->front ? s->at[k - 1].x.p : s->walk->ray.o;
    const struct imp_frame frame = {at.s, at.t, at.n};
    const struct imp_dirs dirs = {
        imp__to_local(&frame, imp__normalize(from - s->at[k].x.p)),
        imp__to_local(&frame, w), lobe, 0};
    imp__kernel_derive(v, &at, &dirs, out);
    return true;
}

/* Without that to the direction to the camera. */
static struct imp__kernel_bar kernel_part(const struct imp__sweep *s, int k,
                                          const struct imp__kernel_d *derived, imp_v3 w,
                                          imp_spec bar)
{
    const int lanes = s->tracer->scene->lanes;
    const imp_v3 n = imp__shading_normal(&s->at[k].x);
    if (imp_unlikely(derived)) return imp__kernel_times(derived, bar, lanes);
    const double sum = imp__sum_used(bar, lanes);
    return is_meter(s, k) ? imp__meter_times(s->tracer->sensor, s->at[k].x.n, w, sum)
                          : imp__lambert_times(n, w, sum);
}

struct imp__kernel_bar imp__sweep_kernel_bar(struct imp__sweep *s, int k,
                                             const struct imp__kernel_d *derived,
                                             imp_v3 w, imp_spec bar)
{
    struct imp__kernel_bar out = kernel_part(s, k, derived, w, bar);
    if (!derived) return out;
    if (imp_unlikely(s->at[k].floats)) { /* its frame has the axes of the world */
        out.n = (imp_v3){0};
        out.turn = 0;
    } else {
        s->at[k].x.s = derived->frame.s;
    }
    if (k <= s->front || imp_unlikely(s->at[k].turns)) s->at[k].wo_bar += out.wo;
    return out;
}

/* The adjoint of the kernel of its light sample, towards w. */
static struct imp__kernel_bar light_kernel(struct imp__sweep *s, int k,
                                           const struct imp_vertex *v, imp_v3 w)
{
    struct imp__kernel_d d;
    const bool derived = imp__sweep_kernel(s, k, v, w, IMP_SMOOTH, &d);
    return imp__sweep_kernel_bar(s, k, derived ? &d : NULL, w, s->piece[k].light);
}

/* A light sample of a point, or of parallel light. */
static void delta_bar(struct imp__sweep *s, int k, const struct imp_vertex *v)
{
    const int light = v->d.light.emitter;
    struct imp_emitter *e = s->tracer->scene->emitters[light];
    const double weight = imp__sum_used(s->piece[k].light, s->tracer->scene->lanes);
    double aim[3];
    e->ops->aim(e, aim, false);
    const imp_v3 at = imp__v3(aim[0], aim[1], aim[2]);
    if (e->ops->flags & IMP_EMITTER_FAR) {
        const struct imp__kernel_bar far = light_kernel(s, k, v, -at);
        imp_v3 turn;
        s->at[k].moved_bar += imp__sweep_shift_bar(s, s->piece[k].light, v->carried,
                                                   s->at[k].x.p, -at, INFINITY, &turn);
        imp__scatter_bar(&s->at[k], &far);
        imp__light_velocity_bar(s->moves, light, at, -far.wi - turn, s->theta_bar);
        return;
    }
    const imp_v3 r = s->at[k].x.p - at;
    const double distance = imp__length(r);
    const imp_v3 d = r * (1 / distance);
    const int lanes = s->tracer->scene->lanes;
    const imp_v3 slope =
        imp_unlikely(imp__has_picture(e))
            ? imp__picture_slope(e, d, s->piece[k].light, lanes, v->carried)
            : imp__sent_slope(e, d, lanes, v->carried) * weight;
    const imp_v3 turn = slope * (1 / distance);
    if (imp_unlikely(e->ops == &imp__projector)) {
        /* Along d another place of the picture comes, as bright as it is by the angle: the part of the
         * slope that is not  d ln 1/cos^3. */
        const imp_v3 axis = imp__light_frame_of(e)->axis[2];
        const imp_v3 of_picture = slope - axis * (-3 * weight / imp__dot(axis, d));
        imp__light_spread_bar(s->moves, light, d,
                              d * imp__dot(d, of_picture) - of_picture, s->theta_bar);
    }
    /* The light turned by a vector sends along d what it sent along d turned back. */
    imp__light_turn_bar(s->moves, light, imp__cross(slope, d), s->theta_bar);
    const struct imp__kernel_bar kernel = light_kernel(s, k, v, r * (-1 / distance));
    const struct imp__line_bar line = imp__sweep_line_bar(
        s, s->piece[k].light, v->to_light, v->carried, s->at[k].x.p, at);
    const imp_v3 bar =
        imp__point_bar(&s->at[k], at, &kernel, weight, line.along) - turn + line.to;
    s->at[k].moved_bar += turn + line.from;
    imp__light_velocity_bar(s->moves, light, at, bar, s->theta_bar);
}

void imp__sweep_lamp_bar(struct imp__sweep *s, int k, struct imp__link_point *y, imp_v3 w,
                         struct imp__kernel_bar *kernel, const struct imp_emitter *e,
                         imp_spec light, const struct imp_track *track,
                         const struct imp_carried *carried)
{
    struct imp__link_point *x = &s->at[k];
    const double d = imp__length(y->x.p - x->x.p),
                 bar = imp__sum_used(light, s->tracer->scene->lanes);
    const struct imp__line_bar line =
        imp__sweep_line_bar(s, light, track, carried, x->x.p, y->x.p);
    if (imp_likely(!x->floats)) {
        imp__connection_bar(x, y, kernel, bar, line.along);
        x->moved_bar += line.from;
        y->bar.v += line.to;
        return;
    }
    double slope;
    const double part = imp__glued_part(e, d, &slope),
                 fixed = imp__sweep_length_bar(
                     s, light, imp__sweep_before(s, y->x.p, y->x.n, w, carried));
    kernel->wi *= part;
    imp__connection_bar(x, y, kernel, bar * part, line.along * part + bar * slope);
    x->moved_bar += imp__reached_bar(y, w, fixed * (1 - part) - bar * slope);
    /* What is glued goes with both ends; the rest is shifted with x. */
    x->moved_bar += line.from + line.to * (1 - part);
    y->bar.v += line.to * part;
}

void imp__sweep_sky_bar(const struct imp__sweep *s, int k, int sky, imp_v3 w,
                        const struct imp__kernel_d *d, imp_spec bar,
                        const struct imp_carried *carried)
{
    const imp_spec glued =
        imp__sky_sent_bar(s->moves, sky, w, bar, carried, s->theta_bar);
    const struct imp__kernel_bar kernel = kernel_part(s, k, d, w, glued);
    imp_v3 turn;
    imp__sweep_shift_bar(s, glued, carried, s->at[k].x.p, w, INFINITY, &turn);
    imp__light_velocity_bar(s->moves, sky, w, kernel.wi + turn, s->theta_bar);
}

/* The light sample of a sky. */
static void sky_sample_bar(struct imp__sweep *s, int k, const struct imp_vertex *v)
{
    const imp_v3 w = imp__normalize(-imp__decided_v3(v->d.light.d));
    struct imp__kernel_d derived;
    const struct imp__kernel_d *d =
        imp__sweep_kernel(s, k, v, w, IMP_SMOOTH, &derived) ? &derived : NULL;
    const struct imp__kernel_bar kernel =
        imp__sweep_kernel_bar(s, k, d, w, s->piece[k].light);
    imp_v3 turn;
    s->at[k].moved_bar += imp__sweep_shift_bar(s, s->piece[k].light, v->carried,
                                               s->at[k].x.p, w, INFINITY, &turn);
    imp__scatter_bar(&s->at[k], &kernel);
    if (imp_unlikely(s->moves->skies))
        imp__sweep_sky_bar(s, k, v->d.light.emitter, w, d, s->piece[k].light, v->carried);
}

void imp__light_sample_bar(struct imp__sweep *s, int k, const struct imp_vertex *v)
{
    const struct imp_scene *scene = s->tracer->scene;
    const struct imp_emitter *e = scene->emitters[v->d.light.emitter];
    if (e->ops->flags & IMP_EMITTER_DELTA) {
        delta_bar(s, k, v);
        return;
    }
    if (e->ops->flags & IMP_EMITTER_ENVIRONMENT) {
        sky_sample_bar(s, k, v);
        return;
    }
    struct imp__link_point y =
        imp__surface_point(scene, e->shape->index, &v->d.light.located, 0, s->walk->time,
                           imp__decided_v3(v->d.light.d));
    const imp_v3 w = imp__link_direction(&s->at[k], &y);
    const imp_spec light = s->piece[k].light;
    const double bar = imp__sum_used(light, scene->lanes);
    struct imp__kernel_bar kernel = light_kernel(s, k, v, w);
    kernel.wi -= imp__sweep_table_bar(s, e, &y.x, -w, bar, v->carried);
    imp__sweep_lamp_bar(s, k, &y, w, &kernel, e, light, v->to_light, v->carried);
    imp__velocity_bar(s->moves, &y.x, &y.bar, s->theta_bar);
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks from the sensor, each alone: step after step to its end. */
#include "sensor_end.h"
#include "surface_sensor.h"

/* The light sample counts as far as what lies between lets it pass. */
static __attribute__((noinline)) void connect_through(struct imp_step *s,
                                                      struct imp_vertex *v,
                                                      const struct imp_surface *at,
                                                      const struct imp_shadow *shadow)
{
    imp_spec T;
    if (!s->segment->sees(s, v, at, shadow, &T)) return;
    v->b = shadow->brings * T;
    if (!s->recorded) return;
    v->d.connection = IMP_CONNECTED;
    v->light_w *= T;
}

static inline void link_see(struct imp_step *s, struct imp_vertex *v,
                            const struct imp_surface *at, const struct imp_link *link)
{
    const struct imp_shadow *shadow = &link->shadow;
    if (imp_unlikely(s->segment->sees != NULL)) {
        connect_through(s, v, at, shadow);
    } else if (!imp__occluded_at(s->scene, s->walk->time, &shadow->o, &shadow->d, 0,
                                 shadow->reach)) {
        v->b = shadow->brings;
        if (s->recorded) v->d.connection = IMP_CONNECTED;
    }
}

static const struct imp_end_ops sensor_end = {.nothing = imp__sky_meet,
                                              .arrive = imp__end_arrive,
                                              .bounces = imp__end_bounces,
                                              .passes = imp__end_counts,
                                              .densities = imp__end_densities,
                                              .meet = imp__end_meet,
                                              .goes_on = imp__end_goes_on,
                                              .link_draw = imp__end_link_draw,
                                              .link_weigh = imp__end_link_weigh,
                                              .link_see = link_see,
                                              .splits = imp__end_splits,
                                              .direction_draw = imp__direction_begin,
                                              .scatter = imp__scatter_along,
                                              .scatter_split = imp__scatter_split};

void imp__walk_on(struct imp_step *s)
{
    while (imp__one_step(&sensor_end, s)) s->depth++;
}

imp_spec imp__walk_scattered(struct imp_step *s, const struct imp_bsdf *scatterer,
                             imp_v3 p)
{
    struct imp_surface at;
    struct imp_frame frame;
    struct imp_vertex *v = imp__medium_meet(s, scatterer, -1, p, 0, &at, &frame);
    if (!v) return (imp_spec){0};
    if (imp__vertex_work(&sensor_end, s, v, NULL, &at, &frame)) {
        s->depth++;
        imp__walk_on(s);
    }
    return imp__walk_fold(s->walk);
}

void imp__walk_on_meter(struct imp_step *s)
{
    struct imp_surface at;
    struct imp_frame frame;
    struct imp_vertex *v = imp__meter_begin(s, &at, &frame);
    if (!v || !imp__vertex_work(&sensor_end, s, v, NULL, &at, &frame)) return;
    s->depth++;
    imp__walk_on(s);
}

/* Turns the frame of v about its normal. */
static void frame_turn(struct imp_step *s, struct imp_vertex *v, imp_v3 along,
                       struct imp_surface *at, struct imp_frame *frame)
{
    const imp_v3 in_plane = along - frame->n * imp__dot(frame->n, along);
    const double length = imp__length(in_plane);
    if (!(length > 0)) return;
    frame->s = at->s = in_plane * (1 / length);
    frame->t = at->t = imp__cross(frame->n, frame->s);
    s->wo_drawn = imp__to_local(frame, -s->d);
    s->wo = imp__decide(s->wo_drawn);
    if (s->recorded) imp__store_v3(v->d.wo, s->wo);
}

void imp__walk_on_hit(struct imp_step *s, struct imp_hit *hit, imp_v3 along)
{
    struct imp_surface at;
    struct imp_frame frame;
    imp__step_numbers(s);
    struct imp_vertex *v = imp__surface_meet(s, hit, &at, &frame);
    if (v && !imp__is_zero(along)) frame_turn(s, v, along, &at, &frame);
    if (!v || !imp__end_arrive(s, v, hit, &at, &frame) ||
        !imp__vertex_work(&sensor_end, s, v, hit, &at, &frame))
        return;
    s->depth++;
    imp__walk_on(s);
}

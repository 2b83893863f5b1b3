/* SPDX-License-Identifier: Apache-2.0
 *
 * Straight segments through nothing. */
#include "walk/graded/graded.h"
#include "walk/media/tracking.h"

static inline enum imp_meeting nearest_hit(struct imp_step *s, struct imp_hit *hit)
{
    return imp__intersect_at(s->scene, s->walk->time, &s->o, &s->d, s->t_min, s->t_max,
                             hit)
               ? IMP_MEETS_SURFACE
               : IMP_MEETS_NOTHING;
}

/* Past the area lights. */
static __attribute__((noinline)) enum imp_meeting camera_meet(struct imp_step *s,
                                                              struct imp_hit *hit)
{
    while (nearest_hit(s, hit) == IMP_MEETS_SURFACE) {
        if (s->scene->shapes[hit->shape]->emitter < 0) return IMP_MEETS_SURFACE;
        const imp_v3 p = s->o + s->d * hit->t;
        const double scale = fmax(fabs(p[0]), fmax(fabs(p[1]), fabs(p[2])));
        s->t_min = hit->t + (1 + scale) * IMP_RAY_EPSILON;
    }
    return IMP_MEETS_NOTHING;
}

enum imp_meeting imp__straight_meet(struct imp_step *s, struct imp_hit *hit)
{
    const bool hide = s->tracer->integrator->hide_emitters && s->depth == 0;
    return imp_likely(!hide) ? nearest_hit(s, hit) : camera_meet(s, hit);
}

static const struct imp_segment_ops straight = {
    .name = "straight", .connects = true, .meet = imp__straight_meet};
struct imp_segment imp__straight = {&straight, NULL};

/* Adjoint photons cross media where there are some; else they are walks of surfaces alone,
 * as those of path. */
static bool tracks(const struct imp_tracer *tracer)
{
    const struct imp_walk_integrator *i = tracer->integrator;
    return i->media && (tracer->scene->n_media > 0 || tracer->scene->priorities ||
                        !(i->photons || i->from_lights));
}

const struct imp_segment_ops *imp__segment_first(const struct imp_tracer *tracer)
{
    return imp_unlikely(tracer->scene->n_bodies > 0) ? &imp__graded_outside
           : imp_unlikely(tracks(tracer))            ? &imp__tracking
                                                     : &straight;
}

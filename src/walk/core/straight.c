/* SPDX-License-Identifier: Apache-2.0
 *
 * Straight segments through nothing. */
#include "step.h"

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

const struct imp_segment_ops imp__straight_ops = {
    .name = "straight", .connects = true, .meet = imp__straight_meet};
struct imp_segment imp__straight = {&imp__straight_ops, NULL};

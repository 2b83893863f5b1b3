/* SPDX-License-Identifier: Apache-2.0
 *
 * Straight segments through nothing. */
#include "graded.h"

/* The nearest hit. With hide_emitters, a camera ray skips area lights. */
static enum imp_meeting straight_meet(struct imp_step *s, struct imp_hit *hit)
{
    return imp__nearest_hit(s, hit) ? IMP_MEETS_SURFACE : IMP_MEETS_NOTHING;
}

static const struct imp_segment_ops straight = {
    .name = "straight", .connects = true, .meet = straight_meet};
struct imp_segment imp__straight = {&straight};

const struct imp_segment_ops *imp__segment_first(const struct imp_scene *scene)
{
    return imp_unlikely(scene->n_media > 0) ? &imp__graded_outside : &straight;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Light that fades on lines in media, in the interior derivative (moved_sweep.h): what its adjoints are to
 * the lines. */
#include "moved_sweep.h"

/* The sum over the lanes of -bar times this, which is a vector by its components. */
static imp_v3 vector_bar(const struct imp__sweep *s, imp_spec bar, const imp_spec of[3])
{
    const int lanes = s->tracer->scene->lanes;
    return imp__v3(-imp__sum_used(bar * of[0], lanes), -imp__sum_used(bar * of[1], lanes),
                   -imp__sum_used(bar * of[2], lanes));
}

struct imp__line_bar imp__sweep_line_bar(const struct imp__sweep *s, imp_spec bar,
                                         const struct imp_track *track,
                                         const struct imp_carried *carried, imp_v3 x,
                                         imp_v3 y)
{
    struct imp__line_bar out = {0, {0}, {0}};
    const struct imp_scene *scene = s->tracer->scene;
    if (imp_likely(!s->fog && !s->media) || imp__is_zero_used(bar, carried)) return out;
    if (s->fog) {
        out.along = imp__sweep_length_bar(s, bar, s->extinction);
        return out;
    }
    const double d = imp__length(y - x);
    if (imp_unlikely(s->varies)) {
        const struct imp__along a =
            imp__media_along(&s->moves->borders, x, (y - x) * (1 / d), d, carried);
        out.along = imp__sweep_length_bar(s, bar, a.depth * (1 / d));
        out.to = vector_bar(s, bar, a.turn) * (1 / d);
        out.from = vector_bar(s, bar, a.slope) - out.to;
    } else if (track) {
        out.along = imp__sweep_length_bar(
            s, bar, imp__track_depth(scene, track, carried) * (1 / d));
    }
    return out;
}

imp_v3 imp__sweep_shift_bar(const struct imp__sweep *s, imp_spec bar,
                            const struct imp_carried *carried, imp_v3 o, imp_v3 w,
                            double length, imp_v3 *turn)
{
    *turn = (imp_v3){0};
    if (imp_likely(!s->varies) || imp__is_zero_used(bar, carried)) return (imp_v3){0};
    const struct imp__along a =
        imp__media_along(&s->moves->borders, o, w, length, carried);
    *turn = vector_bar(s, bar, a.turn);
    return vector_bar(s, bar, a.slope);
}

imp_spec imp__sweep_before(const struct imp__sweep *s, imp_v3 p, imp_v3 ng, imp_v3 w,
                           const struct imp_carried *carried)
{
    if (imp_likely(!s->media)) return s->extinction;
    const struct imp_medium *m =
        imp__borders_at(&s->moves->borders, imp__offset(p, ng, -w), -w);
    return m ? imp__extinction_in(s->tracer->scene, m, p, carried) : imp__spec(0);
}

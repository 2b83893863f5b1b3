/* SPDX-License-Identifier: Apache-2.0
 *
 * One step of a walk, from the ray in flight to the next one. It makes the record of a path,
 * whichever end that begins at: gradients and checks start from what it records. Vertices of
 * bundles that are made in lanes have the same record, to the bit (bundle/lanes_record.c). Each end
 * instantiates it with its table (ends.h). */
#ifndef IMP_WALK_ONE_STEP_H
#define IMP_WALK_ONE_STEP_H

#include "ends.h"
#include "vertices.h"

#define IMP_STEP_INLINE static inline __attribute__((always_inline))

/* Is another vertex within max_depth, even if only one reached by going straight on, which is
 * no bounce? */
IMP_STEP_INLINE bool imp__vertex_goes_on(const struct imp_end_ops *end,
                                         const struct imp_step *s,
                                         const struct imp_vertex *v)
{
    return end->bounces(s) || (end->passes && imp_unlikely(v->bsdf->straight) &&
                               s->segment->through && end->passes(s));
}

/* What leaves v: the connection, and the next ray if it goes_on. False: the walk ends.
 *
 * The point of the connection and the direction are both drawn, then both weighed, and only
 * then the visibility of the point is tested: neither waits for the other's roots and
 * quotients. */
IMP_STEP_INLINE bool imp__vertex_leave(const struct imp_end_ops *end, struct imp_step *s,
                                       struct imp_vertex *v, const struct imp_surface *at,
                                       const struct imp_frame *frame, bool goes_on)
{
    struct imp_link link;
    const bool linked =
        (v->bsdf->flags & IMP_BSDF_SMOOTH) && end->link_draw(s, v, at, &link);
    struct imp_direction direction;
    const bool splits = end->splits && end->splits(s);
    const bool directions = goes_on && s->tracer->integrator->directions;
    const bool drawn =
        directions && !splits && end->direction_draw(s, v, frame, &direction);

    link.shadow.wanted = false;
    if (linked) end->link_weigh(s, v, at, frame, &link);
    if (end->join) {
        if (link.shadow.wanted) end->link_see(s, v, at, &link);
        if (!end->join(s, v, at, frame)) return false;
    }
    const bool continues =
        drawn ? end->scatter(s, v, at, frame, &direction)
              : splits && directions && end->scatter_split(s, v, at, frame);
    if (!end->join && link.shadow.wanted) end->link_see(s, v, at, &link);
    return continues && !s->walk->dropped;
}

/* At a vertex: what is met, the connection, and where the walk goes on. False: it ends. hit
 * NULL: the walk begins here. */
IMP_STEP_INLINE bool imp__vertex_work(const struct imp_end_ops *end, struct imp_step *s,
                                      struct imp_vertex *v, const struct imp_hit *hit,
                                      const struct imp_surface *at,
                                      const struct imp_frame *frame)
{
    const bool goes_on = imp__vertex_goes_on(end, s, v);
    if (!hit) imp__step_numbers(s); /* else drawn before its ray was traced */
    if (end->densities) end->densities(s, v, at);
    if (!end->meet(s, v, hit, at) || (!end->connects_last && !goes_on)) return false;
    if (end->goes_on) end->goes_on(s, v);
    return imp__vertex_leave(end, s, v, at, frame, goes_on);
}

/* What the ray has met is a vertex. */
IMP_STEP_INLINE bool imp__step_on(const struct imp_end_ops *end, struct imp_step *s,
                                  enum imp_meeting met, struct imp_hit *hit)
{
    struct imp_surface at;
    struct imp_frame frame;
    struct imp_vertex *v;
    switch (met) {
    case IMP_MEETS_SURFACE: v = imp__surface_meet(s, hit, &at, &frame); break;
    case IMP_MEETS_MEDIUM:
        v = imp__medium_meet(s, s->flight.here->scatterer, s->flight.here->index,
                             s->flight.at, s->flight.t, &at, &frame);
        break;
    case IMP_MEETS_NOTHING:
        if (end->nothing) end->nothing(s);
        return false;
    default: return false;
    }
    return v && (!end->arrive || end->arrive(s, v, hit, &at, &frame)) &&
           imp__vertex_work(end, s, v, hit, &at, &frame);
}

IMP_STEP_INLINE bool imp__one_step(const struct imp_end_ops *end, struct imp_step *s)
{
    struct imp_hit hit;
    /* Follow the ray to what it meets. Which numbers the vertex there has does not depend on
     * it: they come from memory meanwhile. */
    imp__step_numbers(s);
    const enum imp_meeting met = s->segment->meet(s, &hit);
    return imp__step_on(end, s, met, &hit);
}

#endif

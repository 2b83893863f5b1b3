/* SPDX-License-Identifier: Apache-2.0
 *
 * Lines among shapes that are met from outside alone (boundary.h): bsplinecurves, whose ends are open. A
 * line into an end is closed in one sense and open in the other. What counts is the sense of walks of the
 * camera, which see along a line from its lit end; draws of the boundary come from the other one, and ask
 * what they meet whether it sees where they come from. */
#ifndef IMP_WALK_BOUNDARY_ONE_SIDED_H
#define IMP_WALK_BOUNDARY_ONE_SIDED_H

#include "boundary_parts.h"

/* Is o seen from this point? */
bool imp__one_sided_sees(const struct imp__edge_draw *d, const struct imp_surface *at,
                         imp_v3 o);
/* imp__edge_follow to what sees the line's beginning, with numbers from `dim` on. */
bool imp__one_sided_follow(const struct imp__edge_draw *d, imp_v3 o, imp_v3 w,
                           double from, unsigned dim, struct imp_hit *hit,
                           struct imp_surface *at, struct imp__line *line);
/* A line to the camera, o + till r, as that sees it. */
bool imp__one_sided_line(const struct imp__edge_draw *d, imp_v3 o, imp_v3 r, double till);
/* IMP_E_UNSUPPORTED, with the name of what lines that have a sense must not meet. */
enum imp_status imp__one_sided_allowed(const struct imp__boundary *b);

#endif

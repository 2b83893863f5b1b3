/* SPDX-License-Identifier: Apache-2.0
 *
 * What scenes must not hold, or parameters not be, where derivatives are wanted by what moves: refused by
 * name, with IMP_E_UNSUPPORTED. */
#ifndef IMP_WALK_BOUNDARY_ALLOWED_H
#define IMP_WALK_BOUNDARY_ALLOWED_H

#include "boundary_parts.h"

/* All of it. */
enum imp_status imp__boundary_allowed(const struct imp__boundary *b);
/* Edges that tear, shapes that pass through each other, facets that become lit at once. */
enum imp_status imp__edges_allowed(const struct imp__boundary *b);
/* Borders of media. */
enum imp_status imp__borders_allowed(const struct imp__boundary *b);
/* What moves in time. */
enum imp_status imp__timed_allowed(const struct imp__boundary *b);
/* What a single ray meets. */
enum imp_status imp__rays_allowed(const struct imp__boundary *b);
/* Near planes and virtual meters that cut what moves. */
enum imp_status imp__cuts_allowed(const struct imp__boundary *b);
/* Where the rays through the film's corners begin to see, in order around it. */
bool imp__near_plane(const struct imp_sensor *s, imp_v3 p[4]);

#endif

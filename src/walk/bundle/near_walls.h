/* SPDX-License-Identifier: Apache-2.0
 *
 * Points of a grid near walls. What a walk meets nearer than the next point is hardly seen from there:
 * such points have little from others (reuse.h), and larger errors. They have more walks, which give
 * only: a point takes, from all walks of its group, with m_l those of point l for each of the film's,
 *
 *     S p_j(x) V_j / sum_l m_l p_l(x) V_l.
 *
 * The numbers of walks are of the scene and the grid alone. */
#ifndef IMP_WALK_BUNDLE_NEAR_WALLS_H
#define IMP_WALK_BUNDLE_NEAR_WALLS_H

#include "walk/core/walk.h"

/* Walks of each of the film's pixels that give only, for each of its own: *more [pixels], released by
 * the caller; NULL: none has any. IMP_E_NOMEM. */
enum imp_status imp__near_walls(const struct imp_tracer *tracer, uint8_t **more);

#endif

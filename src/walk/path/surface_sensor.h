/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks from a sensor that is a surface. The irradiance on a surface is pi times what a
 * white diffuse one in its place would send back: so the walk begins with such a vertex,
 * which has a light sample like any other. */
#ifndef IMP_WALK_METER_H
#define IMP_WALK_METER_H

#include "walk/core/step.h"

/* The two vertices with which the walk begins, the sensor and the white one, which is then
 * at work at depth -1. `lens` takes no part. NULL: the walk is dropped. */
struct imp_vertex *imp__meter_begin(struct imp_step *s, struct imp_surface *at,
                                    struct imp_frame *frame);

#endif

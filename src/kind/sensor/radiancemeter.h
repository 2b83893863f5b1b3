/* SPDX-License-Identifier: Apache-2.0
 *
 * A radiancemeter with a grid: what an observer sees at the points of a rectangle. */
#ifndef IMP_KIND_SENSOR_RADIANCEMETER_H
#define IMP_KIND_SENSOR_RADIANCEMETER_H

#include "kind/build.h"
#include "math/vec.h"

/* Is it one? */
bool imp__looks_at_grid(const struct imp_sensor *s);
/* The point in the middle of the pixel of a film position, and the rectangle's normal. */
imp_v3 imp__grid_looked_at(const struct imp_sensor *s, double px, double py,
                           imp_v3 *normal);

#endif

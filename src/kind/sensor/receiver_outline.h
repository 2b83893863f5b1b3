/* SPDX-License-Identifier: Apache-2.0
 *
 * A flat shape that is no rectangle, as grids of points see it: its outline in the rectangle
 * around it. */
#ifndef IMP_KIND_SENSOR_RECEIVER_OUTLINE_H
#define IMP_KIND_SENSOR_RECEIVER_OUTLINE_H

#include "receiver.h"

struct imp__outline {
    imp_v3 origin, axis[2]; /* the rectangle's corner, and its sides as unit vectors */
    double side[2];
    size_t n;
    double (*edge)[4]; /* [n] x0 y0 x1 y1 along the axes from the origin; belongs to the
                          context */
};

/* The outline of s: a disk, or a mesh in one plane, whose rectangle is the smallest that has a side
 * along an edge. The first axis is as near to x (of a plane across x: to y) as the rectangle
 * allows, the second a quarter turn from it about the normal of the shape.
 * IMP_E_SCENE for other shapes, and meshes that are not flat. */
enum imp_status imp__outline_create(const struct imp_build *b, const struct imp_shape *s,
                                    imp_v3 normal, struct imp__outline *out);
void imp__outline_destroy(const struct imp_build *b, struct imp__outline *o);

/* The points of a raster of columns x rows cells, over the rectangle less the margin, that lie
 * on the shape and not nearer to its outline than the margin: into r->place and r->cell, and
 * the size of the raster. *n: how many; IMP_E_SCENE if there is none. */
enum imp_status imp__outline_points(const struct imp_build *b, const struct imp_shape *s,
                                    const struct imp__outline *o, double margin,
                                    int columns, int rows, struct imp_receiver *r,
                                    int *n);

#endif

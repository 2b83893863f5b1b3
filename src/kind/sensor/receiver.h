/* SPDX-License-Identifier: Apache-2.0
 *
 * What a meter of light measures: where on its shape, and by which weight of directions.
 *
 * Planar        E  =      Int L max(0, w . f) dw
 * cylindrical   Ez = 1/pi Int L sin(e) dw
 * semicylindr.  Es = 1/pi Int L (sin(e) + w . f) dw
 *
 * with e the angle between w and the axis n, f across n: projected areas of half a cylinder
 * over its area, (1 + cos a) sin(e) with a the azimuth from f (EN 12464-1; EN 13201-3).
 * Each is pi times a mean of L by a density p of directions: cos/pi, sin(e)/pi^2,
 * (sin(e) + w . f)/pi^2. */
#ifndef IMP_KIND_SENSOR_RECEIVER_H
#define IMP_KIND_SENSOR_RECEIVER_H

#include "kind/build.h"
#include "math/vec.h"

enum imp_receiver_kind { IMP_PLANAR, IMP_CYLINDRICAL, IMP_SEMICYLINDRICAL };

struct imp_receiver {
    enum imp_receiver_kind kind;
    bool turned; /* planar, and f is not the shape's normal */
    bool points; /* at the middle of each pixel's cell; else the mean over the cell */
    bool absent; /* its shape is not there for light */
    double first[2], span[2]; /* of uv, which the film covers */
    /* On a disk or a mesh, which have points alone: the numbers by which sample_area makes the
     * point of each pixel, where that is in the raster around the shape, and its size. */
    const double (*place)[2];
    const int32_t (*cell)[2];
    int columns, rows;
    struct imp_frame frame; /* the shape's, n its normal and the axis */
    imp_v3 facing;          /* f in that frame */
    struct imp_bsdf bsdf;   /* p as the value and density of a material in that frame */
};

/* Light walks cannot meet what is a point, or not there: they are connected to it alone. */
static inline bool imp__is_unmet(const struct imp_sensor *s)
{
    return s->receiver && (s->receiver->points || s->receiver->absent);
}
/* Is the shape there for its sensor alone? */
static inline bool imp__shape_is_absent(const struct imp_shape *s)
{
    return s->sensor && s->sensor->receiver && s->sensor->receiver->absent;
}

/* Has the meter a grid: pixels with a place each? */
static inline bool imp__has_grid(const struct imp_sensor *s)
{
    return s->shape && ((s->shape->ops->flags & IMP_SHAPE_SQUARE) ||
                        (s->receiver && s->receiver->place));
}

/* What sample_area makes the place of a film position in pixels of; uv on a rectangle. */
void imp__receiver_uv(const struct imp_sensor *s, double px, double py, double uv[2]);
/* p of direction w, in the shape's frame. */
double imp__receiver_density(const struct imp_receiver *r, imp_v3 w);
/* Turns the frame with its shape, which a map has moved, from where `rest` is. */
void imp__receiver_turn(struct imp_receiver *r, const struct imp_receiver *rest,
                        const struct imp_shape *s, const double map[12]);
/* Draws w by p. */
imp_v3 imp__receiver_direction(const struct imp_receiver *r, const double u[2]);

/* What is not written of a grid's film: one number of light a pixel, and a box filter, through
 * which each pixel has its own point. IMP_E_SCENE for a wider filter. */
enum imp_status imp__grid_film(const struct imp_build *b, struct imp_sensor *s);
/* Reads what the sensor b->node, a meter on s->shape, says of these; sets s->receiver, and
 * the film's size by the norm's spacing where the film has none. Nothing is read of what
 * the rest of the scene holds. IMP_E_SCENE with its place. */
enum imp_status imp__receiver_build(const struct imp_build *b, struct imp_sensor *s);

#endif

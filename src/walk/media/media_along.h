/* SPDX-License-Identifier: Apache-2.0
 *
 * Media along a straight line, without random numbers: the optical depth, and what it changes by where
 * points of the line move. Where the point at the distance t moves by v(t) across media at rest,
 *
 *     tau = int sigma dt,    tau' = int grad sigma . v dt  + what the line's length changes.
 *
 * An extinction of grids is a polynomial of the third degree between the planes through the middles of
 * their cells, and two points of each piece (Gauss) give the integrals. */
#ifndef IMP_WALK_MEDIA_ALONG_H
#define IMP_WALK_MEDIA_ALONG_H

#include "scene/media_around.h"
#include "walk/core/walk.h"

struct imp__along {
    imp_spec depth;
    imp_spec slope[3]; /* int grad sigma dt */
    imp_spec turn[3];  /* int t grad sigma dt */
};

/* Why the integrals are not exact, in words that follow the medium's name; NULL: they are. */
const char *imp__along_without(const struct imp_scene *scene, const struct imp_medium *m);

/* Extinction at p: 0 outside the box in which the medium is, as far as hits are exact. */
imp_spec imp__extinction_in(const struct imp_scene *scene, const struct imp_medium *m,
                            imp_v3 p, const struct imp_carried *carried);

/* Adds one medium on the line o + t w, w unit, from `near` to `far`; slopes: not the depth alone. */
void imp__along_add(const struct imp_scene *scene, const struct imp_medium *m, imp_v3 o,
                    imp_v3 w, double near, double far, const struct imp_carried *carried,
                    bool slopes, struct imp__along *a);
/* The part of a line that is in the box of a medium that varies. False: none is. */
bool imp__along_box(const struct imp_medium *m, imp_v3 o, imp_v3 w, double *near,
                    double *far);
/* The optical depth as if the box had no sides. */
imp_spec imp__along_beyond(const struct imp_scene *scene, const struct imp_medium *m,
                           imp_v3 o, imp_v3 w, double near, double far,
                           const struct imp_carried *carried);
/* Where a lane has this much optical depth behind `near`; INFINITY: not before `far`, *depth is then what
 * is left of it. */
double imp__along_until(const struct imp_scene *scene, const struct imp_medium *m,
                        imp_v3 o, imp_v3 w, double near, double far,
                        const struct imp_carried *carried, int lane, double *depth);

/* The media of a line between surfaces that do not bound any, one after another; its start and end stand
 * behind borders as they are. */
struct imp__media_line {
    const struct imp__borders *borders;
    imp_v3 start, o, w;
    double length; /* may be INFINITY */
    const struct imp_medium *next;
    double from;
    int left; /* borders that it may meet yet */
};
struct imp__stretch {
    const struct imp_medium *medium; /* NULL: none */
    double near, far;
};
struct imp__media_line imp__media_line(const struct imp__borders *borders, imp_v3 o,
                                       imp_v3 w, double length);
/* False: the line has ended. */
bool imp__media_next(struct imp__media_line *line, struct imp__stretch *out);
/* All of them. */
struct imp__along imp__media_along(const struct imp__borders *borders, imp_v3 o, imp_v3 w,
                                   double length, const struct imp_carried *carried);

/* Derivatives by the place of a point of a medium, by lanes. */
struct imp__point_slopes {
    imp_spec extinction[3], albedo[3]; /* of logarithms; 0 where the number is */
    imp_spec glow[3];                  /* of what is emitted for each collision */
};
/* False: no number of the medium varies. */
bool imp__point_slopes(const struct imp_medium *m, imp_v3 p,
                       const struct imp_carried *carried, struct imp__point_slopes *out);

#endif

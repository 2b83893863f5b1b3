/* SPDX-License-Identifier: Apache-2.0
 *
 * Analytic shapes of a scene that has few of them. Four at a time, those are found whose
 * surrounding ball a ray may meet, and these are intersected; they are not in Embree's tree,
 * which would call back for one after the other. */
#ifndef IMP_SCENE_SHAPE_BALLS_H
#define IMP_SCENE_SHAPE_BALLS_H

#include "scene.h"

#define IMP_SHAPE_BALLS 8

struct imp_shape_balls {
    int n;
    imp_v3 x[IMP_SHAPE_BALLS / 4], y[IMP_SHAPE_BALLS / 4],
        z[IMP_SHAPE_BALLS / 4];     /* centres of the balls */
    imp_v3 r2[IMP_SHAPE_BALLS / 4]; /* squares of their radii, a little enlarged */
    const struct imp_shape *shape[IMP_SHAPE_BALLS];
};

/* At most IMP_SHAPE_BALLS of geometry IMP_ANALYTIC. */
void imp__shape_balls_add(struct imp_shape_balls *f, const struct imp_shape *shape);

/* Which of the balls 4 g to 4 g + 3 may the ray meet? A bit for each. With c from its origin to a
 * centre, b = c.d and a = d.d it meets the ball's line where b^2 >= a (c.c - r^2), and the ball
 * if that lies ahead or the origin is inside. Where c.c is so large that its rounding exceeds
 * what r was enlarged by, the ball counts as met. */
static inline unsigned imp__shape_balls_met(const struct imp_shape_balls *f, int g,
                                            const imp_v3 *o, const imp_v3 *d)
{
    const imp_v3 x = f->x[g] - (*o)[0], y = f->y[g] - (*o)[1], z = f->z[g] - (*o)[2];
    const imp_v3 b = x * (*d)[0] + y * (*d)[1] + z * (*d)[2];
    const imp_v3 out = (x * x + y * y + z * z) * (1 - 1e-14) - f->r2[g];
    return imp__lanes_of((b * b >= out * imp__dot(*d, *d)) & ((b >= 0) | (out <= 0)));
}

/* The nearest hit before *tmax, which becomes its distance. */
static inline bool imp__shape_balls_nearest(const struct imp_shape_balls *f,
                                            const imp_v3 *o, const imp_v3 *d, double tmin,
                                            double *tmax, struct imp_hit *hit)
{
    bool met = false;
    for (int g = 0; 4 * g < f->n; g++)
        for (unsigned left = imp__shape_balls_met(f, g, o, d); left; left &= left - 1) {
            const struct imp_shape *s = f->shape[4 * g + __builtin_ctz(left)];
            struct imp_hit own;
            if (!s->ops->intersect(s, o, d, tmin, *tmax, &own)) continue;
            *hit = own;
            hit->shape = s->index;
            hit->place = 0;
            *tmax = own.t;
            met = true;
        }
    return met;
}

/* Is one of them met between tmin and tmax? */
static inline bool imp__shape_balls_occluded(const struct imp_shape_balls *f,
                                             const imp_v3 *o, const imp_v3 *d,
                                             double tmin, double tmax)
{
    for (int g = 0; 4 * g < f->n; g++)
        for (unsigned left = imp__shape_balls_met(f, g, o, d); left; left &= left - 1) {
            const struct imp_shape *s = f->shape[4 * g + __builtin_ctz(left)];
            struct imp_hit own;
            if (s->ops->intersect(s, o, d, tmin, tmax, &own)) return true;
        }
    return false;
}

#endif

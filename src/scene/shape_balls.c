/* SPDX-License-Identifier: Apache-2.0
 *
 * The ball around an analytic shape joins the list that shape_balls.h searches. */
#include "shape_balls.h"
#include "kind/shape/shape.h"

/* The radius is enlarged by more than the rounding of what is computed with it. */
void imp__shape_balls_add(struct imp_shape_balls *f, const struct imp_shape *shape)
{
    const int g = f->n / 4, k = f->n % 4;
    struct imp_round round;
    imp_v3 centre = (shape->lo + shape->hi) * 0.5;
    double radius = 0.5 * imp__length(shape->hi - shape->lo);
    if (imp__shape_round(shape, &round) && imp__dot(round.axis, round.axis) == 0) {
        centre = round.centre;
        radius = round.radius;
    }
    if (k == 0) /* no ray meets a ball that is not there */
        f->r2[g] = imp__spec(-INFINITY);
    f->x[g][k] = centre[0];
    f->y[g][k] = centre[1];
    f->z[g][k] = centre[2];
    f->r2[g][k] = imp__sqr(radius * (1 + 1e-6));
    f->shape[f->n++] = shape;
}

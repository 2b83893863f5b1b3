/* SPDX-License-Identifier: Apache-2.0
 *
 * What the rows of lights share: the vertices that lights are asked for from, and parts of a
 * row. */
#ifndef IMP_INVERSE_CHECK_LIGHTS_H
#define IMP_INVERSE_CHECK_LIGHTS_H

#include "check_draws.h"
#include "check_places.h"
#include "math/vec.h"

/* In the order of places->all. */
struct imp__lit_places {
    const struct imp__places *places;
    const struct imp__place **at; /* [n] */
    struct imp_light_place *lit;  /* [n] */
    int n;
};

/* Parts: everything, and six ranges of the claimed density over the second one. */
enum { IMP_LIGHT_WHOLE, IMP_LIGHT_RATIOS };

/* Two functions that must agree, at what was drawn. */
static inline void imp__agree_add(struct imp__pair *p, int part, double claim,
                                  double other)
{
    imp__pair_add(p, part, other > 0 ? fmin(claim / other, 2) : 2, 1);
}

static inline double imp__triangle_area(const struct imp_triangles *t, int k)
{
    imp_v3 p[3];
    for (int j = 0; j < 3; j++) {
        const float *x = t->positions + 3 * (size_t)t->indices[3 * (size_t)k + (size_t)j];
        p[j] = (imp_v3){x[0], x[1], x[2]};
    }
    return 0.5 * imp__length(imp__cross(p[1] - p[0], p[2] - p[0]));
}
static inline double imp__triangles_area(const struct imp_triangles *t)
{
    double sum = 0;
    for (size_t k = 0; k < t->n_triangles; k++) sum += imp__triangle_area(t, (int)k);
    return sum;
}

/* A row for the lights that are like light `first`, which is the first of them; none where
 * lights before it are, or where it has no density. */
enum imp_status imp__check_points(struct imp__draw_list *l,
                                  const struct imp__lit_places *v, int first);

#endif

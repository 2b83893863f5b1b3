/* SPDX-License-Identifier: Apache-2.0
 *
 * Rays in columns against the scene: of every ray the numbers that it has alone (scene.h,
 * imp__intersect_at, imp__occluded_at), to the bit. Columns have room for IMP_COLUMN_SLACK
 * numbers more than there are, which may be read and written. */
#ifndef IMP_SCENE_RAY_COLUMNS_H
#define IMP_SCENE_RAY_COLUMNS_H

#include "scene.h"

#define IMP_COLUMN_SLACK 16

struct imp_ray_columns {
    int n;
    double *o[3], *d[3];
    double *near, *far; /* in units of d; near NULL: 0 */
    double *time;       /* NULL: all at this one: */
    double instant;
};

/* What rays meet; shape -1: nothing. */
struct imp_hit_columns {
    double *t, *u, *v; /* as of struct imp_hit */
    int32_t *shape, *prim;
    int64_t *place;
};

static inline void imp__hit_put(const struct imp_hit_columns *hits, int i,
                                const struct imp_hit *hit)
{
    hits->t[i] = hit->t;
    hits->u[i] = hit->u;
    hits->v[i] = hit->v;
    hits->shape[i] = hit->shape;
    hits->prim[i] = hit->prim;
    hits->place[i] = hit->place;
}

/* Nearest hits [rays->n]. */
void imp__intersect_columns(const struct imp_scene *scene,
                            const struct imp_ray_columns *rays,
                            const struct imp_hit_columns *hits);
/* Is anything in the way? hidden [rays->n]. */
void imp__occluded_columns(const struct imp_scene *scene,
                           const struct imp_ray_columns *rays, bool *hidden);

#endif

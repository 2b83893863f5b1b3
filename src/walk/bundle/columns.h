/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks of a bundle in columns: what one walk has in a struct lies here in a row of numbers for
 * all of them, so that several are worked on at a time (math/lane_text.h). A segment takes rays to
 * hits, a vertex takes hits to values, shadow rays and the rays that go on. Columns begin at
 * multiples of 32 bytes, and IMP_COLUMN_SLACK more numbers than are used may be written. */
#ifndef IMP_WALK_BUNDLE_COLUMNS_H
#define IMP_WALK_BUNDLE_COLUMNS_H

#include "base/arena.h"
#include "scene/light_tree.h"
#include "scene/ray_columns.h"
#include <stdint.h>

/* Rays in flight, with all that a walk under way is made of. */
struct imp_flights {
    struct imp_ray_columns ray;
    double *from[3]; /* where it left, for densities of lights */
    double
        *pdf; /* of its direction per steradian; 0: the sensor or a delta lobe chose it */
    double *beta[4]; /* throughput, for roulette */
    double *eta;     /* product of index ratios */
    struct imp_light_place
        *left;      /* where it left, as the tree of lights sees it; NULL: none */
    uint8_t *zeros; /* bit c: throughput c has left out a factor that is zero but has a
                       derivative (core/scatter.c); NULL: there are no derivatives */
    /* In media (in_media.h), else NULL: index of the medium that the ray is in, -1 for none; how far
     * it begins behind the point that it leaves; of walks one of whose colours draws, p_j/p_drew and W
     * (core/lane_mis.h). */
    int32_t *medium;
    double *behind, *ratio[3], *share;
    int32_t *walk; /* number of the walk */
    int32_t *up;   /* place of the last vertex among the values of its depth */
};

/* Values of the vertices of a depth (walk_parts.h: E, B, w), and what comes from beyond. */
struct imp_bundle_values {
    int n;
    double *e[4], *b[4], *w[4], *beyond[4];
    int32_t *up; /* place of the vertex before; of the first vertex, the walk's number */
};

/* Shadow rays, and the vertices whose B they decide: places among the values, or the vertices of
 * recorded walks. */
struct imp_shadows {
    struct imp_ray_columns ray;
    int32_t *at;
    struct imp_vertex **of;
    /* In media, else NULL: number of the walk; the medium where the ray begins, -1 for none; and how
     * far behind its beginning that is. */
    int32_t *walk, *medium;
    double *behind;
};

/* Optional columns. */
struct imp_columns_wanted {
    bool left, zeros, media;
};
/* Columns for n rays, in 3 colours or 4 wavelengths. False: no memory. */
bool imp__rays_create(struct imp_arena *arena, size_t n, struct imp_ray_columns *out);
bool imp__flights_create(struct imp_arena *arena, size_t n, int colors,
                         struct imp_columns_wanted wanted, struct imp_flights *out);
bool imp__hits_create(struct imp_arena *arena, size_t n, struct imp_hit_columns *out);
bool imp__bundle_values_create(struct imp_arena *arena, size_t n, int colors,
                               struct imp_bundle_values *out);
bool imp__shadows_create(struct imp_arena *arena, size_t n,
                         struct imp_columns_wanted wanted, struct imp_shadows *out);

static inline imp_v3 imp__column_v3(double *const c[3], int i)
{
    return imp__v3(c[0][i], c[1][i], c[2][i]);
}
static inline void imp__column_put(double *const c[3], int i, imp_v3 v)
{
    for (int k = 0; k < 3; k++) c[k][i] = v[k];
}
/* Colours: three, or four. */
static inline void imp__color_put(double *const c[4], int colors, int i, imp_spec v)
{
    for (int k = 0; k < colors; k++) c[k][i] = v[k];
}
static inline imp_spec imp__column_color(double *const c[4], int colors, int i)
{
    return (imp_spec){c[0][i], c[1][i], c[2][i], colors > 3 ? c[3][i] : 0};
}

#endif

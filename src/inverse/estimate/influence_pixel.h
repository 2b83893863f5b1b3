/* SPDX-License-Identifier: Apache-2.0
 *
 * The part of one pixel in a pass over influences (influence.c). */
#ifndef IMP_INVERSE_INFLUENCE_PIXEL_H
#define IMP_INVERSE_INFLUENCE_PIXEL_H

#include "film/film_tiles.h"
#include "influence.h"

struct imp__influence_pass {
    const struct imp__functional *f;
    bool positions; /* the second pass: B in the place of A */
    size_t n;       /* numbers F */
    int border, spp;
    int set;             /* samples that depend on each other, about */
    int64_t period;      /* samples that are cut into such sets, of which spp are taken */
    int64_t sets, parts; /* sets of a pixel that are taken; items of a tile */
    struct imp_tiles tiles;
    double *store; /* [tiles][doubles of a result] */
};

/* What the samples of a pixel send, and room for one sample. */
struct imp__influence_pixel {
    size_t side; /* pixels that its samples reach, along an axis */
    double *lane, *S;
    double *a, *u;                /* [n], [side^2] of the set of samples at work */
    double *sum, *square;         /* [n] of a over the sets */
    double *sum_u, *cross;        /* [side^2] of u, [side^2][n] of u a */
    double *value;                /* [n] s_p L_i of a pixel p, or s_p I_p */
    struct imp_taps across, down; /* of the sample */
};

/* Doubles of a tile's result: variance [n], then cross [region^2][n]. */
size_t imp__influence_size(const struct imp__influence_pass *p);
size_t imp__influence_side(const struct imp__influence_pass *p);

bool imp__influence_pixel_create(const struct imp__influence_pass *p,
                                 struct imp_arena *arena, struct imp__influence_pixel *s);
/* a += A_i or B_i, u += u_i. False: no memory. */
bool imp__influence_pixel_add(const struct imp__influence_pass *p,
                              struct imp__influence_pixel *t, struct imp_sample *s);
/* The set of samples is complete. */
void imp__influence_pixel_set_end(const struct imp__influence_pass *p,
                                  struct imp__influence_pixel *t, bool cross);
/* Add a pixel's sums over m sets to the tile's. */
void imp__influence_pixel_end(const struct imp__influence_pass *p,
                              const struct imp_tile *tile, int x, int y, int64_t m,
                              struct imp__influence_pixel *t, double *result, bool cross);
/* value [n] = sum over channels of s_p times the pictures at p. */
void imp__influence_pixel_value(const struct imp__influence_pass *p,
                                struct imp__influence_pixel *t, size_t pixel);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * The upper hemisphere in patches (Reinhart and Walkenhorst 2001: those of Tregenza and Waters
 * 1983, each in four): 14 rows of 90/14.5 degrees with twice 30, 30, 24, 24, 18, 12 and 6
 * patches, and a cap about the zenith. */
#ifndef IMP_INVERSE_SKY_PATCHES_H
#define IMP_INVERSE_SKY_PATCHES_H

#include "kind/emitter/sky_shape.h"

enum {
    IMP__PATCH_ROWS = 14,
    IMP__PATCHES = 577,
    IMP__PATCH_TURNS = 2 * (IMP__PATCHES - 1)
};

/* Numbers of eight hours. Readings of a year have errors of a part in a thousand or more, so floats are
 * enough. */
enum { IMP__AT_ONCE = 8 };
typedef float imp__annual_lanes __attribute__((vector_size(4 * IMP__AT_ONCE)));
typedef int32_t imp__annual_mask __attribute__((vector_size(4 * IMP__AT_ONCE)));

struct imp__sky_patches {
    imp_v3 axis[3];                   /* x, y and z (up), world */
    double sine[IMP__PATCH_ROWS + 1]; /* of the altitude at which row k begins */
    int first[IMP__PATCH_ROWS + 1];   /* patch of row k; of the cap */
    /* Cosines and sines of the points of patches about the zenith, two of each patch. */
    float turn[2][IMP__PATCH_TURNS];
};

void imp__sky_patches_set(struct imp__sky_patches *p, const imp_v3 axis[3]);
/* The patch of a direction, world; -1 below the horizon. */
int imp__sky_patch_of(const struct imp__sky_patches *p, imp_v3 w);
/* Its solid angle. */
double imp__sky_patch_size(const struct imp__sky_patches *p, int patch);
/* The mean radiance over each patch of eight skies whose axes are those of p, at four points (of the
 * cap: eight), so scaled that level ground has the illuminance `level`: Int L cos dw with L constant in
 * each patch. A sky that is dark everywhere is taken as uniform. Patch k is L[2 k]; the others stay. */
void imp__sky_patches_fill(const struct imp__sky_patches *p,
                           const struct imp__sky_shape sky[IMP__AT_ONCE],
                           const double level[IMP__AT_ONCE], imp__annual_lanes *L);

#endif

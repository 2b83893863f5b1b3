/* SPDX-License-Identifier: Apache-2.0
 *
 * Plane polygons cut into triangles. */
#ifndef IMP_FORMAT_POLYGON_CUT_H
#define IMP_FORMAT_POLYGON_CUT_H

#include "base/context.h"
#include <stdint.h>

#define IMP_POLYGON_MAX 1000 /* corners of one that is not convex */

/* Cut the polygon of n >= 3 corners p [n][3] into n - 2 triangles or fewer, with its
 * orientation. It is simple, but may touch itself along seams, by which Radiance and others
 * join a hole to the outline. out [3 (n - 2)] gets indices of corners, *n_out triangles; none
 * if the polygon has no area.
 * @return IMP_E_SCENE, with the reason, if it crosses itself or has too many corners. */
enum imp_status imp__polygon_cut(imp_context *ctx, const double *p, size_t n,
                                 uint32_t *out, size_t *n_out);

#endif

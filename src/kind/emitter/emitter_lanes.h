/* SPDX-License-Identifier: Apache-2.0
 *
 * What lights share in lanes. */
#ifndef IMP_KIND_EMITTER_LANES_H
#define IMP_KIND_EMITTER_LANES_H

#include "kind/kind_lanes.h"

extern const struct imp_emitter_lanes imp__envmap_lanes;

/* All but the density of points that are infinitely far along out->wi. */
static inline void imp__wide_light_far(struct imp_wide_light *out)
{
    out->p = out->wi;
    out->cos_light = imp__wide(1);
    out->drawn = ~(imp_wide_truth){0};
    out->dist = imp__wide(INFINITY);
    out->uv[0] = out->uv[1] = out->located[0] = out->located[1] = imp__wide(0);
    for (int k = 0; k < IMP_WIDE_LANES; k++) out->prim[k] = -1;
}

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * What shapes share in lanes. */
#ifndef IMP_KIND_SHAPE_LANES_H
#define IMP_KIND_SHAPE_LANES_H

#include "kind/kind_lanes.h"
#include "math/trig.h"
#include "shape.h"

#define IMP_WIDE IMP_WIDE_LANES
#define IMP_TEXT "kind/shape/shape_text.h"
#include "math/lane_text.h"

extern const struct imp_shape_lanes imp__rectangle_lanes, imp__sphere_lanes,
    imp__mesh_lanes;

static inline void imp__wide_surface_frame(imp_wide_frame *f, imp_wide3 dp_du)
{
    IMP_WIDE_OF(imp__surface_frames)(f, dp_du);
}

/* imp__light_from_area. */
static inline void imp__lights_from_area(imp_wide3 ref, imp_wide3 p, imp_wide3 ng,
                                         imp_wide3 n, imp_wide inv_area,
                                         struct imp_wide_light *out)
{
    const imp_wide3 d = imp__wide3_minus(p, ref);
    const imp_wide r = imp__wide3_norm(d);
    out->pdf = IMP_WIDE_OF(imp__areas_to_angles)(ref, p, ng, inv_area);
    out->drawn = (out->pdf > imp__wide(0)) & (r < imp__wide(INFINITY));
    out->wi = imp__wide3_times(d, 1 / r);
    out->cos_light = -imp__wide3_inner(out->wi, n);
    out->p = p;
    out->dist = r;
}

#endif

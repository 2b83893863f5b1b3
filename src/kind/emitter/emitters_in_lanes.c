/* SPDX-License-Identifier: Apache-2.0
 *
 * Emitters in lanes: surfaces by their shapes, and the constant sky. */
#include "emitter_lanes.h"
#include "math/trig.h"

#define IMP_WIDE IMP_WIDE_LANES
#define IMP_TEXT "math/warp_text.h"
#include "math/lane_text.h"

extern const struct imp_emitter_ops imp__area, imp__constant, imp__envmap;

/* ---- Surfaces ---------------------------------------------------------------------------- */

static bool area_covers(const struct imp_emitter *e)
{
    const struct imp_shape_lanes *lanes = imp__shape_lanes(e->shape);
    return e->shape->area > 0 && lanes && lanes->sample_toward &&
           (!lanes->lights || lanes->lights(e->shape));
}
static void area_sample(const struct imp_emitter *e, const imp_wide3 *ref,
                        const imp_wide u[2], struct imp_wide_light *out)
{
    imp__shape_lanes(e->shape)->sample_toward(e->shape, ref, u, out);
}

/* ---- The constant sky -------------------------------------------------------------------- */

static void constant_sample(const struct imp_emitter *e, const imp_wide3 *ref,
                            const imp_wide u[2], struct imp_wide_light *out)
{
    (void)e, (void)ref;
    out->wi = IMP_WIDE_OF(imp__sphere_directions)(u[0], u[1]);
    imp__wide_light_far(out);
    out->pdf = imp__wide(IMP_INV_PI / 4);
}

static imp_wide constant_pdf(const struct imp_emitter *e, const imp_wide3 *ref,
                             const imp_wide3 *wi)
{
    (void)e, (void)ref, (void)wi;
    return imp__wide(IMP_INV_PI / 4);
}

/* ---- All --------------------------------------------------------------------------------- */

static const struct imp_emitter_lanes area = {.covers = area_covers,
                                              .sample = area_sample},
                                      constant = {.sample = constant_sample,
                                                  .far = true,
                                                  .pdf = constant_pdf};

const struct imp_emitter_lanes *imp__emitter_lanes(const struct imp_emitter *e)
{
    if (e->ops == &imp__area && area_covers(e)) return &area;
    if (e->ops == &imp__envmap && imp__envmap_lanes.covers(e)) return &imp__envmap_lanes;
    return e->ops == &imp__constant ? &constant : NULL;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Emitters in lanes: surfaces by their shapes, and the constant sky. */
#include "emitter_lanes.h"
#include "kind/shape/shape_lanes.h"
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

static bool area_emits(const struct imp_emitter *e)
{
    return imp__shape_lanes(e->shape)->sample_area && !e->shape->by_triangle;
}
/* imp__surface_emission_sample. */
static void area_emission(const struct imp_emitter *e, const imp_wide u[4],
                          struct imp_wide_emission *out)
{
    imp__shape_lanes(e->shape)->sample_area(e->shape, u, out);
    imp_wide_frame axes = {.n = out->n};
    IMP_WIDE_OF(imp__axes_across)(axes.n, &axes.s, &axes.t);
    const imp_wide3 local = IMP_WIDE_OF(imp__cosine_directions)(u[2], u[3]);
    out->d = imp__wide3_unit(imp__out_of_wide_frame(&axes, local));
    out->cos_light = imp__wide3_inner(axes.n, out->d);
    out->cos_p = imp__wide_magnitude(imp__wide3_inner(out->ng, out->d));
    out->pdf_p = 1 / e->shape->area;
    out->pdf_d = local.z * IMP_INV_PI;
    out->drawn = local.z > imp__wide(0);
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
                                              .sample = area_sample,
                                              .emission = area_emission,
                                              .emits = area_emits},
                                      constant = {.sample = constant_sample,
                                                  .far = true,
                                                  .pdf = constant_pdf};

const struct imp_emitter_lanes *imp__emitter_lanes(const struct imp_emitter *e)
{
    if (e->ops == &imp__area && area_covers(e)) return &area;
    if (e->ops == &imp__envmap && imp__envmap_lanes.covers(e)) return &imp__envmap_lanes;
    return e->ops == &imp__constant ? &constant : NULL;
}

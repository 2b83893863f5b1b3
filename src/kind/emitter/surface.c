/* SPDX-License-Identifier: Apache-2.0
 *
 * Checks, sampling and density shared by area lights. */
#include "surface.h"

enum imp_status imp__surface_light_check(const struct imp_build *b,
                                         const struct imp_emitter *e)
{
    if (!e->shape)
        return imp_build_error(b, NULL, IMP_E_SCENE, "it must be inside a shape");
    if (!e->shape->ops->sample_toward || !e->shape->ops->pdf_toward)
        return imp_build_error(b, NULL, IMP_E_SCENE,
                               "points of its shape (%s) cannot be drawn",
                               e->shape->ops->name);
    if (!(e->shape->area > 0))
        return imp_build_error(b, NULL, IMP_E_SCENE, "its shape '%s' (%s) has no area",
                               e->shape->name ? e->shape->name : "", e->shape->ops->name);
    return IMP_OK;
}

bool imp__surface_light_sample(const struct imp_emitter *e, const imp_v3 *ref,
                               const double u[2], struct imp_light_sample *out)
{
    return e->shape->ops->sample_toward(e->shape, ref, u, out);
}

double imp__surface_light_pdf(const struct imp_emitter *e, const imp_v3 *ref,
                              const imp_v3 *wi, const struct imp_hit *hit,
                              const struct imp_surface *at)
{
    (void)wi;
    return e->shape->ops->pdf_toward(e->shape, ref, hit, at);
}

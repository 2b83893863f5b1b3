/* SPDX-License-Identifier: Apache-2.0
 *
 * The same radiance from everywhere around the scene, drawn uniformly over the sphere. */
#include "emission.h"
#include "kind/build.h"
#include "math/warp.h"

enum { RADIANCE };

static const struct imp_input_desc inputs[] = {
    {.name = "radiance", .role = IMP_EMISSION, .fallback = 1, .unit = "W m^-2 sr^-1"},
    {0}};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_emitter *e)
{
    (void)self;
    if (e->n_in > RADIANCE && e->input[RADIANCE]->texture)
        return imp_build_error(b, NULL, IMP_E_SCENE,
                               "radiance cannot be a texture: it is the same everywhere");
    return IMP_OK;
}

static bool sample(const struct imp_emitter *e, const imp_v3 *ref, const double u[2],
                   struct imp_light_sample *out)
{
    (void)e, (void)ref;
    *out = (struct imp_light_sample){.wi = imp__uniform_sphere(u),
                                     .dist = INFINITY,
                                     .pdf = IMP_INV_PI / 4,
                                     .cos_light = 1};
    return true;
}
static double pdf(const struct imp_emitter *e, const imp_v3 *ref, const imp_v3 *wi,
                  const struct imp_hit *hit, const struct imp_surface *at)
{
    (void)e, (void)ref, (void)wi, (void)hit, (void)at;
    return IMP_INV_PI / 4;
}

const struct imp_emitter_ops imp__constant = {.size = sizeof(struct imp_emitter_ops),
                                              .name = "constant",
                                              .flags = IMP_EMITTER_ENVIRONMENT |
                                                       IMP_EMITTER_UNIFORM,
                                              .inputs = inputs,
                                              .build = build,
                                              .eval = imp__even_eval,
                                              .eval_d = imp__even_eval_d,
                                              .sample = sample,
                                              .pdf = pdf,
                                              .sample_emission = imp__sky_emission_sample,
                                              .pdf_emission = imp__sky_emission_pdf,
                                              .jumps = imp__sky_without_jumps};

/* SPDX-License-Identifier: Apache-2.0
 *
 * directional: parallel light from infinitely far, travelling along `direction` (or +z of
 * to_world). `irradiance` is measured across the ray. */
#include "emission.h"
#include "from_point.h"
#include "math/vec.h"
#include "math/warp.h"
#include <math.h>

struct directional {
    imp_v3 along; /* unit, world */
};

static const struct imp_input_desc inputs[] = {{.name = "irradiance",
                                                .role = IMP_EMISSION,
                                                .flags = IMP_INPUT_NUMBER,
                                                .fallback = 1,
                                                .unit = "W m^-2"},
                                               {0}};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_emitter *e)
{
    struct directional *l = self;
    (void)e;
    return imp__travel_read(b, &l->along);
}

static bool sample(const struct imp_emitter *e, const imp_v3 *ref, const double u[2],
                   struct imp_light_sample *out)
{
    (void)ref, (void)u;
    const struct directional *l = e->self;
    *out = (struct imp_light_sample){
        .wi = -l->along, .dist = INFINITY, .pdf = 1, .cos_light = 1, .ng = l->along};
    return true;
}

/* From a disk before the scene. */
static bool sample_emission(const struct imp_emitter *e, const struct imp_ball *scene,
                            const double u[4], struct imp_emission_sample *out)
{
    const struct directional *l = e->self;
    const struct imp_frame f = imp__frame_from_normal(l->along);
    const double r = scene->radius;
    double xy[2];
    imp__concentric_disk(u, xy);
    *out = (struct imp_emission_sample){.p = scene->centre +
                                             (f.s * xy[0] + f.t * xy[1] - l->along) * r,
                                        .d = l->along,
                                        .cos_light = 1,
                                        .cos_p = 1,
                                        .pdf_p = IMP_INV_PI / (r * r),
                                        .pdf_d = 1};
    return true;
}

static void aim(struct imp_emitter *e, double v[3], bool set)
{
    struct directional *l = e->self;
    const imp_v3 along = imp__v3(v[0], v[1], v[2]);
    if (set && imp__length(along) > 0) l->along = imp__normalize(along);
    for (int k = 0; k < 3; k++) v[k] = l->along[k];
}

const struct imp_emitter_ops imp__directional = {
    .size = sizeof(struct imp_emitter_ops),
    .name = "directional",
    .object_size = sizeof(struct directional),
    .flags = IMP_EMITTER_DELTA | IMP_EMITTER_FAR,
    .inputs = inputs,
    .build = build,
    .eval = imp__even_eval,
    .eval_d = imp__even_eval_d,
    .sample = sample,
    .pdf = imp__point_light_pdf,
    .sample_emission = sample_emission,
    .pdf_emission = imp__along_emission_pdf,
    .aim = aim};

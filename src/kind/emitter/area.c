/* SPDX-License-Identifier: Apache-2.0
 *
 * Light from a surface: the same radiance in all directions on the front, the side of the
 * shading normal, and none behind. `stam_m1` is Stam's pure emitter, the same thing under
 * his name for its strength (Stam 2020, section 3). */
#include "emission.h"
#include "math/vec.h"
#include "surface.h"

enum { RADIANCE };

static const struct imp_input_desc area_inputs[] = {
    {.name = "radiance", .role = IMP_EMISSION, .fallback = 1, .unit = "W m^-2 sr^-1"},
    {0}};
static const struct imp_input_desc stam_inputs[] = {
    {.name = "emission", .role = IMP_EMISSION, .fallback = 1, .unit = "W m^-2 sr^-1"},
    {0}};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_emitter *e)
{
    (void)self;
    if (imp__node_prop(b->node, "to_world"))
        return imp_build_error(b, "to_world", IMP_E_SCENE,
                               "to_world has no meaning here: the light is its shape");
    return imp__surface_light_check(b, e);
}

static void eval(const struct imp_emitter *e, const imp_spec *in,
                 const struct imp_emission *x, imp_spec *le)
{
    (void)e;
    *le = x->cos_light > 0 ? in[RADIANCE] : imp__spec(0);
}
static void eval_d(const struct imp_emitter *e, const imp_spec *in,
                   const struct imp_emission *x, imp_spec *dle)
{
    (void)e, (void)in;
    dle[RADIANCE] = imp__spec(x->cos_light > 0);
}

#define AREA_OPS(name_, inputs_)                                                         \
    {                                                                                    \
        .size = sizeof(struct imp_emitter_ops), .name = name_,                           \
        .flags = IMP_EMITTER_AREA | IMP_EMITTER_UNIFORM | IMP_EMITTER_BY_SHAPE,          \
        .inputs = inputs_, .build = build, .eval = eval, .eval_d = eval_d,               \
        .sample = imp__surface_light_sample, .pdf = imp__surface_light_pdf,              \
        .sample_emission = imp__surface_emission_sample,                                 \
        .pdf_emission = imp__surface_emission_pdf                                        \
    }

const struct imp_emitter_ops imp__area = AREA_OPS("area", area_inputs);
const struct imp_emitter_ops imp__stam_m1 = AREA_OPS("stam_m1", stam_inputs);

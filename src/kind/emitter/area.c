/* SPDX-License-Identifier: Apache-2.0
 *
 * Light from a surface: the same radiance in all directions on the front, the side of the
 * shading normal, and none behind. `stam_m1` is Stam's pure emitter, the same thing under
 * his name for its strength (Stam 2020, section 3). */
#include "kind/build.h"
#include "math/vec.h"

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
    const struct imp_prop *placed = imp__node_prop(b->node, "to_world");
    if (placed)
        return imp__prop_error(b->ctx, b->node, placed, IMP_E_SCENE,
                               "to_world has no meaning here: the light is its shape");
    if (!e->shape)
        return imp__node_error(b->ctx, b->node, IMP_E_SCENE, "it must be inside a shape");
    if (!(e->shape->area > 0))
        return imp__node_error(b->ctx, b->node, IMP_E_SCENE,
                               "its shape '%s' (%s) has no area",
                               e->shape->name ? e->shape->name : "", e->shape->ops->name);
    return IMP_OK;
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
static bool sample(const struct imp_emitter *e, const imp_v3 *ref, const double u[2],
                   struct imp_light_sample *out)
{
    return e->shape->ops->sample_toward(e->shape, ref, u, out);
}
static double pdf(const struct imp_emitter *e, const imp_v3 *ref, const imp_v3 *wi,
                  const struct imp_hit *hit, const struct imp_surface *at)
{
    (void)wi;
    return e->shape->ops->pdf_toward(e->shape, ref, hit, at);
}

const struct imp_emitter_ops imp__area = {.size = sizeof(struct imp_emitter_ops),
                                          .name = "area",
                                          .flags = IMP_EMITTER_AREA,
                                          .inputs = area_inputs,
                                          .build = build,
                                          .eval = eval,
                                          .eval_d = eval_d,
                                          .sample = sample,
                                          .pdf = pdf};
const struct imp_emitter_ops imp__stam_m1 = {.size = sizeof(struct imp_emitter_ops),
                                             .name = "stam_m1",
                                             .flags = IMP_EMITTER_AREA,
                                             .inputs = stam_inputs,
                                             .build = build,
                                             .eval = eval,
                                             .eval_d = eval_d,
                                             .sample = sample,
                                             .pdf = pdf};

/* SPDX-License-Identifier: Apache-2.0
 *
 * beam: light from a surface's front, brightest along an axis,
 *
 *     L(w) = radiance max(0, w . axis)^exponent
 *
 * with the surface's normal for an axis unless one is given: the spot lamps of
 * Christensen, Salesin and DeRose (1993). Points are drawn as for `area`. */
#include "beam.h"
#include "surface.h"

static const struct imp_input_desc inputs[] = {
    {.name = "radiance", .role = IMP_EMISSION, .fallback = 1, .unit = "W m^-2 sr^-1"},
    {.name = "exponent",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_SCALAR,
     .fallback = 1,
     .unit = "1"},
    {0}};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_emitter *e)
{
    enum imp_status st = IMP_OK;
    struct imp__beam *beam = self;
    double axis[3];
    IMP_TRY(imp__surface_light_check(b, e));
    beam->aimed = imp__props_has(b->node, "axis");
    IMP_TRY(imp__props_vector(b->ctx, b->node, "axis", (double[3]){0, 0, 1}, axis));
    beam->axis = imp__v3(axis[0], axis[1], axis[2]);
    const double length = imp__length(beam->axis);
    if (!(length > 0) || !isfinite(length))
        IMP_TRY(imp__prop_error(b->ctx, b->node, imp__node_prop(b->node, "axis"),
                                IMP_E_SCENE, "axis has length %g", length));
    beam->axis *= imp__spec(1 / length);
out:
    return st;
}

/* Cosine with the axis; 0 behind. */
static double cosine(const struct imp_emitter *e, const struct imp_emission *x)
{
    const struct imp__beam *beam = e->self;
    if (!(x->cos_light > 0)) return 0;
    return beam->aimed ? fmax(0, imp__dot(x->d, beam->axis)) : fmin(x->cos_light, 1);
}

static void eval(const struct imp_emitter *e, const imp_spec *in,
                 const struct imp_emission *x, imp_spec *le)
{
    const double c = cosine(e, x);
    *le = in[IMP_BEAM_RADIANCE] * (c > 0 ? pow(c, in[IMP_BEAM_EXPONENT][0]) : 0);
}
static void eval_d(const struct imp_emitter *e, const imp_spec *in,
                   const struct imp_emission *x, imp_spec *dle)
{
    const double c = cosine(e, x), n = in[IMP_BEAM_EXPONENT][0];
    dle[IMP_BEAM_RADIANCE] = imp__spec(c > 0 ? pow(c, n) : 0);
    dle[IMP_BEAM_EXPONENT] = in[IMP_BEAM_RADIANCE] * (c > 0 ? pow(c, n) * log(c) : 0);
}

const struct imp_emitter_ops imp__beam_light = {.size = sizeof(struct imp_emitter_ops),
                                                .name = "beam",
                                                .object_size = sizeof(struct imp__beam),
                                                .flags = IMP_EMITTER_AREA,
                                                .inputs = inputs,
                                                .build = build,
                                                .eval = eval,
                                                .eval_d = eval_d,
                                                .sample = imp__surface_light_sample,
                                                .pdf = imp__surface_light_pdf};

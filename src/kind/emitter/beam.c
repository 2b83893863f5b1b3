/* SPDX-License-Identifier: Apache-2.0
 *
 * beam: light from a surface's front, brightest along an axis,
 *
 *     L(w) = radiance max(0, w . axis)^exponent
 *
 * with the surface's normal for an axis unless one is given: the spot lamps of
 * Christensen, Salesin and DeRose (1993). Points are drawn as for `area`. */
#include "emission.h"
#include "math/vec.h"
#include "surface.h"

enum { RADIANCE, EXPONENT };

struct beam {
    imp_v3 axis; /* unit, world */
    bool aimed;  /* axis is set; else it is the surface's normal */
};

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
    struct beam *beam = self;
    double axis[3];
    IMP_TRY(imp__surface_light_check(b, e));
    beam->aimed = imp_build_has(b, "axis");
    IMP_TRY(imp_build_vector(b, "axis", (double[3]){0, 0, 1}, axis));
    beam->axis = imp__v3(axis[0], axis[1], axis[2]);
    const double length = imp__length(beam->axis);
    if (!(length > 0) || !isfinite(length))
        IMP_TRY(imp_build_error(b, "axis", IMP_E_SCENE, "axis has length %g", length));
    beam->axis *= imp__spec(1 / length);
out:
    return st;
}

/* Cosine with the axis; 0 behind. */
static double cosine(const struct imp_emitter *e, const struct imp_emission *x)
{
    const struct beam *beam = e->self;
    if (!(x->cos_light > 0)) return 0;
    return beam->aimed ? imp_max(imp__dot(x->d, beam->axis), 0.0)
                       : imp_min(x->cos_light, 1.0);
}

static void eval(const struct imp_emitter *e, const imp_spec *in,
                 const struct imp_emission *x, imp_spec *le)
{
    const double c = cosine(e, x);
    *le = in[RADIANCE] * (c > 0 ? pow(c, in[EXPONENT][0]) : 0);
}
static void eval_d(const struct imp_emitter *e, const imp_spec *in,
                   const struct imp_emission *x, imp_spec *dle)
{
    const double c = cosine(e, x), n = in[EXPONENT][0];
    dle[RADIANCE] = imp__spec(c > 0 ? pow(c, n) : 0);
    dle[EXPONENT] = in[RADIANCE] * (c > 0 ? pow(c, n) * log(c) : 0);
}

static int lobe(const struct imp_emitter *e, const imp_v3 *normal, imp_v3 *axis)
{
    const struct beam *beam = e->self;
    *axis = beam->aimed ? beam->axis : *normal;
    return EXPONENT;
}

const struct imp_emitter_ops imp__beam_light = {
    .size = sizeof(struct imp_emitter_ops),
    .name = "beam",
    .object_size = sizeof(struct beam),
    .flags = IMP_EMITTER_AREA | IMP_EMITTER_BY_SHAPE,
    .inputs = inputs,
    .build = build,
    .eval = eval,
    .eval_d = eval_d,
    .sample = imp__surface_light_sample,
    .pdf = imp__surface_light_pdf,
    .lobe = lobe,
    .sample_emission = imp__surface_emission_sample,
    .pdf_emission = imp__surface_emission_pdf};

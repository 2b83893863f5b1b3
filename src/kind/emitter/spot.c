/* SPDX-License-Identifier: Apache-2.0
 *
 * spot: a point that shines into a cone about +z of its frame. With t the angle between
 * axis and direction, b the beam_width and c the cutoff_angle, the irradiance across the
 * ray is
 *
 *     intensity texture(u, v) k/r^2,   k = min(1, max(0, (c - t)/w)),   w = max(c - b, w0)
 *
 * linear in the angle from the beam to the cutoff, as in Mitsuba. w0 = .01 degree keeps k
 * continuous where b >= c, so that a hard edge too has a derivative, if a noisy one. The
 * texture fills the square around the cone's cut:
 *
 *     (u, v) = 1/2 + (x, y)/(2 z tan c) */
#include "from_point.h"
#include "math/transform.h"
#include "math/vec.h"
#include <math.h>

enum { INTENSITY, CUTOFF, BEAM, TEXTURE };

#define DEGREE      (IMP_PI / 180)
#define WIDTH_LEAST 0.01 /* degrees */

static const struct imp_input_desc inputs[] = {
    {.name = "intensity",
     .role = IMP_EMISSION,
     .flags = IMP_INPUT_NUMBER,
     .fallback = 1,
     .unit = "W sr^-1"},
    {.name = "cutoff_angle",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_SCALAR | IMP_INPUT_NUMBER,
     .fallback = 20,
     .lo = 0.1,
     .hi = 180,
     .unit = "degree"},
    {.name = "beam_width",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_SCALAR | IMP_INPUT_NUMBER,
     .fallback = 15,
     .lo = 0,
     .hi = 180,
     .unit = "degree"},
    {.name = "texture",
     .role = IMP_REFLECTANCE,
     .flags = IMP_INPUT_OPTIONAL,
     .fallback = 1,
     .hi = 1,
     .unit = "1"},
    {0}};

/* The beam is 3/4 of the cutoff unless it is given. */
static enum imp_status prepare(const struct imp_build *b)
{
    double cutoff, beam;
    enum imp_status st = IMP_OK;
    if (imp_build_has(b, "beam_width")) return IMP_OK;
    IMP_TRY(imp_build_float(b, "cutoff_angle", inputs[CUTOFF].fallback, &cutoff));
    beam = 0.75 * cutoff;
    if (beam >= inputs[BEAM].lo && beam <= inputs[BEAM].hi)
        IMP_TRY(imp_build_set(b, "beam_width", 1, &beam));
out:
    return st;
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_emitter *e)
{
    if (e->input[TEXTURE]->texture && !(e->input[CUTOFF]->value[0] < 90))
        return imp_build_error(b, "cutoff_angle", IMP_E_SCENE,
                               "cutoff_angle = %g: a spot with a texture needs less than "
                               "90 degrees",
                               e->input[CUTOFF]->value[0]);
    if (imp__input_jumps(e->input[TEXTURE])) e->fixed = UINT64_C(1) << CUTOFF;
    return imp__light_frame_read(b, self);
}

/* Angle between axis and direction, degrees. */
static double angle(const struct imp_emitter *e, const struct imp_emission *x)
{
    const imp_v3 d = imp__light_frame_local(e->self, &x->d);
    return atan2(hypot(d[0], d[1]), d[2]) / DEGREE;
}
/* k, and its derivatives with respect to cutoff and beam. */
static double falloff(const imp_spec *in, double t, double *d_cutoff, double *d_beam)
{
    const double c = in[CUTOFF][0], b = in[BEAM][0];
    const bool sharp = !(c - b > WIDTH_LEAST);
    const double w = sharp ? WIDTH_LEAST : c - b, k = (c - t) / w;
    const bool inside = k > 0 && k < 1;
    *d_cutoff = !inside ? 0 : sharp ? 1 / w : (1 - k) / w;
    *d_beam = !inside || sharp ? 0 : k / w;
    return imp_clamp(k, 0.0, 1.0);
}

static void place(const struct imp_emitter *e, const struct imp_emission *x, double uv[2])
{
    const imp_v3 d = imp__light_frame_local(e->self, &x->d);
    const double scale = 0.5 / (d[2] * tan(e->input[CUTOFF]->value[0] * DEGREE));
    for (int k = 0; k < 2; k++) uv[k] = d[2] > 0 ? 0.5 + d[k] * scale : 0;
}
static void place_d(const struct imp_emitter *e, const struct imp_emission *x, int j,
                    double duv[2])
{
    const imp_v3 d = imp__light_frame_local(e->self, &x->d);
    const double s = sin(e->input[CUTOFF]->value[0] * DEGREE);
    for (int k = 0; k < 2; k++)
        duv[k] = j == CUTOFF && d[2] > 0 ? -DEGREE * d[k] / (2 * d[2] * s * s) : 0;
}

static void eval(const struct imp_emitter *e, const imp_spec *in,
                 const struct imp_emission *x, imp_spec *le)
{
    double unused[2];
    const double k = falloff(in, angle(e, x), &unused[0], &unused[1]);
    *le = in[INTENSITY] * in[TEXTURE] * (k / (x->dist * x->dist));
}
static void eval_d(const struct imp_emitter *e, const imp_spec *in,
                   const struct imp_emission *x, imp_spec *dle)
{
    double d_cutoff, d_beam;
    const double k = falloff(in, angle(e, x), &d_cutoff, &d_beam);
    const double r2 = 1 / (x->dist * x->dist);
    dle[INTENSITY] = in[TEXTURE] * (k * r2);
    dle[TEXTURE] = in[INTENSITY] * (k * r2);
    dle[CUTOFF] = in[INTENSITY] * in[TEXTURE] * (d_cutoff * r2);
    dle[BEAM] = in[INTENSITY] * in[TEXTURE] * (d_beam * r2);
}
static bool sample(const struct imp_emitter *e, const imp_v3 *ref, const double u[2],
                   struct imp_light_sample *out)
{
    (void)u;
    const struct imp__light_frame *f = e->self;
    return imp__point_light_sample(f->origin, *ref, out);
}

static void cone(const struct imp_emitter *e, imp_v3 *axis, double *cosine)
{
    const struct imp__light_frame *f = e->self;
    *axis = f->axis[2];
    *cosine = cos(imp_min(e->input[CUTOFF]->value[0], 180.0) * DEGREE);
}

/* Uniformly in the cone of the cutoff, at whose border the light is 0. */
static double cone_height(const struct imp_emitter *e)
{
    const double s = sin(e->input[CUTOFF]->value[0] * (DEGREE / 2));
    return 2 * s * s; /* 1 - cos */
}
static double pdf_emission(const struct imp_emitter *e, const struct imp_emission *x)
{
    return angle(e, x) < e->input[CUTOFF]->value[0] ? 1 / (IMP_2PI * cone_height(e)) : 0;
}
static bool sample_emission(const struct imp_emitter *e, const struct imp_ball *scene,
                            const double u[4], struct imp_emission_sample *out)
{
    (void)scene;
    const struct imp__light_frame *f = e->self;
    const double height = cone_height(e), k = u[2] * height, phi = IMP_2PI * u[3];
    const double r = sqrt(k * (2 - k));
    const imp_v3 d =
        f->axis[0] * (r * cos(phi)) + f->axis[1] * (r * sin(phi)) + f->axis[2] * (1 - k);
    *out = (struct imp_emission_sample){.p = f->origin,
                                        .d = imp__normalize(d),
                                        .cos_light = 1,
                                        .cos_p = 1,
                                        .pdf_p = 1,
                                        .pdf_d = 1 / (IMP_2PI * height)};
    return true;
}

static void aim(struct imp_emitter *e, double v[3], bool set)
{
    struct imp__light_frame *f = e->self;
    if (set) f->origin = imp__v3(v[0], v[1], v[2]);
    for (int k = 0; k < 3; k++) v[k] = f->origin[k];
}

const struct imp_emitter_ops imp__spot_light = {.size = sizeof(struct imp_emitter_ops),
                                                .name = "spot",
                                                .object_size =
                                                    sizeof(struct imp__light_frame),
                                                .flags = IMP_EMITTER_DELTA,
                                                .inputs = inputs,
                                                .prepare = prepare,
                                                .build = build,
                                                .eval = eval,
                                                .eval_d = eval_d,
                                                .sample = sample,
                                                .pdf = imp__point_light_pdf,
                                                .place = place,
                                                .place_d = place_d,
                                                .sample_emission = sample_emission,
                                                .pdf_emission = pdf_emission,
                                                .cone = cone,
                                                .aim = aim};

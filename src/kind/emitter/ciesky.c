/* SPDX-License-Identifier: Apache-2.0
 *
 * ciesky: the fifteen sky luminance distributions of CIE S 011 (ISO 15469:2004), with Z the angle
 * to the zenith, x that to the sun, Zs the sun's to the zenith:
 *
 *     L/Lz = f(x) g(Z) / (f(Zs) g(0)),   g(Z) = 1 + a exp(b/cos Z),
 *     f(x) = 1 + c (exp(d x) - exp(d pi/2)) + e cos^2 x
 *
 * (types 1 to 15, five numbers each), and type 16, the traditional overcast sky,
 * L/Lz = (1 + 2 cos Z)/3, whose horizontal illuminance is 7 pi/9 Lz. Below the horizon it is
 * dark. Drawn by the cosine to the zenith and uniformly over the upper hemisphere, half each. */
#include "emission.h"
#include "kind/build.h"
#include "math/vec.h"
#include "math/warp.h"
#include "sun_position.h"
#include <math.h>

#define OVERCAST 16

enum { SCALE };

struct ciesky {
    imp_v3 axis[3];  /* x, y and z (up) of the sky, world */
    imp_v3 sun;      /* unit, world */
    const double *n; /* a to e; NULL: type 16 */
    double factor;   /* L at scale 1 over f g, or over (1 + 2 cos Z)/3 */
};

static const struct imp_input_desc inputs[] = {{.name = "scale",
                                                .role = IMP_EMISSION,
                                                .flags = IMP_INPUT_NUMBER,
                                                .fallback = 1,
                                                .unit = "1"},
                                               {0}};

static const double numbers[15][5] = {
    {4, -.7, 0, -1, 0},       {4, -.7, 2, -1.5, .15},  {1.1, -.8, 0, -1, 0},
    {1.1, -.8, 2, -1.5, .15}, {0, -1, 0, -1, 0},       {0, -1, 2, -1.5, .15},
    {0, -1, 5, -2.5, .3},     {0, -1, 10, -3, .45},    {-1, -.55, 2, -1.5, .15},
    {-1, -.55, 5, -2.5, .3},  {-1, -.55, 10, -3, .45}, {-1, -.32, 10, -3, .45},
    {-1, -.32, 16, -3, .3},   {-1, -.15, 16, -3, .3},  {-1, -.15, 24, -2.8, .15}};

/* f(x) g(Z), or (1 + 2 cos Z)/3, in direction w from the ground; 0 below the horizon. */
static double shape(const struct ciesky *s, imp_v3 w)
{
    const double z = imp__dot(w, s->axis[2]);
    if (!(z > 0)) return 0;
    if (!s->n) return (1 + 2 * z) / 3;
    const double *n = s->n, c = imp_clamp(imp__dot(w, s->sun), -1.0, 1.0), x = acos(c);
    const double g = 1 + n[0] * exp(n[1] / z);
    const double f = 1 + n[2] * (exp(n[3] * x) - exp(n[3] * IMP_PI / 2)) + n[4] * c * c;
    return fmax(f * g, 0);
}

/* Int shape cos Z dw. */
static double horizontal(const struct ciesky *s)
{
    enum { UP = 256, AROUND = 512 };
    double sum = 0;
    for (int i = 0; i < UP; i++)
        for (int j = 0; j < AROUND; j++) {
            const double square = (i + 0.5) / UP, phi = (j + 0.5) * IMP_2PI / AROUND;
            const double z = sqrt(square),
                         r = sqrt(1 - square); /* cos dw = d(z^2)/2 dphi */
            sum += shape(s, s->axis[0] * (r * cos(phi)) + s->axis[1] * (r * sin(phi)) +
                                s->axis[2] * z);
        }
    return sum * IMP_PI / (UP * AROUND);
}

static enum imp_status level_read(const struct imp_build *b, struct ciesky *s)
{
    enum imp_status st = IMP_OK;
    double zenith, illuminance;
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "zenith", 1, IMP_POSITIVE, &zenith));
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "illuminance", 1, IMP_POSITIVE,
                                &illuminance));
    if (imp_build_has(b, "zenith") && imp_build_has(b, "illuminance"))
        IMP_TRY(imp_build_error(b, "illuminance", IMP_E_SCENE,
                                "illuminance = %g and zenith = %g: give one of them",
                                illuminance, zenith));
    s->factor = imp_build_has(b, "illuminance") ? illuminance / horizontal(s)
                                                : zenith / shape(s, s->axis[2]);
out:
    return st;
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_emitter *e)
{
    enum imp_status st = IMP_OK;
    struct ciesky *s = self;
    bool of_world;
    int64_t sky;
    (void)e;
    IMP_TRY(imp_build_int(b, "sky", OVERCAST, 1, OVERCAST, &sky));
    IMP_TRY(imp__sky_axes(b, s->axis));
    IMP_TRY(imp__sun_read(b, &s->sun, &of_world));
    if (!of_world)
        s->sun = s->axis[0] * s->sun[0] + s->axis[1] * s->sun[1] + s->axis[2] * s->sun[2];
    s->n = sky == OVERCAST ? NULL : numbers[sky - 1];
    const double height = imp__dot(s->sun, s->axis[2]);
    if (s->n && s->n[2] != 0 && !(height >= 0))
        IMP_TRY(
            imp_build_error(b, of_world ? "sun_direction" : NULL, IMP_E_SCENE,
                            "the sun is %.3g degrees below the horizon, and sky type %d "
                            "is one by day",
                            -asin(height) * 180 / IMP_PI, (int)sky));
    IMP_TRY(level_read(b, s));
out:
    return st;
}

static void eval_d(const struct imp_emitter *e, const imp_spec *in,
                   const struct imp_emission *x, imp_spec *dle)
{
    const struct ciesky *s = e->self;
    (void)in;
    dle[SCALE] = imp__spec(s->factor * shape(s, -x->d));
}
static void eval(const struct imp_emitter *e, const imp_spec *in,
                 const struct imp_emission *x, imp_spec *le)
{
    eval_d(e, in, x, le);
    *le *= in[SCALE];
}

/* (cos/pi + 1/2 pi)/2 above the horizon. */
static double density(const struct ciesky *s, imp_v3 w)
{
    const double z = imp__dot(w, s->axis[2]);
    return z > 0 ? IMP_INV_PI / 2 * (z + 0.5) : 0;
}
static bool sample(const struct imp_emitter *e, const imp_v3 *ref, const double u[2],
                   struct imp_light_sample *out)
{
    const struct ciesky *s = e->self;
    const bool cosine = u[0] < 0.5;
    const double r = cosine ? 2 * u[0] : 2 * u[0] - 1, phi = IMP_2PI * u[1];
    const double z = cosine ? sqrt(1 - r) : 1 - r, across = sqrt(fmax(0, 1 - z * z));
    (void)ref;
    if (!(z > 0)) return false;
    const imp_v3 w = imp__normalize(s->axis[0] * (across * cos(phi)) +
                                    s->axis[1] * (across * sin(phi)) + s->axis[2] * z);
    *out = (struct imp_light_sample){
        .wi = w, .dist = INFINITY, .pdf = density(s, w), .cos_light = 1};
    return out->pdf > 0;
}
static double pdf(const struct imp_emitter *e, const imp_v3 *ref, const imp_v3 *wi,
                  const struct imp_hit *hit, const struct imp_surface *at)
{
    (void)ref, (void)hit, (void)at;
    return density(e->self, *wi);
}

const struct imp_emitter_ops imp__ciesky = {.size = sizeof(struct imp_emitter_ops),
                                            .name = "ciesky",
                                            .object_size = sizeof(struct ciesky),
                                            .flags = IMP_EMITTER_ENVIRONMENT,
                                            .inputs = inputs,
                                            .build = build,
                                            .eval = eval,
                                            .eval_d = eval_d,
                                            .sample = sample,
                                            .pdf = pdf,
                                            .sample_emission = imp__sky_emission_sample,
                                            .pdf_emission = imp__sky_emission_pdf};

/* SPDX-License-Identifier: Apache-2.0
 *
 * projector: a camera run backwards. The picture of irradiance on a screen at distance 1
 * becomes, at a point (x, y, z) of its frame, r away and with c = z/r, the irradiance
 *
 *     pi scale I(u, v)/(z^2 c),    (u, v) = 1/2 - (x/z, a y/z)/(2 t),    0 outside [0, 1]^2
 *
 * across the ray, with t = tan(fov_x/2) and a = width/height of the picture: Mitsuba's
 * factors. */
#include "projector.h"
#include "from_point.h"
#include "kind/sensor/projection.h"
#include "kind/texture/bitmap.h"
#include "math/vec.h"
#include <math.h>

enum { IRRADIANCE, SCALE };

static const struct imp_input_desc inputs[] = {
    {.name = "irradiance", .role = IMP_EMISSION, .fallback = 1, .unit = "W m^-2"},
    {.name = "scale",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_SCALAR | IMP_INPUT_NUMBER,
     .fallback = 1,
     .unit = "1"},
    {0}};

struct projector {
    struct imp__light_frame frame; /* first: imp__light_frame_of */
    double tan_half[2];            /* of the horizontal and vertical field of view */
    double aspect;                 /* width over height of the picture */
};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_emitter *e)
{
    enum imp_status st = IMP_OK;
    struct projector *p = self;
    const struct imp_texture *picture = e->input[IRRADIANCE]->texture;
    struct imp__texels texels;
    double aspect = 1;

    if (picture && imp__bitmap_texels(picture, &texels))
        aspect = (double)texels.width / texels.height;
    IMP_TRY(imp__light_frame_read(b, &p->frame));
    IMP_TRY(imp__fov_build(b, aspect, &p->tan_half[0]));
    p->tan_half[1] = p->tan_half[0] / aspect;
    p->aspect = aspect;
out:
    return st;
}

static void place(const struct imp_emitter *e, const struct imp_emission *x, double uv[2])
{
    const struct projector *p = e->self;
    const imp_v3 d = imp__light_frame_local(&p->frame, &x->d);
    for (int k = 0; k < 2; k++)
        uv[k] = d[2] > 0 ? 0.5 - d[k] / (2 * d[2] * p->tan_half[k]) : -1;
}

/* The factor before scale and irradiance. */
static double spread(const struct imp_emitter *e, const struct imp_emission *x)
{
    const struct projector *p = e->self;
    const imp_v3 d = imp__light_frame_local(&p->frame, &x->d);
    double uv[2];
    place(e, x, uv);
    if (!(uv[0] >= 0 && uv[0] <= 1 && uv[1] >= 0 && uv[1] <= 1)) return 0;
    return IMP_PI / (d[2] * d[2] * d[2] * x->dist * x->dist);
}
static void eval(const struct imp_emitter *e, const imp_spec *in,
                 const struct imp_emission *x, imp_spec *le)
{
    *le = in[IRRADIANCE] * (in[SCALE][0] * spread(e, x));
}
static void eval_d(const struct imp_emitter *e, const imp_spec *in,
                   const struct imp_emission *x, imp_spec *dle)
{
    const double k = spread(e, x);
    dle[IRRADIANCE] = imp__spec(in[SCALE][0] * k);
    dle[SCALE] = in[IRRADIANCE] * k;
}
static bool sample(const struct imp_emitter *e, const imp_v3 *ref, const double u[2],
                   struct imp_light_sample *out)
{
    (void)u;
    const struct projector *p = e->self;
    return imp__point_light_sample(p->frame.origin, *ref, out);
}

/* Uniformly on the screen, 4 t_x t_y at distance 1, whose density per steradian is as the
 * light of an even picture, 1/cos^3. */
static double pdf_emission(const struct imp_emitter *e, const struct imp_emission *x)
{
    const struct projector *p = e->self;
    const double area = 4 * p->tan_half[0] * p->tan_half[1];
    const imp_v3 d = imp__light_frame_local(&p->frame, &x->d);
    double uv[2];
    place(e, x, uv);
    if (!(uv[0] >= 0 && uv[0] <= 1 && uv[1] >= 0 && uv[1] <= 1)) return 0;
    return 1 / (area * d[2] * d[2] * d[2]);
}
static bool sample_emission(const struct imp_emitter *e, const struct imp_ball *scene,
                            const double u[4], struct imp_emission_sample *out)
{
    (void)scene;
    const struct projector *p = e->self;
    const struct imp__light_frame *f = &p->frame;
    const imp_v3 d =
        imp__normalize(f->axis[0] * ((1 - 2 * u[2]) * p->tan_half[0]) +
                       f->axis[1] * ((1 - 2 * u[3]) * p->tan_half[1]) + f->axis[2]);
    const struct imp_emission x = {.dist = 1, .cos_light = 1, .d = d};
    *out = (struct imp_emission_sample){.p = f->origin,
                                        .d = d,
                                        .cos_light = 1,
                                        .cos_p = 1,
                                        .pdf_p = 1,
                                        .pdf_d = pdf_emission(e, &x)};
    return out->pdf_d > 0;
}

static void aim(struct imp_emitter *e, double v[3], bool set)
{
    struct projector *p = e->self;
    if (set) p->frame.origin = imp__v3(v[0], v[1], v[2]);
    for (int k = 0; k < 3; k++) v[k] = p->frame.origin[k];
}

double imp__projector_fov(const struct imp_emitter *e, double *rate)
{
    const struct projector *p = e->self;
    const double t = p->tan_half[0];
    *rate = (1 + t * t) / (2 * t) * (IMP_PI / 180);
    return atan(t) * (360 / IMP_PI);
}

void imp__projector_fov_set(struct imp_emitter *e, double degrees)
{
    struct projector *p = e->self;
    p->tan_half[0] = tan(degrees * (IMP_PI / 360));
    p->tan_half[1] = p->tan_half[0] / p->aspect;
}

void imp__projector_border(const struct imp_emitter *e, double u, imp_v3 *at,
                           imp_v3 *along, imp_v3 *inside)
{
    const struct projector *p = e->self;
    const double *t = p->tan_half, side = imp_min(floor(4 * u), 3.0);
    const int i = (int)side % 2, j = 1 - i;
    const double sign = side < 2 ? -1 : 1, part = 2 * (4 * u - side) - 1;
    *along = p->frame.axis[j] * (8 * t[j]);
    *inside = p->frame.axis[i] * -sign;
    *at = p->frame.axis[2] + p->frame.axis[i] * (sign * t[i]) +
          p->frame.axis[j] * (part * t[j]);
}

const struct imp_emitter_ops imp__projector = {.size = sizeof(struct imp_emitter_ops),
                                               .name = "projector",
                                               .object_size = sizeof(struct projector),
                                               .flags = IMP_EMITTER_DELTA,
                                               .inputs = inputs,
                                               .build = build,
                                               .eval = eval,
                                               .eval_d = eval_d,
                                               .sample = sample,
                                               .pdf = imp__point_light_pdf,
                                               .place = place,
                                               .sample_emission = sample_emission,
                                               .pdf_emission = pdf_emission,
                                               .aim = aim};

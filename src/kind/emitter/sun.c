/* SPDX-License-Identifier: Apache-2.0
 *
 * sun: a disc infinitely far away, of one radiance and of an angular radius a, drawn
 * uniformly by solid angle
 *
 *     Omega = 2 pi (1 - cos a)
 *
 * Its edge moves with the radius, so that this has a derivative among what moves alone
 * (NAME.sun_radius). The fallback is the mean radius of the sun, 6.866e-5 sr. */
#include "sun.h"
#include "emission.h"
#include "kind/build.h"
#include "math/transform.h"
#include "math/vec.h"
#include "math/warp.h"
#include "sky_sun.h"
#include <math.h>

enum { RADIANCE, RADIUS };

struct sun {
    imp_v3 axis;   /* unit, towards it, world */
    double versed; /* 1 - cos a */
};

static const struct imp_input_desc inputs[] = {
    {.name = "radiance",
     .role = IMP_EMISSION,
     .flags = IMP_INPUT_NUMBER,
     .fallback = 1,
     .unit = "W m^-2 sr^-1"},
    {.name = "radius",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_SCALAR | IMP_INPUT_NUMBER | IMP_INPUT_FIXED,
     .fallback = 0.004675,
     .lo = 1e-6,
     .hi = 1.5,
     .unit = "rad"},
    {0}};

static void changed(const struct imp_emitter *e)
{
    struct sun *s = e->self;
    const double half = sin(e->input[RADIUS]->value[0] / 2);
    s->versed = 2 * half * half;
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_emitter *e)
{
    struct sun *s = self;
    const enum imp_status st = imp__travel_read(b, &s->axis);
    s->axis = -s->axis;
    changed(e);
    return st;
}

#define WIDER (1 + 1e-6) /* for directions that are rounded */

/* 1 - cos of the angle to the axis is half the square of the chord. */
static bool inside(const struct sun *s, imp_v3 w)
{
    const imp_v3 chord = w - s->axis;
    return imp__dot(chord, chord) <= 2 * s->versed * WIDER;
}

static void eval(const struct imp_emitter *e, const imp_spec *in,
                 const struct imp_emission *x, imp_spec *le)
{
    *le = inside(e->self, -x->d) ? in[RADIANCE] : imp__spec(0);
}
static void eval_d(const struct imp_emitter *e, const imp_spec *in,
                   const struct imp_emission *x, imp_spec *dle)
{
    (void)in;
    dle[RADIANCE] = imp__spec(inside(e->self, -x->d));
    dle[RADIUS] = imp__spec(0);
}

static bool sample(const struct imp_emitter *e, const imp_v3 *ref, const double u[2],
                   struct imp_light_sample *out)
{
    const struct sun *s = e->self;
    const struct imp_frame f = imp__frame_from_normal(s->axis);
    const double down = u[0] * s->versed, r = sqrt(down * (2 - down)),
                 phi = 2 * IMP_PI * u[1];
    (void)ref;
    *out = (struct imp_light_sample){.wi = imp__normalize(f.s * (r * cos(phi)) +
                                                          f.t * (r * sin(phi)) +
                                                          f.n * (1 - down)),
                                     .dist = INFINITY,
                                     .pdf = IMP_INV_PI / 2 / s->versed,
                                     .cos_light = 1};
    return true;
}
static double pdf(const struct imp_emitter *e, const imp_v3 *ref, const imp_v3 *wi,
                  const struct imp_hit *hit, const struct imp_surface *at)
{
    const struct sun *s = e->self;
    (void)ref, (void)hit, (void)at;
    return inside(s, *wi) ? IMP_INV_PI / 2 / s->versed : 0;
}

static int jumps(const struct imp_emitter *e, struct imp_sky_circle out[IMP_SKY_CIRCLES])
{
    const struct sun *s = e->self;
    out[0] = (struct imp_sky_circle){s->axis, 1 - s->versed * WIDER};
    return 1;
}

static void aim(struct imp_emitter *e, double v[3], bool set)
{
    struct sun *s = e->self;
    const imp_v3 along = imp__v3(v[0], v[1], v[2]);
    if (set && imp__length(along) > 0) s->axis = -imp__normalize(along);
    for (int k = 0; k < 3; k++) v[k] = -s->axis[k];
}

const struct imp_emitter_ops imp__sun = {.size = sizeof(struct imp_emitter_ops),
                                         .name = "sun",
                                         .object_size = sizeof(struct sun),
                                         .flags = IMP_EMITTER_ENVIRONMENT,
                                         .inputs = inputs,
                                         .build = build,
                                         .eval = eval,
                                         .eval_d = eval_d,
                                         .sample = sample,
                                         .pdf = pdf,
                                         .changed = changed,
                                         .sample_emission = imp__sky_emission_sample,
                                         .pdf_emission = imp__sky_emission_pdf,
                                         .jumps = jumps,
                                         .aim = aim};

bool imp__sun_disc(const struct imp_emitter *e, imp_v3 *axis, double *size)
{
    const struct sun *s = e->self;
    if (e->ops != &imp__sun) return false;
    *axis = s->axis;
    *size = IMP_2PI * s->versed;
    return true;
}

static imp_spec *radius_lanes(const struct imp_emitter *e)
{
    return &((struct imp_input *)(uintptr_t)e->input[RADIUS])->value;
}

void imp__sun_radius_set(struct imp_emitter *e, double radius)
{
    *radius_lanes(e) = imp__spec(radius);
    changed(e);
}

double *imp__sun_radius_number(const struct imp_emitter *e)
{
    return (double *)radius_lanes(e);
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Values, draws and integrals of skies by their angles to the zenith and the sun. */
#include "sky_shape.h"
#include "emission.h"
#include "math/transform.h"
#include "math/warp.h"
#include "sun_position.h"
#include <math.h>

enum { SCALE };

const struct imp_input_desc imp__sky_shape_inputs[] = {{.name = "scale",
                                                        .role = IMP_EMISSION,
                                                        .flags = IMP_INPUT_NUMBER,
                                                        .fallback = 1,
                                                        .unit = "1"},
                                                       {0}};

enum imp_status imp__sky_shape_place(const struct imp_build *b, struct imp__sky_shape *s,
                                     bool *of_world)
{
    enum imp_status st = IMP_OK;
    IMP_TRY(imp__sky_axes(b, s->axis));
    IMP_TRY(imp__sun_read(b, &s->sun, of_world));
    if (!*of_world)
        s->sun = s->axis[0] * s->sun[0] + s->axis[1] * s->sun[1] + s->axis[2] * s->sun[2];
out:
    return st;
}

enum imp_status imp__sky_shape_by_day(const struct imp_build *b,
                                      const struct imp__sky_shape *s, bool of_world,
                                      const char *what)
{
    const double height = imp__dot(s->sun, s->axis[2]);
    if (height >= 0) return IMP_OK;
    return imp_build_error(b, of_world ? "sun_direction" : NULL, IMP_E_SCENE,
                           "the sun is %.3g degrees below the horizon, and %s is a sky "
                           "by day",
                           -asin(height) * 180 / IMP_PI, what);
}

double imp__sky_shape_at(const struct imp__sky_shape *s, imp_v3 w)
{
    const double z = imp__dot(w, s->axis[2]);
    if (!(z > 0)) return 0;
    if (s->overcast) return (1 + 2 * z) / 3;
    const double *n = s->n, c = imp_clamp(imp__dot(w, s->sun), -1.0, 1.0), x = acos(c);
    const double g = 1 + n[0] * exp(n[1] / z);
    const double f = 1 + n[2] * (exp(n[3] * x) - s->h) + n[4] * c * c;
    return imp_max(f * g, 0.0);
}

double imp__sky_shape_horizontal(const struct imp__sky_shape *s)
{
    enum { UP = 256, AROUND = 512 };
    double sum = 0;
    for (int i = 0; i < UP; i++)
        for (int j = 0; j < AROUND; j++) {
            const double square = (i + 0.5) / UP, phi = (j + 0.5) * IMP_2PI / AROUND;
            const double z = sqrt(square),
                         r = sqrt(1 - square); /* cos dw = d(z^2)/2 dphi */
            sum += imp__sky_shape_at(s, s->axis[0] * (r * cos(phi)) +
                                            s->axis[1] * (r * sin(phi)) + s->axis[2] * z);
        }
    return sum * IMP_PI / (UP * AROUND);
}

void imp__sky_shape_eval_d(const struct imp_emitter *e, const imp_spec *in,
                           const struct imp_emission *x, imp_spec *dle)
{
    const struct imp__sky_shape *s = e->self;
    (void)in;
    dle[SCALE] = imp__spec(s->factor * imp__sky_shape_at(s, -x->d));
}
void imp__sky_shape_eval(const struct imp_emitter *e, const imp_spec *in,
                         const struct imp_emission *x, imp_spec *le)
{
    imp__sky_shape_eval_d(e, in, x, le);
    *le *= in[SCALE];
}

/* (cos/pi + 1/2 pi)/2 above the horizon. */
static double density(const struct imp__sky_shape *s, imp_v3 w)
{
    const double z = imp__dot(w, s->axis[2]);
    return z > 0 ? IMP_INV_PI / 2 * (z + 0.5) : 0;
}
bool imp__sky_shape_sample(const struct imp_emitter *e, const imp_v3 *ref,
                           const double u[2], struct imp_light_sample *out)
{
    const struct imp__sky_shape *s = e->self;
    const bool cosine = u[0] < 0.5;
    const double r = cosine ? 2 * u[0] : 2 * u[0] - 1, phi = IMP_2PI * u[1];
    const double z = cosine ? sqrt(1 - r) : 1 - r, across = sqrt(imp_max(1 - z * z, 0.0));
    (void)ref;
    if (!(z > 0)) return false;
    const imp_v3 w = imp__normalize(s->axis[0] * (across * cos(phi)) +
                                    s->axis[1] * (across * sin(phi)) + s->axis[2] * z);
    *out = (struct imp_light_sample){
        .wi = w, .dist = INFINITY, .pdf = density(s, w), .cos_light = 1};
    return out->pdf > 0;
}
double imp__sky_shape_pdf(const struct imp_emitter *e, const imp_v3 *ref,
                          const imp_v3 *wi, const struct imp_hit *hit,
                          const struct imp_surface *at)
{
    (void)ref, (void)hit, (void)at;
    return density(e->self, *wi);
}

int imp__sky_shape_jumps(const struct imp_emitter *e,
                         struct imp_sky_circle out[IMP_SKY_CIRCLES])
{
    const struct imp__sky_shape *s = e->self;
    out[0] = (struct imp_sky_circle){s->axis[2], 0}; /* the horizon */
    return 1;
}

void imp__sky_shape_move(struct imp_emitter *e, const double to_world[12])
{
    struct imp__sky_shape *s = e->self;
    imp__sky_axes_turn(s->axis, to_world);
    s->sun = imp__normalize(imp__rows_vector(to_world, s->sun));
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Radiance of the clear sky and of its sun by lanes: wavelengths, colours or the luminance of
 * colours, with derivatives by turbidity and albedo (skylight.h). */
#include "color/cie.h"
#include "color/rgb.h"
#include "sunsky.h"
#include <math.h>

struct at { /* a direction, in the frame of the sky, and a turbidity */
    double cos_theta, cos_gamma;
    bool in_disc;
    struct imp__sky_place place;
    struct imp__sky_between between;
};
static struct at at_direction(const struct sunsky *s, imp_v3 w, double turbidity)
{
    const double c = imp__dot(w, s->sun);
    return (struct at){w[2], c, imp__sunsky_in_disc(s, c), imp__sky_place(w[2], c),
                       imp__sky_between(turbidity)};
}

/* The sun's eleven wavelengths. */
static void sun_waves(const struct sunsky *s, const struct at *x, double turbidity,
                      struct imp__sky_value out[IMP_SKY_WAVES])
{
    if (!s->limb) {
        imp__sun_mean(&s->light, turbidity, out);
        return;
    }
    const double away = (1 - x->cos_gamma) / (1 - s->cos_radius);
    imp__sun_radiance(turbidity, asin(x->cos_theta), sqrt(imp_max(1 - away, 0.0)), out);
}

static void add(struct imp__sky_value *sum, double factor, const struct imp__sky_value *v)
{
    sum->value += factor * v->value;
    sum->by_turbidity += factor * v->by_turbidity;
    sum->by_albedo += factor * v->by_albedo;
}

/* At one wavelength: lines between the model's. */
static void at_wave(const struct sunsky *s, const struct at *x, double albedo, double nm,
                    const struct imp__sky_value *sun, struct sunsky_both *out)
{
    const double at = (nm - IMP_SKY_FIRST_NM) / IMP_SKY_STEP_NM;
    *out = (struct sunsky_both){0};
    if (!(at >= 0 && at <= IMP_SKY_WAVES - 1)) return;
    const int k = (int)imp_min(at, IMP_SKY_WAVES - 2.0);
    for (int j = 0; j < 2; j++) {
        const double share = j ? at - k : 1 - (at - k);
        const struct imp__sky_value sky =
            imp__sky_radiance(&s->light, k + j, &x->between, albedo, &x->place);
        add(&out->sky, share, &sky);
        if (x->in_disc) add(&out->sun, share, &sun[k + j]);
    }
}

/* Sky and sun in colour c: the sky's tables are for colours, in units of luminance. */
static void at_color(const struct sunsky *s, const struct at *x, double albedo, int c,
                     const struct imp__sky_value *sun, struct sunsky_both *out)
{
    const struct imp__sky_value sky =
        imp__sky_radiance(&s->light, c, &x->between, albedo, &x->place);
    *out = (struct sunsky_both){0};
    add(&out->sky, 1 / IMP_CIE_Y_INTEGRAL, &sky);
    for (int k = 0; k < IMP_SKY_WAVES && x->in_disc; k++)
        add(&out->sun, s->light.color[c][k], &sun[k]);
}

void imp__sunsky_lanes(const struct sunsky *s, double turbidity, const imp_spec *albedo,
                       const imp_spec *nm, imp_v3 w, struct sunsky_both out[4])
{
    struct imp__sky_value sun[IMP_SKY_WAVES];
    for (int c = 0; c < 4; c++) out[c] = (struct sunsky_both){0};
    if (s->dark || !(w[2] >= 0)) return;
    const struct at x = at_direction(s, w, turbidity);
    if (x.in_disc) sun_waves(s, &x, turbidity, sun);
    for (int c = 0; c < (s->by_wave ? 4 : 3); c++) {
        const double rho = (*albedo)[s->mono ? 0 : c];
        if (s->by_wave) at_wave(s, &x, rho, (*nm)[c], sun, &out[c]);
        else at_color(s, &x, rho, c, sun, &out[c]);
        const struct imp__sky_value full = out[c].sun;
        out[c].sun = (struct imp__sky_value){0};
        add(&out[c].sun, s->dim, &full);
    }
    if (!s->mono) return;
    static const double weight[3] = {IMP_LUM_R, IMP_LUM_G, IMP_LUM_B};
    struct sunsky_both sum = {0};
    for (int c = 0; c < 3; c++) {
        add(&sum.sky, weight[c], &out[c].sky);
        add(&sum.sun, weight[c], &out[c].sun);
    }
    for (int c = 0; c < 4; c++) out[c] = sum;
}

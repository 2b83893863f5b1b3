/* SPDX-License-Identifier: Apache-2.0
 *
 * phong: Lambert and the modified Phong lobe (Lafortune and Willems, "Using the Modified
 * Phong Reflectance Model", 1994), reciprocal, with t = mirror(wi) . wo:
 *
 *   f cos_i = kd cos_i/pi + ks (n + 2)/(2 pi) max(0, t)^n cos_i
 *
 * Its albedo is at most kd + ks. Half the draws are cosine, half (n + 1)/(2 pi) t^n about
 * the mirror direction; those that fall behind the horizon are lost. */
#include "kind/build.h"
#include "lambert.h"
#include <importon/lobes.h>

enum { DIFFUSE, SPECULAR, EXPONENT, N_INPUTS };

static const struct imp_input_desc inputs[] = {{.name = "diffuse_reflectance",
                                                .role = IMP_REFLECTANCE,
                                                .fallback = 0.5,
                                                .hi = 1,
                                                .unit = "1"},
                                               {.name = "specular_reflectance",
                                                .role = IMP_REFLECTANCE,
                                                .fallback = 0.2,
                                                .hi = 1,
                                                .unit = "1"},
                                               {.name = "exponent",
                                                .role = IMP_UNBOUNDED,
                                                .flags = IMP_INPUT_SCALAR,
                                                .fallback = 30,
                                                .unit = "1"},
                                               {0}};

/* Cosine between the mirror image of one direction and the other. */
static double mirror_dot(const struct imp_dirs *d)
{
    return d->wo[2] * d->wi[2] - d->wo[0] * d->wi[0] - d->wo[1] * d->wi[1];
}

/* The lobe times the cosine, over ks. */
static double lobe(double n, double t, const struct imp_dirs *d)
{
    return t > 0 ? (n + 2) / IMP_2PI * pow(t, n) * d->wi[2] : 0;
}

static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    (void)b;
    *f = imp__spec(0);
    if (imp__front(d))
        *f = in[DIFFUSE] * imp__lambert(d) +
             in[SPECULAR] * lobe(in[EXPONENT][0], mirror_dot(d), d);
}

static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    const double n = in[EXPONENT][0], t = mirror_dot(d);
    (void)b;
    if (!imp__front(d)) return 0;
    return 0.5 * imp__lambert(d) + 0.5 * imp_lobe_pdf(n, t);
}

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    (void)b;
    if (!(d->wo[2] > 0)) return false;
    if (u[0] < 0.5) {
        if (!imp__lambert_sample(&u[1], d)) return false;
    } else {
        const imp_v3 mirror = imp__v3(-d->wo[0], -d->wo[1], d->wo[2]);
        imp_lobe_sample(&mirror, in[EXPONENT][0], u + 1, &d->wi);
        d->lobe = IMP_SMOOTH;
        if (!(d->wi[2] > 0)) return false;
    }
    return true;
}

static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    (void)b;
    for (int j = 0; j < N_INPUTS; j++) df[j] = imp__spec(0);
    if (!imp__front(d)) return;
    const double n = in[EXPONENT][0], t = mirror_dot(d), s = lobe(n, t, d);
    df[DIFFUSE] = imp__spec(imp__lambert(d));
    df[SPECULAR] = imp__spec(s);
    if (t > 0) df[EXPONENT] = in[SPECULAR] * (s * (1 / (n + 2) + log(t)));
}

static void eval_directions_d(const struct imp_bsdf *b, const imp_spec *in,
                              const struct imp_dirs *d, imp_spec d_wo[3],
                              imp_spec d_wi[3])
{
    (void)b;
    for (int k = 0; k < 3; k++) d_wo[k] = d_wi[k] = imp__spec(0);
    if (!imp__front(d)) return;
    const double n = in[EXPONENT][0], t = mirror_dot(d), s = lobe(n, t, d);
    d_wi[2] = in[DIFFUSE] * IMP_INV_PI;
    if (!(t > 0)) return;
    for (int k = 0; k < 3; k++) {
        const imp_spec by_t = in[SPECULAR] * (s * n / t * (k == 2 ? 1 : -1));
        d_wo[k] += by_t * d->wi[k];
        d_wi[k] += by_t * d->wo[k];
    }
    d_wi[2] += in[SPECULAR] * (s / d->wi[2]);
}

const struct imp_bsdf_ops imp__phong = {.size = sizeof(struct imp_bsdf_ops),
                                        .name = "phong",
                                        .inputs = inputs,
                                        .sample = sample,
                                        .eval = eval,
                                        .pdf = pdf,
                                        .eval_d = eval_d,
                                        .eval_directions_d = eval_directions_d};

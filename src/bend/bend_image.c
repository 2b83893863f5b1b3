/* SPDX-License-Identifier: Apache-2.0
 *
 * Irradiance of rays on a picture, and its adjoint. The kernel is a cubic B-spline one
 * pixel wide on each axis: a partition of unity, so energy is exact, and twice
 * differentiable (docs/bent-rays.md 4). Pictures are divided by constants: that of the
 * rays by their power per pixel, the target by its mean. So 1 is the irradiance of all
 * power spread evenly over the picture. */
#include "bend_problem.h"
#include <string.h>

/* Four weights around coordinate c (in pixels; pixel i has its centre at i + 1/2). */
static int kernel(double c, double w[4], double wd[4])
{
    const double f = floor(c - 0.5), u = c - 0.5 - f, m = 1 - u;
    w[0] = m * m * m / 6;
    w[1] = (3 * u * u * u - 6 * u * u + 4) / 6;
    w[2] = (-3 * u * u * u + 3 * u * u + 3 * u + 1) / 6;
    w[3] = u * u * u / 6;
    wd[0] = -m * m / 2;
    wd[1] = (3 * u * u - 4 * u) / 2;
    wd[2] = (-3 * u * u + 2 * u + 1) / 2;
    wd[3] = u * u / 2;
    return (int)f - 1;
}

struct spot {
    double w[4], wd[4], h[4], hd[4];
    int x, y;
};

/* Footprint of a ray on the picture. False: it lies beside the picture. */
static bool spot_of(const struct imp_bend_target *t, imp_v3 at, struct spot *s)
{
    const imp_v3 u = imp__v3_load(t->u), v = imp__v3_load(t->v);
    const imp_v3 r = at - imp__v3_load(t->origin);
    const double a = imp__dot(r, u) / imp__dot(u, u) * t->width;
    const double b = imp__dot(r, v) / imp__dot(v, v) * t->height;
    if (!(a > -2 && a < t->width + 2 && b > -2 && b < t->height + 2)) return false;
    s->x = kernel(a, s->w, s->wd);
    s->y = kernel(b, s->h, s->hd);
    return true;
}

enum imp_status imp__image_value(const imp_bend *b, const struct imp__target_of_rays *t,
                                 const struct imp_bend_exit *exits,
                                 const struct imp_bend_exit *taps, double *value,
                                 struct imp_bend_cotangent *bars,
                                 struct imp_bend_cotangent *tap_bars, float *pixels)
{
    const struct imp_bend_target *desc = &t->desc;
    const bool far = desc->type == IMP_BEND_FARFIELD;
    const size_t n_taps = b->options.n_taps,
                 n = (size_t)desc->width * (size_t)desc->height;
    const double scale = (double)n / t->power;
    const imp_v3 u = imp__v3_load(desc->u), v = imp__v3_load(desc->v);
    double *e = imp__alloc(b->ctx, n, sizeof *e);
    struct imp__arrival a;
    struct spot s;
    if (!e) return imp__error(b->ctx, IMP_E_NOMEM, "no memory for a picture");

    for (size_t i = t->first; i < t->last; i++) {
        if (!imp__arrive(desc, imp__target_exit(desc, exits, taps, n_taps, i), &a))
            continue;
        if (!spot_of(desc, far ? a.d : a.x, &s)) continue;
        const double p = scale * b->power[i] * a.weight;
        for (int q = 0; q < 4; q++)
            for (int k = 0; k < 4; k++)
                if (s.y + q >= 0 && s.y + q < desc->height && s.x + k >= 0 &&
                    s.x + k < desc->width)
                    e[(size_t)(s.y + q) * desc->width + (s.x + k)] += p * s.w[k] * s.h[q];
    }
    double sum = 0;
    for (size_t i = 0; i < n; i++) {
        if (pixels) pixels[i] = (float)e[i];
        e[i] -= t->pixels[i];
        sum += e[i] * e[i];
    }
    *value = desc->weight * sum / (2 * (double)n);
    for (size_t i = t->first; bars && i < t->last; i++) {
        if (!imp__arrive(desc, imp__target_exit(desc, exits, taps, n_taps, i), &a))
            continue;
        if (!spot_of(desc, far ? a.d : a.x, &s)) continue;
        double c = 0, cx = 0, cy = 0;
        for (int q = 0; q < 4; q++)
            for (int k = 0; k < 4; k++)
                if (s.y + q >= 0 && s.y + q < desc->height && s.x + k >= 0 &&
                    s.x + k < desc->width) {
                    const double r = e[(size_t)(s.y + q) * desc->width + (s.x + k)];
                    c += r * s.w[k] * s.h[q];
                    cx += r * s.wd[k] * s.h[q];
                    cy += r * s.w[k] * s.hd[q];
                }
        const double p = desc->weight / (double)n * scale * b->power[i];
        const imp_v3 y = (u * (cx * desc->width / imp__dot(u, u)) +
                          v * (cy * desc->height / imp__dot(v, v))) *
                         (p * a.weight);
        const imp_v3 zero = {0};
        imp__arrive_vjp(desc, &a, far ? zero : y, far ? y : zero, zero, 0, p * c,
                        desc->tap < 0 ? &bars[i]
                                      : &tap_bars[i * n_taps + (size_t)desc->tap]);
    }
    imp__release(b->ctx, e);
    return IMP_OK;
}

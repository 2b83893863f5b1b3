/* SPDX-License-Identifier: Apache-2.0
 *
 * Noise of a photograph, from differences between neighbouring pixels: of the photograph itself where
 * a measurement begins, and of what the pictures leave over of it once they have its edges. */
#include "base/arguments.h"
#include "measuring.h"
#include <math.h>
#include <stdlib.h>

#define SURE                                                                             \
    2 /* errors of a variance by which an estimate has to be less than the one before */

static int ascending(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static double median(float *list, size_t n)
{
    qsort(list, n, sizeof *list, ascending);
    return (double)list[n / 2];
}

/* May a value of the photograph be counted? */
static bool counts(const struct imp__photo *p, size_t pixel, int c)
{
    const double v = (double)p->desc.pixels[pixel * (size_t)p->desc.channels + (size_t)c];
    return p->weights[pixel] > 0 &&
           (!p->desc.clipped || (v > p->desc.low && v < p->desc.high));
}

/* The median of the magnitudes of
 *
 *      1 -2  1
 *     -2  4 -2     which is 0 for what is linear along either axis, and has 36 times the variance
 *      1 -2  1     of independent noise (Immerkaer, Computer Vision and Image Understanding 64, 1996)
 *
 * over .6745 is a robust standard deviation of it: edges and textures count where they cover less
 * than about a third of the pixels. A median has an efficiency of .37, and neighbouring differences
 * have correlations whose squares add up to 1.94^2, so that the relative error of the variance from n of
 * them is 2 sqrt(1.94^2/(2 .37 n)).
 *
 * values, own [n_values]: numbers (NAN: left out), and the variance of each that is not the
 * photograph's (NULL: 0), which is taken off. *variance may come out below 0; *of is its relative
 * error, and infinite where there is nothing to estimate it from. */
static enum imp_status neighbours_variance(struct imp__measure *m,
                                           const struct imp__photo *p,
                                           const float *values, const float *own,
                                           double *variance, double *of)
{
    static const double mask[3] = {1, -2, 1};
    const int w = p->desc.width, h = p->desc.height, C = p->desc.channels;
    size_t n = 0;
    float *list = imp__alloc(m->ctx, 2 * p->n_values, sizeof *list),
          *owns = list + p->n_values;
    if (!list) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for %s", p->name);
    for (int y = 1; y + 1 < h; y++)
        for (int x = 1; x + 1 < w; x++)
            for (int c = 0; c < C; c++) {
                double sum = 0, extra = 0;
                bool whole = true;
                for (int j = -1; j <= 1; j++)
                    for (int i = -1; i <= 1; i++) {
                        const size_t pixel =
                                         (size_t)(y + j) * (size_t)w + (size_t)(x + i),
                                     at = pixel * (size_t)C + (size_t)c;
                        const double factor = mask[j + 1] * mask[i + 1];
                        whole &= counts(p, pixel, c) && !isnan(values[at]);
                        sum += factor * (double)values[at];
                        extra += own ? factor * factor * (double)own[at] / 36 : 0;
                    }
                if (!whole) continue;
                list[n] = (float)fabs(sum);
                owns[n++] = (float)extra;
            }
    const double all = n > 0 ? imp__sqr(median(list, n) / (0.6745 * 6)) : 0;
    *variance = n > 0 ? all - median(owns, n) : 0;
    *of = *variance > 0 ? 2 * sqrt(1.94 * 1.94 / (2 * 0.37 * (double)n)) * all / *variance
                        : (double)INFINITY;
    imp__release(m->ctx, list);
    return IMP_OK;
}

static void noise_set(struct imp__photo *p, double noise, double of)
{
    p->noise = noise;
    p->noise_of = of;
    for (size_t i = 0; i < p->n_values; i++) p->noise_se[i] = (float)noise;
}

bool imp__measure_noise_varies(const struct imp__photo *p)
{
    return p->desc.read > 0 || p->desc.shot > 0 || p->desc.relative > 0;
}

#define REACH 4.0 /* standard deviations on either side of the mean, ... */
#define NODES                                                                            \
    8 /* ... and so many nodes, or, where the curve has its end among them, ... */
#define MORE 128

/* Mean and variance of max(v + s z, 0)^(1/gamma), z normal, by the trapezoidal rule. A curve that bends
 * has a mean that is off v^(1/gamma), to the second order by s^2/2 times its second derivative: at a tenth of white
 * and 1,000 electrons there by 3 % of the noise, which a few thousand values would see. */
static void curve_moments(double v, double s, double gamma, double *mean,
                          double *variance)
{
    const int nodes = v > REACH * s ? NODES : MORE;
    double weights = 0, sum = 0, square = 0;
    for (int k = -nodes; k <= nodes; k++) {
        const double z = REACH * k / nodes, w = exp(-0.5 * z * z);
        const double V = pow(fmax(v + s * z, 0), 1 / gamma);
        weights += w;
        sum += w * V;
        square += w * V * V;
    }
    *mean = sum / weights;
    *variance = fmax(square / weights - imp__sqr(*mean), 0);
}

void imp__measure_noise_by_light(struct imp__photo *p, const float *light, double gamma)
{
    const struct imp_photo *d = &p->desc;
    double sum = 0;
    for (size_t i = 0; i < p->n_values; i++) {
        const double v = fmax((double)light[i], 0);
        double variance = d->read * d->read + d->shot * v + imp__sqr(d->relative * v);
        p->lift[i] = 0;
        if (gamma != 1) {
            double mean;
            curve_moments(v, sqrt(variance), gamma, &mean, &variance);
            p->lift[i] = (float)(mean - pow(v, 1 / gamma));
        }
        variance += d->step * d->step / 12;
        p->noise_se[i] = (float)fmax(sqrt(variance), 1e-9);
        sum += variance;
    }
    p->noise = fmax(sqrt(sum / (double)p->n_values), 1e-9);
    p->noise_of = 0;
}

/* Where a measurement begins, by the photograph. */
static enum imp_status noise_by_photo(struct imp__measure *m, struct imp__photo *p)
{
    size_t index;
    const struct imp_param *curve = imp__measure_film_number(m, p, "gamma", &index);
    const double gamma = curve ? imp__param_get(curve, 0) : 1;
    float *light = imp__alloc(m->ctx, p->n_values, sizeof *light);
    if (!light) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for %s", p->name);
    for (size_t i = 0; i < p->n_values; i++)
        light[i] = (float)pow(fmax((double)p->desc.pixels[i], 0), gamma);
    imp__measure_noise_by_light(p, light, gamma);
    imp__release(m->ctx, light);
    return IMP_OK;
}

enum imp_status imp__measure_noise(struct imp__measure *m, struct imp__photo *p)
{
    double variance = 0, of = 0;
    if (imp__measure_noise_varies(p)) return noise_by_photo(m, p);
    if (p->desc.noise > 0) {
        noise_set(p, p->desc.noise, 0);
        return IMP_OK;
    }
    IMP_CHECKED(neighbours_variance(m, p, p->desc.pixels, NULL, &variance, &of));
    const double noise = fmax(sqrt(fmax(variance, 0)), p->desc.step / sqrt(12));
    if (!(noise > 0))
        return imp__error(m->ctx, IMP_E_ARG,
                          "%s has no noise that can be estimated: give it", p->name);
    noise_set(p, noise, isfinite(of) ? of : 1);
    return IMP_OK;
}

/* In a small photograph edges cover most pixels, and its own differences tell of them. Differences of
 * residuals have the edges left out that the pictures show, too, and stay blind to what is
 * wrong over many pixels, which is what chi-square has to find. Estimates go down only, and only by
 * what is significant: they are of the same noise. */
enum imp_status imp__measure_noise_again(struct imp__measure *m, struct imp__photo *p,
                                         bool *changed)
{
    double variance = 0, of = 0;
    if (p->noise_of == 0) return IMP_OK; /* it was given */
    IMP_CHECKED(neighbours_variance(m, p, p->left, p->own, &variance, &of));
    const double before = p->noise,
                 noise = fmax(sqrt(fmax(variance, 0)), p->desc.step / sqrt(12));
    if (!isfinite(of) || !(imp__sqr(noise) * (1 + SURE * of) < imp__sqr(before)))
        return IMP_OK;
    noise_set(p, noise, of);
    *changed = true;
    return imp__measure_say(m,
                            "%s: noise %.3g of its values, by what the picture leaves "
                            "over; its own edges made it %.3g",
                            p->name, noise, before);
}

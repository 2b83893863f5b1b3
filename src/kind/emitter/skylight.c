/* SPDX-License-Identifier: Apache-2.0
 *
 * Radiance of the clear sky and of the sun's disk from the tables of Hosek and Wilkie, and its
 * derivatives with respect to turbidity and albedo. */
#include "skylight.h"
#include "color/rgb.h"
#include <math.h>
#include <string.h>

enum { A, B, C, D, E, F, G, H, I, R };
enum { SUN_PIECES = 45, SUN_ORDER = 4, LIMB_ORDER = 6, BEZIER = 6 };

/* Bernstein polynomials of degree 5. */
static void bernstein(double x, double w[BEZIER])
{
    static const double choose[BEZIER] = {1, 5, 10, 10, 5, 1};
    for (int j = 0; j < BEZIER; j++) w[j] = choose[j] * pow(x, j) * pow(1 - x, 5 - j);
}

void imp__skylight_set(struct imp__skylight *s, double elevation, double radius,
                       bool by_wave)
{
    double w[BEZIER];
    memset(s, 0, sizeof *s);
    s->channels = by_wave ? IMP_SKY_WAVES : 3;
    s->elevation = elevation;
    s->radius = radius;
    bernstein(cbrt(elevation / (IMP_PI / 2)), w);
    for (int t = 0; t < IMP_SKY_TURBIDITIES; t++)
        for (int a = 0; a < 2; a++)
            for (int k = 0; k < s->channels; k++)
                for (int j = 0; j < BEZIER; j++) {
                    const float *c = by_wave ? imp__sky_spec_numbers[t][a][j][k]
                                             : imp__sky_rgb_numbers[t][a][j][k];
                    for (int m = A; m <= I; m++) s->sky[t][a][k][m] += w[j] * c[m];
                    s->sky[t][a][k][R] +=
                        w[j] * (by_wave ? imp__sky_spec_radiance[t][a][j][k]
                                        : imp__sky_rgb_radiance[t][a][j][k]);
                }
    for (int k = 0; k < IMP_SKY_WAVES; k++) {
        double nm[IMP_SKY_WAVES], hat[IMP_SKY_WAVES] = {0}, rgb[3];
        for (int i = 0; i < IMP_SKY_WAVES; i++)
            nm[i] = IMP_SKY_FIRST_NM + i * IMP_SKY_STEP_NM;
        hat[k] = 1;
        imp__spectrum_to_rgb(IMP_SKY_WAVES, nm, hat, false, rgb);
        for (int c = 0; c < 3; c++) s->color[c][k] = rgb[c];
    }
}

struct imp__sky_between imp__sky_between(double t)
{
    const int k = (int)imp_clamp(floor(t), 1.0, IMP_SKY_TURBIDITIES - 1.0) - 1;
    const double share = t - (k + 1);
    const bool corner = share == 0 && k > 0;
    return (struct imp__sky_between){k,     k + 1,           share, corner ? k - 1 : k,
                                     k + 1, corner ? 0.5 : 1};
}
struct imp__sky_place imp__sky_place(double cos_theta, double cos_gamma)
{
    return (struct imp__sky_place){cos_gamma, acos(imp_clamp(cos_gamma, -1.0, 1.0)),
                                   1 / (cos_theta + 0.01), sqrt(cos_theta)};
}

/* Value and derivatives by A..I, R. */
static double radiance(const double c[IMP_SKY_NUMBERS], const struct imp__sky_place *x,
                       double d[IMP_SKY_NUMBERS])
{
    const double up = x->up, root = x->root, gamma = x->gamma, cos_gamma = x->cos_gamma;
    const double haze = exp(c[B] * up), glow = exp(c[E] * gamma),
                 square = cos_gamma * cos_gamma;
    const double base = 1 + c[I] * c[I] - 2 * c[I] * cos_gamma;
    const double chi = (1 + square) / (base * sqrt(base));
    const double first = 1 + c[A] * haze;
    const double second = c[C] + c[D] * glow + c[F] * square + c[G] * chi + c[H] * root;
    d[A] = haze * second * c[R];
    d[B] = c[A] * haze * up * second * c[R];
    const double by = first * c[R];
    d[C] = by;
    d[D] = by * glow;
    d[E] = by * c[D] * glow * gamma;
    d[F] = by * square;
    d[G] = by * chi;
    d[H] = by * root;
    d[I] = by * c[G] * chi * -3 * (c[I] - cos_gamma) / base;
    d[R] = first * second;
    return first * second * c[R];
}

struct imp__sky_value imp__sky_radiance(const struct imp__skylight *s, int k,
                                        const struct imp__sky_between *of, double albedo,
                                        const struct imp__sky_place *x)
{
    double c[IMP_SKY_NUMBERS], d[IMP_SKY_NUMBERS];
    struct imp__sky_value out = {0};
    const struct imp__sky_between t = *of;
    double thick[IMP_SKY_NUMBERS], light[IMP_SKY_NUMBERS]; /* d by turbidity, by albedo */
    for (int m = 0; m < IMP_SKY_NUMBERS; m++) {
#define GROUND(i) (s->sky[i][1][k][m] - s->sky[i][0][k][m])
#define AT(i)     (s->sky[i][0][k][m] + albedo * GROUND(i))
        c[m] = AT(t.low) + t.share * (AT(t.high) - AT(t.low));
        thick[m] = (AT(t.to) - AT(t.from)) * t.per;
        light[m] = (1 - t.share) * GROUND(t.low) + t.share * GROUND(t.high);
#undef AT
#undef GROUND
    }
    const double value = radiance(c, x, d);
    if (!(value > 0)) return out; /* the fit falls below 0 in places */
    out.value = value;
    for (int m = 0; m < IMP_SKY_NUMBERS; m++) {
        out.by_turbidity += d[m] * thick[m];
        out.by_albedo += d[m] * light[m];
    }
    return out;
}

/* ---- Sun ------------------------------------------------------------------------- */

/* Radiance at the middle of the disc for the whole turbidity t + 1. */
static double sun_at(int t, int k, double elevation)
{
    const double x = cbrt(elevation / (IMP_PI / 2)) * SUN_PIECES;
    const int piece = (int)fmin(x, SUN_PIECES - 1);
    const double start = (double)piece / SUN_PIECES;
    const double from = elevation - start * start * start * IMP_PI / 2;
    const float *c = imp__sun_spec_radiance[t][piece][k];
    double sum = 0;
    for (int j = SUN_ORDER - 1; j >= 0; j--) sum = sum * from + c[j];
    return sum;
}
static double limb_at(int k, double cos_limb)
{
    double sum = 0;
    for (int j = LIMB_ORDER - 1; j >= 0; j--)
        sum = sum * cos_limb + imp__sun_spec_limb[k][j];
    return sum;
}

/* Radiance of a sun that is darker towards its limb by limb[]. */
static void sun_blend(double turbidity, double elevation,
                      const double limb[IMP_SKY_WAVES],
                      struct imp__sky_value out[IMP_SKY_WAVES])
{
    const struct imp__sky_between t = imp__sky_between(turbidity);
    for (int k = 0; k < IMP_SKY_WAVES; k++) {
        const double low = sun_at(t.low, k, elevation),
                     high = sun_at(t.high, k, elevation);
        const double value = (low + t.share * (high - low)) * limb[k];
        out[k] = (struct imp__sky_value){0};
        if (!(value > 0)) continue;
        out[k].value = value;
        out[k].by_turbidity =
            (sun_at(t.to, k, elevation) - sun_at(t.from, k, elevation)) * t.per * limb[k];
    }
}

void imp__sun_radiance(double turbidity, double elevation, double cos_limb,
                       struct imp__sky_value out[IMP_SKY_WAVES])
{
    double limb[IMP_SKY_WAVES];
    for (int k = 0; k < IMP_SKY_WAVES; k++) limb[k] = limb_at(k, cos_limb);
    sun_blend(turbidity, imp_max(elevation, 0.0), limb, out);
}

/* The mean of cos^j over a disc seen from far is 2/(j + 2). The elevation is that of the
 * middle. */
void imp__sun_mean(const struct imp__skylight *s, double turbidity,
                   struct imp__sky_value out[IMP_SKY_WAVES])
{
    double limb[IMP_SKY_WAVES] = {0};
    for (int k = 0; k < IMP_SKY_WAVES; k++)
        for (int j = 0; j < LIMB_ORDER; j++)
            limb[k] += imp__sun_spec_limb[k][j] * 2 / (j + 2);
    sun_blend(turbidity, s->elevation, limb, out);
}

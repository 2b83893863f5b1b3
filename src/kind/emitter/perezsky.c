/* SPDX-License-Identifier: Apache-2.0
 *
 * perezsky: the all-weather sky of Perez, Seals and Michalsky ("All-weather model for sky luminance
 * distribution", Solar Energy 50, 1993, with the erratum in 51), from two measured numbers, the
 * diffuse irradiance Ed of level ground and the direct irradiance Es across the sun's rays. With
 * Z the sun's angle to the zenith in radians, m the air mass (Kasten 1965) and E0 the irradiance
 * outside of the atmosphere,
 *
 *     epsilon = ((Ed + Es)/Ed + 1.041 Z^3)/(1 + 1.041 Z^3)      clearness, one of eight bins
 *     Delta   = m Ed/E0                                          brightness
 *     a = a1 + a2 Z + Delta (a3 + a4 Z), and so b to e
 *
 * but in the first bin c = exp((Delta (c1 + c2 Z))^c3) - c4 and d = -exp(Delta (d1 + d2 Z)) + d3 +
 * Delta d4. Between epsilon = 1.065 and 2.8 a Delta below .2 is taken as .2, as Radiance's programs
 * do: there the fit has no data. */
#include "perezsky.h"
#include "base/required.h"
#include "emission.h"
#include <math.h>

#define BINS 8

static const double bounds[BINS - 1] = {1.065, 1.23, 1.5, 1.95, 2.8, 4.5, 6.2};

/* Table 1 by columns: [a to e][1 to 4][bin]. */
static const double fit[5][4][BINS] = {
    {{1.3525, -1.2219, -1.1, -.5484, -.6, -1.0156, -1, -1.05},
     {-.2576, -.773, -.2515, -.6654, -.3566, -.367, .0211, .0289},
     {-.269, 1.4148, .8952, -.2672, -2.5, 1.0078, .5025, .426},
     {-1.4366, 1.1016, .0156, .7117, 2.325, 1.4051, -.5119, .359}},
    {{-.767, -.2054, .2782, .7234, .2937, .2875, -.3, -.325},
     {.0007, .0367, -.1812, -.6219, .0496, -.5328, .1922, .1156},
     {1.2734, -3.9128, -4.5, -5.6812, -5.6812, -3.85, .7023, .7781},
     {-.1233, .9156, 1.1766, 2.6297, 1.8415, 3.375, -1.6317, .0025}},
    {{2.8, 6.975, 24.7219, 33.3389, 21, 14, 19, 31.0625},
     {.6004, .1774, -13.0812, -18.3, -4.7656, -.9999, -5, -14.5},
     {1.2375, 6.4477, -37.7, -62.25, -21.5906, -7.1406, 1.2438, -46.1148},
     {1, -.1239, 34.8438, 52.0781, 7.2492, 7.5469, -1.9094, 55.375}},
    {{1.8734, -1.5798, -5, -3.5, -3.5, -3.4, -4, -7.2312},
     {.6297, -.5081, 1.5218, .0016, -.1554, -.1078, .025, .405},
     {.9738, -1.7812, 3.9229, 1.1477, 1.4062, -1.075, .3844, 13.35},
     {.2809, .108, -2.6204, .1062, .3988, 1.5702, .2656, .6234}},
    {{.0356, .2624, -.0156, .4659, .0032, -.0672, 1.0468, 1.5},
     {-.1246, .0672, .1597, -.3296, .0766, .4016, -.3788, -.6426},
     {-.5718, -.219, .4199, -.0876, -.0656, .3017, -2.4517, 1.8564},
     {.9938, -.4285, -.5562, -.0329, -.1294, -.4844, 1.4656, .5636}}};

/* Diffuse light by columns 1, W, cos Z, ln Delta; of direct 1, W, exp(5.73 Z - 5), Delta. */
static const double efficacy[2][4][BINS] = {
    {{97.24, 107.22, 104.97, 102.39, 100.71, 106.42, 141.88, 152.23},
     {-.46, 1.15, 2.96, 5.59, 5.94, 3.83, 1.9, .35},
     {12, .59, -5.53, -13.95, -22.75, -36.15, -53.24, -45.27},
     {-8.91, -3.95, -8.77, -13.9, -23.74, -28.83, -14.03, -7.98}},
    {{57.2, 98.99, 109.83, 110.34, 106.36, 107.19, 105.75, 101.18},
     {-4.55, -3.46, -4.9, -5.84, -3.97, -1.25, .77, 1.58},
     {-2.98, -1.21, -1.71, -1.99, -1.75, -1.51, -1.26, -1.1},
     {117.12, 12.38, -8.81, -4.56, -6.16, -26.73, -34.44, -8.29}}};

/* up: cos Z. The sky's bin, Z and Delta. */
static int sky_of(const struct imp__perez_weather *w, double up, double *Z, double *Delta)
{
    *Z = acos(imp_clamp(up, 0.0, 1.0));
    const double cube = 1.041 * *Z * *Z * *Z;
    const double epsilon = ((w->diffuse + w->direct) / w->diffuse + cube) / (1 + cube);
    const double air =
        1 / (imp_clamp(up, 0.0, 1.0) + 0.15 * pow(93.885 - *Z * 180 / IMP_PI, -1.253));
    *Delta = air * w->diffuse / w->extraterrestrial;
    int bin = 0;
    while (bin < BINS - 1 && epsilon >= bounds[bin]) bin++;
    return bin;
}

void imp__perez_shape(struct imp__sky_shape *s, const struct imp__perez_weather *w)
{
    double Z, Delta;
    const int bin = sky_of(w, imp__dot(s->sun, s->axis[2]), &Z, &Delta);
    if (bin >= 1 && bin <= 4) Delta = imp_max(Delta, 0.2);
    for (int k = 0; k < 5; k++) {
        const double x1 = fit[k][0][bin], x2 = fit[k][1][bin], x3 = fit[k][2][bin],
                     x4 = fit[k][3][bin];
        s->n[k] = x1 + x2 * Z + Delta * (x3 + x4 * Z);
        if (bin == 0 && k == 2) s->n[k] = exp(pow(Delta * (x1 + x2 * Z), x3)) - x4;
        if (bin == 0 && k == 3) s->n[k] = -exp(Delta * (x1 + x2 * Z)) + x3 + Delta * x4;
    }
    s->h = 0;
    s->overcast = false;
}

void imp__perez_efficacy(const struct imp__perez_weather *w, double up, double dew,
                         double *diffuse, double *direct)
{
    double Z, Delta;
    const int bin = sky_of(w, up, &Z, &Delta);
    const double water = exp(0.07 * dew - 0.075); /* cm */
    const double last[2][2] = {{cos(Z), log(Delta)}, {exp(5.73 * Z - 5), Delta}};
    for (int k = 0; k < 2; k++) {
        double sum = efficacy[k][0][bin] + efficacy[k][1][bin] * water;
        for (int j = 0; j < 2; j++) sum += efficacy[k][2 + j][bin] * last[k][j];
        *(k ? direct : diffuse) = imp_max(sum, 0.0);
    }
}

static void fit_now(struct imp__sky_shape *s)
{
    imp__perez_shape(s, &s->weather);
    s->factor = s->level / imp__sky_shape_horizontal(s);
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_emitter *e)
{
    enum imp_status st = IMP_OK;
    struct imp__sky_shape *s = self;
    double diffuse, direct, level, outside;
    bool of_world;
    (void)e;
    for (int k = 0; k < 2; k++) {
        const char *name = k ? "direct" : "diffuse";
        if (!imp_build_has(b, name)) IMP_TRY(imp__node_missing(b->ctx, b->node, name));
    }
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "diffuse", 0,
                                (struct imp_interval){0, 1000, IMP_OPEN_LO}, &diffuse));
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "direct", 0,
                                (struct imp_interval){0, 1500, IMP_CLOSED}, &direct));
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "extraterrestrial", IMP__SOLAR_CONSTANT,
                                (struct imp_interval){1300, 1450, IMP_CLOSED}, &outside));
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "illuminance", diffuse, IMP_POSITIVE,
                                &level));
    IMP_TRY(imp__sky_shape_place(b, s, &of_world));
    IMP_TRY(imp__sky_shape_by_day(b, s, of_world, "Perez'"));
    s->weather = (struct imp__perez_weather){diffuse, direct, outside};
    s->level = level;
    s->fit = fit_now;
    fit_now(s);
    if (!(s->factor > 0) || !isfinite(s->factor))
        IMP_TRY(imp_build_error(b, "diffuse", IMP_E_SCENE,
                                "%g W/m^2 and direct = %g: the model has no sky for them",
                                diffuse, direct));
out:
    return st;
}

const struct imp_emitter_ops imp__perezsky = {IMP__SKY_SHAPE_OPS, .name = "perezsky",
                                              .build = build};

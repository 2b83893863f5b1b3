/* SPDX-License-Identifier: Apache-2.0
 *
 * The CIE skies: horizontal and vertical illuminances by walks against an integral over the formula
 * written again here; normalisation; the daylight factor of an unobstructed point and of one
 * below a horizontal slot, in closed form under the overcast sky. */
#include "sky_kit.h"
#include <math.h>

static imp_context *ctx;

/* The numbers of ISO 15469, table 1, in another order than in the kind: gradation groups I to VI
 * (a, b) and indicatrix groups 1 to 6 (c, d, e), and the groups of each type. */
static const double gradation[6][2] = {{4, -.7},   {1.1, -.8}, {0, -1},
                                       {-1, -.55}, {-1, -.32}, {-1, -.15}};
static const double indicatrix[6][3] = {{0, -1, 0},    {2, -1.5, .15}, {5, -2.5, .3},
                                        {10, -3, .45}, {16, -3, .3},   {24, -2.8, .15}};
static const int groups[15][2] = {{1, 1}, {1, 2}, {2, 1}, {2, 2}, {3, 1},
                                  {3, 2}, {3, 3}, {3, 4}, {4, 2}, {4, 3},
                                  {4, 4}, {5, 4}, {5, 5}, {6, 5}, {6, 6}};
static const double sun[3] = {.6, 0, .8};

static double relative(int type, const double w[3])
{
    if (type == 16) return (1 + 2 * w[2]) / 3;
    const double *g = gradation[groups[type - 1][0] - 1],
                 *f = indicatrix[groups[type - 1][1] - 1];
    const double x = acos(fmin(w[0] * sun[0] + w[1] * sun[1] + w[2] * sun[2], 1)),
                 zs = acos(sun[2]);
    const double up = (1 + g[0] * exp(g[1] / w[2])) / (1 + g[0] * exp(g[1]));
    const double around =
        1 + f[0] * (exp(f[1] * x) - exp(f[1] * M_PI / 2)) + f[2] * cos(x) * cos(x);
    const double there =
        1 + f[0] * (exp(f[1] * zs) - exp(f[1] * M_PI / 2)) + f[2] * cos(zs) * cos(zs);
    return up * around / there;
}

/* Int L max(0, w . n) dw at Lz = 1. */
static double illuminance(int type, const double n[3])
{
    enum { Z = 600, A = 1200 };
    double sum = 0;
    for (int i = 0; i < Z; i++)
        for (int j = 0; j < A; j++) {
            const double z = (i + .5) / Z, r = sqrt(1 - z * z),
                         a = (j + .5) * 2 * M_PI / A;
            const double w[3] = {r * cos(a), r * sin(a), z};
            sum += relative(type, w) * fmax(0, w[0] * n[0] + w[1] * n[1] + w[2] * n[2]);
        }
    return sum * 2 * M_PI / (Z * A);
}

static void skies(void)
{
    static const double up[3] = {0, 0, 1}, side[3] = {.6, .8, 0};
    for (int type = 1; type <= 16; type++) {
        char xml[2048];
        snprintf(xml, sizeof xml,
                 HEAD
                 "<emitter type='ciesky'><integer name='sky' value='%d'/><float "
                 "name='zenith' value='3000'/><vector name='sun_direction' x='.6' y='0' "
                 "z='.8'/></emitter>" METER("") METER("<vector name='facing' x='3' y='4' "
                                                      "z='0'/>") "</scene>",
                 type);
        imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
        const enum imp_from from = type % 4 ? IMP_FROM_SENSOR : IMP_FROM_LIGHTS;
        for (int k = 0; k < 2; k++) {
            const struct imp_estimate e = read_meter(ctx, s, k, from);
            const double truth = 3000 * illuminance(type, k ? side : up);
            tap_ok(fabs(e.value - truth) < 4.5 * e.se + 1e-4 * truth &&
                       e.se < .01 * truth,
                   "type %d, %s: %.1f +- %.1f lx of %.1f", type,
                   k ? "vertical" : "horizontal", e.value, e.se, truth);
        }
        imp_scene_destroy(s);
    }
    tap_near(illuminance(16, up), 7 * M_PI / 9, 1e-5, 0,
             "overcast: 7 pi/9 of the zenith");
}

/* Below a black plane with a round hole seen under the angle t from the zenith, an overcast sky of E
 * gives 3/7 (sin^2 t + 4/3 (1 - cos^3 t)) E: the sky component of the daylight factor. */
static void factor(void)
{
    const double t = M_PI / 6;
    char xml[4096];
    snprintf(
        xml, sizeof xml,
        HEAD
        "<emitter type='ciesky'><float name='illuminance' value='10000'/></emitter>"
        "<shape type='cylinder'><point name='p0' x='0' y='0' z='0'/><point name='p1' "
        "x='0' y='0' z='%.9g'/><float name='radius' value='1'/><boolean "
        "name='flip_normals' value='true'/><bsdf type='diffuse'><rgb "
        "name='reflectance' value='0'/></bsdf></shape><shape type='rectangle'>"
        "<transform name='to_world'><scale value='.001'/></transform><sensor "
        "type='irradiancemeter'><boolean name='virtual' value='true'/><string "
        "name='units' value='photometric'/><film type='hdrfilm'><integer name='width' "
        "value='1'/><integer name='height' value='1'/></film></sensor></shape></scene>",
        1 / tan(t));
    imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
    const struct imp_estimate e = read_meter(ctx, s, 0, IMP_FROM_SENSOR);
    const double c = cos(t),
                 truth = 10000 * 3 / 7. * (1 - c * c + 4 / 3. * (1 - c * c * c));
    tap_ok(fabs(e.value - truth) < 4.5 * e.se && e.se < .02 * truth,
           "daylight factor %.3f %% +- %.3f, of %.3f", e.value / 100, e.se / 100,
           truth / 100);
    imp_scene_destroy(s);
}

static void refused(void)
{
    static const char *const rows[][2] = {
        {"<integer name='sky' value='17'/>", "sky"},
        {"<integer name='sky' value='12'/><vector name='sun_direction' x='1' y='0' "
         "z='-1'/>",
         "below the horizon"},
        {"<float name='zenith' value='1'/><float name='illuminance' value='1'/>",
         "give one of them"}};
    for (int k = 0; k < 3; k++) sky_refused(ctx, "ciesky", rows[k][0], rows[k][1]);
}

int main(void)
{
    ctx = test_context(0);
    skies();
    factor();
    refused();
    imp_context_destroy(ctx);
    return tap_done();
}

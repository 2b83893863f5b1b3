/* SPDX-License-Identifier: Apache-2.0
 *
 * Perez' sky: one in each of the eight bins of clearness, horizontal and vertical illuminances
 * by walks against an integral over the formula written again here, with the table by rows
 * (Perez, Seals and Michalsky 1993, table 1); what is refused. */
#include "sky_kit.h"
#include <math.h>

static imp_context *ctx;

static const double table[8][20] = {
    {1.3525,  -0.2576, -0.2690, -1.4366, -0.7670, 0.0007, 1.2734,
     -0.1233, 2.8000,  0.6004,  1.2375,  1.000,   1.8734, 0.6297,
     0.9738,  0.2809,  0.0356,  -0.1246, -0.5718, 0.9938},
    {-1.2219, -0.7730, 1.4148, 1.1016, -0.2054, 0.0367,  -3.9128,
     0.9156,  6.9750,  0.1774, 6.4477, -0.1239, -1.5798, -0.5081,
     -1.7812, 0.1080,  0.2624, 0.0672, -0.2190, -0.4285},
    {-1.1000, -0.2515, 0.8952,   0.0156,   0.2782,  -0.1812, -4.5000,
     1.1766,  24.7219, -13.0812, -37.7000, 34.8438, -5.0000, 1.5218,
     3.9229,  -2.6204, -0.0156,  0.1597,   0.4199,  -0.5562},
    {-0.5484, -0.6654, -0.2672,  0.7117,   0.7234,  -0.6219, -5.6812,
     2.6297,  33.3389, -18.3000, -62.2500, 52.0781, -3.5000, 0.0016,
     1.1477,  0.1062,  0.4659,   -0.3296,  -0.0876, -0.0329},
    {-0.6000, -0.3566, -2.5000, 2.3250,   0.2937,  0.0496,  -5.6812,
     1.8415,  21.0000, -4.7656, -21.5906, 7.2492,  -3.5000, -0.1554,
     1.4062,  0.3988,  0.0032,  0.0766,   -0.0656, -0.1294},
    {-1.0156, -0.3670, 1.0078,  1.4051,  0.2875, -0.5328, -3.8500,
     3.3750,  14.0000, -0.9999, -7.1406, 7.5469, -3.4000, -0.1078,
     -1.0750, 1.5702,  -0.0672, 0.4016,  0.3017, -0.4844},
    {-1.0000, 0.0211,  0.5025,  -0.5119, -0.3000, 0.1922,  0.7023,
     -1.6317, 19.0000, -5.0000, 1.2438,  -1.9094, -4.0000, 0.0250,
     0.3844,  0.2656,  1.0468,  -0.3788, -2.4517, 1.4656},
    {-1.0500, 0.0289,  0.4260,   0.3590,   -0.3250, 0.1156,  0.7781,
     0.0025,  31.0625, -14.5000, -46.1148, 55.3750, -7.2312, 0.4050,
     13.3500, 0.6234,  1.5000,   -0.6426,  1.8564,  0.5636}};
static const double sun[3] = {.6, 0, .8};

/* f(x) g(Z) of the sky of (diffuse, direct) in W/m^2. */
static double relative(double diffuse, double direct, const double w[3], int *bin)
{
    static const double upper[8] = {1.065, 1.23, 1.5, 1.95, 2.8, 4.5, 6.2, INFINITY};
    const double Z = acos(sun[2]), k = 1.041 * pow(Z, 3);
    const double epsilon = ((diffuse + direct) / diffuse + k) / (1 + k);
    const double m = 1 / (sun[2] + .15 * pow(93.885 - Z * 180 / M_PI, -1.253));
    double delta = m * diffuse / 1367, n[5];
    for (*bin = 0; epsilon >= upper[*bin];) ++*bin;
    if (*bin >= 1 && *bin <= 4 && delta < .2) delta = .2;
    const double *t = table[*bin];
    for (int i = 0; i < 5; i++)
        n[i] = t[4 * i] + t[4 * i + 1] * Z + delta * (t[4 * i + 2] + t[4 * i + 3] * Z);
    if (*bin == 0) {
        n[2] = exp(pow(delta * (t[8] + t[9] * Z), t[10])) - t[11];
        n[3] = t[14] + delta * t[15] - exp(delta * (t[12] + t[13] * Z));
    }
    const double c = w[0] * sun[0] + w[1] * sun[1] + w[2] * sun[2];
    const double f = 1 + n[2] * exp(n[3] * acos(fmin(c, 1))) + n[4] * c * c;
    return fmax(f * (1 + n[0] * exp(n[1] / w[2])), 0);
}

/* Int f g max(0, w . n) dw */
static double integral(double diffuse, double direct, const double n[3], int *bin)
{
    enum { Z = 600, A = 1200 };
    double sum = 0;
    for (int i = 0; i < Z; i++)
        for (int j = 0; j < A; j++) {
            const double z = (i + .5) / Z, r = sqrt(1 - z * z),
                         a = (j + .5) * 2 * M_PI / A;
            const double w[3] = {r * cos(a), r * sin(a), z};
            sum += relative(diffuse, direct, w, bin) *
                   fmax(0, w[0] * n[0] + w[1] * n[1] + w[2] * n[2]);
        }
    return sum * 2 * M_PI / (Z * A);
}

static void skies(void)
{
    static const double up[3] = {0, 0, 1}, side[3] = {.6, .8, 0};
    static const double weather[8][2] = {{210, 0},   {300, 60},  {250, 130}, {220, 220},
                                         {180, 300}, {150, 480}, {140, 740}, {90, 850}};
    for (int k = 0; k < 8; k++) {
        const double *w = weather[k];
        int bin;
        char xml[2048];
        snprintf(xml, sizeof xml,
                 HEAD "<emitter type='perezsky'><float name='diffuse' value='%g'/><float "
                      "name='direct' value='%g'/>%s<vector name='sun_direction' x='.6' "
                      "y='0' z='.8'/></emitter>" METER("")
                          METER("<vector name='facing' "
                                "x='3' y='4' z='0'/>") "</scene>",
                 w[0], w[1], k % 2 ? "<float name='illuminance' value='20000'/>" : "");
        imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
        const double level = k % 2 ? 20000 : w[0], all = integral(w[0], w[1], up, &bin);
        tap_ok(bin == k, "%g and %g W/m^2: bin %d", w[0], w[1], bin + 1);
        for (int m = 0; m < 2; m++) {
            const struct imp_estimate e = read_meter(ctx, s, m, IMP_FROM_SENSOR);
            const double truth = level * (m ? integral(w[0], w[1], side, &bin) / all : 1);
            tap_ok(fabs(e.value - truth) < 4.5 * e.se + 2e-4 * truth &&
                       e.se < .01 * truth,
                   "%s: %.2f +- %.2f of %.2f", m ? "vertical" : "horizontal", e.value,
                   e.se, truth);
        }
        imp_scene_destroy(s);
    }
}

static void refused(void)
{
    static const char *const rows[][2] = {
        {"<float name='diffuse' value='100'/>", "direct"},
        {"<float name='direct' value='100'/>", "diffuse"},
        {"<float name='diffuse' value='0'/><float name='direct' value='100'/>",
         "diffuse"},
        {"<float name='diffuse' value='9'/><float name='direct' value='9'/><vector "
         "name='sun_direction' x='1' y='0' z='-1'/>",
         "below the horizon"}};
    for (int k = 0; k < 4; k++) sky_refused(ctx, "perezsky", rows[k][0], rows[k][1]);
}

int main(void)
{
    ctx = test_context(0);
    skies();
    refused();
    imp_context_destroy(ctx);
    return tap_done();
}

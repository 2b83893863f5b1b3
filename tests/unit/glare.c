/* SPDX-License-Identifier: Apache-2.0
 *
 * Guth's position index against four rows of the table of CIE 117-1995, and glare
 * ratings against the formula worked by hand, from numbers and from a scene. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/rooms.h>
#include <math.h>

static imp_context *ctx;

/* Index of a source at T/R aside and H/R above. */
static double position(double t, double h)
{
    return imp_guth_position(atan2(t, h) * 180 / M_PI, atan(hypot(t, h)) * 180 / M_PI);
}

static void positions(void)
{
    static const struct {
        double t; /* T/R; H/R goes up by tenths from 0 */
        int n;
        double p[20];
    } row[] = {
        {0,
         18,
         {1.00, 1.26, 1.53, 1.90, 2.35, 2.86, 3.50, 4.20, 5.00, 6.00, 7.00, 8.10, 9.25,
          10.35, 11.70, 13.15, 14.70, 16.20}},
        {.5,
         19,
         {1.43, 1.60, 1.82, 2.10, 2.48, 2.91, 3.40, 3.98, 4.70, 5.50, 6.40, 7.30, 8.30,
          9.40, 10.50, 11.75, 13.00, 14.40, 15.70}},
        {1, 20, {2.11, 2.40, 2.75, 3.10, 3.50,  3.91,  4.40,  5.00,  5.60,  6.20,
                 7.00, 7.90, 8.80, 9.75, 10.80, 11.90, 12.95, 14.00, 15.00, 16.00}},
        {2, 20, {3.50, 4.00, 4.50,  4.90,  5.35,  5.80,  6.40,  7.10,  7.70,  8.30,
                 8.90, 9.60, 10.40, 11.10, 12.00, 12.85, 13.60, 14.30, 15.10, 16.00}}};
    double worst = 0, between = 0, step = 0;
    for (size_t r = 0; r < sizeof row / sizeof *row; r++)
        for (int k = 0; k < row[r].n; k++) {
            worst = fmax(worst, fabs(position(row[r].t, k / 10.) / row[r].p[k] - 1));
            if (k + 1 < row[r].n)
                between = fmax(between, fabs(position(row[r].t, (k + .5) / 10) /
                                                 (row[r].p[k] + row[r].p[k + 1]) * 2 -
                                             1));
        }
    tap_ok(worst < 1e-9, "position indices of CIE 117: within %.1e", worst);
    tap_ok(between < .02, "and between them: within %.1f %% of their means",
           100 * between);
    for (int i = 0; i < 400; i++)
        for (int k = 0; k < 300; k++) {
            const double here = position(i * .01, k * .01);
            step = fmax(step, fabs(log(position((i + 1) * .01, k * .01) / here)));
            step = fmax(step, fabs(log(position(i * .01, (k + 1) * .01) / here)));
        }
    tap_ok(step < .03, "without jumps: %.3f at most within .01", step);
    tap_ok(imp_guth_position(90, 0) == 1 && isnan(imp_guth_position(-1, 0)) &&
               isnan(imp_guth_position(0, 91)) && isfinite(imp_guth_position(0, 90)),
           "angles out of their range");
}

static void formula(void)
{
    /* .25/25 (10000^2 x .002/4 + 5000^2 x .004/1) = .01 x 150000 = 1500: 8 log10 = 25.409 */
    const struct imp_glare_source s[] = {{10000, .002, 2}, {5000, .004, 1}};
    double ugr;
    test_must(ctx, imp_ugr(ctx, 25, 2, s, &ugr));
    tap_near(ugr, 25.40873, 1e-6, 0, "two sources");
    test_must(ctx, imp_ugr(ctx, 25, 0, NULL, &ugr));
    tap_ok(isinf(ugr) && ugr < 0, "none");
    const struct imp_glare_source bad = {-1, 1, 1};
    tap_ok(imp_ugr(ctx, 0, 1, s, &ugr) == IMP_E_ARG &&
               imp_ugr(ctx, 1, 1, &bad, &ugr) == IMP_E_ARG,
           "no background, a negative luminance");
}

/* Luminous disks across the ray from the eye, worked by hand with the position indices of CIE 117's
 * table: above the line of sight by H, aside by T, at distance R along it. */
static void disks(void)
{
    static const struct {
        double T, H, R, area, luminance; /* m, m^2, cd/m^2 */
        size_t n;                        /* so many, one like the other */
        double background, ugr;
    } rows[] = {
        /* H/R = .2, p = 1.53; w = .04/16.64: .25/40 x 15000^2 x .0024038/2.3409 = 1444.1 */
        {0, .8, 4, .04, 15000, 1, 40, 25.28},
        /* .5, 2.86; .1/20: .25/25 x 4 x 6000^2 x .005/8.1796 = 880.2 */
        {0, 2, 4, .1, 6000, 4, 25, 23.56},
        /* .3, 1.90; .3/27.25: .25/60 x 6 x 3000^2 x .011009/3.61 = 686.2 */
        {0, 1.5, 5, .3, 3000, 6, 60, 22.69},
        /* T/R = 1, H/R = .5, 3.91; .1/36: .25/30 x 2 x 8000^2 x .0027778/15.288 = 193.81 */
        {4, 2, 4, .1, 8000, 2, 30, 18.30},
        /* 1.5, .3, 4.10; .3/83.5: .25/50 x 12000^2 x .0035928/16.81 = 153.89 */
        {7.5, 1.5, 5, .3, 12000, 1, 50, 17.50}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        struct imp_glare_source s[6];
        const double T = rows[k].T, H = rows[k].H, R = rows[k].R;
        double ugr;
        for (size_t i = 0; i < rows[k].n; i++)
            s[i] = (struct imp_glare_source){rows[k].luminance,
                                             rows[k].area / (T * T + R * R + H * H),
                                             position(T / R, H / R)};
        test_must(ctx, imp_ugr(ctx, rows[k].background, rows[k].n, s, &ugr));
        tap_near(ugr, rows[k].ugr, .01, 0, "disks by hand");
    }
}

#define LAMP(name, y, more)                                                              \
    "<emitter type='ies' id='" name "'><string name='filename' value='" IMP_SCENES       \
    "/lamps/opal.ldt'/>" more "<transform name='to_world'><rotate x='1' angle='180'/>"   \
    "<translate y='" y "' z='2.7'/></transform></emitter>"
/* Two observers at (-1, 0, 1.2) and (1, 0, 1.2), who look along y under a sky of 20 cd/m^2. */
#define EYES(facing)                                                                     \
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "          \
    "value='2'/></integrator><emitter type='constant'><rgb name='radiance' value='20'/>" \
    "</emitter><shape type='rectangle'><transform name='to_world'><scale x='2'/>"        \
    "<translate z='1.2'/></transform><sensor type='irradiancemeter' id='eyes'><boolean " \
    "name='virtual' value='true'/><string name='at' value='points'/>" facing             \
    "<string name='units' value='photometric'/><film type='hdrfilm'><integer "           \
    "name='width' value='2'/><integer name='height' value='1'/></film></sensor></shape>"
#define SIGHT "<vector name='facing' x='0' y='1' z='0'/>"

/* By hand: opening 1.15 m x .28 m, 4000 lm of a cosine. d = (1, 3, 1.5) from the eye. */
static double by_hand(double background, double dimming)
{
    const double r2 = 1 + 9 + 2.25, r = sqrt(r2), cosine = 1.5 / r;
    const double area = 1.15 * .28 * cosine, intensity = dimming * 4000 / M_PI * cosine;
    const double a = atan2(1, 1.5) * 180 / M_PI, b = acos(3 / r) * 180 / M_PI;
    const double p = imp_guth_position(a, b), l = intensity / area;
    return 8 * log10(.25 / background * l * l * area / r2 / (p * p));
}

static void scenes(void)
{
    static const struct {
        const char *what, *rest;
        double dimming; /* 0: nothing is seen */
    } rows[] = {
        {"a luminaire", LAMP("a", "3", ""), 1},
        {"dimmed", LAMP("a", "3", "<float name='dimming' value='.25'/>"), .25},
        {"behind the observer", LAMP("a", "-3", ""), 0},
        {"hidden",
         LAMP("a", "3", "") "<shape type='sphere'><transform name='to_world'><scale "
                            "value='.2'/><translate y='2.9' z='2.6'/></transform>"
                            "<bsdf type='diffuse'><rgb name='reflectance' value='0'/>"
                            "</bsdf></shape>",
         0}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        char xml[4096];
        struct imp_run run = IMP_RUN_INIT;
        double ugr[2], se[2];
        snprintf(xml, sizeof xml, EYES(SIGHT) "%s</scene>", rows[k].rest);
        imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
        run.spp = 65536;
        test_must(ctx, imp_grid_glare(s, &run, ugr, se));
        const double truth =
            rows[k].dimming > 0 ? by_hand(20, rows[k].dimming) : -INFINITY;
        for (int e = 0; e < 2; e++)
            tap_ok(truth == ugr[e] ||
                       (fabs(ugr[e] - truth) < .2 && se[e] > 0 && se[e] < .05),
                   "%s, observer %d: %.3f +- %.3f, by hand %.3f", rows[k].what, e, ugr[e],
                   se[e], truth);
        imp_scene_destroy(s);
    }
}

/* A cosine of 1000 cd below the horizon, `above` behind it; 1.15 m x .28 m, and so high. */
static void table_write(double above, double height)
{
    FILE *f = fopen("glare_box.ies", "w");
    if (!f) exit(99);
    fprintf(f, "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 181 1 1 2 .28 1.15 %g\n1 1 0\n",
            height);
    for (int v = 0; v <= 180; v++) fprintf(f, "%d\n", v);
    fputs("0\n", f);
    for (int v = 0; v <= 180; v++)
        fprintf(f, "%.9g\n", v <= 90 ? 1000 * cos(v * M_PI / 180) : above);
    fclose(f);
}

/* Boxes at z from 2.7 - height to 2.7, seen as their middles; nothing of the box is what hides it. */
static void boxes(void)
{
    static const struct {
        const char *what, *rest;
        double above, given, height; /* height 0: nothing is seen */
    } rows[] = {{"a box", "", 0, .1, .1},
                {"a box of 1 cm", "", 100, 0, .01},
                {"a box that is hidden",
                 "<shape type='sphere'><transform name='to_world'><scale value='.2'/>"
                 "<translate y='2.6' z='2.4'/></transform><bsdf type='diffuse'><rgb "
                 "name='reflectance' value='0'/></bsdf></shape>",
                 0, .1, 0}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        char xml[4096];
        struct imp_run run = IMP_RUN_INIT;
        double ugr[2], se[2];
        table_write(rows[k].above, rows[k].given);
        snprintf(xml, sizeof xml,
                 EYES(SIGHT) "<emitter type='ies' id='a'><string name='filename' "
                             "value='glare_box.ies'/><boolean name='opening' "
                             "value='true'/><transform name='to_world'><rotate x='1' "
                             "angle='180'/><translate y='3' z='2.7'/></transform>"
                             "</emitter>%s</scene>",
                 rows[k].rest);
        imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
        run.spp = 65536;
        test_must(ctx, imp_grid_glare(s, &run, ugr, se));
        imp_scene_destroy(s);
        const double h = rows[k].height, up = 1.5 - h / 2, r2 = 10 + up * up,
                     r = sqrt(r2);
        const double area = (1.15 * .28 * up + h * (1.15 * 3 + .28)) / r,
                     L = 1000 * up / r / area;
        const double p =
            imp_guth_position(atan2(1, up) * 180 / M_PI, acos(3 / r) * 180 / M_PI);
        const double truth =
            h > 0 ? 8 * log10(.25 / 20 * L * L * area / r2 / (p * p)) : -INFINITY;
        for (int e = 0; e < 2; e++)
            tap_ok(truth == ugr[e] ||
                       (fabs(ugr[e] - truth) < .1 && se[e] > 0 && se[e] < .05),
                   "%s, observer %d: %.3f +- %.3f, by hand %.3f", rows[k].what, e, ugr[e],
                   se[e], truth);
    }
}

/* ---- Tables -------------------------------------------------------------------------- */

/* From a rectangle of x by y to the one opposite at distance 1, by quadrature. */
static double opposite(double x, double y)
{
    enum { N = 24 };
    double sum = 0;
    for (int a = 0; a < N; a++)
        for (int b = 0; b < N; b++)
            for (int c = 0; c < N; c++)
                for (int d = 0; d < N; d++) {
                    const double u = x * (a - c) / N, v = y * (b - d) / N,
                                 r2 = 1 + u * u + v * v;
                    sum += x * y / (M_PI * r2 * r2);
                }
    return sum / ((double)N * N * N * N);
}

/* Of a cosine of 4000 lm (its table has .07 % less) with an opening of 1.15 m x .28 m: the
 * ceiling shines alike all over, so that the floor has the form factor of its light. Equations of
 * three surfaces by Cramer's rule. */
static double table_by_hand(double x, double y, double spacing, const double rho[3])
{
    const double F = opposite(x, y), level = x * y, walls = 2 * (x + y),
                 area = 1.15 * .28;
    const int columns = (int)lround(x / spacing), rows = (int)lround(y / spacing);
    const double flux = 4000. * columns * rows, back = (1 - F) * level / walls;
    /* f = e_f + (1 - F) r_w w + F r_c c; w = e_w + back (r_f f + r_c c) + (1 - 2 back) r_w w;
     * c = F r_f f + (1 - F) r_w w */
    const double m[3][3] = {{1, -(1 - F) * rho[1], -F * rho[0]},
                            {-back * rho[2], 1 - (1 - 2 * back) * rho[1], -back * rho[0]},
                            {-F * rho[2], -(1 - F) * rho[1], 1}};
    const double e[3] = {flux * F / level, flux * (1 - F) / walls, 0};
    double det = 0, top = 0;
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        det += m[0][k] * (m[1][i] * m[2][j] - m[1][j] * m[2][i]);
        const double w[3][3] = {
            {m[0][0], e[0], m[0][2]}, {m[1][0], e[1], m[1][2]}, {m[2][0], e[2], m[2][2]}};
        top += w[0][k] * (w[1][i] * w[2][j] - w[1][j] * w[2][i]);
    }
    const double background = (top / det - e[1]) / M_PI, L = 4000 / (M_PI * area);
    double sum = 0;
    for (int i = 0; i < columns; i++)
        for (int j = 0; j < rows; j++) {
            const double T = fabs((i + .5) * spacing - x / 2), R = (j + .5) * spacing;
            const double r = sqrt(T * T + R * R + 1);
            if (T > 3 * R || acos(1 / r) > 85 * M_PI / 180) continue;
            const double p =
                imp_guth_position(atan(T) * 180 / M_PI, acos(R / r) * 180 / M_PI);
            sum += L * L * area / r / (r * r) / (p * p);
        }
    return 8 * log10(.25 / background * sum);
}

static void tables(void)
{
    static const struct {
        int room;
        double x, y, spacing;
    } rows[] = {{0, 2, 2, .25}, {10, 4, 8, .25}, {10, 4, 8, 1}, {6, 4, 2, .5}};
    imp_scene *s = NULL;
    test_must(ctx, imp_scene_load(ctx, IMP_SCENES "/lamps/opal.ldt", NULL, &s));
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        struct imp_glare_table_options o = IMP_GLARE_TABLE_OPTIONS_INIT;
        struct imp_glare_table t = IMP_GLARE_TABLE_INIT;
        double worst = 0;
        o.size = sizeof o;
        o.spacing = rows[k].spacing;
        o.flux = 4000;
        t.size = sizeof t;
        test_must(ctx, imp_luminaire_glare_table(s, 0, &o, &t));
        for (int set = 0; set < IMP_GLARE_SETS; set++)
            for (int turned = 0; turned < 2; turned++)
                worst =
                    fmax(worst, fabs(t.ugr[rows[k].room][turned][set] -
                                     table_by_hand(rows[k].x, rows[k].y, rows[k].spacing,
                                                   t.reflectance[set])));
        tap_ok(worst < .02, "table of a cosine, %gH x %gH, spacing %g: within %.4f",
               rows[k].x, rows[k].y, rows[k].spacing, worst);
    }
    struct imp_glare_table t = IMP_GLARE_TABLE_INIT, one = IMP_GLARE_TABLE_INIT;
    struct imp_glare_table_options o = IMP_GLARE_TABLE_OPTIONS_INIT;
    t.size = sizeof t;
    one.size = sizeof one;
    o.size = sizeof o;
    test_must(ctx, imp_luminaire_glare_table(s, 0, NULL, &t));
    o.flux = 1000;
    test_must(ctx, imp_luminaire_glare_table(s, 0, &o, &one));
    tap_ok(fabs(t.ugr[3][1][2] - one.ugr[3][1][2] - 8 * log10(t.flux / 1000)) < 1e-9,
           "the correction for the flux, 8 log10(%.1f/1000)", t.flux);
    o.spacing = 3;
    tap_ok(imp_luminaire_glare_table(s, 0, &o, &t) == IMP_E_ARG &&
               imp_luminaire_glare_table(s, 1, NULL, &t) == IMP_E_ARG,
           "a spacing of 3, a luminaire that is not there");
    imp_scene_destroy(s);
    /* Its lobes are across its length, which LM-63 has along C0. */
    test_must(ctx, imp_scene_load(ctx, IMP_SCENES "/lamps/batwing.ies", NULL, &s));
    test_must(ctx, imp_luminaire_glare_table(s, 0, NULL, &t));
    tap_ok(t.ugr[8][0][0] > t.ugr[8][1][0] + 1, "bat wings: %.1f across, %.1f along",
           t.ugr[8][0][0], t.ugr[8][1][0]);
    imp_scene_destroy(s);
    test_must(ctx, imp_scene_load(ctx, IMP_SCENES "/lamps/downlight.ies", NULL, &s));
    tap_ok(imp_luminaire_glare_table(s, 0, NULL, &t) == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "no luminous area"),
           "%s", imp_last_error(ctx));
    imp_scene_destroy(s);
}

static void refused(void)
{
    static const char *const facing[] = {"", "<vector name='facing' x='0' y='1' z='1'/>"};
    for (int k = 0; k < 2; k++) {
        char xml[4096];
        double ugr[2];
        snprintf(xml, sizeof xml, EYES("%s") LAMP("a", "3", "") "</scene>", facing[k]);
        imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
        tap_ok(imp_grid_glare(s, NULL, ugr, NULL) == IMP_E_ARG &&
                   strstr(imp_last_error(ctx), "no line of sight"),
               "%s", imp_last_error(ctx));
        imp_scene_destroy(s);
    }
    char xml[4096];
    double ugr[2];
    snprintf(xml, sizeof xml,
             EYES(SIGHT) "<emitter type='ies' id='spot'><string name='filename' "
                         "value='" IMP_SCENES "/lamps/downlight.ies'/><transform "
                         "name='to_world'><rotate x='1' angle='180'/><translate y='3' "
                         "z='2.7'/></transform></emitter></scene>");
    imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
    tap_ok(imp_grid_glare(s, NULL, ugr, NULL) == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "'spot' has no luminous area"),
           "%s", imp_last_error(ctx));
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(0);
    positions();
    formula();
    disks();
    scenes();
    boxes();
    tables();
    refused();
    imp_context_destroy(ctx);
    return tap_done();
}

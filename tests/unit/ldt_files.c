/* SPDX-License-Identifier: Apache-2.0
 *
 * EULUMDAT files: every symmetry against the function of C and gamma that it was made of, what is
 * damaged, and luminaires in operation; types A and B of LM-63 against their directions. */
#include "format/ies_file.h"
#include "format/ldt_file.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "kind/emitter/ies.h"
#include "math/rng.h"
#include "scene/scene.h"
#include <importon/rooms.h>
#include <math.h>
#include <stdarg.h>

static imp_context *ctx;
static char text[65536];
static size_t used;

static void put(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    used += (size_t)vsnprintf(text + used, sizeof text - used, format, args);
    va_end(args);
}

static enum imp_status parse(struct imp_arena *keep, struct imp_ies_data *d)
{
    const struct imp_bytes b = {(unsigned char *)text, used, used};
    return imp__ldt_parse(ctx, keep, "l.ldt", &b, d);
}

/* ---- Symmetries ----------------------------------------------------------------------- */

enum { PLANES = 8, ANGLES = 5 };
static const double gammas[ANGLES] = {0, 20, 45, 70, 90};

/* Intensity at a plane k of 8 and angle i, with the symmetry; cd/klm. */
static double table(int symmetry, int k, int i)
{
    k = ((k % 8) + 8) % 8;
    if (symmetry == 1) k = 0;
    if (symmetry == 2 || symmetry == 4) k = k > 4 ? 8 - k : k;
    if (symmetry == 3 || symmetry == 4) { /* about C90 (2) and C270 (6) */
        const int mirrored = ((4 - k) % 8 + 8) % 8;
        k = symmetry == 4 ? (k > 2 ? 4 - k : k) : (k > 2 && k < 6 ? mirrored : k);
    }
    return 100 + 31 * ((k * 5) % 8) + 7 * i * (k + 1);
}

static void write(int symmetry, double flux, double factor)
{
    static const int first[] = {0, 0, 0, 6, 0}, n[] = {8, 1, 5, 5, 3};
    used = 0;
    put("importon\n3\n%d\n8\n45\n5\n0\nr\nname\n1\nf\nd\n1200\n300\n60\n1150\n280\n0\n0\n"
        "0\n0\n100\n0\n%g\n0\n1\n2\nLED\n%g\n4000\n80\n25,5\n",
        symmetry, factor, flux);
    for (int k = 0; k < 10; k++) put("0\n");
    for (int k = 0; k < 8; k++) put("%d\n", 45 * k);
    for (int i = 0; i < ANGLES; i++) put("%g\n", gammas[i]);
    for (int k = 0; k < n[symmetry]; k++)
        for (int i = 0; i < ANGLES; i++)
            put("%g\n", table(symmetry, first[symmetry] + k, i));
}

static struct imp__ies lamp_of(const struct imp_ies_data *d)
{
    return (struct imp__ies){.nadir = imp__v3(0, 0, 1),
                             .c0 = imp__v3(1, 0, 0),
                             .c90 = imp__v3(0, -1, 0),
                             .data = d,
                             .factor = 1};
}
static imp_v3 along(double v, double h)
{
    v *= IMP_PI / 180, h *= IMP_PI / 180;
    return imp__v3(sin(v) * cos(h), -sin(v) * sin(h), cos(v));
}

static void symmetries(void)
{
    for (int s = 0; s <= 4; s++) {
        struct imp_arena keep;
        struct imp_ies_data d;
        double worst = 0;
        imp__arena_init(&keep, ctx);
        write(s, 2000, 1.5);
        test_must(ctx, parse(&keep, &d));
        const struct imp__ies x = lamp_of(&d);
        for (int k = 0; k < 8; k++)
            for (int i = 1; i < ANGLES; i++) {
                const double truth = 3 * table(s, k, i);
                worst = fmax(
                    worst,
                    fabs(imp__ies_intensity(&x, along(gammas[i], 45 * k)) / truth - 1));
                /* Between planes, linear. */
                const double half = 1.5 * (table(s, k, i) + table(s, k + 1, i));
                worst = fmax(
                    worst,
                    fabs(imp__ies_intensity(&x, along(gammas[i], 45 * k + 22.5)) / half -
                         1));
            }
        tap_ok(worst < 1e-9 && imp__ies_is_valid(&d) && d.watts == 25.5 &&
                   d.lamp_flux == 2000 && d.size[0] == .28 && d.size[1] == 1.15,
               "symmetry %d: %.1e", s, worst);
        imp__arena_free(&keep);
    }
}

/* ---- Damage --------------------------------------------------------------------------- */

/* Line `line` of a good file replaced. */
static void damage(int line, const char *by)
{
    char copy[sizeof text], *at = copy;
    write(4, 1000, 1);
    memcpy(copy, text, used);
    copy[used] = 0;
    used = 0;
    for (int k = 1; *at; k++) {
        char *end = strchr(at, '\n');
        if (k == line) put("%s\n", by);
        else put("%.*s\n", (int)(end - at), at);
        at = end + 1;
    }
}

static void damaged(void)
{
    static const struct {
        int line;
        const char *by, *says;
    } rows[] = {{3, "5", "l.ldt:3: the symmetry is 5, not in [0, 4]"},
                {3, "x", "l.ldt:3: the symmetry: not a number"},
                {4, "7", "7 C-planes cannot have symmetry 4"},
                {4, "1e9", "l.ldt:4: the number of C-planes is 1e+09"},
                {6, "1", "l.ldt:6: the number of angles is 1"},
                {6, "30000", "x 30000 intensities, but the file has"},
                {13, "-1", "l.ldt:13: the length is -1"},
                {24, "nan", "l.ldt:24: the factor of the intensities"},
                {26, "0", "l.ldt:26: the number of sets of lamps is 0"},
                {29, "", "l.ldt:29: the flux of the lamps: not a number"},
                {44, "0", "l.ldt:44: a C-plane 0 does not come after 0"},
                {51, "95", "l.ldt:52: an angle 20 does not come after 95"},
                {45, "100", "the C-planes of symmetry 4"},
                {58, "-3", "l.ldt:58: an intensity is -3"}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        struct imp_arena keep;
        struct imp_ies_data d;
        imp__arena_init(&keep, ctx);
        damage(rows[k].line, rows[k].by);
        const enum imp_status st = parse(&keep, &d);
        tap_ok(st == IMP_E_SCENE && strstr(imp_last_error(ctx), rows[k].says), "%s",
               st == IMP_OK ? rows[k].says : imp_last_error(ctx));
        imp__arena_free(&keep);
    }
    write(4, 1000, 1);
    const size_t whole = used;
    int wrong = 0;
    for (size_t n = 0; n + 3 < whole; n++) {
        struct imp_arena keep;
        struct imp_ies_data d;
        imp__arena_init(&keep, ctx);
        used = n;
        wrong += parse(&keep, &d) != IMP_E_SCENE;
        imp__arena_free(&keep);
    }
    tap_ok(wrong == 0, "cut off anywhere: refused");
}

/* ---- Types A and B -------------------------------------------------------------------- */

static void types(void)
{
    static const double v[] = {-90, -30, 0, 30, 90}, h[] = {-90, -45, 0, 45, 90},
                        half[] = {0, 45, 90};
    double cd[25], of_half[15];
    for (int j = 0; j < 5; j++)
        for (int i = 0; i < 5; i++) cd[5 * j + i] = 100 + 13 * i + 7 * j * j;
    for (int j = 0; j < 3; j++) memcpy(of_half + 5 * j, cd + 5 * (j + 2), 5 * sizeof *cd);
    for (int type = IMP_PHOTOMETRY_B; type <= IMP_PHOTOMETRY_A; type++) {
        const struct imp_ies_data d = {.n_vertical = 5,
                                       .n_horizontal = 5,
                                       .vertical = v,
                                       .horizontal = h,
                                       .candela = cd,
                                       .type = (enum imp_photometry)type};
        const struct imp_ies_data s = {.n_vertical = 5,
                                       .n_horizontal = 3,
                                       .vertical = v,
                                       .horizontal = half,
                                       .candela = of_half,
                                       .type = (enum imp_photometry)type};
        const struct imp__ies x = lamp_of(&d), y = lamp_of(&s);
        const bool b = type == IMP_PHOTOMETRY_B;
        double worst = 0, flux = 0;
        for (int j = 1; j < 4; j++)
            for (int i = 1; i < 4; i++) {
                const double a = v[i] * IMP_PI / 180, t = h[j] * IMP_PI / 180;
                const imp_v3 n = x.nadir, c = x.c0, e = x.c90;
                const imp_v3 w = b ? (n * cos(a) + c * sin(a)) * cos(t) - e * sin(t)
                                   : (c * cos(t) - e * sin(t)) * cos(a) - n * sin(a);
                worst = fmax(worst, fabs(imp__ies_intensity(&x, w) - cd[5 * j + i]));
                worst = fmax(worst, fabs(imp__ies_intensity(&y, w) -
                                         cd[5 * (j < 2 ? 4 - j : j) + i]));
            }
        tap_ok(worst < 1e-9 && imp__ies_intensity(&x, b ? -x.nadir : -x.c0) == 0,
               "type %c: %.1e", b ? 'B' : 'A', worst);
        enum { N = 400000 };
        for (uint32_t k = 0; k < N; k++) {
            const double z = 2 * ((k + .5) / N) - 1,
                         phi = IMP_2PI * fmod(k * .6180339887498949, 1);
            const double r = sqrt(1 - z * z);
            flux += imp__ies_intensity(&x, imp__v3(r * cos(phi), r * sin(phi), z));
        }
        tap_near(imp__ies_flux(&x), flux * 4 * IMP_PI / N, 2e-3, 0, "its flux");
    }
}

/* ---- In a scene ----------------------------------------------------------------------- */

static void operation(void)
{
    static const struct {
        const char *more;
        double flux, efficacy, level;
    } rows[] = {
        {"", 4000, 125, 1},
        {"<float name='dimming' value='.5'/>", 2000, 125, .5},
        {"<float name='maintenance' value='.8'/><float name='flux' value='3000'/>", 2400,
         93.75, 1},
        {"<rgb name='scale' value='2'/>", 8000, 125, 2},
        {"<rgb name='scale' value='.5'/><float name='dimming' value='.5'/>", 1000, 125,
         .25},
        {"<rgb name='scale' value='0'/>", 0, 125, 0},
        {"<string name='units' value='radiometric'/>", 4000, 125, 1}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        char xml[1024];
        struct imp_luminaire_info l = {.size = sizeof l};
        snprintf(
            xml, sizeof xml,
            "<scene version='3.0.0'><emitter type='point'/><emitter type='ies' id='opal'>"
            "<string name='filename' value='" IMP_SCENES "/lamps/opal.ldt'/>%s"
            "<transform name='to_world'><translate x='1' y='2' z='3'/></transform>"
            "</emitter></scene>",
            rows[k].more);
        imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
        test_must(ctx, imp_scene_get_luminaire(s, 0, &l));
        /* A table of cos in steps of 5 degrees, linear between: 6e-4. */
        tap_ok(fabs(l.flux - rows[k].flux) <= 1.3e-3 * rows[k].flux &&
                   fabs(l.efficacy / rows[k].efficacy - 1) < 1.3e-3 && l.is_point &&
                   l.position[2] == 3 && l.watts == 32 &&
                   fabs(l.level - rows[k].level) < 1e-6 &&
                   fabs(l.power - 32 * rows[k].level) < 1e-4 &&
                   strcmp(l.name, "opal") == 0 && imp_scene_n_luminaires(s) == 1,
               "%s: %.2f lm, %.2f lm/W, %.2f W", rows[k].more, l.flux, l.efficacy,
               l.power);
        tap_ok(imp_scene_get_luminaire(s, 1, &l) == IMP_E_ARG &&
                   imp_scene_get_luminaire(s, -1, &l) == IMP_E_ARG,
               "no such luminaire");
        imp_scene_destroy(s);
    }
}

int main(void)
{
    ctx = test_context(1);
    symmetries();
    damaged();
    types();
    operation();
    imp_context_destroy(ctx);
    return tap_done();
}

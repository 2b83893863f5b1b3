/* SPDX-License-Identifier: Apache-2.0
 *
 * Luminaires at the openings of their files: a flat one of Lambert's law over a plane against
 * configuration factors, from both ends; boxes, which light as the table says from afar in any direction; the
 * same bits as the shape written by hand; and files that say nothing. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/rooms.h>
#include <math.h>

static imp_context *ctx;
enum { NX = 6, NY = 4, N = NX * NY };

/* Degree by degree: 1000 cd straight down; below the horizon by cos, or alike in all directions. Its
 * opening is 1.2 m along C0 and .6 m across. */
static void table_write(const char *name, bool lambert, const char *sizes)
{
    FILE *f = fopen(name, "w");
    if (!f) exit(99);
    const int n = lambert ? 91 : 181;
    fprintf(f, "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 %d 1 1 2 %s\n1 1 0\n", n, sizes);
    for (int v = 0; v < n; v++) fprintf(f, "%d\n", v);
    fputs("0\n", f);
    for (int v = 0; v < n; v++)
        fprintf(f, "%.9g\n", lambert ? 1000 * cos(v * M_PI / 180) : 1000);
    fclose(f);
}

#define AT                                                                               \
    "<rotate x='1' angle='180'/><rotate z='1' angle='30'/><translate x='.7' y='-.4' "    \
    "z='1'/>"
#define ROTATED "<rotate x='1' angle='180'/><rotate z='1' angle='30'/>"
#define FILE_OF(name)                                                                    \
    "<string name='filename' value='" name "'/><string name='units' "                    \
    "value='photometric'/>"
#define LAMP(name, more)                                                                 \
    "<emitter type='ies' id='lamp'>" FILE_OF(name) more "<transform name='to_world'>" AT \
                                                        "</transform></emitter>"
#define OPENING "<boolean name='opening' value='true'/>"

static void scene_text(char *xml, size_t size, const char *lamp)
{
    snprintf(xml, size,
             "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
             "value='2'/></integrator>%s<shape type='rectangle'><transform "
             "name='to_world'><scale x='3' y='2'/></transform><sensor "
             "type='irradiancemeter' id='grid'><boolean name='virtual' value='true'/>"
             "<string name='at' value='points'/><string name='units' "
             "value='photometric'/><film type='hdrfilm'><integer name='width' "
             "value='6'/><integer name='height' value='4'/></film></sensor></shape>"
             "</scene>",
             lamp);
}

static void read_of(const char *lamp, enum imp_from from, int64_t spp, double value[N],
                    double se[N], double at[3 * N])
{
    char xml[4096];
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate mean;
    run.spp = spp;
    run.from = from;
    scene_text(xml, sizeof xml, lamp);
    imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
    if (at) test_must(ctx, imp_grid_points(s, 0, at, NULL));
    test_must(ctx, imp_grid_read(s, &run, value, se, &mean, NULL));
    imp_scene_destroy(s);
}

/* Configuration factor of a rectangle a x b at the distance 1, seen from below its corner (Howell, B-3),
 * odd in both. */
static double corner(double a, double b)
{
    const double x = sqrt(1 + a * a), y = sqrt(1 + b * b);
    return (a / x * atan(b / x) + b / y * atan(a / y)) / (2 * M_PI);
}

/* E = pi L F, L = 1000 cd / area. */
static double truth_of(const double p[3])
{
    const double c = cos(M_PI / 6), s = sin(M_PI / 6), dx = p[0] - .7, dy = p[1] + .4;
    const double u = c * dx + s * dy, v = c * dy - s * dx;
    double F = 0;
    for (int i = -1; i <= 1; i += 2)
        for (int j = -1; j <= 1; j += 2) F += i * j * corner(.6 * i - u, .3 * j - v);
    return M_PI * 1000 / .72 * F;
}

static void flat(void)
{
    double value[N], se[N], at[3 * N], point[N], none[N], off = 0;
    table_write("lambert.ies", true, ".6 1.2 0");
    read_of(LAMP("lambert.ies", ""), IMP_FROM_SENSOR, 4, point, none, NULL);
    for (int end = 0; end < 2; end++) {
        double worst = 0, widest = 0;
        read_of(LAMP("lambert.ies", OPENING), end ? IMP_FROM_LIGHTS : IMP_FROM_SENSOR,
                end ? 200000 : 4096, value, se, at);
        for (int i = 0; i < N; i++) {
            const double truth = truth_of(at + 3 * i);
            /* The table's lines between degrees: 4e-5; the last half degree: more, of light that
             * no point receives. */
            worst = fmax(worst, (fabs(value[i] - truth) - 1e-4 * truth) / se[i]);
            widest = fmax(widest, se[i] / truth);
            off = fmax(off, fabs(point[i] / truth - 1));
        }
        tap_ok(worst < 3.5 && widest < (end ? .03 : 5e-3),
               "an opening over a plane, from the %s: worst %.2f, relative error %.1e",
               end ? "lights" : "sensor", worst, widest);
    }
    tap_ok(off > .08, "where the point is up to %.0f %% off", 100 * off);
}

/* At 400 m from its middle, where a box of 1.2 m has 1000 cd in each direction to 1.2/400. Of one without a
 * height, 1 cm thick, little is drawn on the sides. Here z points down, and boxes lie above z = 0. */
static void box(void)
{
    static const struct {
        const char *to_world, *what;
    } meter[] = {{"<translate z='-400'/>", "behind"},
                 {"<rotate x='1' angle='180'/><translate z='400'/>", "below"},
                 {"<rotate y='1' angle='-90'/><translate x='400'/>", "beside"}};
    static const char *const sizes[] = {".6 1.2 .3", ".6 1.2 0"};
    for (int k = 0; k < 2; k++) {
        table_write("alike.ies", false, sizes[k]);
        for (int m = 0; m < 3 - k; m++) {
            char xml[4096];
            struct imp_run run = IMP_RUN_INIT;
            struct imp_estimate mean;
            double value, se;
            snprintf(
                xml, sizeof xml,
                "<scene version='3.0.0'><integrator type='path'/><emitter type='ies' "
                "id='lamp'>" FILE_OF("alike.ies") OPENING
                "</emitter><shape type='rectangle'><transform name='to_world'><scale "
                "value='.01'/>%s<translate z='%g'/></transform><sensor "
                "type='irradiancemeter' id='m'>"
                "<boolean name='virtual' value='true'/><string name='at' "
                "value='points'/><string name='units' value='photometric'/><film "
                "type='hdrfilm'><integer name='width' value='1'/><integer "
                "name='height' value='1'/></film></sensor></shape></scene>",
                meter[m].to_world, k ? .005 : .15);
            imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
            run.spp = m < 2 ? 16384 : 65536;
            test_must(ctx, imp_grid_read(s, &run, &value, &se, &mean, NULL));
            imp_scene_destroy(s);
            const double truth = 1000. / (400 * 400);
            tap_ok(fabs(value - truth) < 3.5 * se + 1.5e-3 * truth && se < 6e-3 * truth,
                   "a box %s, from %s: %.4e +- %.1e of %.4e",
                   k ? "without a height" : "of .3 m", meter[m].what, value, se, truth);
        }
    }
}

static void by_hand(void)
{
    double value[N], se[N], own[N], own_se[N];
    read_of(LAMP("lambert.ies", OPENING), IMP_FROM_SENSOR, 64, value, se, NULL);
    read_of("<shape type='rectangle'><transform name='to_world'><scale x='.6' y='.3'/>" AT
            "</transform><bsdf type='diffuse'><rgb name='reflectance' value='0'/></bsdf>"
            "<emitter type='ies' id='lamp'>" FILE_OF(
                "lambert.ies") "<transform name='to_world'>" ROTATED
                               "</transform></emitter></shape>",
            IMP_FROM_SENSOR, 64, own, own_se, NULL);
    tap_ok(!memcmp(value, own, sizeof own) && !memcmp(se, own_se, sizeof se),
           "the same bits as a shape by hand");
    read_of(LAMP("lambert.ies", ""), IMP_FROM_SENSOR, 4, value, se, NULL);
    read_of(LAMP("lambert.ies", "<boolean name='opening' value='false'/>"),
            IMP_FROM_SENSOR, 4, own, own_se, NULL);
    tap_ok(!memcmp(value, own, sizeof own), "false: a point");
}

static void names(void)
{
    char xml[4096];
    struct imp_luminaire_info info = {.size = sizeof info};
    scene_text(xml, sizeof xml, LAMP("lambert.ies", OPENING));
    imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
    test_must(ctx, imp_scene_get_luminaire(s, 0, &info));
    tap_ok(!info.is_point && !strcmp(info.name, "lamp") &&
               fabs(info.position[0] - .7) < 1e-6 && fabs(info.position[2] - 1) < 1e-6 &&
               fabs(info.flux / (1000 * M_PI) - 1) < 1e-4,
           "a shape of the lamp's name, at its place, with its flux: %.2f lm", info.flux);
    imp_scene_destroy(s);
}

/* Four angles of a table of 100 cd, of which one is 0, and what its opening is: in a box the middle is half
 * of the centimetre lower. */
static void behind(void)
{
    static const struct {
        const char *what, *angles, *candela;
        double z;
    } rows[] = {{"dark from the horizon on", "0 60 90 180", "100 100 0 0", 1},
                {"light at the horizon alone", "0 60 90 180", "100 100 100 0", 1},
                {"light at 100 degrees", "0 60 100 180", "100 100 100 0", .995},
                {"light until 100 degrees", "0 80 100 180", "100 100 0 0", .995}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        char xml[4096];
        struct imp_luminaire_info info = {.size = sizeof info};
        FILE *f = fopen("behind.ies", "w");
        if (!f) exit(99);
        fprintf(f,
                "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 4 1 1 2 .6 1.2 0\n1 1 0\n%s\n0\n"
                "%s\n",
                rows[k].angles, rows[k].candela);
        fclose(f);
        scene_text(xml, sizeof xml, LAMP("behind.ies", OPENING));
        imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
        test_must(ctx, imp_scene_get_luminaire(s, 0, &info));
        imp_scene_destroy(s);
        tap_ok(fabs(info.position[2] - rows[k].z) < 1e-6, "%s: a %s (middle %g)",
               rows[k].what, rows[k].z < 1 ? "box" : "rectangle", info.position[2]);
    }
}

/* At one place: as points only. */
static void several(void)
{
    static const char *const files[] = {"lamp=lambert.ies,alike.ies"};
    for (int open = 0; open < 2; open++) {
        char xml[4096];
        struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
        imp_scene *s = NULL;
        o.mode = IMP_MONO;
        o.luminaires = files;
        o.n_luminaires = 1;
        scene_text(xml, sizeof xml,
                   open ? LAMP("lambert.ies", OPENING)
                        : LAMP("lambert.ies", "<boolean name='opening' value='false'/>"));
        const enum imp_status st =
            imp_scene_load_string(ctx, xml, strlen(xml), "test", &o, &s);
        tap_ok(open ? st == IMP_E_UNSUPPORTED &&
                          strstr(imp_last_error(ctx), "black shapes hide each other")
                    : st == IMP_OK,
               "several files: %s", open ? imp_last_error(ctx) : "points");
        imp_scene_destroy(s);
    }
}

static void refused(const char *lamp, const char *needle)
{
    char xml[4096];
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    imp_scene *s = NULL;
    o.mode = IMP_MONO;
    scene_text(xml, sizeof xml, lamp);
    const enum imp_status st =
        imp_scene_load_string(ctx, xml, strlen(xml), "test", &o, &s);
    tap_ok(st == IMP_E_SCENE && strstr(imp_last_error(ctx), needle), "refused: %s",
           imp_last_error(ctx));
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(0);
    flat();
    box();
    by_hand();
    names();
    behind();
    several();
    table_write("point.ies", true, "0 0 0");
    refused(LAMP("point.ies", OPENING), "names no luminous opening");
    refused(LAMP("lambert.ies", "<string name='opening' value='yes'/>"),
            "opening is true or false");
    refused("<shape type='rectangle'><emitter type='ies'>" FILE_OF("lambert.ies") OPENING
            "</emitter></shape>",
            "opening");
    refused(LAMP("lambert.ies", OPENING) "<shape type='sphere' id='lamp_opening'/>",
            "'lamp_opening', is taken");
    imp_context_destroy(ctx);
    return tap_done();
}

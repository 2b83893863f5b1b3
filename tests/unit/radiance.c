/* SPDX-License-Identifier: Apache-2.0
 *
 * Radiance's scenes: illuminances and radiances in closed form, materials against Radiance's
 * formulas, the bits of the same room in XML, polygons cut into triangles, and what is refused. */
#include "base/film.h"
#include "format/polygon_cut.h"
#include "imp_fail_alloc.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/rooms.h>
#include <math.h>
#include <stdbool.h>
#include <unistd.h>

static imp_context *ctx;
static char folder[] = "/tmp/importon-rad-XXXXXX";

static void put(const char *name, const char *text)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "wb");
    if (!f || fputs(text, f) < 0 || fclose(f) != 0) exit(1);
}

static enum imp_status load_in(imp_context *c, const char *name, bool lenient,
                               imp_scene **out)
{
    const char *defines[] = {"view=eye.vf", "width=8", "spp=16"};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    char path[256];
    const char *search[] = {folder};
    snprintf(path, sizeof path, "%s/%s", folder, name);
    o.search = search, o.n_search = 1;
    o.defines = defines;
    o.n_defines = strstr(name, ".rad") ? 3 : 0;
    o.lenient = lenient ? IMP_LENIENT_QUIET : IMP_LENIENT_OFF;
    o.mode = IMP_RGB;
    return imp_scene_load(c, path, &o, out);
}

static imp_scene *load(const char *name)
{
    imp_scene *s;
    test_must(ctx, load_in(ctx, name, false, &s));
    return s;
}

/* A scene of this text, seen through `view`. */
static imp_scene *seen(const char *rad, const char *view)
{
    put("a.rad", rad);
    put("eye.vf", view);
    return load("a.rad");
}

/* Means of a channel over the picture, of 8 seeds. */
static struct tap_stat mean_of(imp_scene *s, int channel, int spp)
{
    struct tap_stat all = {0};
    for (uint64_t seed = 1; seed <= 8; seed++) {
        struct imp_run run = IMP_RUN_INIT;
        imp_film *f;
        double sum = 0;
        run.seed = seed;
        run.spp = spp;
        run.points = IMP_POINTS_INDEPENDENT;
        test_must(ctx, imp_render(s, &run, &f));
        const int n = f->width * f->height;
        for (int i = 0; i < n; i++) sum += f->mean[i * f->channels + channel];
        tap_add(&all, sum / n);
        imp_film_destroy(f);
    }
    return all;
}

/* Against a truth; what has no noise, up to the floats of a picture. */
static void agree(const struct tap_stat *m, double truth, const char *what)
{
    if (tap_se(m) < 1e-9) tap_near(m->mean, truth, 1e-7, 1e-7, what);
    else tap_z(m, truth, 4e-3, what);
}

/* ---- Rooms in closed form ------------------------------------------------------------- */

/* A black lamp of radius r in a bubble of radius R and reflectance rho: its wall gets
 * E0 = pi L r^2/R^2 from the lamp and rho E (1 - r^2/R^2) from itself, everywhere alike. */
static void sphere_room(void)
{
    imp_scene *s =
        seen("void plastic wall 0 0 5 .6 .3 0 0 0\nvoid light bulb 0 0 3 8 8 8\n"
             "wall bubble room 0 0 4 1 2 3 2\nbulb sphere lamp 0 0 4 1 2 3 .5\n",
             "rvu -vtv -vp 1 2 4 -vd 0 0 1 -vu 0 1 0 -vh 30 -vv 20");
    static const double rho[3] = {.6, .3, 0};
    for (int c = 0; c < 3; c++) {
        const double f = .5 * .5 / 4, E = M_PI * 8 * f / (1 - rho[c] * (1 - f));
        const struct tap_stat m = mean_of(s, c, 64);
        agree(&m, rho[c] * E / M_PI, "the wall of a sphere");
    }
    imp_scene_destroy(s);
}

/* Configuration factor of a rectangle a x b at distance c from a point below its corner
 * (Howell, Catalog of radiation configuration factors, B-3). */
static double corner_factor(double a, double b, double c)
{
    const double x = a / c, y = b / c, p = sqrt(1 + x * x), q = sqrt(1 + y * y);
    return (x / p * atan(y / p) + y / q * atan(x / q)) / (2 * M_PI);
}

/* What a designer writes: meters in XML over a room in a .rad. The lamp is 2 x 1, 1.5 above the
 * grid of one point below its middle; walls are black. */
static void meter_room(void)
{
    put("room.rad",
        "void plastic black 0 0 5 0 0 0 0 0\nvoid light lamp 0 0 3 100 100 100\n"
        "black polygon floor 0 0 12 -3 -3 0 3 -3 0 3 3 0 -3 3 0\n"
        "lamp polygon panel 0 0 12 -1 -.5 2.3 -1 .5 2.3 1 .5 2.3 1 -.5 2.3\n");
    put("room.xml",
        "<scene version='3.0.0'><default name='efficacy' value='179'/>"
        "<integrator type='path'/><include filename='room.rad'/>"
        "<shape type='rectangle'><transform name='to_world'><scale "
        "value='.1'/><translate "
        "z='.8'/></transform><sensor type='irradiancemeter' id='work'><boolean "
        "name='virtual' value='true'/><string name='units' value='photometric'/><string "
        "name='at' value='points'/><film type='hdrfilm'><integer name='width' value='1'/>"
        "<integer name='height' value='1'/></film></sensor></shape></scene>");
    imp_scene *s = load("room.xml");
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate mean;
    double value, se;
    run.spp = 8192;
    test_must(ctx, imp_grid_read(s, &run, &value, &se, &mean, NULL));
    const double E = 179 * M_PI * 100 * 4 * corner_factor(1, .5, 1.5);
    tap_ok(fabs(value - E) < 4.5 * se && se < 4e-3 * E,
           "below a panel: %.2f +- %.2f lx, in closed form %.2f", value, se, E);
    imp_scene_destroy(s);
}

/* ---- Materials ------------------------------------------------------------------------ */

#define FACING "polygon a 0 0 12 -9 -9 0 9 -9 0 9 9 0 -9 9 0\n"
#define DOWN   "-vtv -vp 0 0 1 -vd 0 0 -1 -vu 0 1 0 -vh .2 -vv .1"
/* A lamp behind the viewer, or behind the pane, which fills all directions there. */
#define ABOVE "void light l 0 0 3 1 1 1\nl bubble sky 0 0 4 0 0 0 50\n"
#define BELOW                                                                            \
    "void light l 0 0 3 1 1 1\nl polygon sky 0 0 12 -9 -9 -1 9 -9 -1 9 9 -1 -9 9 -1\n"

static void material(const char *text, const char *lamp, const double truth[3],
                     const char *what)
{
    char rad[1024];
    snprintf(rad, sizeof rad, "void %s\nm " FACING "%s", text, lamp);
    imp_scene *s = seen(rad, DOWN);
    for (int c = 0; c < 3; c++) {
        const struct tap_stat m = mean_of(s, c, 128);
        agree(&m, truth[c], what);
    }
    imp_scene_destroy(s);
}

static void materials(void)
{
    double T[3], R[3];
    const double t[3] = {.96, .5, .1}, n = 1.7, F = pow((n - 1) / (n + 1), 2);
    for (int k = 0; k < 3; k++) { /* glass.c of Radiance, at normal incidence */
        const double d = t[k], all = 1 - F * F * d * d;
        T[k] = (1 - F) * (1 - F) * d / all;
        R[k] = F * (1 + (1 - 2 * F) * d * d) / all;
    }
    material("plastic m 0 0 5 .5 .3 .2 0 0", ABOVE, (double[3]){.5, .3, .2}, "matte");
    /* Radiance: (1 - s) of the colour, and s; of a metal all of it has the colour. */
    material("plastic m 0 0 5 .5 .3 .2 .1 0", ABOVE, (double[3]){.55, .37, .28},
             "plastic");
    material("metal m 0 0 5 .5 .3 .2 .7 0", ABOVE, (double[3]){.5, .3, .2}, "metal");
    material("metal m 0 0 5 .5 .3 .2 1 0", ABOVE, (double[3]){.5, .3, .2}, "bare metal");
    material("mirror m 0 0 3 .9 .8 .7", ABOVE, (double[3]){.9, .8, .7}, "mirror");
    material("glass m 0 0 4 .96 .5 .1 1.7", BELOW, T, "light through glass");
    /* the bubble is on both sides of the pane */
    for (int k = 0; k < 3; k++) T[k] += R[k];
    material("glass m 0 0 4 .96 .5 .1 1.7", ABOVE, T, "glass in uniform light");
    material("light m 0 0 3 1 2 3", "", (double[3]){1, 2, 3}, "light");
}

/* Which side shines: towards the viewer `on`, or away from it. */
static void side(const char *surface, double radiance, const char *what)
{
    char rad[512];
    snprintf(rad, sizeof rad, "void light m 0 0 3 1 1 1\nm %s\n", surface);
    imp_scene *s = seen(rad, DOWN);
    const struct tap_stat m = mean_of(s, 0, 16);
    tap_near(m.mean, radiance, 0, 1e-6, what);
    imp_scene_destroy(s);
}

static void sides(void)
{
    side("ring a 0 0 8 0 0 0 0 0 2 0 1", 1, "a disk shines along its direction");
    side("ring a 0 0 8 0 0 0 0 0 -2 0 1", 0, "and not behind");
    side("ring a 0 0 8 0 .5 0 0 0 2 .2 .8", 1, "a ring shines");
    side("ring a 0 0 8 0 0 0 0 0 2 .2 .8", 0, "but not in its hole");
    side("sphere a 0 0 4 0 0 0 .5", 1, "a sphere shines outwards");
    side("bubble a 0 0 4 0 0 0 .5", 0, "a bubble inwards");
    side("cylinder a 0 0 7 -1 0 0 1 0 0 .5", 1, "a cylinder outwards");
    side("tube a 0 0 7 -1 0 0 1 0 0 .5", 0, "a tube inwards");
}

/* ---- The same room twice -------------------------------------------------------------- */

static void same_bits(void)
{
    put("w.obj",
        "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 0 0 3\nv 0 4 3\nv 4 4 3\nv 4 0 3\n"
        "f 1 2 3 4\nf 5 6 7 8\n");
    put("l.obj", "v 1 1 2.9\nv 1 3 2.9\nv 3 3 2.9\nv 3 1 2.9\nf 1 2 3 4\n");
    put("b.xml",
        "<scene version='3.0.0'><integrator type='path'/><bsdf type='twosided' "
        "id='white'>"
        "<bsdf type='diffuse'><rgb name='reflectance' value='.7 .6 .5'/></bsdf></bsdf>"
        "<shape type='obj'><string name='filename' value='w.obj'/><boolean "
        "name='face_normals' value='true'/><ref id='white'/></shape>"
        "<shape type='obj'><string name='filename' value='l.obj'/><boolean "
        "name='face_normals' value='true'/><emitter type='area'><rgb name='radiance' "
        "value='5'/></emitter></shape>"
        "<sensor type='perspective'><float name='fov' value='90'/><transform "
        "name='to_world'><lookat origin='2 .5 1' target='2 1.5 1' up='0 0 "
        "1'/></transform>"
        "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' "
        "value='6'/></film><sampler type='independent'><integer name='sample_count' "
        "value='16'/></sampler></sensor></scene>");
    /* tan(73.74/2) = .75: a picture of 8 x 6. */
    imp_scene *a =
        seen("# a comment\nvoid plastic \"white\" 0 0 5 .7 .6 .5 0 0\n"
             "void light lamp 0 0 3 5 5 5\n"
             "white polygon floor 0 0 12 0 0 0 4 0 0 4 4 0 0 4 0\n"
             "white polygon ceiling 0 0 12 0 0 3 0 4 3 4 4 3 4 0 3\n"
             "lamp polygon panel 0 0 12 1 1 2.9 1 3 2.9 3 3 2.9 3 1 2.9\n",
             "VIEW= -vtv -vp 2 .5 1 -vd 0 1 0 -vu 0 0 1 -vh 90 -vv 73.7397953");
    imp_scene *b = load("b.xml");
    struct imp_run run = IMP_RUN_INIT;
    imp_film *f, *g;
    test_must(ctx, imp_render(a, &run, &f));
    test_must(ctx, imp_render(b, &run, &g));
    const bool size = f->width == 8 && f->height == 6 && g->height == 6;
    const size_t bytes = (size_t)(f->width * f->height * f->channels) * sizeof *f->mean;
    double sum = 0;
    for (int i = 0; i < 48 * 3; i++) sum += f->mean[i];
    tap_ok(size && sum > 1 && memcmp(f->mean, g->mean, bytes) == 0,
           "the room as .rad and as XML: the same bits");
    imp_film_destroy(f);
    imp_film_destroy(g);
    imp_scene_destroy(a);
    imp_scene_destroy(b);
}

/* ---- Polygons ------------------------------------------------------------------------- */

/* Cut, and count: the sum of the triangles' areas, and how often they cover q. */
static double covered(const double *p, size_t n, const double q[2], int *times)
{
    uint32_t cut[3 * 64];
    size_t n_triangles;
    double area = 0;
    *times = 0;
    if (imp__polygon_cut(ctx, p, n, cut, &n_triangles) != IMP_OK) return -1;
    for (size_t i = 0; i < n_triangles; i++) {
        double e[3];
        for (int k = 0; k < 3; k++) {
            const double *a = p + 3 * cut[3 * i + k],
                         *b = p + 3 * cut[3 * i + (k + 1) % 3];
            e[k] = (b[0] - a[0]) * (q[1] - a[1]) - (b[1] - a[1]) * (q[0] - a[0]);
            area += (a[0] * b[1] - a[1] * b[0]) / 2;
        }
        *times += (e[0] > 0) == (e[1] > 0) && (e[1] > 0) == (e[2] > 0);
    }
    return area;
}

static void polygons(void)
{
    /* A square of 4 x 4 with a hole of 2 x 2, by a seam. */
    static const double hole[] = {0, 0, 0, 4, 0, 0, 4, 4, 0, 0, 4, 0, 0, 0, 0,
                                  1, 1, 0, 1, 3, 0, 3, 3, 0, 3, 1, 0, 1, 1, 0};
    static const double crossed[] = {0, 0, 0, 4, 4, 0, 4, 0, 0, 0, 3, 0};
    static const double line[] = {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3};
    double star[3 * 40], turned[3 * 40], worst = 0;
    int inside, outside, bad = 0;
    tap_near(covered(hole, 10, (double[2]){2.1, 1.7}, &outside), 12, 1e-14, 0,
             "area of a square with a hole");
    covered(hole, 10, (double[2]){.5, 1.7}, &inside);
    tap_ok(outside == 0 && inside == 1, "its hole is not covered, its rim once");
    for (int shape = 0; shape < 50; shape++) { /* star-shaped about the origin, drawn */
        uint32_t state = 1 + (uint32_t)shape;
        double area = 0;
        for (int i = 0; i < 40; i++) {
            state = state * 1664525u + 1013904223u;
            const double r = 1 + 4 * (state >> 8) / 16777216., a = 2 * M_PI * i / 40;
            star[3 * i] = r * cos(a), star[3 * i + 1] = r * sin(a), star[3 * i + 2] = 7;
        }
        for (int i = 0; i < 40; i++) {
            const double *a = star + 3 * i, *b = star + 3 * ((i + 1) % 40);
            area += (a[0] * b[1] - a[1] * b[0]) / 2;
            memcpy(turned + 3 * (39 - i), a, 3 * sizeof *a);
        }
        worst =
            fmax(worst, fabs(covered(star, 40, (double[2]){1e-3, 2e-3}, &inside) - area));
        bad += inside != 1;
        worst = fmax(worst,
                     fabs(covered(turned, 40, (double[2]){1e-3, 2e-3}, &inside) + area));
        bad += inside != 1;
        covered(star, 40, (double[2]){5.1, 0}, &outside);
        bad += outside != 0;
    }
    tap_ok(worst < 1e-12 && bad == 0, "50 stars either way: areas to %.0e", worst);
    tap_ok(covered(crossed, 4, (double[2]){0, 0}, &inside) == -1,
           "a crossed one: refused");
    tap_ok(covered(line, 4, (double[2]){0, 0}, &inside) == 0, "a line: no triangles");
}

/* ---- Names, and what is refused ------------------------------------------------------- */

static double value_of(const imp_scene *s, const char *name)
{
    double v[3];
    size_t index;
    if (imp_scene_find_param(s, name, &index) != IMP_OK ||
        imp_scene_get_values(s, index, v) != IMP_OK)
        return -1;
    return v[0];
}

static void names(void)
{
    imp_scene *s = seen("void plastic a 0 0 5 .1 .1 .1 0 0\na sphere s1 0 0 4 0 0 0 1\n"
                        "void plastic a 0 0 5 .2 .2 .2 0 0\na sphere s2 0 0 4 3 0 0 1\n"
                        "void alias b a\nb sphere s3 0 0 4 6 0 0 1\n"
                        "inherit alias c b\nc sphere s4 0 0 4 9 0 0 1\n"
                        "void plastic unused 0 0 5 .9 .9 .9 0 0\n"
                        "void light l 0 0 3 4 4 4\nl sphere lamp 0 0 4 0 5 0 1\n"
                        "l sphere lamp 0 0 4 0 9 0 1\n",
                        "-vp 0 -9 0");
    tap_ok(value_of(s, "a.brdf_0.reflectance.value") == .1 &&
               value_of(s, "a_2.brdf_0.reflectance.value") == .2 &&
               value_of(s, "b.brdf_0.reflectance.value") == .2 &&
               value_of(s, "c.brdf_0.reflectance.value") == .2 &&
               value_of(s, "lamp.radiance.value") == 4 &&
               value_of(s, "lamp_2.radiance.value") == 4 &&
               value_of(s, "unused.brdf_0.reflectance.value") == -1,
           "later definitions, aliases, lamps by name");
    imp_scene_destroy(s);
}

static void refused(const char *rad, enum imp_status status, const char *message)
{
    imp_scene *s = NULL;
    put("a.rad", rad);
    put("eye.vf", "rvu");
    const enum imp_status st = load_in(ctx, "a.rad", false, &s);
    tap_ok(st == status && strstr(imp_last_error(ctx), message), "%s", message);
    if (st != status || !strstr(imp_last_error(ctx), message))
        printf("# status %d: %s\n", (int)st, imp_last_error(ctx));
    imp_scene_destroy(s);
}

/* -vs moves the view to the right, -vl up: what was in the middle is left, below. */
static void shifts(void)
{
    static const struct {
        const char *option;
        int x, y; /* of the pixel that sees the lamp */
    } cases[] = {{"", 4, 4}, {"-vs .25", 2, 4}, {"-vl .25", 4, 6}};
    for (int k = 0; k < 3; k++) {
        char view[100];
        snprintf(view, sizeof view, "-vp .1 -5 -.1 -vd 0 1 0 -vh 40 -vv 40 %s",
                 cases[k].option);
        imp_scene *s =
            seen("void light l 0 0 3 1 1 1\nl sphere a 0 0 4 .3 0 -.3 .1", view);
        struct imp_run run = IMP_RUN_INIT;
        imp_film *f;
        int best = 0;
        run.spp = 64;
        test_must(ctx, imp_render(s, &run, &f));
        for (int i = 0; i < 64; i++)
            if (f->mean[i * f->channels] > f->mean[best * f->channels]) best = i;
        tap_ok(best % 8 == cases[k].x && best / 8 == cases[k].y,
               "view '%s': the lamp at pixel %d, %d", cases[k].option, best % 8,
               best / 8);
        imp_film_destroy(f);
        imp_scene_destroy(s);
    }
}

static void refusals(void)
{
    imp_scene *s;
    refused("\n!xform -t 1 2 3 b.rad\n", IMP_E_SCENE,
            "a.rad:2:1: '!xform -t 1 2 3 b.rad'");
    refused("void plastik a 0 0 0", IMP_E_SCENE, "did you mean 'plastic'?");
    refused("void plastic a 0 0 5 .5 2 .5 0 0", IMP_E_SCENE, "colour 2 is 2");
    refused("void plastic a 0 0 3 .5 .5 .5", IMP_E_SCENE, "needs 5 numbers, and has 3");
    refused("void glow a 0 0 4 1 1 nan 0", IMP_E_SCENE, "number 3 of 4 is 'nan'");
    refused("void plastic a 0 0 99999999999", IMP_E_SCENE, "not the number of words");
    refused("void plastic a 0 0 2 .55\n", IMP_E_SCENE, "the file ends before a number");
    refused("a sphere s 0 0 4 0 0 0 1", IMP_E_SCENE, "modifier 'a' is not defined");
    refused("void plastic a 0 0 5 .5 .5 .5 0 0\na sphere s 0 0 4 0 0 0 -1", IMP_E_SCENE,
            "a.rad:2:1: sphere 's': needs a centre");
    refused("void plastic a 0 0 5 .5 .5 .5 0 0\n"
            "a polygon p 0 0 12 0 0 0 4 4 0 4 0 0 0 3 0",
            IMP_E_SCENE, "it crosses itself");
    const char *unread =
        "void brightfunc f 2 b x.cal 0 0\nf plastic t 0 0 5 .5 .5 .5 0 0\n"
        "t sphere s 0 0 4 0 0 0 1\nvoid trans u 0 0 7 .5 .5 .5 0 0 .5 .5\n"
        "u sphere s 0 0 4 3 0 0 1\nvoid cone c 0 0 8 0 0 0 1 1 1 1 2\n"
        "void trans library 0 0 7 1 1 1 0 0 1 1\n";
    refused(unread, IMP_E_UNSUPPORTED,
            "a.rad:1:1: brightfunc 'f', trans 'u' (line 4), cone 'c' (line 6): not "
            "supported");
    struct imp_scene_info info = {.size = sizeof info};
    test_must(ctx, load_in(ctx, "a.rad", true, &s));
    test_must(ctx, imp_scene_get_info(s, &info));
    tap_ok(info.n_missing == 3 && info.n_shapes == 2, "a lenient scene goes on without");
    imp_scene_destroy(s);
    put("eye.vf", "rvu -vth");
    tap_ok(load_in(ctx, "a.rad", true, &s) == IMP_E_UNSUPPORTED &&
               strstr(imp_last_error(ctx), "eye.vf:1:1: -vth"),
           "a fisheye: refused");
    put("in.xml",
        "<scene version='3.0.0'><shape type='sphere'><include filename='a.rad'/>"
        "</shape></scene>");
    tap_ok(load_in(ctx, "in.xml", false, &s) == IMP_E_SCENE &&
               strstr(imp_last_error(ctx), "belongs in the scene"),
           "in a shape: refused");
}

static void memory(void)
{
    struct fail_alloc heap = {0};
    imp_context *fragile = fail_alloc_context(&heap);
    const long at_rest = heap.live;
    long n = 0, leaks = 0, wrong = 0;
    put("a.rad", "void plastic a 0 0 5 .1 .1 .1 .1 .1\na sphere s1 0 0 4 0 0 0 1\n"
                 "a polygon p 0 0 9 0 0 0 1 0 0 1 1 0\nvoid alias b a\n"
                 "void light l 0 0 3 4 4 4\nl ring r 0 0 8 0 5 0 0 0 1 .5 1\n");
    put("eye.vf", "rvu");
    for (;; n++) {
        imp_scene *s = NULL;
        heap.calls = 0;
        heap.fail_at = n + 1;
        const enum imp_status st = load_in(fragile, "a.rad", false, &s);
        heap.fail_at = 0;
        imp_scene_destroy(s);
        if (st == IMP_OK || n > 5000) break;
        wrong += st != IMP_E_NOMEM;
        leaks += heap.live != at_rest;
    }
    tap_ok(n > 20 && n < 5000 && leaks == 0 && wrong == 0,
           "%ld failures of memory: %ld leaks, %ld with another status", n, leaks, wrong);
    imp_context_destroy(fragile);
}

int main(void)
{
    if (!mkdtemp(folder)) return 1;
    ctx = test_context(1);
    sphere_room();
    meter_room();
    materials();
    sides();
    same_bits();
    polygons();
    names();
    shifts();
    refusals();
    memory();
    imp_context_destroy(ctx);
    static const char *const files[] = {"a.rad", "eye.vf", "room.rad", "room.xml",
                                        "w.obj", "l.obj",  "b.xml",    "in.xml"};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        char path[256];
        snprintf(path, sizeof path, "%s/%s", folder, files[i]);
        unlink(path);
    }
    rmdir(folder);
    return tap_done();
}

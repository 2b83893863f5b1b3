/* SPDX-License-Identifier: Apache-2.0
 *
 * Textures from photographs. A floor whose 8 x 8 texels are drawn at random is photographed with noise, a
 * gamma and 8 bits, and measured from a grey guess beside an unknown exposure of the second photograph:
 * 95 % intervals hold the truth in 90 to 97 % of the texels, and standard errors are bounded, so that
 * they cannot hold it by their width.
 *
 * Argument long, or a number: 20 floors in place of 1, whose share only a wide bound holds. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include <importon/measure.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SIDE = 16, PIXELS = SIDE * SIDE, TEXELS = 8, ALL = TEXELS * TEXELS };
#define GAMMA    2.2
#define NOISE    0.01
#define EXPOSURE 1.3

static imp_context *ctx;
static char map[] = "/tmp/importon-floor-XXXXXX";

/* Two cameras above a floor, which a lamp and a sky light; nothing else is there, so that what a texel
 * sends does not depend on others. */
static imp_scene *scene_make(double exposure)
{
    char xml[4096];
    int n = snprintf(xml, sizeof xml,
                     "<scene version='3.0.0'><integrator type='path'><integer "
                     "name='max_depth' value='2'/></integrator>");
    for (int c = 0; c < 2; c++)
        n += snprintf(
            xml + n, sizeof xml - (size_t)n,
            "<sensor type='perspective' id='%s'><float name='fov' value='%d'/><transform "
            "name='to_world'><lookat origin='%g,4,.3' target='0,0,0' up='0,0,-1'/>"
            "</transform><film type='hdrfilm'><integer name='width' value='%d'/><integer "
            "name='height' value='%d'/><rfilter type='box'/><float name='exposure' "
            "value='%g'/><float name='gamma' value='2.2'/></film></sensor>",
            c ? "right" : "left", c ? 30 : 28, c ? 0.4 : -0.3, SIDE, SIDE,
            c ? exposure : 1.);
    snprintf(xml + n, sizeof xml - (size_t)n,
             "<shape type='rectangle'><transform name='to_world'><rotate x='1' "
             "angle='-90'/></transform><bsdf type='diffuse' id='floor'><texture "
             "type='bitmap' name='reflectance'><string name='filename' value='%s'/>"
             "<boolean name='raw' value='true'/></texture></bsdf></shape>"
             "<shape type='rectangle'><transform name='to_world'><scale value='.5'/>"
             "<rotate x='1' angle='90'/><translate x='-2' y='3' z='.5'/></transform>"
             "<emitter type='area' id='lamp'><spectrum name='radiance' value='5'/>"
             "</emitter></shape><emitter type='constant' id='sky'><spectrum "
             "name='radiance' value='.4'/></emitter></scene>",
             map);
    return test_scene_text(ctx, xml, IMP_MONO);
}

static void texels_set(imp_scene *s, const double *value)
{
    size_t k;
    test_must(ctx, imp_scene_find_param(s, "floor.reflectance.data", &k));
    test_must(ctx, imp_scene_set_values(s, k, ALL, value));
}

static void photo_make(imp_scene *s, int sensor, uint64_t seed, float *out)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.sensor = sensor;
    run.spp = 1024;
    run.seed = seed;
    test_must(ctx, imp_render(s, &run, &film));
    for (uint32_t i = 0; i < PIXELS; i++) {
        const struct imp_key key = imp__key(seed, 7, (uint64_t)sensor);
        const double u = 1 - imp__u01(key, 2 * i), v = imp__u01(key, 2 * i + 1),
                     normal = sqrt(-2 * log(u)) * cos(6.283185307179586 * v),
                     value = pow(fmax((double)imp_film_mean(film)[i], 0), 1 / GAMMA) +
                             NOISE * normal;
        out[i] = (float)(round(255 * fmin(1, fmax(0, value))) / 255);
    }
    imp_film_destroy(film);
}

struct record {
    int texels, inside, wide, explained;
    double square; /* of distances in standard errors */
};

static void one_floor(uint64_t seed, int spp, struct record *r)
{
    static float pixels[2][PIXELS];
    static const char *const hold[] = {"*.gamma.*", "sky.*", "lamp.*", "left.exposure"};
    const struct imp_key key = imp__key(seed, 5, 0);
    double truth[ALL], grey[ALL];
    imp_problem *problem;
    const struct imp_measure_result *result;
    struct imp_photo photo[2];
    struct imp_measure_options o = IMP_MEASURE_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    for (uint32_t k = 0; k < ALL; k++) {
        truth[k] = 0.2 + 0.6 * imp__u01(key, k);
        grey[k] = 0.5;
    }
    imp_scene *s = scene_make(EXPOSURE);
    texels_set(s, truth);
    for (int c = 0; c < 2; c++)
        photo_make(s, c, 1000 * (uint64_t)(c + 1) + seed, pixels[c]);
    imp_scene_destroy(s);
    s = scene_make(1);
    texels_set(s, grey);
    for (int c = 0; c < 2; c++) {
        photo[c] = (struct imp_photo)IMP_PHOTO_INIT;
        photo[c].sensor = c;
        photo[c].width = photo[c].height = SIDE;
        photo[c].channels = 1;
        photo[c].pixels = pixels[c];
        photo[c].clipped = true;
        photo[c].low = 0.5 / 255;
        photo[c].high = 254.5 / 255;
        photo[c].step = 1. / 255;
        photo[c].noise = hypot(NOISE, 1 / (255 * sqrt(12)));
    }
    o.hold = hold;
    o.n_hold = 4;
    o.stages = "exposure,textures";
    run.spp = spp;
    run.seed = seed;
    test_must(ctx, imp_measure(s, photo, 2, &o, &run, &problem, &result));
    r->explained += result->explained;
    if (result->n_textures != 0 || imp_problem_n_variables(problem) != ALL + 1) exit(1);
    for (size_t i = 0; i < imp_problem_n_variables(problem); i++) {
        struct imp_variable_info v = IMP_VARIABLE_INFO_INIT;
        struct imp_param_info info = {.size = sizeof info};
        struct imp_fit_variable f = IMP_FIT_VARIABLE_INIT;
        test_must(ctx, imp_problem_get_variable(problem, i, &v));
        test_must(ctx, imp_scene_get_param(s, v.param, &info));
        test_must(ctx, imp_problem_get_fit_variable(problem, i, &f));
        if (info.count != ALL) continue;
        const double is = truth[v.element];
        r->texels++;
        r->inside += f.lo95 <= is && is <= f.hi95;
        r->wide += !(f.se < 0.06);
        r->square += pow((f.value - is) / f.se, 2);
    }
    if (!result->explained)
        for (size_t i = 0; i < result->n_lines; i++)
            printf("# floor %d: %s\n", (int)seed, result->lines[i]);
    imp_problem_destroy(problem);
    imp_scene_destroy(s);
}

/* A picture of the floor's size: its values are set. */
static bool map_make(void)
{
    const int at = mkstemp(map);
    FILE *f = at >= 0 ? fdopen(at, "wb") : NULL;
    float grey[ALL];
    for (int k = 0; k < ALL; k++) grey[k] = 0.5f;
    if (!f) return false;
    fprintf(f, "Pf\n%d %d\n-1\n", TEXELS, TEXELS);
    fwrite(grey, sizeof *grey, ALL, f);
    return fclose(f) == 0;
}

int main(int argc, char **argv)
{
    const int floors = argc > 1 ? (strcmp(argv[1], "long") ? atoi(argv[1]) : 20) : 1;
    struct record r = {0};
    if (!map_make()) return 1;
    test_must(NULL, imp_context_create(NULL, &ctx));
    for (int k = 0; k < floors; k++) one_floor((uint64_t)k, floors > 1 ? 16 : 8, &r);
    /* Texels of a floor are correlated by the exposure and as neighbours: as if half as many. */
    const double part = (double)r.inside / r.texels,
                 se = sqrt(0.95 * 0.05 / (r.texels / 2.)), mean = r.square / r.texels;
    tap_ok(part > fmin(0.95 - 3 * se, 0.9) && (floors < 10 || part < 0.98),
           "95 %% intervals hold the texels # %d of %d, mean square %.2f", r.inside,
           r.texels, mean);
    tap_ok(r.wide <= r.texels / 20, "their errors are bounded # %d of %d are wide",
           r.wide, r.texels);
    tap_ok(r.explained >= floors - floors / 10, "photographs are explained # %d of %d",
           r.explained, floors);
    remove(map);
    imp_context_destroy(ctx);
    return tap_done();
}

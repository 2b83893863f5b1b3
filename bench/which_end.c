/* SPDX-License-Identifier: Apache-2.0
 *
 * Which end walks had better begin at: processor time to a given error of pictures and
 * readings, by walks from the sensor, from the lights and from both ends (integrator
 * bdpt), and rays a second, one thread.
 *
 *     which_end [seconds an entry, default 2 [first row, from 0 [last row]]]
 *
 * Segments are rays that look for what a walk meets next, boundaries of media included; rays
 * are those and the ones that ask whether something stands in between. Both are counted
 * where they are traced.
 *
 * The error of a picture is the root of the mean square error of its pixels over its mean
 * value. Errors are those that the pictures tell; where one end hardly finds the light
 * they are too small, and the means beside them differ.
 */
#include <embree3/rtcore.h>
#include <importon/importon.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static imp_context *ctx;

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "which_end: %s: %s\n", imp_status_text(st), imp_last_error(ctx));
    exit(3);
}

/* ---- Rays, counted by the linker's --wrap ------------------------------------------- */

static double segments, shadows;

void __real_rtcIntersect1(RTCScene, struct RTCIntersectContext *, struct RTCRayHit *);
void __wrap_rtcIntersect1(RTCScene, struct RTCIntersectContext *, struct RTCRayHit *);
void __wrap_rtcIntersect1(RTCScene scene, struct RTCIntersectContext *context,
                          struct RTCRayHit *hit)
{
    segments++;
    __real_rtcIntersect1(scene, context, hit);
}

void __real_rtcOccluded1(RTCScene, struct RTCIntersectContext *, struct RTCRay *);
void __wrap_rtcOccluded1(RTCScene, struct RTCIntersectContext *, struct RTCRay *);
void __wrap_rtcOccluded1(RTCScene scene, struct RTCIntersectContext *context,
                         struct RTCRay *ray)
{
    shadows++;
    __real_rtcOccluded1(scene, context, ray);
}

/* ---- Scenes ------------------------------------------------------------------------- */

static double processor(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* clang-format off: literals are broken where the markup is */
#define AT(t) "<transform name='to_world'>" t "</transform>"
#define BOX(w, h)                                                                        \
    "<film type='hdrfilm'><integer name='width' value='" #w "'/><integer name='height' " \
    "value='" #h "'/><rfilter type='box'/></film>"
#define CAMERA                                                                           \
    "<sensor type='perspective'><float name='fov' value='60'/>" AT(                      \
        "<lookat origin='0,0,1.9' target='0,-.6,0' up='0,1,0'/>")                        \
        BOX(24, 16) "</sensor>"
#define METER(side)                                                                      \
    "<shape type='rectangle'>" AT("<scale value='" side "'/><rotate x='1' angle='-90'/>" \
                                  "<translate y='-1.9'/>")                               \
        GRAY(".3") "<sensor type='irradiancemeter'>" BOX(1, 1) "</sensor></shape>"
#define GRAY(r) "<bsdf type='diffuse'><rgb name='reflectance' value='" r "'/></bsdf>"
#define LAMP(side)                                                                       \
    "<shape type='rectangle'>" AT(                                                       \
        "<scale value='" side "'/><rotate x='1' angle='90'/>"                            \
        "<translate y='1.95'/>") "<emitter type='area'><rgb name='radiance' "            \
                                 "value='5'/></emitter></shape>"
#define WALLS                                                                            \
    "<shape type='cube'>" AT("<scale value='2'/>") "<boolean name='flip_normals' "       \
                                                   "value='true'/>" GRAY(                \
                                                       ".5") "</shape>"
#define GLASS                                                                            \
    "<shape type='sphere'><float name='radius' value='.6'/><point name='center' "        \
    "value='0,-.8,0'/><bsdf type='dielectric'/></shape>"
#define METAL                                                                            \
    "<shape type='cylinder'><point name='p0' value='0,-2,0'/><point name='p1' "          \
    "value='0,-1.4,0'/><float name='radius' value='1'/><boolean name='flip_normals' "    \
    "value='true'/><bsdf type='twosided'><bsdf type='roughconductor'><float "            \
    "name='alpha' value='.05'/></bsdf></bsdf></shape>"
/* A lamp in a tube, whose light comes by the ceiling alone. */
#define HIDDEN                                                                           \
    "<shape type='disk'>" AT(                                                            \
        "<scale value='.3'/><rotate x='1' angle='-90'/>"                                 \
        "<translate y='1'/>") "<emitter type='area'><rgb name='radiance' "               \
                              "value='50'/></emitter></shape>"                           \
                              "<shape type='cylinder'><point name='p0' "                 \
                              "value='0,.95,0'/><point name='p1' "                       \
                              "value='0,1.5,0'/><float name='radius' "                   \
                              "value='.35'/><bsdf type='twosided'>" GRAY(                \
                                  ".1") "</bsdf></shape>"
/* clang-format on */

static const struct {
    const char *name, *body; /* NULL: scenes/headlamp.xml */
} cases[] = {
    {"room, camera", WALLS LAMP(".5") CAMERA},
    {"room, lamp .05, camera", WALLS LAMP(".05") CAMERA},
    {"lamp in a tube under the ceiling, camera", WALLS HIDDEN CAMERA},
    {"glass ball, lamp .3, camera (caustic)", WALLS LAMP(".3") GLASS CAMERA},
    {"ring of metal, lamp .3, camera (caustic)", WALLS LAMP(".3") METAL CAMERA},
    {"room, meter .5", WALLS LAMP(".5") METER(".5")},
    {"room, meter .02", WALLS LAMP(".5") METER(".02")},
    {"glass ball, lamp .1, meter .5 (caustic)", WALLS LAMP(".1") GLASS METER(".5")},
    {"glass ball, lamp .5, meter .1", WALLS LAMP(".5") GLASS METER(".1")},
    {"headlamp in fog, lux on the wall", NULL},
};

static imp_scene *scene_of(size_t i, int from)
{
    struct imp_load_options load = IMP_LOAD_OPTIONS_INIT;
    char text[8192];
    const char *const defines[] = {text};
    imp_scene *scene;
    load.mode = IMP_MONO;
    if (!cases[i].body) { /* from the sensor, photons aim at the reflector's opening */
        strcpy(text, "integrator=photons");
        load.defines = defines;
        load.n_defines = from == 0;
        must(imp_scene_load(ctx, IMP_SCENES "/headlamp.xml", &load, &scene));
        return scene;
    }
    const int n = snprintf(
        text, sizeof text,
        "<scene version='3.0.0'><integrator type='bdpt'><integer name='max_depth' "
        "value='8'/></integrator>%s</scene>",
        cases[i].body);
    must(imp_scene_load_string(ctx, text, (size_t)n, "which_end", &load, &scene));
    return scene;
}

/* ---- Measurements ------------------------------------------------------------------- */

struct result {
    double mean, error, seconds; /* relative error, for this time */
    double walks, segments, rays;
};

static struct result measured(imp_scene *scene, enum imp_from from, int spp)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_film_info info = {.size = sizeof info};
    struct result r = {0};
    imp_film *film;
    run.from = from;
    run.spp = spp;
    run.points = IMP_POINTS_INDEPENDENT;
    segments = shadows = 0;
    const double start = processor();
    must(imp_render(scene, &run, &film));
    r.seconds = processor() - start;
    must(imp_film_get_info(film, &info));
    const size_t n = (size_t)info.width * (size_t)info.height * (size_t)info.channels;
    const float *mean = imp_film_mean(film), *se = imp_film_se(film);
    double square = 0;
    for (size_t k = 0; k < n; k++) {
        r.mean += (double)mean[k] / (double)n;
        square += (double)se[k] * (double)se[k] / (double)n;
    }
    r.error = sqrt(square) / r.mean;
    r.walks = (double)info.width * info.height * (double)info.spp;
    r.segments = segments;
    r.rays = segments + shadows;
    imp_film_destroy(film);
    return r;
}

/* With as many samples as take about this time. */
static struct result timed(imp_scene *scene, enum imp_from from, double seconds)
{
    struct result r = measured(scene, from, 16);
    int spp = 16;
    while (r.seconds < 0.6 * seconds && spp < 1 << 28) {
        const double more = fmin(0.9 * seconds / fmax(r.seconds, 1e-4), 64);
        spp = (int)(spp * fmax(more, 1.5));
        r = measured(scene, from, spp);
    }
    return r;
}

static void print(size_t i, const struct result *r, int ends)
{
    printf("| %s ", cases[i].name);
    for (int e = 0; e < 3; e++)
        if (e < ends) printf("| %.2g ", r[e].seconds * r[e].error * r[e].error / 1e-4);
        else printf("| ");
    for (int e = 0; e < 3; e++)
        if (e < ends)
            printf("| %.2g, %.2g, %.2g ", 1e-6 * r[e].walks / r[e].seconds,
                   1e-6 * r[e].segments / r[e].seconds, 1e-6 * r[e].rays / r[e].seconds);
        else printf("| ");
    printf("|");
    for (int e = 0; e < ends; e++) printf(" %.4g", r[e].mean);
    printf(" |\n");
    fflush(stdout);
}

int main(int argc, char **argv)
{
    const size_t n = sizeof cases / sizeof *cases;
    const double seconds = argc > 1 ? atof(argv[1]) : 2;
    const size_t first = argc > 2 ? (size_t)atoi(argv[2]) : 0;
    const size_t end = argc > 3 ? (size_t)atoi(argv[3]) + 1 : n;
    struct imp_context_options options = IMP_CONTEXT_OPTIONS_INIT;
    static const enum imp_from ends[] = {IMP_FROM_SENSOR, IMP_FROM_LIGHTS,
                                         IMP_FROM_SCENE};
    options.threads = 1;
    if (imp_context_create(&options, &ctx) != IMP_OK) return 3;
    printf(
        "| scene | from the sensor, s | light tracing, s | bidirectional, s | 10^6 "
        "walks, "
        "segments, rays a second from the sensor | light tracing | bidirectional | means "
        "|\n|---|---|---|---|---|---|---|---|\n");
    for (size_t i = first; i < end && i < n; i++) {
        const int n_ends = cases[i].body ? 3 : 2; /* bdpt refuses thin glass in fog */
        struct result r[3] = {{0}};
        for (int e = 0; e < n_ends; e++) {
            imp_scene *scene = scene_of(i, e);
            r[e] = timed(scene, ends[e], seconds);
            imp_scene_destroy(scene);
        }
        print(i, r, n_ends);
    }
    imp_context_destroy(ctx);
    return 0;
}

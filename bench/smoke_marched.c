/* SPDX-License-Identifier: Apache-2.0
 *
 * A plume of smoke, and its shadow on a floor, by walks and by a ray marcher in equal
 * processor time (Morley et al. 2006, figures 7 and 8): light of a square lamp that is
 * scattered once, or reaches the floor.
 *
 *     smoke_marched FOLDER [CELLS [SECONDS]]
 *
 * writes FOLDER/smoke_walks.png, smoke_marched.png, shadow_walks.png, shadow_marched.png,
 * and prints root mean square errors against many walks. The marcher takes a step a cell
 * along the ray and along a shadow ray from each step; the lamp's point is another for each. */
#include "plume.h"
#include "walk/media/tracking.h"
#include <importon/importon.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { RES = 96, TRUTH = 24 };
static imp_context *ctx;

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "smoke_marched: %s\n", imp_last_error(ctx));
    exit(3);
}
static double cpu(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Smoke in the unit cube over a floor at y = -0.02, a lamp of side 1 and radiance 20 that
 * looks down from (2, 2.5, 1/2). */
#define ALBEDO   0.9
#define FLOOR    -0.02
#define PAINT    0.6
#define RADIANCE 20.
#define CAMERA(origin, target)                                                           \
    "<sensor type='perspective'><float name='fov' value='32'/><transform "               \
    "name='to_world'><lookat origin='" origin "' target='" target "' up='0,1,0'/>"       \
    "</transform><film type='hdrfilm'><integer name='width' value='96'/><integer "       \
    "name='height' value='96'/><rfilter type='box'/></film></sensor>"
static const imp_v3 lamp = {2, 2.5, .5, 0};
static const char scene_text[] =
    "<scene version='3.0.0'><integrator type='volpath'><integer name='max_depth' "
    "value='2'/></integrator><medium type='heterogeneous' id='smoke'><float "
    "name='albedo' value='0.9'/><volume name='sigma_t' type='gridvolume'><string "
    "name='filename' value='%s'/></volume><float name='scale' value='0.5'/></medium>"
    "<shape type='cube'><bsdf type='null'/><ref id='smoke' name='interior'/><transform "
    "name='to_world'><scale value='0.5'/><translate x='0.5' y='0.5' z='0.5'/>"
    "</transform></shape><shape type='rectangle'><bsdf type='diffuse'><float "
    "name='reflectance' value='0.6'/></bsdf><transform name='to_world'><rotate x='1' "
    "angle='-90'/><scale value='40'/><translate y='-0.02'/></transform></shape><shape "
    "type='rectangle'><emitter type='area'><float name='radiance' value='20'/></emitter>"
    "<transform name='to_world'><rotate x='1' angle='90'/><scale value='0.5'/><translate "
    "x='2' y='2.5' z='0.5'/></transform></shape>" CAMERA("0.6,1.1,3.4", "0.4,0.42,0.5")
        CAMERA("-1.2,1.4,2.6", "-0.55,-0.02,0.5") "</scene>";

static double uniform(void) { return drand48(); }

/* Where the ray is in the unit cube. */
static bool in_cube(imp_v3 o, imp_v3 d, double *near, double *far)
{
    for (int a = 0; a < 3; a++) {
        const double t0 = -o[a] / d[a], t1 = (1 - o[a]) / d[a];
        *near = fmax(*near, fmin(t0, t1));
        *far = fmin(*far, fmax(t0, t1));
    }
    return *near < *far;
}
static double sigma_at(const struct imp_medium *m, imp_v3 p)
{
    imp_spec in[IMP_INPUTS_MAX];
    return imp__extinction_at(m, p, NULL, in)[0];
}
static double depth(const struct imp_medium *m, imp_v3 o, imp_v3 d, double far, int steps)
{
    double near = 0, sum = 0;
    if (!in_cube(o, d, &near, &far)) return 0;
    for (int k = 0; k < steps; k++)
        sum += sigma_at(m, o + d * (near + (far - near) * (k + .5) / steps));
    return sum * (far - near) / steps;
}

/* Irradiance across the direction *d to a point of the lamp, through the smoke. */
static double from_lamp(const struct imp_medium *m, imp_v3 p, int steps, imp_v3 *d)
{
    const imp_v3 q = lamp + imp__v3(uniform() - .5, 0, uniform() - .5), way = q - p;
    const double length = imp__length(way);
    *d = way * (1 / length);
    return RADIANCE * (*d)[1] / (length * length) * exp(-depth(m, p, *d, length, steps));
}

static double marched(const struct imp_medium *m, const struct imp_sensor_ray *r,
                      int steps)
{
    imp_v3 d;
    double sum = 0, T = 1, near = 0;
    const double end = r->d[1] < 0 ? (FLOOR - r->o[1]) / r->d[1] : INFINITY;
    double far = end;
    if (in_cube(r->o, r->d, &near, &far)) {
        const double step = (far - near) / steps;
        for (int k = 0; k < steps; k++) {
            const imp_v3 p = r->o + r->d * (near + (k + .5) * step);
            const double sigma = sigma_at(m, p), half = exp(-sigma * step / 2);
            if (sigma > 0)
                sum += T * half * sigma * step * ALBEDO * IMP_INV_PI / 4 *
                       from_lamp(m, p, steps, &d);
            T *= half * half;
        }
    }
    if (end < INFINITY) {
        const double E = from_lamp(m, r->o + r->d * end, steps, &d);
        sum += T * PAINT * IMP_INV_PI * E * d[1];
    }
    return sum;
}

static double error_of(const float *value, const double *truth)
{
    double error = 0, mean = 0;
    for (int p = 0; p < RES * RES; p++) {
        error += pow((double)value[p] - truth[p], 2) / (RES * RES);
        mean += truth[p] / (RES * RES);
    }
    return 100 * sqrt(error) / mean;
}

static imp_film *walks(imp_scene *s, int sensor, int spp, uint64_t seed)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *f;
    run.sensor = sensor;
    run.spp = spp;
    run.seed = seed;
    must(imp_render(s, &run, &f));
    return f;
}

static void compare(imp_scene *s, int sensor, const char *folder, const char *what,
                    int cells, double seconds)
{
    static double truth[RES * RES], sum[RES * RES];
    char path[1024];
    double t = cpu();
    imp_film *f = walks(s, sensor, 16, 2);
    const int spp = (int)fmax(16 * seconds / (cpu() - t), 1);
    imp_film_destroy(f);
    f = walks(s, sensor, TRUTH * spp, 3);
    for (int p = 0; p < RES * RES; p++) truth[p] = (double)imp_film_mean(f)[p];
    imp_film_destroy(f);
    t = cpu();
    f = walks(s, sensor, spp, 1);
    const double walked = cpu() - t, error = error_of(imp_film_mean(f), truth);
    snprintf(path, sizeof path, "%s/%s_walks.png", folder, what);
    must(imp_film_write(f, path, NULL));

    /* The marcher's picture takes the film's place. */
    float *value = (float *)(uintptr_t)imp_film_mean(f);
    const struct imp_sensor *camera = s->sensors[sensor];
    const double lens[2] = {.5, .5};
    int passes = 0;
    memset(sum, 0, sizeof sum);
    for (t = cpu(); passes == 0 || cpu() - t < walked; passes++)
        for (int p = 0; p < RES * RES; p++) {
            struct imp_sensor_ray r;
            camera->ops->ray(camera, p % RES + uniform(), p / RES + uniform(), lens, &r);
            sum[p] += marched(s->media[0], &r, cells);
        }
    const double took = cpu() - t;
    for (int p = 0; p < RES * RES; p++) value[p] = (float)(sum[p] / passes);
    printf("%-7s %6d %8.2f %7.2f %8d %8.2f %7.2f\n", what, spp, walked, error, passes,
           took, error_of(value, truth));
    snprintf(path, sizeof path, "%s/%s_marched.png", folder, what);
    must(imp_film_write(f, path, NULL));
    imp_film_destroy(f);
}

int main(int argc, char **argv)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    struct imp_load_options load = IMP_LOAD_OPTIONS_INIT;
    const int cells = argc > 2 ? atoi(argv[2]) : 96;
    const double seconds = argc > 3 ? atof(argv[3]) : 0.3;
    char volume[1024], text[sizeof scene_text + 1024];
    imp_scene *s;
    if (argc < 2 || cells < 1 || cells > 512 || !(seconds > 0)) {
        fprintf(stderr, "usage: smoke_marched FOLDER [CELLS [SECONDS]]\n");
        return 2;
    }
    snprintf(volume, sizeof volume, "%s/smoke_marched.vol", argv[1]);
    if (!plume_write(volume, cells, 7)) {
        fprintf(stderr, "%s cannot be written\n", volume);
        return 3;
    }
    o.threads = 1;
    must(imp_context_create(&o, &ctx));
    snprintf(text, sizeof text, scene_text, volume);
    load.mode = IMP_MONO;
    must(imp_scene_load_string(ctx, text, strlen(text), "smoke_marched", &load, &s));
    remove(volume);
    srand48(7);
    puts("        samples  seconds  rmse %  marched  seconds  rmse %");
    compare(s, 0, argv[1], "smoke", cells, seconds);
    compare(s, 1, argv[1], "shadow", cells, seconds);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return 0;
}

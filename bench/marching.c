/* SPDX-License-Identifier: Apache-2.0
 *
 * Media as surfaces that are hit with the right probability, against a ray marcher (Morley
 * et al. 2006): look-ups of the extinction for a path, and for a marched ray, as the cells
 * along the ray grow in number while its optical depth stays; their slopes; and the root
 * mean square error of both after the same processor time.
 *
 *     marching [SPP]
 *
 * The first is single scattering of a point light in a cube of random layers of mean
 * extinction 2, the second the shadow of an area light below such layers. */
#include "marcher.h"
#include "walk/media/tracking.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { RES = 8, SIZES = 6, LARGEST = 4096 };

static imp_context *ctx;

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "marching: %s\n", imp_last_error(ctx));
    exit(3);
}
static double cpu(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static const char scene_text[] = /* with the name of the volume's file */
    "<scene version='3.0.0'><integrator type='volpath'><integer name='max_depth' "
    "value='2'/></integrator><medium type='heterogeneous' id='fog'><float name='albedo' "
    "value='0.8'/><volume name='sigma_t' type='gridvolume'><string name='filename' "
    "value='%s'/><string name='filter_type' value='nearest'/></volume></medium>"
    "<shape type='cube'><bsdf type='null'/><ref id='fog' name='interior'/><transform "
    "name='to_world'><scale value='0.5'/><translate x='0.5' y='0.5' z='0.5'/>"
    "</transform></shape><emitter type='point'><point name='position' x='2' y='0.5' "
    "z='3'/><float name='intensity' value='10'/></emitter><sensor type='orthographic'>"
    "<transform name='to_world'><scale value='0.4'/><lookat origin='0.5,0.5,-1' "
    "target='0.5,0.5,1' up='0,1,0'/></transform><film type='hdrfilm'><integer "
    "name='width' value='8'/><integer name='height' value='8'/><rfilter type='box'/>"
    "</film></sensor></scene>";

static imp_scene *scene_make(const struct marcher *m, const char *of)
{
    const int32_t head[5] = {1, 1, 1, m->n, 1};
    const float box[6] = {0, 0, 0, 1, 1, 1};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    char path[] = "/tmp/marching-XXXXXX", text[4096];
    imp_scene *scene;
    const int fd = mkstemp(path);
    FILE *f = fd < 0 ? NULL : fdopen(fd, "wb");
    if (!f || fwrite("VOL\3", 1, 4, f) != 4 || fwrite(head, 4, 5, f) != 5 ||
        fwrite(box, 4, 6, f) != 6 ||
        fwrite(m->sigma, sizeof *m->sigma, (size_t)m->n, f) != (size_t)m->n ||
        fclose(f) != 0) {
        fprintf(stderr, "marching: no file for the volume\n");
        exit(3);
    }
    snprintf(text, sizeof text, of, path);
    o.mode = IMP_MONO;
    must(imp_scene_load_string(ctx, text, strlen(text), "marching", &o, &scene));
    remove(path);
    return scene;
}

static int events_of(const struct imp_track *t) { return t ? t->n : 0; }

/* Tentative collisions of a walk and the way to its light, in the mean: each is a look-up. */
static double lookups(const imp_scene *s, int walks)
{
    const struct imp_tracer tracer = {
        .scene = s, .integrator = imp__walk_integrator(s), .sensor = s->sensors[0]};
    struct imp_arena arena;
    int64_t sum = 0;
    imp__arena_init(&arena, ctx);
    for (int k = 0; k < walks; k++) {
        const struct imp_arena_mark mark = imp__arena_mark(&arena);
        struct imp_walk w;
        imp__walk_trace(&tracer, &arena, k % RES, k / RES % RES, k / (RES * RES), &w);
        for (const struct imp_vertex *v = w.first; v; v = v->next)
            sum += events_of(v->on) + events_of(v->to_light);
        imp__arena_rewind(&arena, mark);
    }
    imp__arena_free(&arena);
    return (double)sum / walks;
}

/* ---- In the shadow of an area light -------------------------------------------------- */

/* A white floor at z = -1/2 below layers without an end, a black screen at z = 1.5 that covers
 * x > 1/2, and a lamp of radiance 1 above it, of side 2 about (1/2, 1/2, 2). */
static const char shadow_text[] =
    "<scene version='3.0.0'><integrator type='volpath'><integer name='max_depth' "
    "value='2'/></integrator><medium type='heterogeneous' id='fog'><float name='albedo' "
    "value='0'/><volume name='sigma_t' type='gridvolume'><string name='filename' "
    "value='%s'/><string name='filter_type' value='nearest'/><transform "
    "name='to_world'><translate x='-0.5' y='-0.5'/><scale x='20' y='20' z='1'/>"
    "</transform></volume></medium><shape type='cube'><bsdf type='null'/><ref id='fog' "
    "name='interior'/><transform name='to_world'><translate z='1'/><scale x='10' y='10' "
    "z='0.5'/></transform></shape><shape type='rectangle'><bsdf type='diffuse'><float "
    "name='reflectance' value='1'/></bsdf><transform name='to_world'><scale value='9'/>"
    "<translate z='-0.5'/></transform></shape><shape type='rectangle'><bsdf "
    "type='diffuse'><float name='reflectance' value='0'/></bsdf><transform "
    "name='to_world'><scale value='5'/><translate x='5.5' z='1.5'/></transform></shape>"
    "<shape type='rectangle'><emitter type='area'><float name='radiance' value='1'/>"
    "</emitter><transform name='to_world'><rotate x='1' angle='180'/><translate x='0.5' "
    "y='0.5' z='2'/></transform></shape><sensor type='orthographic'><transform "
    "name='to_world'><scale value='0.4'/><lookat origin='0.5,0.5,-0.1' "
    "target='0.5,0.5,-1' up='0,1,0'/></transform><film type='hdrfilm'><integer "
    "name='width' value='8'/><integer name='height' value='8'/><rfilter type='box'/>"
    "</film></sensor></scene>";

/* What the lamp's point (u, v) brings to the floor at (x, y) but for the layers, and how far
 * the way through these is: 1/cos. */
static double brings(double x, double y, double u, double v, double *slant)
{
    const double dx = u - x, dy = v - y, r2 = dx * dx + dy * dy + 6.25,
                 cosine = 2.5 / sqrt(r2);
    *slant = 1 / cosine;
    return x + dx * .8 > .5 ? 0 : cosine * cosine / r2 / M_PI;
}

/* Place on the floor of a point of pixel p: x falls with the column, y with the row. */
static void floor_at(int p, double a, double b, double *x, double *y)
{
    *x = .5 + .4 * (2 * (p % RES + a) / RES - 1);
    *y = .5 - .4 * (2 * (p / RES + b) / RES - 1);
}

static void truths(const struct marcher *m, double truth[RES * RES])
{
    enum { SUB = 4, LAMP = 100 };
    double depth = 0, slant, x, y;
    for (int i = 0; i < m->n; i++) depth += (double)m->sigma[i] / m->n;
    for (int p = 0; p < RES * RES; p++) {
        truth[p] = 0;
        for (int k = 0; k < SUB * SUB; k++)
            for (int l = 0; l < LAMP * LAMP; l++) {
                floor_at(p, (k % SUB + .5) / SUB, (k / SUB + .5) / SUB, &x, &y);
                const double f = brings(x, y, -.5 + 2 * (l % LAMP + .5) / LAMP,
                                        -.5 + 2 * (l / LAMP + .5) / LAMP, &slant);
                truth[p] += 4 * f * exp(-depth * slant) / (SUB * SUB * LAMP * LAMP);
            }
    }
}

/* One sample of a pixel: a point of the lamp, and layers marched with the scene's own
 * look-ups. */
static double marched(const struct imp_medium *fog, int p, int steps)
{
    double x, y, slant, depth = 0;
    imp_spec in[IMP_INPUTS_MAX];
    floor_at(p, drand48(), drand48(), &x, &y);
    const double u = 2 * drand48() - .5, v = 2 * drand48() - .5,
                 f = brings(x, y, u, v, &slant);
    if (f == 0) return 0;
    for (int k = 0; k < steps; k++) {
        const double z = (k + .5) / steps, w = (z + .5) / 2.5;
        const imp_v3 at = {x + (u - x) * w, y + (v - y) * w, z, 0};
        depth += imp__extinction_at(fog, at, NULL, in)[0] / steps;
    }
    return 4 * f * exp(-depth * slant);
}

static double error_of(const double *value, const double *truth)
{
    double error = 0, mean = 0;
    for (int p = 0; p < RES * RES; p++) {
        error += pow(value[p] - truth[p], 2) / (RES * RES);
        mean += truth[p] / (RES * RES);
    }
    return 100 * sqrt(error) / mean;
}

/* The walks' error after `spp` samples of each pixel, and the marcher's in the same time,
 * one step a layer. */
static void equal_time(imp_scene *s, const struct marcher *m, int spp)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *f;
    double truth[RES * RES], value[RES * RES] = {0}, t = cpu();
    int samples = 0;
    truths(m, truth);
    run.spp = spp;
    t = cpu();
    must(imp_render(s, &run, &f));
    const double seconds = cpu() - t;
    double walks[RES * RES];
    for (int p = 0; p < RES * RES; p++) walks[p] = (double)imp_film_mean(f)[p];
    imp_film_destroy(f);
    for (t = cpu(); cpu() - t < seconds; samples++)
        for (int p = 0; p < RES * RES; p++) value[p] += marched(s->media[0], p, m->n);
    for (int p = 0; p < RES * RES; p++) value[p] /= samples;
    printf("%5d  %7d  %9.2f  %7d  %9.2f  %.3f\n", m->n, spp, error_of(walks, truth),
           samples, error_of(value, truth), seconds);
}

int main(int argc, char **argv)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    const int spp = argc > 1 ? atoi(argv[1]) : 4096;
    double x[SIZES], y[2][SIZES];
    static float sigma[LARGEST];
    if (spp < 1) {
        fprintf(stderr, "usage: marching [SPP]\n");
        return 2;
    }
    o.threads = 1;
    must(imp_context_create(&o, &ctx));
    puts("cells  look-ups of a path  of a marched ray");
    for (int k = 0; k < SIZES; k++) {
        struct marcher m = {.n = 32 << k,
                            .sigma = sigma,
                            .albedo = .8,
                            .light = {2, .5, 3},
                            .intensity = 10};
        srand48(7);
        for (int i = 0; i < m.n; i++) sigma[i] = (float)(4 * drand48());
        imp_scene *s = scene_make(&m, scene_text);
        x[k] = log(m.n);
        y[0][k] = lookups(s, 20000);
        marcher_radiance(&m, .5, .5, m.n);
        y[1][k] = (double)m.lookups;
        printf("%5d  %18.2f  %16.0f\n", m.n, y[0][k], y[1][k]);
        imp_scene_destroy(s);
    }
    for (int j = 0; j < 2; j++) {
        double sx = 0, sy = 0, sxx = 0, sxy = 0;
        for (int k = 0; k < SIZES; k++) {
            const double l = log(y[j][k]);
            sx += x[k], sy += l, sxx += x[k] * x[k], sxy += x[k] * l;
        }
        printf("slope of %s in logarithms: %.2f\n", j ? "the marcher" : "paths",
               (SIZES * sxy - sx * sy) / (SIZES * sxx - sx * sx));
    }
    puts("In the shadow of an area light, in equal time:\n"
         "cells  samples  rmse in %  marched  rmse in %  seconds");
    for (int k = 3; k < 8; k += 2) {
        struct marcher m = {.n = 32 << k,
                            .sigma = sigma,
                            .albedo = .8,
                            .light = {2, .5, 3},
                            .intensity = 10};
        srand48(7);
        for (int i = 0; i < m.n; i++) sigma[i] = (float)(4 * drand48());
        imp_scene *s = scene_make(&m, shadow_text);
        equal_time(s, &m, spp);
        imp_scene_destroy(s);
    }
    imp_context_destroy(ctx);
    return 0;
}

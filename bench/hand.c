/* SPDX-License-Identifier: Apache-2.0
 *
 * The library beside a path tracer that was written by hand for scenes like this one
 * (hand_tracer.c): five balls, two of them mirrors, on a floor between two walls under a
 * rectangular light. Both make the same picture: first their means and those of 8 x 8 blocks are
 * compared, each difference by its z-score. Then processor seconds of a sample, in rounds in
 * which they take turns, by one thread and by two.
 *
 *     hand [--rounds N] [--spp N] [--res N]
 *
 * Prints rows for docs/speed.md; exit code 1: the pictures differ. */
#include "hand_tracer.h"
#include <importon/importon.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum {
    ROUNDS_MAX = 99,
    PICTURES = 64,
    EACH = 8,
    BLOCKS = 8,
    SIDE = 64,
    NUMBERS = 3 * BLOCKS * BLOCKS
};

static const struct hand_sphere spheres[] = {{{-1.7, 0.7, 0.2}, 0.7, {.75, .25, .2}, 0},
                                             {{0, 0.9, 1.1}, 0.9, {.9, .85, .8}, 1},
                                             {{1.6, 0.6, 0.3}, 0.6, {.2, .45, .75}, 0},
                                             {{-0.5, 0.35, -0.9}, 0.35, {.8, .9, .95}, 1},
                                             {{0.6, 0.4, -0.8}, 0.4, {.7, .7, .3}, 0}};
static const struct hand_rectangle rectangles[] = {
    {{0, 0, 0}, {0, 0, 4}, {4, 0, 0}, {.6, .6, .6}, {0}},    /* floor, y up */
    {{0, 2, 3}, {-4, 0, 0}, {0, 2, 0}, {.7, .65, .6}, {0}},  /* back, to -z */
    {{-3, 2, 0}, {0, 0, -4}, {0, 2, 0}, {.3, .6, .35}, {0}}, /* left, to +x */
    {{0.3, 3.9, -0.5}, {1, 0, 0}, {0, 0, .7}, {0}, {17, 14, 11}}};
static const struct hand_scene scene = {.sphere = spheres,
                                        .rectangle = rectangles,
                                        .n_spheres = 5,
                                        .n_rectangles = 4,
                                        .light = 3,
                                        .eye = {0.8, 2.2, -6},
                                        .target = {0, 0.9, 0},
                                        .up = {0, 1, 0},
                                        .fov = 42,
                                        .max_depth = 8,
                                        .rr_depth = 5};

static void must(imp_context *ctx, enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "hand: %s\n", imp_last_error(ctx));
    exit(3);
}
static double processor(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* The same numbers as a scene file. */
static imp_scene *library_scene(imp_context *ctx, int res)
{
    char text[8192];
    int n = 0;
#define PUT(...) (n += snprintf(text + n, sizeof text - (size_t)n, __VA_ARGS__))
#define THREE(v) (v)[0], (v)[1], (v)[2]
    PUT("<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='%d'/>"
        "<integer name='rr_depth' value='%d'/></integrator>\n<sensor type='perspective'>"
        "<float name='fov' value='%.17g'/><transform name='to_world'>"
        "<lookat origin='%.17g,%.17g,%.17g' target='%.17g,%.17g,%.17g' "
        "up='%.17g,%.17g,%.17g'/></transform><film type='hdrfilm'><integer name='width' "
        "value='%d'/><integer name='height' value='%d'/><rfilter type='box'/></film>"
        "</sensor>\n",
        scene.max_depth, scene.rr_depth, scene.fov, THREE(scene.eye), THREE(scene.target),
        THREE(scene.up), res, res);
    for (int i = 0; i < scene.n_spheres; i++) {
        const struct hand_sphere *k = &spheres[i];
        PUT("<shape type='sphere'><point name='center' x='%.17g' y='%.17g' z='%.17g'/>"
            "<float name='radius' value='%.17g'/>",
            THREE(k->centre), k->radius);
        PUT("<bsdf type='%s'><rgb name='%s' "
            "value='%.17g,%.17g,%.17g'/>%s</bsdf></shape>\n",
            k->mirror ? "conductor" : "diffuse",
            k->mirror ? "specular_reflectance" : "reflectance", THREE(k->albedo),
            k->mirror ? "<string name='material' value='none'/>" : "");
    }
    for (int i = 0; i < scene.n_rectangles; i++) {
        const struct hand_rectangle *k = &rectangles[i];
        const double *a = k->a, *b = k->b, *c = k->centre;
        const double normal[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                  a[0] * b[1] - a[1] * b[0]};
        PUT("<shape type='rectangle'><transform name='to_world'><matrix value='");
        for (int r = 0; r < 3; r++)
            PUT("%.17g %.17g %.17g %.17g ", a[r], b[r], normal[r], c[r]);
        PUT("0 0 0 1'/></transform>");
        if (i == scene.light)
            PUT("<emitter type='area'><rgb name='radiance' value='%.17g,%.17g,%.17g'/>"
                "</emitter></shape>\n",
                THREE(k->emits));
        else
            PUT("<bsdf type='diffuse'><rgb name='reflectance' value='%.17g,%.17g,%.17g'/>"
                "</bsdf></shape>\n",
                THREE(k->albedo));
    }
    PUT("</scene>\n");
    imp_scene *out;
    must(ctx, imp_scene_load_string(ctx, text, (size_t)n, "hand", NULL, &out));
    return out;
}

/* Processor seconds of a picture. out [res][res][3]; NULL: it is not looked at. */
static double library_render(imp_context *ctx, const imp_scene *s, int spp, uint64_t seed,
                             int res, double *out)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = spp;
    run.seed = seed;
    const double start = processor();
    must(ctx, imp_render(s, &run, &film));
    const double seconds = processor() - start;
    for (int k = 0; out && k < 3 * res * res; k++) out[k] = imp_film_mean(film)[k];
    imp_film_destroy(film);
    return seconds;
}

/* ---- Is it the same picture? ------------------------------------------------------- */

struct moments {
    double sum[NUMBERS + 3], squares[NUMBERS + 3]; /* of blocks; of the picture */
};

static void moments_add(struct moments *m, const double *picture)
{
    double value[NUMBERS + 3] = {0};
    const int block = SIDE / BLOCKS;
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++)
            for (int c = 0; c < 3; c++) {
                const double v = picture[3 * (y * SIDE + x) + c];
                value[3 * (y / block * BLOCKS + x / block) + c] += v / (block * block);
                value[NUMBERS + c] += v / (SIDE * SIDE);
            }
    for (int k = 0; k < NUMBERS + 3; k++) {
        m->sum[k] += value[k];
        m->squares[k] += value[k] * value[k];
    }
}

static double variance_of_mean(const struct moments *m, int k)
{
    return (m->squares[k] - m->sum[k] * m->sum[k] / PICTURES) /
           ((PICTURES - 1.) * PICTURES);
}

static int compare_pictures(imp_context *ctx)
{
    static double picture[3 * SIDE * SIDE];
    static struct moments of[2];
    imp_scene *s = library_scene(ctx, SIDE);
    for (int k = 0; k < PICTURES; k++) {
        library_render(ctx, s, EACH, (uint64_t)k, SIDE, picture);
        moments_add(&of[0], picture);
        hand_render(&scene, SIDE, SIDE, EACH, (uint64_t)k + 1, 1, picture);
        moments_add(&of[1], picture);
    }
    imp_scene_destroy(s);
    double worst = 0, squares = 0, mean[2][3], se[2][3], z[3], noise[2] = {0};
    int n = 0;
    for (int k = 0; k < NUMBERS + 3; k++) {
        const double v0 = variance_of_mean(&of[0], k), v1 = variance_of_mean(&of[1], k);
        const double d = (of[0].sum[k] - of[1].sum[k]) / PICTURES;
        const double score = v0 + v1 > 0 ? d / sqrt(v0 + v1) : d == 0 ? 0 : INFINITY;
        if (k < NUMBERS) {
            worst = fmax(worst, fabs(score));
            squares += score * score;
            noise[0] += v0, noise[1] += v1;
            n++;
            continue;
        }
        z[k - NUMBERS] = score;
        for (int p = 0; p < 2; p++) {
            mean[p][k - NUMBERS] = of[p].sum[k] / PICTURES;
            se[p][k - NUMBERS] = sqrt(p ? v1 : v0);
        }
    }
    for (int p = 0; p < 2; p++)
        printf("%s: mean %.6f %.6f %.6f +- %.6f %.6f %.6f\n", p ? "hand" : "library",
               THREE(mean[p]), THREE(se[p]));
    printf("z of the means %.2f %.2f %.2f; of %d numbers of blocks at most %.2f, mean "
           "square "
           "%.3f; variance library / hand %.3f\n",
           THREE(z), n, worst, squares / n, noise[0] / noise[1]);
    for (int c = 0; c < 3; c++) worst = fmax(worst, fabs(z[c]));
    return worst < 4;
}

/* ---- Time ---------------------------------------------------------------------------- */

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void compare_times(int threads, int rounds, int res, int spp)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    imp_context *ctx;
    double library[ROUNDS_MAX], hand[ROUNDS_MAX], ratio[ROUNDS_MAX];
    double *picture = malloc(3 * (size_t)res * (size_t)res * sizeof *picture);
    if (!picture) abort();
    o.threads = threads;
    must(NULL, imp_context_create(&o, &ctx));
    imp_scene *s = library_scene(ctx, res);
    const double samples = (double)res * res * spp;
    for (int r = -1; r < rounds; r++) { /* the first does not count */
        const double t = library_render(ctx, s, spp, (uint64_t)r + 2, res, NULL);
        const double start = processor();
        hand_render(&scene, res, res, spp, (uint64_t)r + 2, threads, picture);
        if (r < 0) continue;
        hand[r] = (processor() - start) / samples;
        library[r] = t / samples;
        ratio[r] = library[r] / hand[r];
    }
    qsort(library, (size_t)rounds, sizeof *library, by_value);
    qsort(hand, (size_t)rounds, sizeof *hand, by_value);
    qsort(ratio, (size_t)rounds, sizeof *ratio, by_value);
    printf("| %d | %.0f | %.0f | %.2f | %.2f (%.2f to %.2f) |\n", threads,
           1e9 * library[0], 1e9 * hand[0], library[0] / hand[0], ratio[rounds / 2],
           ratio[0], ratio[rounds - 1]);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    free(picture);
}

int main(int argc, char **argv)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    imp_context *ctx;
    int rounds = 9, spp = 32, res = 128;
    for (int k = 1; k < argc; k++) {
        int *to = !strcmp(argv[k], "--rounds") ? &rounds
                  : !strcmp(argv[k], "--spp")  ? &spp
                  : !strcmp(argv[k], "--res")  ? &res
                                               : NULL;
        if (!to || ++k == argc || (*to = atoi(argv[k])) < 1 || rounds > ROUNDS_MAX) {
            fprintf(stderr, "usage: hand [--rounds N] [--spp N] [--res N]\n");
            return 2;
        }
    }
    o.threads = 1;
    must(NULL, imp_context_create(&o, &ctx));
    const int same = compare_pictures(ctx);
    imp_context_destroy(ctx);
    printf("\n| threads | library, ns a sample | hand | ratio of minima | median of %d "
           "rounds "
           "(all) |\n|---|---|---|---|---|\n",
           rounds);
    for (int threads = 1; threads <= 2; threads++)
        compare_times(threads, rounds, res, spp);
    if (!same) fprintf(stderr, "hand: the pictures differ\n");
    return !same;
}

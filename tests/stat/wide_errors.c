/* SPDX-License-Identifier: Apache-2.0
 *
 * Standard errors of losses and their gradients through filters wider than a pixel, whose
 * pixels share walks, against the spread over seeds: at the optimum, where adjoints are
 * noise that neighbours share, and away from it. Run with "long" for all filters. */
#include "imp_cornell.h"
#include "imp_tap.h"
#include <stdbool.h>

enum { MOST = 16 };

static imp_context *ctx;

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}
static double median(double *x, size_t n)
{
    qsort(x, n, sizeof *x, by_value);
    return x[n / 2];
}

/* ---- A few numbers ----------------------------------------------------------------- */

struct setting {
    const char *filter; /* its element */
    int side, spp, seeds;
    enum imp_points points;
    enum imp_loss loss;
    double away; /* factor of all numbers */
    bool fixed;  /* an adjoint image, not a loss */
};

static void name_of(const struct setting *s, char name[200])
{
    static const char *const losses[] = {"l2", "relative l2", "l1", "log"};
    snprintf(name, 200, "%s, %d spp, %s, %s%s", s->filter, s->spp,
             s->points == IMP_POINTS_SOBOL ? "sobol" : "independent",
             s->fixed ? "fixed adjoint" : losses[s->loss],
             s->fixed       ? ""
             : s->away == 1 ? " at the optimum"
                            : " away from it");
}

static void errors(const struct setting *s)
{
    static const char *const active[] = {
        "white.reflectance.value", "red.reflectance.value", "green.reflectance.value",
        "light.radiance.value"};
    static struct tap_stat value[MOST + 1];
    double x[MOST], g[MOST], se[MOST], told[MOST + 1] = {0}, ratio[MOST];
    char name[200];
    imp_scene *scene = test_cornell_through(ctx, s->filter, s->side);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_target target = IMP_TARGET_INIT;
    imp_film *film;
    imp_problem *p;
    run.spp = 1024;
    run.seed = 7;
    test_must(ctx, imp_render(scene, &run, &film));
    test_must(ctx, imp_problem_create(scene, &p));
    for (int k = 0; k < 4; k++) test_must(ctx, imp_problem_activate(p, active[k]));
    target.pixels = imp_film_mean(film);
    target.width = target.height = s->side;
    target.channels = 3;
    target.loss = s->loss;
    target.epsilon = 0.05;
    test_must(ctx, imp_problem_add_target(p, &target));
    const size_t n = imp_problem_n(p);
    imp_problem_get_x(p, x);
    for (size_t k = 0; k < n; k++) x[k] *= s->away;
    test_must(ctx, imp_problem_set_x(p, x));
    memset(value, 0, sizeof value);
    for (int seed = 0; seed < s->seeds; seed++) {
        struct imp_estimate f = {0};
        run.spp = s->spp;
        run.seed = 100 + (uint64_t)seed;
        run.points = s->points;
        if (s->fixed)
            test_must(ctx, imp_problem_reverse(p, imp_film_mean(film), &run, g, se));
        else test_must(ctx, imp_problem_objective(p, NULL, &run, &f, g, se));
        for (size_t k = 0; k < n; k++) {
            tap_add(&value[k], g[k]);
            told[k] += se[k] * se[k] / s->seeds;
        }
        tap_add(&value[n], f.value);
        told[n] += f.se * f.se / s->seeds;
    }
    double lowest = INFINITY, highest = 0;
    for (size_t k = 0; k < n; k++) {
        ratio[k] = sqrt(told[k] / (value[k].m2 / (value[k].n - 1)));
        lowest = fmin(lowest, ratio[k]);
        highest = fmax(highest, ratio[k]);
    }
    const double mid = median(ratio, n);
    const double loss = s->fixed ? 1 : sqrt(told[n] / (value[n].m2 / (value[n].n - 1)));
    name_of(s, name);
    tap_ok(mid >= 0.85 && mid <= 1.2 && lowest >= 0.7 && highest <= 1.4,
           "%s: errors of the gradient # told/seen %.2f (%.2f to %.2f)", name, mid,
           lowest, highest);
    if (!s->fixed)
        tap_ok(loss >= 0.8 && loss <= 1.25, "%s: error of the loss # told/seen %.2f",
               name, loss);
    imp_film_destroy(film);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* ---- Many numbers, in fixed point -------------------------------------------------- */

/* A lamp before a wall of texels, through a filter; a ball shades some of it. */
static imp_scene *wall_of(const char *filter, int side, int texels)
{
    const double camera[16] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 4, 0, 0, 0, 1};
    const double before[16] = {.5, 0, 0, -1, 0, -.5, 0, 1, 0, 0, -1, 2, 0, 0, 0, 1};
    const double ball[16] = {.3, 0, 0, -.5, 0, .3, 0, .5, 0, 0, .3, .6, 0, 0, 0, 1};
    float *pixels = malloc(3 * (size_t)(texels * texels) * sizeof *pixels);
    imp_scene *s;
    for (int k = 0; k < 3 * texels * texels; k++)
        pixels[k] = .3f + .4f * (float)(k * 37 % 101) / 101;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "integrator", "path", NULL, NULL);
    imp_scene_integer(s, "max_depth", 3);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_transform(s, "to_world", camera);
    imp_scene_float(s, "fov", 30);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", side);
    imp_scene_integer(s, "height", side);
    imp_scene_begin(s, "rfilter", filter, NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "rectangle", NULL, NULL);
    imp_scene_transform(s, "to_world", before);
    imp_scene_begin(s, "emitter", "area", NULL, NULL);
    imp_scene_float(s, "radiance", 8);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "sphere", NULL, NULL);
    imp_scene_transform(s, "to_world", ball);
    imp_scene_end(s);
    test_picture_wall(s, texels, texels, pixels);
    test_must(ctx, imp_scene_commit(s));
    free(pixels);
    return s;
}

static void texels(const char *filter, enum imp_points points, int spp, int seeds)
{
    enum { SIDE = 24, TEXELS = 20, N = 3 * TEXELS * TEXELS };
    static struct tap_stat value[N];
    static double told[N], g[N], se[N], ratio[N];
    imp_scene *scene = wall_of(filter, SIDE, TEXELS);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_target target = IMP_TARGET_INIT;
    imp_film *film;
    double off = 0, all = 0;
    run.spp = 256;
    test_must(ctx, imp_render(scene, &run, &film));
    imp_problem *p = test_problem(ctx, scene, "*reflectance.data");
    target.pixels = imp_film_mean(film);
    target.width = target.height = SIDE;
    target.channels = 3;
    test_must(ctx, imp_problem_add_target(p, &target));
    if (imp_problem_n(p) != N) exit(99);
    memset(value, 0, sizeof value);
    memset(told, 0, sizeof told);
    for (int seed = 0; seed < seeds; seed++) {
        run.spp = spp;
        run.seed = 100 + (uint64_t)seed;
        run.points = points;
        test_must(ctx, imp_problem_objective(p, NULL, &run, NULL, g, se));
        for (int k = 0; k < N; k++) {
            tap_add(&value[k], g[k]);
            told[k] += se[k] * se[k] / seeds;
        }
    }
    size_t used = 0;
    for (int k = 0; k < N; k++) {
        const double seen = value[k].m2 / (value[k].n - 1);
        all += seen;
        off += told[k];
        if (seen > 0) ratio[used++] = sqrt(told[k] / seen);
    }
    const double mid = median(ratio, used);
    tap_ok(
        mid >= 0.85 && mid <= 1.3 && sqrt(off / all) < 1.4 && sqrt(off / all) > 0.8,
        "%s, %d spp, %s, %d texels # told/seen %.2f (10 %% below %.2f, above %.2f), of "
        "all %.2f",
        filter, spp, points == IMP_POINTS_SOBOL ? "sobol" : "independent", N, mid,
        ratio[used / 10], ratio[9 * used / 10], sqrt(off / all));
    imp_film_destroy(film);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    static const enum imp_points ONE = IMP_POINTS_INDEPENDENT, SETS = IMP_POINTS_SOBOL;
    static const char *const filters[] = {"box", "tent", "gaussian", "mitchell",
                                          "lanczos"};
    static const enum imp_loss losses[] = {IMP_LOSS_L2, IMP_LOSS_LOG, IMP_LOSS_L1};
    const bool all = argc > 1 && strcmp(argv[1], "long") == 0;
    ctx = test_context(1);
    errors(&(struct setting){"<rfilter type='gaussian'/>", 16, 32, 100, ONE, IMP_LOSS_L2,
                             1, false});
    errors(&(struct setting){"<rfilter type='gaussian'/>", 16, 8, 100, ONE, IMP_LOSS_L2,
                             .7, false});
    errors(&(struct setting){"<rfilter type='tent'/>", 16, 16, 100, SETS, IMP_LOSS_LOG, 1,
                             false});
    errors(&(struct setting){"<rfilter type='tent'/>", 16, 2, 100, ONE, IMP_LOSS_L1, 1,
                             false});
    errors(&(struct setting){"<rfilter type='mitchell'/>", 16, 8, 100, SETS, IMP_LOSS_L2,
                             1, true});
    texels("gaussian", ONE, 8, 60);
    for (int f = 0; all && f < 5; f++)
        for (int sets = 0; sets < 2; sets++) {
            const enum imp_points kind = sets ? SETS : ONE;
            char filter[40];
            snprintf(filter, sizeof filter, "<rfilter type='%s'/>", filters[f]);
            struct setting s = {filter, 24, 32, 100, kind, IMP_LOSS_L2, 1, true};
            errors(&s);
            for (int k = 0; k < 12; k++) {
                static const int spp[] = {8, 32};
                s = (struct setting){
                    filter, 24, spp[k % 2], 100, kind, losses[k / 4], k / 2 % 2 ? .7 : 1,
                    false};
                errors(&s);
            }
            for (int spp = 8; f > 0 && spp <= 32; spp *= 4)
                texels(filters[f], kind, spp, 100);
        }
    if (all) /* a filter that reaches beyond a block */
        errors(&(struct setting){"<rfilter type='gaussian'><float name='stddev' "
                                 "value='1'/></rfilter>",
                                 24, 32, 100, ONE, IMP_LOSS_L2, 1, false});
    imp_context_destroy(ctx);
    return tap_done();
}

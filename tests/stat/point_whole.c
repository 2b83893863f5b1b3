/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures whose pixels are one set of points each: the same means, a smaller variance than in four
 * sets, no standard errors where sets are few, and refusals where errors are wanted. */
#include "gain_scenes.h"
#include "imp_tap.h"
#include "importon/until.h"
#include <stdlib.h>

enum { SEEDS = 64 };
static const enum imp_points kinds[] = {IMP_POINTS_INDEPENDENT, IMP_POINTS_SOBOL,
                                        IMP_POINTS_WHOLE};

static imp_context *ctx;

static imp_film *film_of(imp_scene *scene, enum imp_points points, int spp, int seed)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = spp;
    run.seed = (uint64_t)seed + 1000 * (uint64_t)points;
    run.points = points;
    test_must(ctx, imp_render(scene, &run, &film));
    return film;
}
static size_t values(const imp_film *film)
{
    struct imp_film_info info = {.size = sizeof info};
    test_must(ctx, imp_film_get_info(film, &info));
    return (size_t)info.width * (size_t)info.height * (size_t)info.channels;
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* most: of the median value's variance, over that of four sets. */
static void picture(const char *name, imp_scene *scene, int spp, double most)
{
    struct tap_stat *value[3] = {NULL};
    size_t n = 0, used = 0, with_errors = 0;
    double *ratio, z2 = 0;
    for (int kind = 0; kind < 3; kind++)
        for (int seed = 0; seed < SEEDS; seed++) {
            imp_film *film = film_of(scene, kinds[kind], spp, seed);
            n = values(film);
            if (!value[kind]) value[kind] = calloc(n, sizeof **value);
            for (size_t i = 0; i < n; i++)
                tap_add(&value[kind][i], imp_film_mean(film)[i]);
            with_errors += (imp_film_se(film) != NULL) != (kind < 2);
            imp_film_destroy(film);
        }
    ratio = malloc(n * sizeof *ratio);
    for (size_t i = 0; i < n; i++) {
        double v[3];
        for (int kind = 0; kind < 3; kind++) v[kind] = value[kind][i].m2 / (SEEDS - 1);
        if (!(v[0] > 0 && v[1] > 0)) continue;
        z2 += pow(value[2][i].mean - value[0][i].mean, 2) / ((v[0] + v[2]) / SEEDS);
        ratio[used++] = v[2] / v[1];
    }
    qsort(ratio, used, sizeof *ratio, by_value);
    tap_ok(with_errors == 0, "%s, %d samples: errors of sets, none of one set", name,
           spp);
    tap_ok(used > n / 2 && fabs(z2 / (double)used - 1) < .25,
           "%s, %d samples: same mean # z^2 %.3f", name, spp, z2 / (double)used);
    tap_ok(ratio[used / 2] <= most,
           "%s, %d samples: variance of the median value # %.3f of that of four sets, at "
           "most %g",
           name, spp, ratio[used / 2], most);
    for (int kind = 0; kind < 3; kind++) free(value[kind]);
    free(ratio);
}

/* From 193 samples on there are four sets, and those of IMP_POINTS_SOBOL. */
static void sets(imp_scene *scene)
{
    for (int spp = 192; spp <= 256; spp += 64) {
        struct imp_run run = IMP_RUN_INIT;
        imp_film *film[2];
        run.spp = spp;
        for (int kind = 0; kind < 2; kind++) {
            run.points = kinds[1 + kind];
            test_must(ctx, imp_render(scene, &run, &film[kind]));
        }
        const size_t n = values(film[0]);
        const bool same =
            !memcmp(imp_film_mean(film[0]), imp_film_mean(film[1]), n * sizeof(float));
        const float *se = imp_film_se(film[1]);
        if (spp == 192)
            tap_ok(!se && !same, "192 samples: three sets have no standard errors");
        else
            tap_ok(se && same && !memcmp(se, imp_film_se(film[0]), n * sizeof(float)),
                   "256 samples: four sets are those of sobol");
        for (int kind = 0; kind < 2; kind++) imp_film_destroy(film[kind]);
    }
}

static void refused(imp_scene *scene)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_until_options until = IMP_UNTIL_OPTIONS_INIT;
    struct imp_until_end end = IMP_UNTIL_END_INIT;
    struct imp_target target = IMP_TARGET_INIT;
    imp_film *film = NULL, *other = film_of(scene, IMP_POINTS_SOBOL, 4, 0);
    imp_problem *p;
    run.spp = 16;
    run.points = IMP_POINTS_WHOLE;
    tap_ok(imp_render_until(scene, &run, &until, &film, &end) == IMP_E_ARG && !film &&
               strstr(imp_last_error(ctx), "no standard errors"),
           "refused until an error # %s", imp_last_error(ctx));
    test_must(ctx, imp_problem_create(scene, &p));
    struct imp_film_info info = {.size = sizeof info};
    test_must(ctx, imp_film_get_info(other, &info));
    target.pixels = imp_film_mean(other);
    target.width = info.width;
    target.height = info.height;
    target.channels = 3;
    test_must(ctx, imp_problem_add_target(p, &target));
    struct imp_estimate f;
    tap_ok(imp_problem_objective(p, NULL, &run, &f, NULL, NULL) == IMP_E_ARG,
           "refused by losses # %s", imp_last_error(ctx));
    run.time_limit_s = 1;
    tap_ok(imp_render(scene, &run, &film) == IMP_E_ARG && !film,
           "refused with a time limit # %s", imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_film_destroy(other);
}

int main(void)
{
    ctx = test_context(0);
    imp_scene *open = gain_open(ctx, 12, ""), *box = gain_cornell(ctx, 12);
    picture("open", open, 16, .8);
    picture("open", open, 64, .75);
    picture("cornell", box, 16, .9);
    sets(box);
    refused(box);
    imp_scene_destroy(open);
    imp_scene_destroy(box);
    imp_context_destroy(ctx);
    return tap_done();
}

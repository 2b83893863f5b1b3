/* SPDX-License-Identifier: Apache-2.0
 *
 * Samples of tiles by their share of the gradient's variance: what is gained at equal cost,
 * against the same samples everywhere and against what Neyman's formula promises; means are the
 * same, and errors are as large as they are stated. Run with "long" for more seeds. */
#include "gain_scenes.h"
#include "imp_tap.h"
#include "inverse/allocation.h"
#include <stdbool.h>
#include <stdlib.h>
#include <time.h>

enum { LOOKS = 12, PARAMS = 32 };
static int seeds = 16, side = 32;
static bool all; /* "long" */

static imp_context *ctx;

/* In the open scene. */
static const char metal_and_bulb[] =
    "<shape type='sphere'><point name='center' x='-.9' y='.3' z='.6'/><float "
    "name='radius' "
    "value='.3'/><bsdf type='roughconductor' id='metal'><string name='material' "
    "value='Cu'/><string name='distribution' value='ggx'/><float name='alpha' "
    "value='.15'/></bsdf></shape>"
    "<shape type='sphere'><point name='center' x='.8' y='.25' z='.8'/><float "
    "name='radius' "
    "value='.05'/><emitter type='area' id='bulb'><rgb name='radiance' "
    "value='80,60,40'/></emitter></shape>";

enum which { CORNELL, TEXTURED, OPEN, MASKED, SMALL, SCENES };
static const char *const names[] = {"cornell", "textured", "open", "masked",
                                    "small part"};
static const char *const actives[][5] = {
    {"white.reflectance.value", "red.reflectance.value", "green.reflectance.value",
     "light.radiance.value"},
    {"wall.reflectance.color0.value", "wall.reflectance.color1.value", "metal.alpha*",
     "sky.radiance.value", "lamp.radiance.value"},
    {"clay.reflectance.value", "metal.alpha*", "sky.radiance.value",
     "lamp.radiance.value", "bulb.radiance.value"},
    {"white.reflectance.value", "red.reflectance.value", "green.reflectance.value",
     "light.radiance.value"},
    {"metal.alpha*"}};

static imp_scene *scene_of(enum which which)
{
    if (which == OPEN || which == SMALL) return gain_open(ctx, side, metal_and_bulb);
    return which == TEXTURED ? gain_textured(ctx, side) : gain_cornell(ctx, side);
}

static double weight_of(size_t k, const void *payload)
{
    return ((const double *)payload)[k];
}
static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* `most`: of the variance of equal samples, mean over the numbers. */
static void gradient(enum which which, int spp, enum imp_points points, double most)
{
    char name[64];
    imp_scene *scene = scene_of(which);
    imp_film *film;
    imp_problem *p;
    struct imp_film_info info = {.size = sizeof info};
    struct imp_run run = IMP_RUN_INIT;
    struct imp__allocation a;
    double x[PARAMS], g[PARAMS], se[PARAMS], weights[PARAMS], cpu[2] = {0, 0};
    static struct tap_stat value[2][PARAMS + 1];
    double stated[2][PARAMS + 1] = {{0}};
    struct imp_estimate f;
    run.spp = 1024;
    run.seed = 7;
    test_must(ctx, imp_render(scene, &run, &film));
    test_must(ctx, imp_film_get_info(film, &info));
    test_must(ctx, imp_problem_create(scene, &p));
    for (int k = 0; k < 5 && actives[which][k]; k++)
        test_must(ctx, imp_problem_activate(p, actives[which][k]));
    const int w = (int)info.width, h = (int)info.height;
    float *mask = calloc((size_t)w * (size_t)h, sizeof *mask);
    for (int i = 0; i < w * h; i++)
        mask[i] = i % w >= w / 3 && i % w < 2 * w / 3 && i / w > h / 2;
    struct imp_target target = IMP_TARGET_INIT;
    target.pixels = imp_film_mean(film);
    target.width = w;
    target.height = h;
    target.channels = 3;
    if (which == MASKED) target.weights = mask;
    test_must(ctx, imp_problem_add_target(p, &target));
    const size_t n = imp_problem_n(p);
    imp_problem_get_x(p, x);
    for (size_t k = 0; k < n; k++)
        if (x[k] < 1) x[k] = x[k] < 0.25 && which != CORNELL ? .3 : .4;
    run = (struct imp_run)IMP_RUN_INIT;
    run.spp = spp;
    run.points = points;
    test_must(ctx, imp__allocation_create(p, &run, &a));
    memset(value, 0, sizeof value);
    /* The noise of every number counts in units of itself. */
    for (size_t k = 0; k < n; k++) weights[k] = 0;
    for (int i = 0; i < 8; i++) {
        run.seed = 100 + (uint64_t)i;
        test_must(ctx, imp_problem_objective(p, x, &run, &f, g, se));
        for (size_t k = 0; k < n; k++) weights[k] += se[k] * se[k] / 8;
    }
    for (size_t k = 0; k < n; k++) weights[k] = 1 / weights[k];
    const struct imp__metric metric = {.weight = weight_of, .payload = weights};
    for (int i = 0; i < LOOKS; i++) {
        run.seed = 300 + (uint64_t)i;
        a.metric = &metric;
        p->allocation = &a;
        test_must(ctx, imp_problem_objective(p, x, &run, &f, g, se));
        p->allocation = NULL;
        imp__allocation_update(&a);
    }
    a.metric = NULL;
    for (int i = 0; i < seeds; i++)
        for (int kind = 0; kind < 2; kind++) {
            const double start = seconds();
            run.seed = 1000 + (uint64_t)i + 5000 * (uint64_t)kind;
            p->allocation = kind ? &a : NULL;
            test_must(ctx, imp_problem_objective(p, x, &run, &f, g, se));
            p->allocation = NULL;
            cpu[kind] += seconds() - start;
            for (size_t k = 0; k <= n; k++) {
                const double v = k < n ? g[k] : f.value, e = k < n ? se[k] : f.se;
                tap_add(&value[kind][k], v);
                stated[kind][k] += e * e / seeds;
            }
        }
    /* Of the formula. */
    double s = 0, sc = 0, c = 0, even = 0, here = 0, high = 0, least = 1e9, samples = 0,
           asked = 0;
    for (size_t k = 0; k < a.n; k++) {
        const double v = a.state[k], cost = a.state[a.n + k];
        s += v / a.even[k];
        sc += sqrt(v * cost);
        c += cost * a.even[k];
        even += v / a.even[k];
        here += v / a.spp[k];
        high = fmax(high, (double)a.spp[k] / a.even[k]);
        least = fmin(least, (double)a.spp[k] / a.even[k]);
        samples += a.spp[k], asked += a.even[k];
    }
    double told = 0, seen = 0, z = 0, error[2] = {0, 0};
    for (size_t k = 0; k < n; k++) {
        const double v0 = value[0][k].m2 / (seeds - 1), v1 = value[1][k].m2 / (seeds - 1);
        told += stated[1][k] / stated[0][k] / (double)n;
        seen += v1 / v0 / (double)n;
        error[0] += sqrt(stated[0][k] / v0) / (double)n;
        error[1] += sqrt(stated[1][k] / v1) / (double)n;
        z = fmax(z, fabs(value[1][k].mean - value[0][k].mean) / sqrt((v0 + v1) / seeds));
    }
    const double model = here / even, optimum = sc * sc / (s * c);
    const double both =
        (told + 0.1 * stated[1][n] / stated[0][n]) / 1.1; /* as v has it */
    snprintf(name, sizeof name, "%s, %d %s", names[which], spp,
             points == IMP_POINTS_SOBOL ? "points" : "independent");
    tap_ok(
        told <= most && seen <= 1.6 * most,
        "%s: variance of the gradient # stated %.3f, at most %g; seen %.3f; times the "
        "processor's time %.3f; %.3f of the samples, %.2f to %.2f times those asked for",
        name, told, most, seen, told * cpu[1] / cpu[0], samples / asked, least, high);
    /* Of independent samples it falls as 1/n, and a little faster; of points, faster. */
    tap_ok(both <= 1.1 * model &&
               (points == IMP_POINTS_SOBOL || spp < 64 || both >= 0.75 * model),
           "%s: what the formula says # %.3f for %.3f, of the best %.3f; the loss's "
           "variance %.3f",
           name, both, model, optimum, stated[1][n] / stated[0][n]);
    tap_ok(z < 4, "%s: same means # |z| at most %.2f", name, z);
    tap_ok(all ? error[1] > 0.85 && error[1] < 1.2 : error[1] > 0.7 && error[1] < 1.4,
           "%s: errors # stated/seen %.2f, of equal samples %.2f", name, error[1],
           error[0]);
    imp__allocation_destroy(&a);
    free(mask);
    imp_film_destroy(film);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    static const double most[SCENES] = {.35, 1.02, .55, .35, .35};
    all = argc > 1 && strcmp(argv[1], "long") == 0;
    if (all) seeds = 64;
    ctx = test_context(all ? 0 : 1);
    gradient(CORNELL, 16, IMP_POINTS_SOBOL, most[CORNELL]);
    gradient(SMALL, 16, IMP_POINTS_SOBOL, most[SMALL]);
    for (enum which which = CORNELL; all && which < SCENES; which++) {
        gradient(which, 16, IMP_POINTS_SOBOL, most[which]);
        gradient(which, 64, IMP_POINTS_SOBOL, most[which]);
        gradient(which, 64, IMP_POINTS_INDEPENDENT, 1.6 * most[which]);
    }
    imp_context_destroy(ctx);
    return tap_done();
}

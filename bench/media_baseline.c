/* SPDX-License-Identifier: Apache-2.0
 *
 * What the baseline of the light (src/walk/path/baseline.h) does to derivatives with respect to
 * the extinction of uniform media: variance and processor time without it, over those with
 * it, for fog that is thin and thick, dark and white, grey and coloured, lit from outside
 * and from within. One thread; runs with and without take turns.
 *
 *     media_baseline [REPEATS [SPP]]
 *
 * `mean` is the derivative of the picture's mean, `loss` that of an l2 loss against a picture
 * of the same scene at 1.2 times the extinction, summed over the colours where there are
 * some. Told are medians over the repeats, since near a point light single walks bring very
 * much, with their standard errors (1.25 times those of a mean). */
#include "../tests/imp_scene.h"
#include "walk/path/baseline.h"
#include <math.h>
#include <time.h>

static bool without;
enum imp_status __real_imp__baseline_set(struct imp_tracer *tracer, int64_t walks);
enum imp_status __wrap_imp__baseline_set(struct imp_tracer *tracer, int64_t walks);
enum imp_status __wrap_imp__baseline_set(struct imp_tracer *tracer, int64_t walks)
{
    return __real_imp__baseline_set(tracer, without ? 0 : walks);
}

static imp_context *ctx;

static double cpu(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

#define SKY "<emitter type='constant'><float name='radiance' value='0.5'/></emitter>"
#define LAMP                                                                             \
    "<shape type='sphere'><point name='center' x='3' y='3' z='-4'/>"                     \
    "<float name='radius' value='0.5'/><emitter type='area'>"                            \
    "<float name='radiance' value='40'/></emitter></shape>"
#define POINT                                                                            \
    "<emitter type='point'><point name='position' x='0.3' y='0.2' z='0'/>"               \
    "<float name='intensity' value='1'/></emitter>"
#define BALL                                                                             \
    "<shape type='sphere'><point name='center' x='0.3' y='0.2' z='0'/>"                  \
    "<float name='radius' value='0.2'/><ref id='fog' name='exterior'/>"                  \
    "<bsdf type='diffuse'/><emitter type='area'>"                                        \
    "<float name='radiance' value='8'/></emitter></shape>"
#define WALL                                                                             \
    "<shape type='rectangle'><transform name='to_world'><scale value='0.7'/>"            \
    "<translate z='-0.8'/></transform><ref id='fog' name='exterior'/>"                   \
    "<ref id='fog' name='interior'/><bsdf type='diffuse'/></shape>"
#define GREY     "<float name='sigma_t' value='%g'/>"
#define COLOURED "<rgb name='sigma_t' value='%g, 1.2, 0.4'/>"

static const struct {
    const char *what, *sigma, *lights;
    double extinction, albedo;
} cases[] = {
    {"thin", GREY, SKY LAMP, .1, .8},
    {"middle", GREY, SKY LAMP, 1.5, .8},
    {"thick", GREY, SKY LAMP, 10, .8},
    {"very thick", GREY, SKY LAMP, 100, .8},
    {"black", GREY, SKY LAMP, 1.5, 0},
    {"nearly black", GREY, SKY LAMP, 1.5, .05},
    {"nearly white", GREY, SKY LAMP, 1.5, .99},
    {"white and thick", GREY, SKY LAMP, 10, 1},
    {"coloured", COLOURED, SKY LAMP, 3, .8},
    {"coloured and thick", COLOURED, SKY LAMP, 20, .95},
    {"a lamp alone", GREY, LAMP, 1.5, .8},
    {"a point light inside", GREY, POINT, 1.5, .8},
    {"a point light inside, thick", GREY, POINT, 10, .9},
    {"a glowing ball inside", GREY, BALL, 1.5, .8},
    {"a wall inside, sky and lamp", GREY, SKY LAMP WALL, 1.5, .8},
};

static const char scene_text[] =
    "<scene version='3.0.0'><integrator type='volpath'>"
    "<integer name='max_depth' value='32'/></integrator>"
    "<sensor type='perspective'><float name='fov' value='40'/><transform name='to_world'>"
    "<lookat origin='0,0,5' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"
    "<integer name='width' value='32'/><integer name='height' value='32'/>"
    "<rfilter type='box'/></film></sensor>"
    "<medium type='homogeneous' id='fog'>%s<float name='albedo' value='%g'/>"
    "<phase type='hg'><float name='g' value='0.3'/></phase></medium>"
    "<shape type='cube'><bsdf type='null'/><ref id='fog' name='interior'/></shape>"
    "%s</scene>";

static imp_scene *scene_of(size_t c, double factor)
{
    char sigma[256], text[sizeof scene_text + 2048];
    snprintf(sigma, sizeof sigma, cases[c].sigma, cases[c].extinction * factor);
    snprintf(text, sizeof text, scene_text, sigma, cases[c].albedo, cases[c].lights);
    return test_scene_text(ctx, text, IMP_RGB);
}

static void target_add(size_t c, imp_problem *p)
{
    struct imp_target target = IMP_TARGET_INIT;
    struct imp_film_info info = {.size = sizeof info};
    struct imp_run run = IMP_RUN_INIT;
    imp_scene *s = scene_of(c, 1.2);
    imp_film *f;
    run.seed = 12345;
    run.spp = 256;
    test_must(ctx, imp_render(s, &run, &f));
    test_must(ctx, imp_film_get_info(f, &info));
    target.width = info.width;
    target.height = info.height;
    target.channels = info.channels;
    target.pixels = imp_film_mean(f);
    test_must(ctx, imp_problem_add_target(p, &target));
    imp_film_destroy(f);
    imp_scene_destroy(s);
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Variance, and variance times seconds, without the baseline over those with it. */
static void compare(imp_problem *p, bool loss, int repeats, int spp)
{
    double g[8], se[8], time[2] = {1e300, 1e300}, mean = 0, squares = 0;
    const size_t n = imp_problem_n_variables(p);
    double *ratio = malloc((size_t)repeats * sizeof *ratio);
    for (int r = 0; r < repeats; r++) {
        double variance[2] = {0};
        for (int k = 0; k < 2; k++) {
            struct imp_run run = IMP_RUN_INIT;
            struct imp_estimate value;
            without = k;
            run.seed = (uint64_t)(2 * r + k + 1);
            run.spp = spp;
            const double t = cpu();
            test_must(ctx, loss ? imp_problem_objective(p, NULL, &run, &value, g, se)
                                : imp_problem_functional(p, NULL, &run, NULL, g, se));
            time[k] = fmin(time[k], cpu() - t);
            for (size_t i = 0; i < n; i++) variance[k] += se[i] * se[i];
        }
        ratio[r] = log(variance[1] / variance[0]);
        mean += ratio[r] / repeats;
        squares += ratio[r] * ratio[r] / repeats;
    }
    qsort(ratio, (size_t)repeats, sizeof *ratio, by_value);
    const double median = exp((ratio[(repeats - 1) / 2] + ratio[repeats / 2]) / 2),
                 se_log = 1.25 * sqrt(fmax(squares - mean * mean, 0) / repeats);
    printf("  %s %.2f +- %.2f (%.2f)", loss ? "loss" : "mean", median, median * se_log,
           median * time[1] / time[0]);
    free(ratio);
}

int main(int argc, char **argv)
{
    const int repeats = argc > 1 ? atoi(argv[1]) : 8, spp = argc > 2 ? atoi(argv[2]) : 32;
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    if (repeats < 1 || spp < 2) {
        fprintf(stderr, "usage: media_baseline [REPEATS [SPP]]\n");
        return 2;
    }
    o.threads = 1;
    test_must(NULL, imp_context_create(&o, &ctx));
    printf("variance without the baseline over that with it (the same times time)\n");
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        imp_scene *s = scene_of(c, 1);
        imp_problem *p = test_problem(ctx, s, "fog.sigma_t.value");
        printf("%-28s extinction %-4g albedo %-4g", cases[c].what, cases[c].extinction,
               cases[c].albedo);
        target_add(c, p);
        compare(p, false, repeats, spp);
        compare(p, true, repeats, spp);
        printf("\n");
        fflush(stdout);
        imp_problem_destroy(p);
        imp_scene_destroy(s);
    }
    imp_context_destroy(ctx);
    return 0;
}

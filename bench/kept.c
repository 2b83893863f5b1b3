/* SPDX-License-Identifier: Apache-2.0
 *
 * What a recorded walk costs: evaluated, folded and swept, over traced and swept, one thread,
 * processor time; the median of pairs measured in turn (walks). Then pictures, searches (fits)
 * by L-BFGS, MMA and SLSQP, and how far values of N draws spread far away (spread).
 *
 *     kept [--repeats N] [--spp N] [--picture-spp N] [--scene NAME] [--only PART]
 *
 * Each but the last twice: vertex by vertex, and as sums of products (walk/kept/reduced.h). */
#include "walk/kept/store.h"
#include <importon/walks.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static int repeats = 5, spp = 16, picture_spp = 0; /* 0: the scene's */
static const char *only = "", *scene_only = ""; /* parts, and scenes, whose name has it */
static imp_context *ctx;

/* Walks that are kept from here on: vertices alone, or sums of products beside them. */
static bool as_vertices;
enum imp_status __real_imp__reduction_create(const struct imp_scene *scene,
                                             const struct imp_walk_integrator *integrator,
                                             const uint8_t *free,
                                             struct imp_reduction **out);
enum imp_status __wrap_imp__reduction_create(const struct imp_scene *scene,
                                             const struct imp_walk_integrator *integrator,
                                             const uint8_t *free,
                                             struct imp_reduction **out);
enum imp_status __wrap_imp__reduction_create(const struct imp_scene *scene,
                                             const struct imp_walk_integrator *integrator,
                                             const uint8_t *free,
                                             struct imp_reduction **out)
{
    *out = NULL;
    return as_vertices ? IMP_OK
                       : __real_imp__reduction_create(scene, integrator, free, out);
}

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "kept: %s\n", imp_last_error(ctx));
    exit(3);
}

static double cpu(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}
static double median(double *x, int n)
{
    qsort(x, (size_t)n, sizeof *x, by_value);
    return x[n / 2];
}

struct gradient {
    struct imp_sink sink; /* first */
    const struct imp_active *active;
    double *g;
};
static void add(struct imp_sink *sink, int param, size_t element, int channels,
                const imp_spec *bar)
{
    struct gradient *to = (struct gradient *)sink;
    const int64_t base = to->active->base[param];
    if (base < 0) return;
    double *g = to->g + (size_t)base + element;
    if (channels == 3)
        for (int c = 0; c < 3; c++) g[c] += (*bar)[c];
    else g[0] += (*bar)[0] + (*bar)[1] + (*bar)[2];
}

struct job {
    struct imp_tracer tracer;
    struct imp_arena arena;
    struct imp_record record;
    struct imp_reduction *reduction;
    struct imp_reduced reduced;
    struct gradient to;
    double sum; /* of radiance: what was asked for is used */
};

static void sweep(struct job *j, const struct imp_walk *w)
{
    j->sum += w->L[0] + w->L[1] + w->L[2];
    imp__walk_sweep(&j->tracer, w, (imp_spec){1, 1, 1, 0}, &j->to.sink);
}

/* All walks of the picture; kept too, if `keep`. */
static void trace_all(struct job *j, bool keep, bool swept)
{
    const struct imp_film_desc *film = &j->tracer.sensor->film;
    for (int y = 0; y < film->crop_h; y++)
        for (int x = 0; x < film->crop_w; x++)
            for (int s = 0; s < spp; s++) {
                const struct imp_arena_mark mark = imp__arena_mark(&j->arena);
                struct imp_walk w;
                imp__walk_trace(&j->tracer, &j->arena, x, y, s, &w);
                if (keep) must(imp__record_keep(&j->record, &w, s));
                if (swept) sweep(j, &w);
                imp__arena_rewind(&j->arena, mark);
            }
}
static void evaluate_all(struct job *j, bool swept)
{
    j->tracer.value_only = !swept;
    for (size_t i = 0; i < j->record.n_walks; i++) {
        const struct imp_arena_mark mark = imp__arena_mark(&j->arena);
        struct imp_walk w;
        if (as_vertices || !j->reduced.of ||
            !imp__reduced_walk(&j->reduced, &j->record, i, &j->tracer, &j->arena, &w))
            imp__record_walk(&j->record, i, &j->tracer, &j->arena, &w);
        if (swept) sweep(j, &w);
        else j->sum += w.L[0] + w.L[1] + w.L[2];
        imp__arena_rewind(&j->arena, mark);
    }
    j->tracer.value_only = false;
}

static bool wanted(const char *part, const char *file)
{
    return strstr(part, only) && strstr(file, scene_only);
}

static void measure(const char *file, const char *define)
{
    if (!wanted("walks", file)) return;
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    char path[1024];
    imp_scene *scene;
    struct imp_active active;
    o.defines = &define;
    o.n_defines = define != NULL;
    snprintf(path, sizeof path, "%s/%s", IMP_SCENES, file);
    must(imp_scene_load(ctx, path, &o, &scene));
    uint8_t *chosen = calloc(scene->n_params + 1, 1);
    if (!chosen) exit(3);
    for (size_t k = 0; k < scene->n_params; k++)
        chosen[k] = (scene->params[k].info.flags & IMP_PARAM_DIFFERENTIABLE) != 0;
    must(imp__active_create(scene, chosen, &active));
    struct job j = {.tracer = {.scene = scene,
                               .integrator = imp__walk_integrator(scene),
                               .sensor = scene->sensors[0],
                               .active = &active,
                               .seed = 1},
                    .to = {{.add = add}, &active, calloc(active.n + 1, sizeof(double))}};
    if (!j.to.g) exit(3);
    imp__arena_init(&j.arena, ctx);
    must(imp__record_create(&j.tracer, (size_t)2 << 30, &j.record));
    trace_all(&j, true, false);
    must(imp__reduction_create(scene, j.tracer.integrator, chosen, &j.reduction));
    double reducing = cpu();
    if (j.reduction) imp__reduced_make(j.reduction, &j.record, &j.reduced);
    reducing = cpu() - reducing;

    double both[2][64], value[2][64], ns[64];
    for (int k = 0; k < repeats; k++) {
        double start = cpu();
        trace_all(&j, false, true);
        const double traced = cpu() - start;
        ns[k] = traced / (double)j.record.n_walks * 1e9;
        for (int reduced = 0; reduced < 2; reduced++) {
            as_vertices = !reduced;
            start = cpu();
            evaluate_all(&j, true);
            both[reduced][k] = (cpu() - start) / traced;
            start = cpu();
            evaluate_all(&j, false);
            value[reduced][k] = (cpu() - start) / traced;
        }
    }
    printf("%-14s %-16s %5.2f vertices %5.0f bytes a walk, reduced %3.0f in %3.0f ns; "
           "traced and swept %5.0f ns; vertices: value %.3f, and swept %.3f of that; "
           "reduced: %.3f, %.3f\n",
           file, define ? define : "",
           (double)j.record.n_vertices / (double)j.record.n_walks,
           (double)imp__record_bytes(&j.record) / (double)j.record.n_walks,
           (double)imp__reduced_bytes(&j.reduced) / (double)j.record.n_walks,
           reducing / (double)j.record.n_walks * 1e9, median(ns, repeats),
           median(value[0], repeats), median(both[0], repeats), median(value[1], repeats),
           median(both[1], repeats));
    fflush(stdout);
    imp__reduced_free(&j.reduced);
    imp__reduction_destroy(j.reduction);
    imp__record_destroy(&j.record);
    imp__arena_free(&j.arena);
    imp__active_destroy(ctx, &active);
    free(j.to.g);
    free(chosen);
    imp_scene_destroy(scene);
}

/* All numbers that may change, and do: nine tenths of what they were. */
static void change(imp_scene *scene)
{
    imp_problem *p;
    must(imp_problem_create(scene, &p));
    must(imp_problem_activate(p, "*"));
    const size_t n = imp_problem_n_variables(p);
    double *x = calloc(n, sizeof *x);
    if (!x) exit(3);
    imp_problem_get_x(p, x);
    for (size_t i = 0; i < n; i++) x[i] *= 0.9;
    must(imp_problem_set_x(p, x));
    imp_problem_destroy(p);
    free(x);
}

/* Whole pictures, through the film, elsewhere than at the draw: kept ones over traced ones. */
static void measure_picture(const char *file, const char *define)
{
    if (!wanted("pictures", file)) return;
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_walks_options keep = IMP_WALKS_OPTIONS_INIT;
    char path[1024];
    imp_scene *scene;
    imp_walks *walks[2]; /* as vertices, reduced */
    double ratio[2][64];
    o.defines = &define;
    o.n_defines = define != NULL;
    snprintf(path, sizeof path, "%s/%s", IMP_SCENES, file);
    must(imp_scene_load(ctx, path, &o, &scene));
    keep.memory = 8000000000u;
    run.spp = picture_spp;
    for (int reduced = 0; reduced < 2; reduced++) {
        as_vertices = !reduced;
        must(imp_walks_keep(scene, &run, &keep, &walks[reduced]));
    }
    change(scene);
    for (int k = 0; k < repeats; k++) {
        double took[3];
        for (int way = 0; way < 3; way++) {
            imp_film *film;
            const double start = cpu();
            run.walks = way > 0 ? walks[way - 1] : NULL;
            must(imp_render(scene, &run, &film));
            took[way] = cpu() - start;
            imp_film_destroy(film);
        }
        for (int reduced = 0; reduced < 2; reduced++)
            ratio[reduced][k] = took[1 + reduced] / took[0];
    }
    printf(
        "%-14s %-16s picture of recorded walks over its render: vertices %.3f, reduced "
        "%.3f\n",
        file, define ? define : "", median(ratio[0], repeats), median(ratio[1], repeats));
    for (int reduced = 0; reduced < 2; reduced++) imp_walks_destroy(walks[reduced]);
    imp_scene_destroy(scene);
}

/* A search of 15 evaluations with recorded walks over one that traces them, without what comes
 * after it. */
static void measure_fit(const char *file, const char *define, const char *glob,
                        enum imp_optimizer method, const char *name)
{
    if (!wanted("fits", file)) return;
    int evaluations[3] = {0, 0, 0};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_target t = IMP_TARGET_INIT;
    char path[1024], said[256] = "";
    imp_scene *scene;
    imp_film *film;
    double ratio[2][64];
    o.defines = &define;
    o.n_defines = define != NULL;
    snprintf(path, sizeof path, "%s/%s", IMP_SCENES, file);
    must(imp_scene_load(ctx, path, &o, &scene));
    run.spp = 64;
    must(imp_render(scene, &run, &film));
    struct imp_film_info info = {.size = sizeof info};
    must(imp_film_get_info(film, &info));
    t.width = info.width;
    t.height = info.height;
    t.channels = info.channels;
    t.pixels = imp_film_mean(film);
    for (int k = 0; k < repeats; k++) {
        double took[3];
        for (int way = 0; way < 3; way++) {
            const bool kept = way > 0;
            struct imp_fit_options f = IMP_FIT_OPTIONS_INIT;
            const struct imp_fit_result *r;
            imp_problem *p;
            double x[256];
            must(imp_problem_create(scene, &p));
            must(imp_problem_activate(p, glob));
            must(imp_problem_add_target(p, &t));
            const size_t n = imp_problem_n_variables(p);
            double *at = calloc(n, sizeof *at);
            if (!at || n > 256) exit(3);
            imp_problem_get_x(p, x);
            for (size_t i = 0; i < n; i++) at[i] = 0.7 * x[i];
            must(imp_problem_set_x(p, at));
            run.seed = 9;
            f.optimizer = method;
            f.max_iterations = 15;
            f.tolerance = 1e-9;
            f.memory = 4000000000u;
            f.no_recording = !kept;
            as_vertices = way == 1;
            const double start = cpu();
            must(imp_fit(p, &f, &run, &r));
            took[way] = cpu() - start;
            evaluations[way] = r->iterations;
            if (kept) snprintf(said, sizeof said, "%s", r->walks);
            must(imp_problem_set_x(p, x));
            imp_problem_destroy(p);
            free(at);
        }
        for (int reduced = 0; reduced < 2; reduced++)
            ratio[reduced][k] = took[0] / took[1 + reduced];
    }
    printf("%-14s %-16s %-5s, evaluations %d traced, %d as vertices, %d reduced, and the "
           "last; times as fast: vertices %.2f, reduced %.2f; %s\n",
           file, define ? define : "", name, evaluations[0], evaluations[1],
           evaluations[2], median(ratio[0], repeats), median(ratio[1], repeats), said);
    fflush(stdout);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
}

/* Stam's box where MMA's fourth evaluation went, whose reflectances of the sphere add up to
 * 1.3: the loss and its derivative by the walls' reflectance, of draws kept at seven tenths
 * of all numbers by roulette's floor, or of fresh walks, floor 0. */
static void measure_spread(const char *file, const char *define, double floor)
{
    static const double went[] = {.015, .015, .015, .629, .696, 19.7, .023,
                                  .023, .023, .492, 5.25, 5.25, 5.25};
    enum { N = sizeof went / sizeof *went, WALLS = 9 };
    if (!wanted("spread", file)) return;
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_film_info info = {.size = sizeof info};
    char path[1024];
    double near[N], g[N], se[N], sum[2] = {0}, square[2] = {0}, growth = 0;
    imp_scene *scene;
    imp_film *film;
    imp_problem *p;
    o.defines = &define;
    o.n_defines = 1;
    snprintf(path, sizeof path, "%s/%s", IMP_SCENES, file);
    must(imp_scene_load(ctx, path, &o, &scene));
    must(imp_render(scene, NULL, &film));
    must(imp_film_get_info(film, &info));
    t.width = info.width;
    t.height = info.height;
    t.channels = info.channels;
    t.pixels = imp_film_mean(film);
    must(imp_problem_create(scene, &p));
    must(imp_problem_activate(p, "*"));
    must(imp_problem_add_target(p, &t));
    if (imp_problem_n_variables(p) != N) exit(3);
    imp_problem_get_x(p, near);
    for (int i = 0; i < N; i++) near[i] *= 0.7;
    for (int k = 0; k < repeats; k++) {
        struct imp_run run = IMP_RUN_INIT;
        struct imp_walks_options keep = IMP_WALKS_OPTIONS_INIT;
        struct imp_walks_weight weight = IMP_WALKS_WEIGHT_INIT;
        struct imp_estimate f;
        imp_walks *walks = NULL;
        run.seed = 1000 + (uint64_t)k;
        keep.losses = 1;
        keep.survival = floor;
        must(imp_problem_set_x(p, near));
        if (floor > 0) must(imp_walks_keep(scene, &run, &keep, &walks));
        must(imp_problem_set_x(p, went));
        if (walks) {
            must(imp_walks_weigh(walks, 0, NULL, &weight));
            walks->ess = -1; /* evaluated, whatever they are worth */
            run = (struct imp_run)IMP_RUN_INIT;
            run.walks = walks;
            growth += weight.growth / repeats;
        }
        must(imp_problem_objective(p, NULL, &run, &f, g, se));
        for (int j = 0; j < 2; j++) {
            const double x = j ? g[WALLS] : f.value;
            sum[j] += x;
            square[j] += x * x;
        }
        imp_walks_destroy(walks);
    }
    printf("%-14s floor %.2f, growth %.2f:", file, floor, growth);
    for (int j = 0; j < 2; j++) {
        const double mean = sum[j] / repeats;
        printf(" %s %.1f, spread %.2f%s", j ? "by the walls" : "loss", mean,
               sqrt(fmax(square[j] / repeats - mean * mean, 0)), j ? "\n" : ";");
    }
    imp_problem_destroy(p);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    for (int k = 1; k + 1 < argc; k += 2) {
        if (strcmp(argv[k], "--repeats") == 0) repeats = atoi(argv[k + 1]);
        else if (strcmp(argv[k], "--spp") == 0) spp = atoi(argv[k + 1]);
        else if (strcmp(argv[k], "--picture-spp") == 0) picture_spp = atoi(argv[k + 1]);
        else if (strcmp(argv[k], "--only") == 0) only = argv[k + 1];
        else if (strcmp(argv[k], "--scene") == 0) scene_only = argv[k + 1];
    }
    if (repeats < 1 || repeats > 64 || spp < 1) return 2;
    o.threads = 1;
    if (imp_context_create(&o, &ctx) != IMP_OK) return 3;
    measure("cornell.xml", "res=64");
    measure("stam.xml", "integrator=path");
    measure("stam.xml", "integrator=stam");
    measure("textured.xml", NULL);
    measure("lamps.xml", NULL);
    measure_picture("cornell.xml", "res=64");
    measure_picture("stam.xml", "integrator=path");
    measure_picture("textured.xml", NULL);
    measure_picture("lamps.xml", NULL);
    static const enum imp_optimizer methods[] = {IMP_LBFGS, IMP_MMA, IMP_SLSQP};
    static const char *const names[] = {"lbfgs", "mma", "slsqp"};
    for (int k = 0; k < 3; k++) {
        measure_fit("cornell.xml", "res=64", "*", methods[k], names[k]);
        measure_fit("stam.xml", "integrator=path", "*", methods[k], names[k]);
        measure_fit("textured.xml", NULL, "*.value", methods[k], names[k]);
    }
    static const double floors[] = {0, 0.3, 0.4, 0.45, 0.6};
    for (int k = 0; k < 5; k++) measure_spread("stam.xml", "integrator=path", floors[k]);
    imp_context_destroy(ctx);
    return 0;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Searches on one draw, whose walks are kept: the answers of searches that trace each
 * time, within their errors; new draws where the search goes far; tracing where memory
 * does not suffice or something active moves rays, with the reason; the same bits on any
 * number of threads. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <stdbool.h>

#define MOST 64

struct fitted {
    struct imp_fit_variable v[MOST];
    size_t n;
    struct imp_estimate objective;
    char walks[512];
};

static imp_film *target_of(imp_context *ctx, imp_scene *scene)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = 512;
    run.seed = 77;
    test_must(ctx, imp_render(scene, &run, &film));
    return film;
}

static struct fitted fit(imp_context *ctx, const char *file, const char *defines,
                         enum imp_color_mode mode, const char *glob, double start,
                         enum imp_optimizer optimizer, double memory, int iterations)
{
    struct fitted out = {.n = 0};
    imp_scene *scene = test_scene(ctx, file, mode, defines);
    imp_film *film = target_of(ctx, scene);
    imp_problem *p;
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *r;
    struct imp_film_info info = {.size = sizeof info};
    double x[MOST];
    imp_film_get_info(film, &info);
    test_must(ctx, imp_problem_create(scene, &p));
    for (const char *g = glob; g; g = strchr(g, ',') ? strchr(g, ',') + 1 : NULL) {
        char name[64];
        snprintf(name, sizeof name, "%.*s", (int)strcspn(g, ","), g);
        test_must(ctx, imp_problem_activate(p, name));
    }
    t.width = info.width;
    t.height = info.height;
    t.channels = info.channels;
    t.pixels = imp_film_mean(film);
    t.noise_se = imp_film_se(film);
    test_must(ctx, imp_problem_add_target(p, &t));
    imp_problem_get_x(p, x);
    for (size_t k = 0; k < imp_problem_n_variables(p); k++) x[k] *= start;
    test_must(ctx, imp_problem_set_x(p, x));
    o.optimizer = optimizer;
    o.memory = memory > 0 ? (size_t)memory : 0;
    o.no_recording = memory < 0;
    o.intervals = iterations > 2;
    o.max_iterations = iterations;
    run.spp = 32;
    run.seed = 5;
    test_must(ctx, imp_fit(p, &o, &run, &r));
    out.n = r->n;
    memcpy(out.v, r->variables, r->n * sizeof *out.v);
    out.objective = r->objective;
    snprintf(out.walks, sizeof out.walks, "%s", r->walks ? r->walks : "");
    imp_problem_destroy(p);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
    return out;
}

static bool same(const struct fitted *a, const struct fitted *b)
{
    bool all = a->n == b->n && a->objective.value == b->objective.value &&
               a->objective.se == b->objective.se;
    for (size_t k = 0; k < a->n && all; k++) /* NaN of a bound is like NaN */
        all = memcmp(&a->v[k].start, &b->v[k].start,
                     offsetof(struct imp_fit_variable, at_bound) -
                         offsetof(struct imp_fit_variable, start)) == 0 &&
              a->v[k].at_bound == b->v[k].at_bound &&
              a->v[k].determined == b->v[k].determined;
    return all;
}

/* Largest |difference| over the standard errors of both. */
static double apart(const struct fitted *a, const struct fitted *b)
{
    double worst = 0;
    for (size_t k = 0; k < a->n; k++)
        worst = fmax(worst,
                     fabs(a->v[k].value - b->v[k].value) / hypot(a->v[k].se, b->v[k].se));
    return worst;
}

int main(void)
{
    imp_context *ctx = test_context(2), *one = test_context(1);
    static const enum imp_optimizer methods[] = {IMP_LBFGS, IMP_MMA, IMP_SLSQP};
    static const char *const names[] = {"lbfgs", "mma", "slsqp"};
    const char *box = "res=16";
    for (int k = 0; k < 3; k++) {
        const struct fitted kept =
            fit(ctx, "cornell.xml", box, IMP_RGB, "red.*", 0.6, methods[k], 0, 40);
        const struct fitted traced =
            fit(ctx, "cornell.xml", box, IMP_RGB, "red.*", 0.6, methods[k], -1, 40);
        tap_ok(strstr(kept.walks, "drawn 1 time ") && traced.walks[0] == 0,
               "%s: kept, if it is not forbidden # %s", names[k], kept.walks);
        /* Both end with a Newton step of walks of their own. */
        tap_ok(apart(&kept, &traced) < 4.5, "%s: the answers agree # z %.2f", names[k],
               apart(&kept, &traced));
        if (k > 0) continue;
        const struct fitted again =
            fit(one, "cornell.xml", box, IMP_RGB, "red.*", 0.6, methods[k], 0, 40);
        tap_ok(same(&kept, &again), "lbfgs: the same bits with one thread");
        const struct fitted small =
            fit(ctx, "cornell.xml", box, IMP_RGB, "red.*", 0.6, methods[k], 1e4, 40);
        tap_ok(same(&small, &traced) && strstr(small.walks, "MB are allowed"),
               "too little memory: traced, and told # %s", small.walks);
    }
    const struct fitted far = fit(ctx, "stam.xml", "res=16 integrator=path", IMP_MONO,
                                  "sphere.exponent,light.*", 4, IMP_LBFGS, 0, 40);
    double z = 0;
    int times = 0;
    for (size_t k = 0; k < far.n; k++)
        z = fmax(z, fabs(far.v[k].value * 4 - far.v[k].start) / (4 * far.v[k].se));
    const char *drawn = strstr(far.walks, "drawn ");
    if (drawn) sscanf(drawn, "drawn %d", &times);
    tap_ok(times >= 2 && z < 4.5,
           "an exponent from four times its value: new draws, and the truth # z %.2f, %s",
           z, far.walks);
    const struct fitted fog =
        fit(ctx, "fog.xml", "res=8", IMP_RGB, "fog.sigma_t*", 1.05, IMP_LBFGS, 0, 1);
    tap_ok(strstr(fog.walks, "every evaluation traced") && strstr(fog.walks, "sigma_t"),
           "an extinction is traced # %s", fog.walks);
    imp_context_destroy(ctx);
    imp_context_destroy(one);
    return tap_done();
}

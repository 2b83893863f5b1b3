/* SPDX-License-Identifier: Apache-2.0
 *
 * Everything that takes long can be stopped at its first reports, and leaves what it
 * promises: pictures with the passes done, outputs untouched, a fit at the state reached;
 * and the problem goes on afterwards as if nothing had been. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/gauss/gauss_newton.h"
#include "inverse/problem/problem.h"
#include <math.h>

#define MANY 100000000 /* samples: only the stop ends this */

static const char ball[] =
    "<scene version='3.0.0'><integrator type='path'/>"
    "<sensor type='perspective'><transform name='to_world'>"
    "<lookat origin='0,1,4' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"
    "<integer name='width' value='20'/><integer name='height' value='12'/>%s</film>"
    "</sensor><emitter type='constant' id='sky'><rgb name='radiance' "
    "value='1,.9,.8'/></emitter>"
    "<bsdf type='diffuse' id='ball'><rgb name='reflectance' value='.5,.4,.3'/></bsdf>"
    "<shape type='sphere'><ref id='ball'/></shape>"
    "</scene>";
enum { W = 20, H = 12, C = 3, N = 6 };

static imp_context *ctx;
static imp_scene *scene;
static imp_problem *problem;
static int calls, stop_at;

static int progress(const struct imp_progress *p, void *payload)
{
    (void)p, (void)payload;
    return ++calls >= stop_at;
}

static struct imp_run stopped_run(int at)
{
    struct imp_run run = IMP_RUN_INIT;
    run.spp = MANY;
    run.progress = progress;
    calls = 0;
    stop_at = at;
    return run;
}

/* Finite, with the samples it claims, and destroyed here. */
static int film_fine(imp_film *film)
{
    struct imp_film_info info = {.size = sizeof info};
    if (!film) return 0;
    imp_film_get_info(film, &info);
    int fine = info.width == W && info.height == H && info.spp >= 0 && info.spp < MANY;
    for (int i = 0; i < W * H * info.channels; i++)
        fine &= isfinite(imp_film_mean(film)[i]) != 0;
    imp_film_destroy(film);
    return fine;
}

static int untouched(const double *v, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (v[i] != -7) return 0;
    return 1;
}

static void pictures(int at)
{
    struct imp_run run = stopped_run(at);
    double x_dot[N] = {1, 2, 3, 4, 5, 6};
    imp_film *film = NULL, *films[N] = {NULL};

    imp_scene *none = NULL; /* leaves a message */
    tap_ok(imp_scene_load(ctx, "no file", NULL, &none) == IMP_E_IO, "no such scene");
    enum imp_status st = imp_render(scene, &run, &film);
    tap_ok(st == IMP_CANCELLED && film_fine(film), "render, stopped at report %d", at);
    tap_ok(!strcmp(imp_last_error(ctx), imp_status_text(IMP_CANCELLED)),
           "the message is its own # %s", imp_last_error(ctx));
    run = stopped_run(at);
    film = NULL;
    st = imp_problem_forward(problem, x_dot, &run, &film);
    tap_ok(st == IMP_CANCELLED && film_fine(film), "forward, stopped at report %d", at);
    run = stopped_run(at);
    film = NULL;
    st = imp_problem_jacobian(problem, &run, &film, films);
    struct imp_film_info info = {.size = sizeof info};
    struct imp_estimate mean = {.value = -7}, sums[N];
    imp_film_get_info(film, &info);
    const struct imp_run again = IMP_RUN_INIT;
    int told = imp_problem_jacobian_sums(problem, NULL, &again, film, films, NULL, 0,
                                         &mean, sums) == IMP_OK;
    for (int k = 0; k < N; k++) told &= isfinite(sums[k].value) == (info.spp > 0);
    tap_ok(told && isfinite(mean.value) == (info.spp > 0),
           "means of pictures with %d samples", (int)info.spp);
    int fine = film_fine(film);
    for (int k = 0; k < N; k++) fine &= film_fine(films[k]);
    tap_ok(st == IMP_CANCELLED && fine, "jacobian, stopped at report %d", at);
    run = stopped_run(MANY); /* time is no failure */
    run.time_limit_s = 0.05;
    film = NULL;
    st = imp_render(scene, &run, &film);
    tap_ok(st == IMP_OK && film_fine(film), "render until the time is up");
}

static void gradients(int at)
{
    double g[2 * N], H_all[3 * N * N];
    float seed[W * H * C] = {0};
    struct imp_estimate J = {.value = -7, .se = -7};
    for (int i = 0; i < 2 * N; i++) g[i] = -7;
    for (int i = 0; i < 3 * N * N; i++) H_all[i] = -7;

    struct imp_run run = stopped_run(at);
    enum imp_status st = imp_problem_objective(problem, NULL, &run, &J, g, g + N);
    tap_ok(st == IMP_CANCELLED && untouched(g, 2 * N) && J.value == -7,
           "objective, stopped at report %d", at);
    run = stopped_run(at);
    st = imp_problem_reverse(problem, seed, &run, g, g + N);
    tap_ok(st == IMP_CANCELLED && untouched(g, 2 * N), "reverse, stopped at report %d",
           at);
    struct imp__gauss_newton gn = {
        .H = H_all, .H_same = H_all + N * N, .cov_g = H_all + 2 * N * N, .g = g};
    run = stopped_run(at);
    st = imp__gauss_newton(problem, NULL, &run, &gn);
    tap_ok(st == IMP_CANCELLED && untouched(g, 2 * N) && untouched(H_all, 3 * N * N),
           "Gauss-Newton, stopped at report %d", at);
}

/* The walks of one evaluation are few, those of the fit many. */
static void fits(int at)
{
    static const char *const name[] = {"Adam", "LM", "L-BFGS"};
    for (int kind = IMP_ADAM; kind <= IMP_LBFGS; kind++) {
        struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
        const struct imp_fit_result *r = NULL;
        struct imp_run run = stopped_run(at);
        double start[N], x[N];
        imp_problem_get_x(problem, start);
        o.optimizer = (enum imp_optimizer)kind;
        o.max_iterations = 1000000;
        o.tolerance = 1e-12;
        o.intervals = 1;
        if (kind == IMP_ADAM) run.spp = 8;
        if (kind == IMP_LBFGS)
            run.spp = 10000; /* each sample of its walks has a number in memory */
        const enum imp_status st = imp_fit(problem, &o, &run, &r);
        imp_problem_get_x(problem, x);
        int fine = st == IMP_CANCELLED && r && r->n == N;
        for (size_t k = 0; fine && k < N; k++)
            fine = r->variables[k].value == x[k] && isfinite(x[k]);
        if (fine && isnan(r->objective.value)) /* before its first evaluation */
            fine = isnan(r->residual) && isnan(r->residual_hi);
        tap_ok(fine && strcmp(r->reason, "cancelled") == 0,
               "%s, stopped at report %d # %s, %d iterations", name[kind], at,
               imp_status_text(st), r ? r->iterations : -1);
        test_must(ctx, imp_problem_set_x(problem, start));
    }
}

static void checks(int at)
{
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    const struct imp_check_row *rows = NULL;
    size_t n = 0;
    struct imp_run run = stopped_run(at);
    o.only = "frozen,dot,euler,fresh,loss,ends";
    o.draws_s = 0.02;
    o.fresh_spp = MANY;
    double before[N], after[N];
    imp_problem_get_x(problem, before);
    const enum imp_status st = imp_check(problem, &o, &run, &rows, &n);
    imp_problem_get_x(problem, after);
    int fine = st == IMP_CANCELLED && (rows || n == 0);
    for (size_t k = 0; k < n && fine; k++) fine = rows[k].method && rows[k].param;
    tap_ok(fine && memcmp(before, after, sizeof before) == 0,
           "check, stopped at report %d # %zu rows", at, n);
}

/* The same numbers as before anything was stopped. */
static void numbers(double *out)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate J;
    run.spp = 8;
    run.seed = 5;
    test_must(ctx, imp_problem_objective(problem, NULL, &run, &J, out, out + N));
    out[2 * N] = J.value;
}

int main(void)
{
    static const char *const filter[] = {"<rfilter type='box'/>", ""};
    static float pixels[W * H * C];
    for (int i = 0; i < W * H * C; i++) pixels[i] = 0.3f;
    for (int f = 0; f < 2; f++) {
        char xml[2048];
        double before[2 * N + 1], after[2 * N + 1];
        struct imp_target t = IMP_TARGET_INIT;
        snprintf(xml, sizeof xml, ball, filter[f]);
        ctx = test_context(f ? 2 : 1);
        scene = test_scene_text(ctx, xml, IMP_RGB);
        problem = test_problem(ctx, scene, "*");
        t.width = W, t.height = H, t.channels = C, t.pixels = pixels;
        test_must(ctx, imp_problem_add_target(problem, &t));
        if (imp_problem_n_variables(problem) != N) return 99;
        printf("# %s filter\n", f ? "gaussian" : "box");
        numbers(before);
        for (int at = 1; at <= 2; at++) {
            pictures(at);
            gradients(at);
            fits(at);
            checks(at);
        }
        numbers(after);
        tap_ok(memcmp(before, after, sizeof before) == 0, "then the same bits as before");
        imp_problem_destroy(problem);
        imp_scene_destroy(scene);
        imp_context_destroy(ctx);
    }
    return tap_done();
}

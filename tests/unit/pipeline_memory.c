/* SPDX-License-Identifier: Apache-2.0
 *
 * Allocation 1, 2, 3, ... fails inside every call that makes something of a scene: each
 * time IMP_E_NOMEM with a message, outputs untouched, nothing leaked; and the same call
 * on the same objects works when memory is back. */
#include "imp_fail_alloc.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/gauss/gauss_newton.h"
#include "inverse/problem/problem.h"
#include <unistd.h>

static struct fail_alloc heap;
static imp_context *ctx;
static imp_scene *scene, *wide, *texture;
static imp_problem *problem, *wide_problem, *texture_problem, *l1_problem;
static imp_film *picture;
static char folder[] = "/tmp/importon-memory-XXXXXX";
static char path[128];

static const char xml[] =
    "<scene version='3.0.0'><integrator type='%s'><integer name='max_depth' value='4'/>"
    "</integrator><sensor type='perspective'><transform name='to_world'>"
    "<lookat origin='0,1,4' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"
    "<integer name='width' value='10'/><integer name='height' value='9'/>"
    "<rfilter type='%s'/></film></sensor><emitter type='constant' id='sky'/>"
    "<bsdf type='twosided' id='two'><bsdf type='roughconductor' id='metal'/></bsdf>"
    "<shape type='sphere'><ref id='two'/></shape>"
    "<shape type='rectangle'><transform name='to_world'><scale value='0.4'/>"
    "<translate y='2'/></transform><emitter type='area'/></shape></scene>";

static imp_scene *textured(int side)
{
    imp_scene *s;
    float *pixels = malloc((size_t)side * (size_t)side * 3 * sizeof *pixels);
    for (int k = 0; k < side * side * 3; k++) pixels[k] = 0.4f;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    test_camera(s, 3, 40, 10, 9);
    test_picture_wall(s, side, side, pixels);
    test_must(ctx, imp_scene_commit(s));
    free(pixels);
    return s;
}

static imp_problem *matching(imp_scene *s, enum imp_loss loss)
{
    imp_problem *p = test_problem(ctx, s, "*");
    struct imp_target t = IMP_TARGET_INIT;
    static float pixels[10 * 9 * 3];
    for (int k = 0; k < 270; k++) pixels[k] = 0.3f;
    t.width = 10, t.height = 9, t.channels = 3, t.pixels = pixels;
    t.loss = loss;
    test_must(ctx, imp_problem_add_target(p, &t));
    return p;
}

/* ---- Calls: each makes and destroys its output --------------------------------- */

static struct imp_run run = IMP_RUN_INIT;

static enum imp_status keep_nothing(enum imp_status st, imp_film **film)
{
    if (st != IMP_OK && *film) st = IMP_E_NUMERIC; /* an output of a failed call */
    imp_film_destroy(*film);
    return st;
}
static enum imp_status render(void)
{
    imp_film *film = NULL;
    return keep_nothing(imp_render(scene, &run, &film), &film);
}
static enum imp_status render_wide(void)
{
    imp_film *film = NULL;
    return keep_nothing(imp_render(wide, &run, &film), &film);
}
static enum imp_status objective_of(imp_problem *p)
{
    const size_t n = imp_problem_n_variables(p);
    struct imp_estimate J = {.value = -1, .se = -1, .bias_order = -1};
    double *g = calloc(2 * n, sizeof *g);
    g[0] = -7;
    enum imp_status st = imp_problem_objective(p, NULL, &run, &J, g, g + n);
    if (st != IMP_OK && (J.value != -1 || g[0] != -7)) st = IMP_E_NUMERIC;
    free(g);
    return st;
}
static enum imp_status objective(void) { return objective_of(problem); }
static enum imp_status objective_l1(void) { return objective_of(l1_problem); }
static enum imp_status objective_wide(void) { return objective_of(wide_problem); }
static enum imp_status objective_texture(void) { return objective_of(texture_problem); }
static enum imp_status reverse(void)
{
    static float seed[10 * 9 * 3];
    double g[64] = {-7};
    enum imp_status st = imp_problem_reverse(problem, seed, &run, g, NULL);
    if (st != IMP_OK && g[0] != -7) st = IMP_E_NUMERIC;
    return st;
}
static enum imp_status forward(void)
{
    double x_dot[64] = {1, 2};
    imp_film *film = NULL;
    return keep_nothing(imp_problem_forward(problem, x_dot, &run, &film), &film);
}
static enum imp_status jacobian(void)
{
    imp_film *films[64] = {0}, *primal = NULL;
    enum imp_status st = imp_problem_jacobian(problem, &run, &primal, films);
    for (size_t k = 0; k < imp_problem_n_variables(problem); k++)
        st = keep_nothing(st, &films[k]);
    return keep_nothing(st, &primal);
}
static enum imp_status gauss_newton_of(imp_problem *p)
{
    const size_t n = imp_problem_n_variables(p);
    struct imp__gauss_newton gn = {0};
    gn.H = calloc(2 * n * n, sizeof(double));
    gn.cov_g = gn.H + n * n;
    const enum imp_status st = imp__gauss_newton(p, NULL, &run, &gn);
    free(gn.H);
    return st;
}
static enum imp_status gauss_newton(void) { return gauss_newton_of(problem); }
static enum imp_status gauss_newton_wide(void) { return gauss_newton_of(wide_problem); }
static enum imp_status describe_as(int json)
{
    char *text = NULL;
    enum imp_status st = imp_walk_describe(scene, &run, 5, 5, 0, json, &text);
    if (st != IMP_OK && text) st = IMP_E_NUMERIC;
    imp_free(ctx, text);
    return st;
}
static enum imp_status describe(void) { return describe_as(0); }
static enum imp_status describe_json(void) { return describe_as(1); }
static enum imp_status film_as(const char *ending)
{
    imp_film *film = NULL;
    struct imp_write_options o = IMP_WRITE_OPTIONS_INIT;
    snprintf(path, sizeof path, "%s/a.%s", folder, ending);
    o.standard_error = strcmp(ending, "exr") == 0;
    enum imp_status st = imp_film_write(picture, path, &o);
    if (st == IMP_OK) st = imp_film_read(ctx, path, &film);
    unlink(path);
    return keep_nothing(st, &film);
}
static enum imp_status film_exr(void) { return film_as("exr"); }
static enum imp_status film_pfm(void) { return film_as("pfm"); }
static enum imp_status film_png(void) { return film_as("png"); }
static enum imp_status film_npy(void) { return film_as("npy"); }
static enum imp_status film_text(void)
{
    imp_film *film = NULL;
    enum imp_status st = imp_film_create(ctx, 3, 2, "R,G,B", &film);
    if (st == IMP_OK) st = imp_film_set_text(film, "key", "value");
    imp_film_destroy(film);
    return st;
}
static enum imp_status compare(void)
{
    struct imp_compare_result r = {.size = sizeof r};
    return imp_compare(ctx, picture, picture, NULL, &r);
}
static enum imp_status problem_make(void)
{
    imp_problem *p = NULL;
    enum imp_status st = imp_problem_create(scene, &p);
    if (st == IMP_OK) st = imp_problem_activate(p, "*");
    if (st == IMP_OK) st = imp_problem_activate(p, "metal.alpha.value");
    if (st == IMP_OK) st = imp_problem_add_tikhonov(p, "*", 1, 1);
    imp_problem_destroy(p);
    return st;
}

static enum imp_status functional(void)
{
    struct imp_estimate F = {.value = -1, .se = -1, .bias_order = -1};
    double g[64] = {-7};
    enum imp_status st = imp_problem_functional(problem, NULL, &run, &F, g, NULL);
    if (st != IMP_OK && (F.value != -1 || g[0] != -7)) st = IMP_E_NUMERIC;
    return st;
}

static void check(const char *name, enum imp_status (*call)(void))
{
    long n, wrong = 0, leaks = 0, silent = 0;
    enum imp_status st = call(); /* the pool and Embree's device are made once */
    if (!tap_ok(st == IMP_OK, "%s works # %s", name, st ? imp_last_error(ctx) : ""))
        return;
    for (n = 1; n < 20000; n += 1 + n / 40) {
        const long before = heap.live;
        heap.fail_at = heap.calls + n;
        st = call();
        heap.fail_at = 0;
        leaks += heap.live != before;
        if (st == IMP_OK) break;
        if (st != IMP_E_NOMEM)
            printf("# allocation %ld: %s: %s\n", n, imp_status_text(st),
                   imp_last_error(ctx));
        wrong += st != IMP_E_NOMEM;
        silent += !*imp_last_error(ctx);
        if (call() != IMP_OK || heap.live != before) {
            tap_ok(0, "%s works again after failure %ld # %s", name, n,
                   imp_last_error(ctx));
            return;
        }
    }
    tap_ok(st == IMP_OK && !wrong && !leaks && !silent,
           "%s: allocations up to %ld fail # %ld wrong statuses, %ld leaks, %ld without "
           "message",
           name, n, wrong, leaks, silent);
}

int main(void)
{
    for (int threads = 1; threads <= 2; threads++) {
        struct imp_context_options co = IMP_CONTEXT_OPTIONS_INIT;
        char text[2048];
        heap = (struct fail_alloc){0};
        co.threads = threads;
        co.allocator = fail_alloc_hooks(&heap);
        if (imp_context_create(&co, &ctx) != IMP_OK) return 1;
        printf("# %d threads\n", threads);
        strcpy(folder, "/tmp/importon-memory-XXXXXX");
        if (!mkdtemp(folder)) return 1;
        run.spp = 5;
        snprintf(text, sizeof text, xml, "path", "box");
        scene = test_scene_text(ctx, text, IMP_RGB);
        snprintf(text, sizeof text, xml, "path", "gaussian");
        wide = test_scene_text(ctx, text, IMP_RGB);
        texture = textured(256);
        problem = matching(scene, IMP_LOSS_L2);
        l1_problem = matching(scene, IMP_LOSS_L1);
        wide_problem = matching(wide, IMP_LOSS_L2);
        texture_problem = matching(texture, IMP_LOSS_L2);
        test_must(ctx, imp_render(scene, &run, &picture));
        test_must(ctx, imp_film_set_text(picture, "seed", "0"));

        check("render", render);
        check("render through a wide filter", render_wide);
        check("objective", objective);
        check("objective, L1", objective_l1);
        check("objective through a wide filter", objective_wide);
        check("objective of a texture of 256 x 256", objective_texture);
        check("reverse", reverse);
        check("forward", forward);
        check("jacobian", jacobian);
        check("Gauss-Newton", gauss_newton);
        check("Gauss-Newton through a wide filter", gauss_newton_wide);
        check("a walk in words", describe);
        check("a walk in JSON", describe_json);
        check("EXR", film_exr);
        check("PFM", film_pfm);
        check("PNG", film_png);
        check("NPY", film_npy);
        check("texts of a film", film_text);
        check("compare", compare);
        check("a problem", problem_make);

        imp_film_destroy(picture);
        imp_problem_destroy(problem);
        imp_problem_destroy(l1_problem);
        imp_problem_destroy(wide_problem);
        imp_problem_destroy(texture_problem);
        imp_scene_destroy(scene);

        snprintf(text, sizeof text, xml, "bdpt", "box");
        scene = test_scene_text(ctx, text, IMP_RGB);
        problem = matching(scene, IMP_LOSS_L2);
        for (int k = 0; k < 2; k++) {
            run.from = k ? IMP_FROM_LIGHTS : IMP_FROM_SCENE;
            printf("# from %s\n", k ? "the lights" : "both ends");
            check("render", render);
            check("objective", objective);
            check("functional", functional);
            check("forward", forward);
            check("jacobian", jacobian);
            check("Gauss-Newton", gauss_newton);
        }
        run.from = IMP_FROM_SCENE;
        imp_problem_destroy(problem);
        imp_scene_destroy(scene);
        imp_scene_destroy(wide);
        imp_scene_destroy(texture);
        imp_context_destroy(ctx);
        rmdir(folder);
        tap_ok(heap.live == 0, "all memory is given back");
    }
    return tap_done();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Allocation 1, 2, 3, ... fails, in fits and checks: an error every time, nothing leaks,
 * and the scene's numbers are what they were. And the bytes that Adam takes for a texture:
 * no more than 40 a number, checkpoints, resuming and the result included. */
#include "imp_fail_alloc.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse_scenes.h"
#include <math.h>
#include <unistd.h>

enum job { FIT_ADAM, FIT_LM, FIT_LBFGS, CHECK, FUNCTIONAL, JACOBIAN_SUMS, N_JOBS };
static const char *const names[] = {"fit, Adam",   "fit, LM and intervals",
                                    "fit, L-BFGS", "check",
                                    "functional",  "sums of derivative pictures"};

/* From a new context to the result; *reached: how far it got. */
static enum imp_status run_job(enum job job, struct fail_alloc *heap, long fail_at,
                               int *changed)
{
    struct imp_context_options co = IMP_CONTEXT_OPTIONS_INIT;
    struct imp_load_options lo = IMP_LOAD_OPTIONS_INIT;
    imp_context *ctx = NULL;
    imp_scene *s = NULL;
    imp_problem *p = NULL;
    float pixels[12 * 10 * 3];
    co.threads = 1;
    co.allocator = fail_alloc_hooks(heap);
    heap->fail_at = 0;
    if (imp_context_create(&co, &ctx) != IMP_OK) return IMP_E_NOMEM;
    enum imp_status st =
        imp_scene_load_string(ctx, ball_xml, strlen(ball_xml), "ball", &lo, &s);
    struct imp_target t = IMP_TARGET_INIT;
    for (int i = 0; i < 360; i++) pixels[i] = 0.8f;
    t.width = 12, t.height = 10, t.channels = 3, t.pixels = pixels;
    double before[6], after[6];
    /* Everything so far may allocate; what follows fails at its allocation number
     * fail_at. */
    heap->fail_at = fail_at ? heap->calls + fail_at : 0;
    if (st == IMP_OK) st = imp_problem_create(s, &p);
    if (st == IMP_OK) st = imp_problem_activate(p, "ball.*");
    if (st == IMP_OK) st = imp_problem_add_target(p, &t);
    if (st == IMP_OK) st = imp_problem_add_tikhonov(p, "ball.*", 0.1, 1);
    const int ready = st == IMP_OK;
    if (ready) imp_problem_get_x(p, before);
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 4;
    if (ready && job == CHECK) {
        const struct imp_check_row *rows;
        size_t n;
        struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
        o.only = "frozen,dot,euler,fresh,loss,ends";
        o.draws_s = 0.02;
        o.paths = 10;
        st = imp_check(p, &o, &run, &rows, &n);
    } else if (ready && job == FUNCTIONAL) {
        struct imp_estimate value;
        double g[6], g_se[6];
        st = imp_problem_functional(p, pixels, &run, &value, g, g_se);
    } else if (ready && job == JACOBIAN_SUMS) {
        struct imp_estimate value, sums[6];
        imp_film *primal = NULL, *films[6] = {NULL};
        st = imp_problem_jacobian(p, &run, &primal, films);
        if (st == IMP_OK)
            st = imp_problem_jacobian_sums(p, pixels, &run, primal, films, NULL, 0,
                                           &value, sums);
        for (int k = 0; k < 6; k++) imp_film_destroy(films[k]);
        imp_film_destroy(primal);
    } else if (ready) {
        const struct imp_fit_result *r;
        struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
        o.optimizer = job == FIT_ADAM ? IMP_ADAM : job == FIT_LM ? IMP_LM : IMP_LBFGS;
        o.max_iterations = 3;
        o.intervals = job == FIT_LM;
        st = imp_fit(p, &o, &run, &r);
    }
    *changed = 0;
    if (ready && (st != IMP_OK || job >= CHECK)) {
        imp_problem_get_x(p, after);
        *changed = memcmp(before, after, 3 * sizeof *before) != 0;
    }
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return st;
}

/* ---- A texture by Adam ----------------------------------------------------------- */

struct taken {
    double first, second, left; /* bytes: two fits, the second resumed; with the result */
};

static struct taken texture_fit(int texels, const char *checkpoint,
                                enum imp_variates variates)
{
    enum { SIDE = 16 };
    const size_t n = 3 * (size_t)texels * (size_t)texels;
    static float target[SIDE * SIDE * 3];
    float *pixels = calloc(n, sizeof *pixels);
    struct fail_alloc heap = {0};
    imp_context *ctx = fail_alloc_context(&heap);
    imp_scene *s;
    imp_problem *p;
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    const struct imp_fit_result *r;
    struct taken taken;
    if (!pixels) exit(99);
    for (size_t k = 0; k < n; k++) pixels[k] = 0.5f;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    test_camera(s, 3, 30, SIDE, SIDE);
    test_picture_wall(s, texels, texels, pixels);
    test_must(ctx, imp_scene_commit(s));
    free(pixels);
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "*data*"));
    t.width = t.height = SIDE, t.channels = 3, t.pixels = target;
    test_must(ctx, imp_problem_add_target(p, &t));
    test_must(ctx, imp_problem_add_smoothness(p, "*data*", 0.01));

    const size_t before = heap.bytes;
    run.spp = 4;
    o.checkpoint = checkpoint;
    o.resume = 1;
    o.control_variate = variates;
    o.max_iterations = 2;
    heap.peak = heap.bytes;
    test_must(ctx, imp_fit(p, &o, &run, &r));
    taken.first = (double)(heap.peak - before);
    o.max_iterations = 25; /* more than a window */
    heap.peak = heap.bytes;
    test_must(ctx, imp_fit(p, &o, &run, &r));
    taken.second = (double)(heap.peak - before);
    taken.left = (double)(heap.bytes - before);
    if (r->iterations != 25 || r->n_history != 25) exit(99);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    remove(checkpoint);
    return taken;
}

static void texture_memory(void)
{
    enum { SMALL = 64, LARGE = 320 };
    char path[64];
    snprintf(path, sizeof path, "/tmp/imp_fit_memory_%ld.ck", (long)getpid());
    for (int with = 0; with < 2; with++) {
        const enum imp_variates which = with ? IMP_VARIATES_ON : IMP_VARIATES_OFF;
        const struct taken a = texture_fit(SMALL, path, which),
                           b = texture_fit(LARGE, path, which);
        const double n = 3. * (LARGE * LARGE - SMALL * SMALL);
        const double first = (b.first - a.first) / n, second = (b.second - a.second) / n;
        /* Iterate 8, moments, window, average and start 24 and gradient 8; then x and start.
         * With control variates, the texels of a second scene 4, and a checkpoint 8. */
        const double most = with ? 54.1 : 40.1;
        tap_ok(first <= most, "%sa fit of %d numbers # %.2f bytes each",
               with ? "with control variates, " : "", 3 * LARGE * LARGE, first);
        tap_ok(second <= most, "and another, resumed from a checkpoint # %.2f", second);
        tap_ok((b.left - a.left) / n <= 12.1, "its result # %.2f", (b.left - a.left) / n);
    }
}

int main(void)
{
    for (int job = 0; job < N_JOBS; job++) {
        struct fail_alloc heap = {0};
        int changed, bad_status = 0, leaks = 0, touched = 0;
        long n = 0;
        enum imp_status st = run_job(job, &heap, 0, &changed);
        tap_ok(st == IMP_OK && heap.live == 0, "%s: works when memory lasts", names[job]);
        for (n = 1; n < 20000; n += 1 + n / 60) {
            heap = (struct fail_alloc){0};
            st = run_job(job, &heap, n, &changed);
            leaks += heap.live != 0;
            touched += changed;
            if (st == IMP_OK) break;
            if (st != IMP_E_NOMEM) printf("# allocation %ld: status %d\n", n, (int)st);
            bad_status += st != IMP_E_NOMEM;
        }
        tap_ok(st == IMP_OK && bad_status == 0 && leaks == 0 && touched == 0,
               "%s: allocations up to %ld fail # %d wrong statuses, %d leaks, %d scenes "
               "changed",
               names[job], n, bad_status, leaks, touched);
    }
    texture_memory();
    return tap_done();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Allocation 1, 2, 3, ... and all that follow fail, in least squares of 300 numbers with their
 * errors: an error every time, nothing leaks, and the numbers are what they were. */
#include "imp_fail_alloc.h"
#include "imp_scene.h"
#include "imp_tap.h"

enum { SIDE = 10, N = 3 * SIDE * SIDE, FILM = 8 };

static imp_problem *problem;
static double x[N];

static enum imp_status fit(imp_context *ctx)
{
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *r;
    o.optimizer = IMP_LM;
    o.max_iterations = 2;
    o.intervals = 1;
    run.spp = 32;
    test_must(ctx, imp_problem_set_x(problem, x));
    return imp_fit(problem, &o, &run, &r);
}

int main(void)
{
    static float pixels[N], target[FILM * FILM * 3], se[FILM * FILM * 3];
    struct fail_alloc heap = {0};
    imp_context *ctx = fail_alloc_context(&heap);
    struct imp_target t = IMP_TARGET_INIT;
    imp_scene *s;
    double after[N];
    for (int i = 0; i < N; i++) pixels[i] = .5f;
    for (int i = 0; i < FILM * FILM * 3; i++) target[i] = .4f, se[i] = .01f;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    test_camera(s, 3, 37, FILM, FILM);
    test_picture_wall(s, SIDE, SIDE, pixels);
    test_must(ctx, imp_scene_commit(s));
    problem = test_problem(ctx, s, "*data*");
    t.width = t.height = FILM, t.channels = 3, t.pixels = target, t.noise_se = se;
    test_must(ctx, imp_problem_add_target(problem, &t));
    imp_problem_get_x(problem, x);
    test_must(ctx, fit(ctx)); /* the pool and the device are made once */
    test_must(ctx, imp_problem_set_x(problem, x));
    long n, wrong = 0, moved = 0, leaks = 0;
    enum imp_status st = IMP_E_NOMEM;
    for (n = 1; n < 5000 && st != IMP_OK; n += 1 + n / 40) {
        heap.fail_at = heap.calls + n;
        st = fit(ctx);
        heap.fail_at = 0;
        imp_problem_get_x(problem, after);
        wrong += st != IMP_OK && (st != IMP_E_NOMEM || !*imp_last_error(ctx));
        moved += st != IMP_OK && memcmp(x, after, sizeof x) != 0;
    }
    tap_ok(st == IMP_OK && n > 100 && !wrong && !moved,
           "allocations up to %ld fail # %ld wrong statuses, %ld moved numbers", n, wrong,
           moved);
    imp_problem_destroy(problem);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    leaks = heap.live;
    tap_ok(leaks == 0, "nothing leaks # %ld blocks", leaks);
    return tap_done();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Intervals of whole fits: 100 noisy pictures of the box, each fitted with walks of its
 * own; the truth must lie in the 95 % intervals 90 to 99 times, with the pictures' noise
 * given and without. */
#include "imp_tap.h"
#include "inverse_scenes.h"
#include <math.h>

enum { SEEDS = 100, N = 3 };

static void coverage(imp_context *ctx, int noise_given)
{
    imp_scene *s = scene_open(ctx, box_xml, IMP_RGB);
    int covered[N] = {0}, failed = 0;
    struct tap_stat z2 = {0};
    double truth[N] = {0.7, 0.7, 0.7};
    for (int k = 0; k < SEEDS; k++) {
        imp_problem *p = NULL;
        imp_film *film = NULL;
        const struct imp_fit_result *r = NULL;
        struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
        struct imp_run run = IMP_RUN_INIT;
        enum imp_status st = imp_problem_create(s, &p);
        if (st == IMP_OK) st = imp_problem_activate(p, "white.*");
        if (st == IMP_OK) st = imp_problem_set_x(p, truth);
        struct imp_target t = target_of(ctx, s, 0, 32, 500 + (uint64_t)k, &film);
        if (!noise_given) t.noise_se = NULL;
        if (st == IMP_OK) st = imp_problem_add_target(p, &t);
        if (st == IMP_OK) st = imp_problem_set_x(p, (double[]){0.5, 0.5, 0.5});
        o.optimizer = IMP_LM;
        o.intervals = 1;
        run.spp = 16;
        run.seed = 9000 + (uint64_t)k;
        if (st == IMP_OK) st = imp_fit(p, &o, &run, &r);
        failed += st != IMP_OK;
        for (int i = 0; st == IMP_OK && i < N; i++) {
            const struct imp_fit_variable *v = &r->variables[i];
            covered[i] += v->lo95 <= truth[i] && truth[i] <= v->hi95;
            tap_add(&z2, pow((v->value - truth[i]) / v->se, 2));
        }
        imp_problem_destroy(p);
        imp_film_destroy(film);
    }
    tap_ok(failed == 0, "%d fits", SEEDS);
    for (int i = 0; i < N; i++)
        tap_ok(covered[i] >= 90 && covered[i] <= 99 + 1,
               "channel %d, noise %s # %d of %d intervals "
               "hold the truth",
               i, noise_given ? "given" : "from residuals", covered[i], SEEDS);
    tap_ok(z2.mean < 1.5 && z2.mean > 0.6, "mean z^2 # %.2f", z2.mean);
    imp_scene_destroy(s);
}

int main(void)
{
    imp_context *ctx;
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 1;
    coverage(ctx, 1);
    coverage(ctx, 0);
    imp_context_destroy(ctx);
    return tap_done();
}

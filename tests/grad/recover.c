/* SPDX-License-Identifier: Apache-2.0
 *
 * T6 of docs/estimators.md 2.3: all seven controls of Stam's box back from one 32 x 32
 * picture, from a start 30 % off. Light samples instead of Stam's own walk (expectations
 * are the same, the noise of a pixel is far smaller), and weights that follow the
 * picture's noise. With IMP_SLOW set, enough samples for 2 %; else what the standard
 * errors promise. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>

static imp_scene *box(imp_context *ctx)
{
    return test_scene(ctx, "stam.xml", IMP_MONO, "res=32 integrator=path");
}

int main(void)
{
    imp_context *ctx = test_context(0);
    const int slow = getenv("IMP_SLOW") != NULL;
    imp_scene *s = box(ctx);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_target t = IMP_TARGET_INIT;
    imp_film *film = NULL;
    run.spp = slow ? 65536 : 1024;
    run.seed = 42;
    test_must(ctx, imp_render(s, &run, &film));
    const float *se = imp_film_se(film);
    static float weights[32 * 32];
    double mean = 0;
    for (int i = 0; i < 1024; i++) mean += se[i] / 1024;
    for (int i = 0; i < 1024; i++)
        weights[i] = (float)(1 / (se[i] * se[i] / (mean * mean) + 0.05));
    t.width = t.height = 32;
    t.channels = 1;
    t.pixels = imp_film_mean(film);
    t.noise_se = se;
    t.weights = weights;

    for (int kind = IMP_ADAM; kind <= IMP_LM; kind++) {
        imp_problem *p = NULL;
        double truth[7], x[7];
        const struct imp_fit_result *r = NULL;
        struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
        test_must(ctx, imp_problem_create(s, &p));
        test_must(ctx, imp_problem_activate(p, "*"));
        test_must(ctx, imp_problem_add_target(p, &t));
        imp_problem_get_x(p, truth);
        for (int k = 0; k < 7; k++) x[k] = truth[k] * (k % 2 ? 1.3 : 0.7);
        test_must(ctx, imp_problem_set_x(p, x));
        o.optimizer = (enum imp_optimizer)kind;
        o.intervals = 1;
        o.max_iterations = kind == IMP_ADAM && !slow ? 40 : 0;
        run.spp = slow ? (kind == IMP_ADAM ? 1024 : 8192) : kind == IMP_ADAM ? 16 : 96;
        run.seed = 7;
        test_must(ctx, imp_fit(p, &o, &run, &r));
        const char *name = kind == IMP_ADAM ? "Adam" : "LM";
        tap_ok(kind == IMP_ADAM || r->iterations <= 10,
               "%s # %d iterations, condition %.0f: %s", name, r->iterations,
               r->condition, r->reason);
        for (int k = 0; k < 7; k++) {
            struct imp_param_info info = {.size = sizeof info};
            const size_t param = test_param_of(ctx, p, (size_t)k);
            test_must(ctx, imp_scene_get_param(s, param, &info));
            const struct imp_fit_variable *v = &r->variables[k];
            const double off = v->value / truth[k] - 1, z = (v->value - truth[k]) / v->se;
            /* 4.5 of its own standard errors (7e-6 by chance), which are at most a
             * quarter of the value (Adam, the sphere's own light). IMP_SLOW makes them
             * small. */
            tap_ok(slow ? fabs(off) < 0.02
                        : v->determined && fabs(z) < 4.5 && v->se < 0.3 * truth[k],
                   "%s: %s # from %g to %.5g (%+.2f %%), se %.2g, z %.2f", name,
                   info.name, v->start, v->value, 100 * off, v->se, z);
        }
        test_must(ctx, imp_problem_set_x(p, truth));
        imp_problem_destroy(p);
    }
    imp_film_destroy(film);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return tap_done();
}

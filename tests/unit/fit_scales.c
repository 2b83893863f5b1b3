/* SPDX-License-Identifier: Apache-2.0
 *
 * What a fit by Adam knows of the way that its numbers can have to go: a range between two
 * bounds is the whole of it, and a factor of e, or a size at the start, is not. For few
 * numbers, for many, and where cells are taken together. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/fit/fit.h"

enum { FILM = 8, MOST = 24, SKY = 2 };

static imp_scene *scene_make(imp_context *ctx, int side)
{
    static const double sky[3] = {SKY, SKY, SKY};
    static float pixels[3 * MOST * MOST];
    imp_scene *s;
    size_t param;
    for (int k = 0; k < 3 * MOST * MOST; k++) pixels[k] = .5f;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    test_camera(s, 3, 30, FILM, FILM);
    test_picture_wall(s, side, side, pixels);
    test_must(ctx, imp_scene_commit(s));
    for (param = 0; !strstr(s->params[param].info.name, "radiance"); param++) {}
    test_must(ctx, imp_scene_set_values(s, param, 3, sky));
    return s;
}

/* Numbers whose bounds, scale or end of the way are not as expected; of texels and sky. */
struct wrong {
    int texels, sky;
};

static bool is(const struct imp__span *a, double scale, bool settles)
{
    return fabs(a->scale - scale) < 1e-12 && a->settles == settles && !a->by_start;
}

static struct wrong looked_at(const struct imp__fit *fit, const struct imp__search *s,
                              bool log)
{
    struct wrong wrong = {0};
    for (size_t i = 0; i < fit->problem->n; i++) {
        const struct imp__block *b = imp__problem_block(fit->problem, i);
        struct imp__span a = imp__goal_span(&fit->goal, i);
        /* Where numbers are many, a scale may be that of the start. */
        if (a.by_start)
            a.scale = fmax(a.scale, fabs(imp__search_start(s, i))), a.by_start = false;
        if (strstr(imp__block_name(fit->problem, b), "radiance"))
            wrong.sky += !is(&a, log ? 1 : SKY, false);
        else wrong.texels += !is(&a, 1, !log);
    }
    return wrong;
}

static void kinds(imp_context *ctx, int side, bool log)
{
    static float target[3 * FILM * FILM];
    static double x[3 * MOST * MOST + 3];
    imp_scene *scene = scene_make(ctx, side);
    imp_problem *p = test_problem(ctx, scene, "*data*");
    const struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct imp__fit fit;
    struct imp__search *s;
    test_must(ctx, imp_problem_activate(p, "*radiance*"));
    if (log) test_must(ctx, imp_problem_tie(p, "*", IMP_TIE_LOG));
    test_target(ctx, p, 0, FILM, FILM, target);
    run.spp = 4;
    test_must(ctx, imp__fit_begin(p, &o, &run, &fit));
    const struct imp__opt_options opt = {1, .05, 1e-4, 0, fit.quiet};
    imp_problem_get_x(p, x);
    test_must(ctx, imp__search_create(&fit.goal, IMP_ADAM, &opt, x, &s));
    imp__fit_scales(&fit, s);
    const struct wrong wrong = looked_at(&fit, s, log);
    tap_ok(fit.quiet && p->n == (size_t)(3 * side * side + 3) && wrong.texels == 0 &&
               wrong.sky == 0,
           "%zu numbers%s: texels %s, a sky never # %d and %d are not so", p->n,
           log ? " as logarithms" : "", log ? "never settle" : "settle", wrong.texels,
           wrong.sky);
    for (size_t k = 0; k < p->n_blocks; k++) {
        const struct imp__block *b = &p->blocks[k];
        const bool sky = strstr(imp__block_name(p, b), "radiance") != NULL;
        struct imp__span a = {.end = b->count, .lo = b->lo, .hi = b->hi};
        imp__fit_span_scale(b, x, &a);
        const bool by_start = a.by_start;
        a.by_start = false;
        tap_ok(is(&a, log || !sky ? 1 : SKY, !log && !sky) && by_start == (sky && !log),
               "... and as cells taken together: %s # scale %g",
               sky ? "the sky" : "texels", a.scale);
    }
    imp__search_destroy(s);
    imp__fit_end(&fit);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(void)
{
    imp_context *ctx = test_context(1);
    for (int log = 0; log < 2; log++) {
        kinds(ctx, 8, log);
        kinds(ctx, MOST, log);
    }
    imp_context_destroy(ctx);
    return tap_done();
}

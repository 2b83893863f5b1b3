/* SPDX-License-Identifier: Apache-2.0
 *
 * Least squares of thousands of numbers: a wall of 32 x 32 texels and the sky that lights it,
 * which trade but for a grey card in front, come back from a picture whose noise is known,
 * within the errors told; by Adam the sky is far off after many more samples. The same bits on
 * any number of threads. What is refused. With the argument "long", more seeds. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/fit/fit.h"
#include "search/conjugate.h"

enum { SIDE = 32, TEXELS = 3 * SIDE * SIDE, FILM = 64, MOST = TEXELS + 3 };

struct room {
    imp_scene *scene;
    imp_problem *problem;
    size_t sky; /* number of its first */
};

/* From above a square of the wall's size, with a card on it that keeps its grey. */
static imp_scene *scene_make(imp_context *ctx, const float *pixels, int width, int height,
                             const char *filter)
{
    static const double look[16] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 5, 0, 0, 0, 1};
    static const double card[16] = {.2, 0, 0,  .6,  0, .2, 0, .6,
                                    0,  0, .2, .02, 0, 0,  0, 1};
    static const double grey[3] = {.5, .5, .5};
    imp_scene *s;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "integrator", "path", NULL, NULL);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "orthographic", "camera", NULL);
    imp_scene_transform(s, "to_world", look);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", width);
    imp_scene_integer(s, "height", height);
    imp_scene_begin(s, "rfilter", filter, NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    test_picture_wall(s, SIDE, SIDE, pixels);
    imp_scene_begin(s, "shape", "rectangle", NULL, NULL);
    imp_scene_transform(s, "to_world", card);
    imp_scene_begin(s, "bsdf", "diffuse", "card", NULL);
    imp_scene_rgb(s, "reflectance", grey);
    imp_scene_end(s);
    imp_scene_end(s);
    test_must(ctx, imp_scene_commit(s));
    return s;
}

static float truth[TEXELS], start[TEXELS];

static struct room room_make(imp_context *ctx, const struct imp_target *t,
                             const char *filter)
{
    struct room r = {.scene = scene_make(ctx, start, FILM, FILM, filter)};
    double x[MOST];
    r.problem = test_problem(ctx, r.scene, "*data*");
    test_must(ctx, imp_problem_activate(r.problem, "*radiance*"));
    test_must(ctx, imp_problem_add_target(r.problem, t));
    imp_problem_get_x(r.problem, x);
    while (x[r.sky] != 1) r.sky++;
    for (size_t c = 0; c < 3; c++) x[r.sky + c] = .5;
    test_must(ctx, imp_problem_set_x(r.problem, x));
    return r;
}
static void room_free(struct room *r)
{
    imp_problem_destroy(r->problem);
    imp_scene_destroy(r->scene);
}

static double truth_of(const struct room *r, size_t k)
{
    if (k >= r->sky && k < r->sky + 3) return 1;
    return (double)truth[k < r->sky ? k : k - 3];
}

struct score {
    struct tap_stat square, inside; /* of numbers that have an error */
    struct tap_stat sky, sky_se;    /* z, errors told */
    size_t without;
};

static void score_add(imp_context *ctx, const struct room *r, struct score *s)
{
    struct tap_stat square = {0}, inside = {0};
    for (size_t k = 0; k < imp_problem_n_variables(r->problem); k++) {
        struct imp_fit_variable v = IMP_FIT_VARIABLE_INIT;
        test_must(ctx, imp_problem_get_fit_variable(r->problem, k, &v));
        if (isnan(v.se)) {
            s->without++;
            continue;
        }
        const double z = (v.value - truth_of(r, k)) / v.se;
        if (k >= r->sky && k < r->sky + 3) {
            tap_add(&s->sky, z);
            tap_add(&s->sky_se, v.se);
        }
        tap_add(&square, z * z);
        tap_add(&inside, v.lo95 <= truth_of(r, k) && truth_of(r, k) <= v.hi95);
    }
    tap_add(&s->square, square.mean);
    tap_add(&s->inside, inside.mean);
}

static struct imp_target target_of(imp_film *film, float *se)
{
    struct imp_target t = IMP_TARGET_INIT;
    t.width = t.height = FILM, t.channels = 3;
    t.pixels = imp_film_mean(film);
    t.noise_se = se;
    return t;
}

/* The most samples of a pixel that a fit can have taken. */
static double samples(const struct imp_fit_result *r, int spp)
{
    return spp * (9.0 * r->iterations + 5);
}

/* Of a picture of `of` samples, with its noise known or not, by `spp`. */
static void recover(imp_context *ctx, int seeds, int known, int of, int spp)
{
    struct score s = {0};
    struct tap_stat sky_off = {0};
    double most = 0;
    for (int seed = 0; seed < seeds; seed++) {
        struct imp_run run = IMP_RUN_INIT;
        struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
        const struct imp_fit_result *r;
        imp_scene *real = scene_make(ctx, truth, FILM, FILM, "box");
        imp_film *film;
        run.spp = of;
        run.seed = 100 + (uint64_t)seed;
        test_must(ctx, imp_render(real, &run, &film));
        imp_scene_destroy(real);
        static float se[FILM * FILM * 3];
        memcpy(se, imp_film_se(film), sizeof se);
        const struct imp_target t = target_of(film, known ? se : NULL);
        struct room room = room_make(ctx, &t, "box");
        run.spp = spp;
        run.seed = 200 + (uint64_t)seed;
        o.optimizer = IMP_LM;
        o.intervals = 1;
        test_must(ctx, imp_fit(room.problem, &o, &run, &r));
        if (seed == 0)
            tap_ok(r->n == MOST && !r->covariance && r->iterations < 12 && r->warning &&
                       strstr(r->warning, "32 drawn vectors"),
                   "%zu numbers # %d iterations, %s; %s", r->n, r->iterations, r->reason,
                   r->warning ? r->warning : "no warning");
        score_add(ctx, &room, &s);
        most = fmax(most, samples(r, spp));
        room_free(&room);
        if (seed > 0 || !known) {
            imp_film_destroy(film);
            continue;
        }
        room = room_make(ctx, &t, "box");
        o = (struct imp_fit_options)IMP_FIT_OPTIONS_INIT;
        o.max_iterations = 120;
        run.spp = 8;
        test_must(ctx, imp_fit(room.problem, &o, &run, &r));
        for (size_t c = 0; c < 3; c++) {
            struct imp_fit_variable v = IMP_FIT_VARIABLE_INIT;
            test_must(ctx, imp_problem_get_fit_variable(room.problem, room.sky + c, &v));
            tap_add(&sky_off, v.value - 1);
        }
        tap_ok(8.0 * r->iterations > 1.1 * most && fabs(sky_off.mean) > 5 * s.sky_se.mean,
               "Adam's sky is off by %.3f # %.0f samples of a pixel; by least squares it "
               "has the error %.4f after at most %.0f",
               sky_off.mean, 8.0 * r->iterations, s.sky_se.mean, most);
        room_free(&room);
        imp_film_destroy(film);
    }
    /* With few samples and residuals for the noise the errors are upper bounds. */
    const double least = known ? .8 : .6, most_inside = known ? .975 : .995;
    tap_ok(
        s.square.mean > least && s.square.mean < 1.2,
        "squared errors over those told, noise %s, %d samples # %.3f +- %.3f of %d fits",
        known ? "known" : "not known", spp, s.square.mean, tap_se(&s.square), seeds);
    tap_ok(s.inside.mean > .93 && s.inside.mean < most_inside,
           "95 %% intervals that hold the truth # %.4f +- %.4f", s.inside.mean,
           tap_se(&s.inside));
    tap_ok(s.without < (size_t)seeds * MOST / 10 && s.sky.n == 3 * seeds,
           "texels beneath the card alone have no error # %zu of %d", s.without,
           seeds * MOST);
    double worst = 0;
    worst = fabs(s.sky.mean) * sqrt(s.sky.n);
    tap_ok(worst < 4.5, "the sky is right # z %.2f, spread %.2f", worst,
           tap_se(&s.sky) * sqrt(s.sky.n));
}

static void same_bits(void)
{
    static double x[2][MOST];
    for (int k = 0; k < 2; k++) {
        imp_context *ctx = test_context(k ? 3 : 1);
        static float pixels[FILM * FILM * 3], weights[FILM * FILM];
        struct imp_target t = IMP_TARGET_INIT;
        struct imp_run run = IMP_RUN_INIT;
        struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
        const struct imp_fit_result *r;
        for (int i = 0; i < FILM * FILM * 3; i++) pixels[i] = .3f + .2f * (i % 5 == 0);
        for (int i = 0; i < FILM * FILM; i++) weights[i] = i % 3 != 0;
        t.width = t.height = FILM, t.channels = 3, t.pixels = pixels, t.weights = weights;
        struct room room = room_make(ctx, &t, "box");
        test_must(ctx, imp_problem_add_smoothness(room.problem, "*data*", .1));
        o.optimizer = IMP_LM;
        o.max_iterations = 2;
        o.intervals = 1;
        run.spp = 4;
        test_must(ctx, imp_fit(room.problem, &o, &run, &r));
        for (size_t i = 0; i < MOST; i++) {
            struct imp_fit_variable v = IMP_FIT_VARIABLE_INIT;
            test_must(ctx, imp_problem_get_fit_variable(room.problem, i, &v));
            x[k][i] = isnan(v.se) ? v.value : v.value + v.se;
        }
        room_free(&room);
        imp_context_destroy(ctx);
    }
    tap_ok(memcmp(x[0], x[1], sizeof x[0]) == 0, "the same bits on 1 and 3 threads");
}

static int ask(const struct imp_progress *p, void *stop)
{
    (void)p;
    return *(int *)stop;
}

/* A step takes up to thousands of products: it ends between two of them. */
static void stopped(imp_context *ctx)
{
    static float pixels[FILM * FILM * 3];
    static double x[MOST], step[MOST];
    static bool fixed[MOST];
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp__fit fit = {0};
    struct imp__sparse_normal eq = {0};
    int stop = 0;
    t.width = t.height = FILM, t.channels = 3, t.pixels = pixels;
    struct room room = room_make(ctx, &t, "box");
    imp_problem_get_x(room.problem, x);
    o.optimizer = IMP_LM;
    run.spp = 4;
    run.progress = ask;
    run.progress_payload = &stop;
    test_must(ctx, imp__fit_begin(room.problem, &o, &run, &fit));
    test_must(ctx, fit.goal.sparse(x, 1, 1, &eq, fit.goal.payload));
    for (size_t k = 0; k < MOST; k++) fixed[k] = !(eq.same[k] > 0);
    struct imp__conjugate c = {.eq = &eq, .fixed = fixed, .tolerance = 1e-9, .most = 50};
    test_must(ctx, imp__conjugate_solve(ctx, &c, .1, 1, eq.g, step));
    const int whole = c.iterations;
    stop = 1;
    fit.last_report_s = 0;
    enum imp_status st = imp__conjugate_solve(ctx, &c, .1, 1, eq.g, step);
    tap_ok(whole > 5 && st == IMP_CANCELLED && c.iterations == 0,
           "cancelled within a step # of %d products", whole);
    fit.stopped = false;
    stop = 0;
    fit.deadline_s = imp__now() - 1;
    st = imp__conjugate_solve(ctx, &c, .1, 1, eq.g, step);
    tap_ok(st == IMP_CANCELLED && c.iterations == 0, "and by its time limit");
    imp__sparse_normal_destroy(&eq);
    imp__fit_end(&fit);
    room_free(&room);
}

static void refused(imp_context *ctx, imp_problem *p, int spp, enum imp_status expected,
                    const char *part, const char *name)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    const struct imp_fit_result *r;
    double before[MOST], after[MOST];
    const int few = imp_problem_n_variables(p) <= MOST;
    run.spp = spp;
    o.optimizer = IMP_LM;
    if (few) imp_problem_get_x(p, before);
    const enum imp_status st = imp_fit(p, &o, &run, &r);
    if (few) imp_problem_get_x(p, after);
    tap_ok(st == expected && strstr(imp_last_error(ctx), part) &&
               (!few || memcmp(before, after, sizeof before) == 0),
           "refused: %s # %s", name, imp_last_error(ctx));
}

static void refusals(imp_context *ctx)
{
    static float pixels[FILM * FILM * 3];
    struct imp_target t = IMP_TARGET_INIT;
    t.width = t.height = FILM, t.channels = 3, t.pixels = pixels;
    struct room room = room_make(ctx, &t, "gaussian");
    refused(ctx, room.problem, 4, IMP_E_UNSUPPORTED, "box",
            "a filter wider than a pixel");
    room_free(&room);
    room = room_make(ctx, &t, "box");
    refused(ctx, room.problem, 1 << 28, IMP_E_NOMEM, "GB", "rows of 6 TB");
    room_free(&room);
    t.loss = IMP_LOSS_L1;
    room = room_make(ctx, &t, "box");
    refused(ctx, room.problem, 4, IMP_E_ARG, "l1", "a loss without a second derivative");
    room_free(&room);

    enum { LARGE = 300 };
    float *large = calloc(3 * LARGE * LARGE, sizeof *large);
    imp_scene *s;
    t.loss = IMP_LOSS_L2;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    test_camera(s, 3, 30, FILM, FILM);
    test_picture_wall(s, LARGE, LARGE, large);
    test_must(ctx, imp_scene_commit(s));
    imp_problem *p = test_problem(ctx, s, "*data*");
    test_must(ctx, imp_problem_add_target(p, &t));
    refused(ctx, p, 4, IMP_E_ARG, "262144", "270,000 numbers");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    free(large);
}

int main(int argc, char **argv)
{
    const int all = argc > 1 && strcmp(argv[1], "long") == 0;
    imp_context *ctx = test_context(0);
    for (int i = 0; i < TEXELS; i++) {
        const int x = i / 3 % SIDE, y = i / 3 / SIDE, c = i % 3;
        truth[i] = (float)(.5 + .35 * sin(.5 * x + c) * cos(.4 * y - c));
        start[i] = .5f;
    }
    recover(ctx, all ? 40 : 2, 1, 64, 16);
    recover(ctx, all ? 40 : 1, 0, 64, 8);
    same_bits();
    stopped(ctx);
    refusals(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}

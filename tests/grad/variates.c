/* SPDX-License-Identifier: Apache-2.0
 *
 * Control variates of fits: walks evaluated at the last numbers; pictures carried on along a
 * given path of numbers, whose means, gradients and variances are those of estimators.md 21;
 * also with samples that are allocated to tiles; the same bits for any threads, ranks and pauses;
 * where they are refused.
 *
 *     variates long     # more chains, and the variances of docs/fitting.md */
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/estimate/problem_tracer.h"
#include "inverse/estimate/replicates.h"
#include "inverse/gradient/allocation.h"
#include "inverse/gradient/objective_gradient.h"
#include "inverse/gradient/variate.h"
#include "math/rng.h"
#include "team_kit.h"

static imp_context *ctx;

/* ---- A walk at other numbers ------------------------------------------------------- */

/* In another scene, against the same scene with its numbers changed. */
static void elsewhere(const char *file, enum imp_color_mode mode, const char *defines,
                      const char *glob)
{
    imp_scene *scene = test_scene(ctx, file, mode, defines);
    struct imp_scene *twin = NULL;
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_tracer tracer, there;
    struct imp_arena arena;
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, glob));
    test_must(ctx, imp__problem_tracer(p, &run, NULL, &tracer));
    test_must(ctx, scene->twin(scene, &twin));
    tracer.elsewhere = true;
    there = tracer;
    there.scene = twin;
    there.sensor = twin->sensors[0];
    imp__arena_init(&arena, ctx);
    int equal = 0, walks = 0, moved = 0;
    double worst = 0, largest = 0;
    for (int k = 0; k < 300; k++) {
        const struct imp_arena_mark mark = imp__arena_mark(&arena);
        const int w = tracer.sensor->film.crop_w, h = tracer.sensor->film.crop_h;
        struct imp_walk walk;
        imp__walk_trace(&tracer, &arena, k % w, k / w % h, k, &walk);
        if (!walk.dropped && walk.valid) {
            const imp_spec same = imp__walk_elsewhere(&there, &walk);
            walks++;
            equal +=
                memcmp(&same, &walk.L, (size_t)scene->channels * sizeof(double)) == 0;
            /* The twin's numbers, then for reference the scene's own. */
            for (int round = 0; round < 2; round++) {
                struct imp_scene *s = round ? scene : twin;
                for (size_t q = 0; q < s->n_params; q++) {
                    struct imp_param *a = &s->params[q];
                    for (size_t e = 0; p->active.base[q] >= 0 && e < a->info.count; e++) {
                        const double now = imp__param_get(&twin->params[q], e);
                        const double by = e % 2 == (size_t)k % 2 ? 0.8 : 1.25;
                        const double x = round ? now : now * by;
                        imp__param_set(a, e, imp_clamp(x, a->info.lo, a->info.hi));
                    }
                }
                imp__theta_announce(s);
            }
            const imp_spec is = imp__walk_elsewhere(&there, &walk);
            const imp_spec must = imp__walk_frozen(&tracer, &walk);
            for (int c = 0; c < scene->channels; c++) {
                worst = fmax(worst, fabs(is[c] - must[c]));
                largest = fmax(largest, fabs(must[c]));
                moved += is[c] != walk.L[c];
            }
        }
        imp__arena_rewind(&arena, mark);
        /* The next one is traced at the new numbers: both scenes have them. */
    }
    tap_ok(equal == walks && walks > 100,
           "%s %s: at equal numbers a walk has its own value, to the bit # %d of %d",
           file, glob, equal, walks);
    tap_ok(worst <= 1e-12 * largest && moved > 50,
           "... and at others that of the scene with these numbers # %.1e of %.3g, "
           "%d differ",
           worst, largest, moved);
    imp__arena_free(&arena);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    imp_scene_destroy(twin);
}

/* ---- A path of numbers -------------------------------------------------------------- */

enum { STEPS = 6, MOST = 32 };

struct chain_sums {
    struct tap_stat g[STEPS][MOST], plain[STEPS][MOST];
    struct tap_stat mean[STEPS], variance[STEPS]; /* of the picture; by the variate */
    struct tap_stat told[STEPS]; /* the variance less the squared error */
    /* Of the gradient where I_{t-1} is given: squared errors told, and seen by two seeds. */
    struct tap_stat se2[STEPS][MOST], seen2[STEPS][MOST];
};

/* Numbers of step t: on both sides of the true ones, some of them 0 for a while. */
static void path_at(int t, size_t n, const double *truth, double *x)
{
    for (size_t k = 0; k < n; k++) {
        x[k] = truth[k] * (1 + 0.3 * cos(1.7 * (double)k + 0.6 * t));
        if (truth[k] <= 1) x[k] = fmin(x[k], 1);
        if (truth[k] <= 1 && (t == 2 || (t == 3 && k % 3 != 0))) x[k] = 0;
    }
}

static double unit(size_t k, const void *payload)
{
    (void)k, (void)payload;
    return 1;
}

enum how { PLAIN, MASKED, POINTS, ALLOCATED };
static const char *const how_words[] = {"", " masked", " in sets of points",
                                        " with allocated samples"};

/* The gradient's errors are of this evaluation's walks alone: from one I_{t-1}, two seeds. */
static void errors_told(imp_problem *p, int t, const double *x, struct imp_run run,
                        struct chain_sums *sums)
{
    const size_t n = imp_problem_n_variables(p);
    double *before = calloc(imp__variate_numbers(p->variate, p), sizeof *before);
    double g[2][MOST], se[2][MOST];
    if (!before) exit(99);
    imp__variate_save(p->variate, p, before);
    for (int k = 0; k < 2; k++) {
        run.seed = imp__mix64(run.seed + 1);
        test_must(ctx, imp__problem_objective(p, x, &run, false, NULL, g[k], se[k]));
        imp__variate_restore(p->variate, p, before);
    }
    for (size_t k = 0; k < n; k++) {
        tap_add(&sums->seen2[t][k], imp__sqr(g[0][k] - g[1][k]) / 2);
        tap_add(&sums->se2[t][k], (imp__sqr(se[0][k]) + imp__sqr(se[1][k])) / 2);
    }
    free(before);
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Of each number, over the steps that see it. */
static void errors_compare(const struct chain_sums *sums, size_t n)
{
    double ratio[MOST];
    size_t count = 0;
    for (size_t k = 0; k < n; k++) {
        double told = 0, seen = 0;
        for (int t = 1; t < STEPS; t++) {
            /* In units of the step's own variance: steps count alike. */
            const double unit = sums->se2[t][k].mean;
            if (unit > 0) told++, seen += sums->seen2[t][k].mean / unit;
        }
        if (seen > 0) ratio[count++] = sqrt(told / seen);
    }
    qsort(ratio, count, sizeof *ratio, by_size);
    if (count == 0) exit(99);
    const double median = ratio[count / 2], least = ratio[0], most = ratio[count - 1];
    tap_ok(
        count > 10 && median > .9 && median < 1.1 && least > .7 && most < 1.3,
        "... and errors of gradients, the last picture given # told/seen %.3f, %.3f to "
        "%.3f of %zu numbers",
        median, least, most, count);
}

/* Along a given path the mean of I_t, of the gradient and of the squared error of I_t. */
static void along_a_path(const char *file, const char *defines, const char *glob,
                         enum imp_loss loss, enum how how, int chains)
{
    const bool masked = how == MASKED, points = how == POINTS;
    const struct imp__metric metric = {.weight = unit};
    imp_scene *scene = test_scene(ctx, file, IMP_RGB, defines);
    imp_problem *p;
    struct imp_target target = IMP_TARGET_INIT;
    struct imp_run run = IMP_RUN_INIT;
    static struct chain_sums sums;
    memset(&sums, 0, sizeof sums);
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, glob));
    const struct imp_film_desc *film = &scene->sensors[0]->film;
    const size_t n = imp_problem_n_variables(p),
                 pixels = (size_t)film->crop_w * (size_t)film->crop_h;
    float *pixel = calloc(3 * pixels, sizeof *pixel),
          *mask = calloc(pixels, sizeof *mask);
    double truth[MOST], x[MOST], g[MOST];
    if (n > MOST || !pixel || !mask) exit(99);
    for (size_t i = 0; i < 3 * pixels; i++) pixel[i] = 0.2f + 0.1f * (float)(i % 5);
    for (size_t i = 0; i < pixels; i++) mask[i] = (float)(i % 3);
    imp_problem_get_x(p, truth);
    target.width = film->crop_w;
    target.height = film->crop_h;
    target.channels = 3;
    target.pixels = pixel;
    target.loss = loss;
    target.epsilon = 0.1;
    if (masked) target.weights = mask;
    test_must(ctx, imp_problem_add_target(p, &target));
    run.spp = points ? 32 : 6;
    run.points = points ? IMP_POINTS_SOBOL : IMP_POINTS_INDEPENDENT;

    /* What pictures of the path are: many samples. */
    double *is[STEPS];
    for (int t = 0; t < STEPS; t++) {
        struct imp_run fine = run;
        imp_film *picture;
        path_at(t, n, truth, x);
        test_must(ctx, imp_problem_set_x(p, x));
        fine.spp = how == ALLOCATED ? 4000 : 20000;
        fine.points = IMP_POINTS_SOBOL;
        test_must(ctx, imp_render(scene, &fine, &picture));
        is[t] = calloc(3 * pixels, sizeof **is);
        if (!is[t]) exit(99);
        for (size_t i = 0; i < 3 * pixels; i++)
            is[t][i] = (double)imp_film_mean(picture)[i];
        imp_film_destroy(picture);
    }
    bool uneven = how != ALLOCATED;
    for (int chain = 0; chain < chains; chain++) {
        struct imp__variate *v;
        struct imp__allocation a = {0};
        path_at(0, n, truth, x);
        test_must(ctx, imp_problem_set_x(p, x));
        test_must(ctx, imp__variate_create(p, &run, &v));
        if (how == ALLOCATED) test_must(ctx, imp__allocation_create(p, &run, &a));
        for (int t = 0; t < STEPS; t++) {
            path_at(t, n, truth, x);
            for (int with = 0; with < 2; with++) {
                p->variate = with ? v : NULL;
                p->allocation = with && a.n > 0 ? &a : NULL;
                a.metric = &metric;
                run.seed = imp__mix64(2 * (uint64_t)(chain * STEPS + t) + (uint64_t)with);
                if (with && points && t > 0) errors_told(p, t, x, run, &sums);
                test_must(ctx, imp__problem_objective(p, x, &run, false, NULL, g, NULL));
                for (size_t k = 0; k < n; k++)
                    tap_add(with ? &sums.g[t][k] : &sums.plain[t][k], g[k]);
                p->variate = NULL;
                p->allocation = NULL;
            }
            for (size_t k = 0; k < a.n; k++) uneven |= a.spp[k] != a.even[k];
            imp__allocation_update(&a);
            const struct imp__variate_view *view = &v->views[0];
            double error = 0, square = 0;
            for (size_t i = 0; i < view->n; i++) {
                const double weight = masked ? (double)mask[i / 3] : 1;
                const double d = view->last[i] - is[t][i], T = (double)pixel[i];
                error += weight * d;
                square += weight / (loss == IMP_LOSS_L2 ? 1 : T * T + 0.1) * d * d;
            }
            tap_add(&sums.mean[t], error);
            const double told = view->half[0].variance + view->half[1].variance;
            tap_add(&sums.variance[t], told);
            tap_add(&sums.told[t], told - square);
        }
        imp__variate_destroy(v);
        imp__allocation_destroy(&a);
    }
    double worst = 0, count = 0, gain = 0, off = 0, mean = 0;
    for (int t = 1; t < STEPS; t++) {
        for (size_t k = 0; k < n; k++) {
            const struct tap_stat *a = &sums.g[t][k], *b = &sums.plain[t][k];
            const double se = sqrt(imp__sqr(tap_se(a)) + imp__sqr(tap_se(b)));
            if (!(se > 0)) continue;
            worst = fmax(worst, fabs(a->mean - b->mean) / se);
            count++;
        }
        mean = fmax(mean, fabs(sums.mean[t].mean / tap_se(&sums.mean[t])));
        off = fmax(off, fabs(sums.told[t].mean / sums.variance[t].mean));
    }
    for (size_t k = 0; k < n; k++)
        gain += sums.plain[STEPS - 1][k].m2 / sums.g[STEPS - 1][k].m2 / (double)n;
    tap_ok(worst < 4.5 && count > 5 && gain > 1.5 && uneven,
           "%s%s, loss %d: along a given path gradients have the mean of those without # "
           "worst z of %.0f %.2f; variance without/with %.2f at last",
           file, how_words[how], (int)loss, count, worst, gain);
    tap_ok(mean < 4.5, "... pictures that of many samples # worst z %.2f", mean);
    tap_ok(off < 0.3, "... and the variance that is told # off by %.3f", off);
    if (points) errors_compare(&sums, n);
    for (int t = 0; t < STEPS; t++) free(is[t]);
    free(pixel);
    free(mask);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* ---- Rests ---------------------------------------------------------------------------- */

/* Roughness that goes to and fro lets nothing be carried on; where it stays, all is. */
static void rests(void)
{
    enum { ALL = 16, STAYS = 10 };
    imp_scene *scene = test_scene(ctx, "textured.xml", IMP_RGB, "width=48 height=36");
    imp_problem *p = test_problem(ctx, scene, "metal.alpha*");
    float *grey = calloc((size_t)3 * 48 * 36, sizeof *grey);
    const size_t n = imp_problem_n_variables(p);
    struct imp__variate *v;
    struct imp_run run = IMP_RUN_INIT;
    double x[4], g[4];
    int few = 0, back = 0;
    if (!grey || n > 4) exit(99);
    test_target(ctx, p, 0, 48, 36, grey);
    run.spp = 8;
    test_must(ctx, imp__variate_create(p, &run, &v));
    for (int t = 0; t < ALL; t++) {
        for (size_t k = 0; k < n; k++) x[k] = t >= STAYS || t % 2 ? 0.05 : 0.6;
        run.seed = 500 + (uint64_t)t;
        p->variate = v;
        test_must(ctx, imp__problem_objective(p, x, &run, false, NULL, g, NULL));
        p->variate = NULL;
        const enum imp__variate_looks looks = v->views[0].looks;
        if (t > 2 && t < STAYS) few += looks == IMP_VARIATE_AT_FEW;
        if (t > STAYS + 2) back += looks == IMP_VARIATE_AT_ALL;
    }
    tap_ok(few >= 5 && back == ALL - STAYS - 3,
           "rests where nothing can be carried on, and goes on where it can # %d of %d, "
           "%d of %d",
           few, STAYS - 3, back, ALL - STAYS - 3);
    imp__variate_destroy(v);
    free(grey);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* ---- Fits ---------------------------------------------------------------------------- */

enum { W = 16, H = 12 };

struct fitted {
    imp_context *context;
    int iterations, levels, stop_after;
    const char *checkpoint;
    bool resume;
    enum imp_allocation allocation;
    double x[12288 + 1], loss, history;
    char text[200];
    struct team_rank rank;
};

static int stop(const struct imp_fit_step *step, void *payload)
{
    const struct fitted *f = payload;
    return step->iteration == f->stop_after;
}

/* The floor of textured.xml from a picture, and from two at once. */
static void *fit(void *payload)
{
    struct fitted *f = payload;
    imp_context *c = f->context;
    imp_scene *scene = test_scene(c, "textured.xml", IMP_RGB, "width=16 height=12");
    imp_problem *p;
    imp_film *film;
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    const struct imp_fit_result *result;
    size_t param;
    const double half = 0.5;
    run.spp = 64;
    test_must(c, imp_render(scene, &run, &film));
    test_must(c, imp_problem_create(scene, &p));
    test_must(c, imp_problem_activate(p, "floor.*"));
    t.width = W, t.height = H, t.channels = 3;
    t.pixels = imp_film_mean(film);
    test_must(c, imp_problem_add_target(p, &t));
    t.loss = IMP_LOSS_RELATIVE_L2;
    t.epsilon = 0.1;
    test_must(c, imp_problem_add_target(p, &t));
    test_must(c, imp_scene_find_param(scene, "floor.reflectance.data", &param));
    test_must(c, imp_scene_set_values(scene, param, 1, &half));
    o.max_iterations = f->iterations;
    o.levels = f->levels;
    o.step = stop;
    o.step_payload = f;
    o.control_variate = IMP_VARIATES_ON;
    o.allocation = f->allocation;
    o.checkpoint = f->checkpoint;
    o.resume = f->resume;
    run.spp = f->allocation == IMP_ALLOCATION_EVEN ? 4 : 16; /* no tile has below 4 */
    const enum imp_status st = imp_fit(p, &o, &run, &result);
    if (st != IMP_CANCELLED || f->stop_after == 0) test_must(c, st);
    imp_problem_get_x(p, f->x);
    f->loss = result->objective.value;
    f->history = result->history[result->n_history - 1];
    snprintf(f->text, sizeof f->text, "%s",
             result->control_variate ? result->control_variate : "");
    imp_film_destroy(film);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    return NULL;
}

static void *fit_of_rank(void *payload)
{
    struct fitted *f = payload;
    test_must(f->context, team_join(f->context, &f->rank));
    return fit(f);
}

static bool same(const struct fitted *a, const struct fitted *b)
{
    return memcmp(a->x, b->x, sizeof a->x) == 0 && a->loss == b->loss &&
           a->history == b->history;
}

static void same_bits(enum imp_allocation allocation)
{
    static struct fitted one, other[3];
    const struct fitted all = {
        .iterations = 12, .context = ctx, .allocation = allocation};
    one = all;
    fit(&one);
    tap_ok(strncmp(one.text, "control variate: at the end", 27) == 0, "%s", one.text);
    for (int threads = 1; threads <= 3; threads += 2) {
        other[0] = all;
        other[0].context = test_context(threads);
        fit(&other[0]);
        tap_ok(same(&one, &other[0]), "%d threads: the same bits", threads);
        imp_context_destroy(other[0].context);
    }
    for (int sums = 0; sums < 2; sums++) {
        struct team_hub hub = {.ranks = 3, .sums = sums};
        pthread_t thread[3];
        pthread_barrier_init(&hub.barrier, NULL, 3);
        for (int k = 0; k < 3; k++) {
            other[k] = all;
            other[k].context = test_context(1);
            other[k].rank = (struct team_rank){&hub, k};
            if (pthread_create(&thread[k], NULL, fit_of_rank, &other[k]) != 0) exit(99);
        }
        for (int k = 0; k < 3; k++) pthread_join(thread[k], NULL);
        tap_ok(same(&one, &other[0]) && same(&one, &other[1]) && same(&one, &other[2]),
               "3 ranks%s: the same bits", sums ? ", whose integers are added up" : "");
        for (int k = 0; k < 3; k++) imp_context_destroy(other[k].context);
        pthread_barrier_destroy(&hub.barrier);
    }
    char path[] = "variates_XXXXXX";
    if (mkstemp(path) < 0) exit(99);
    remove(path);
    other[0] = all;
    other[0].iterations = 7;
    other[0].checkpoint = path;
    fit(&other[0]);
    other[0].iterations = 12;
    other[0].resume = true;
    fit(&other[0]);
    tap_ok(same(&one, &other[0]), "stopped and resumed: the same bits");
    remove(path);
    /* The finest level begins six iterations after the fit. */
    one = all;
    one.levels = 2;
    fit(&one);
    other[0] = one;
    other[0].stop_after = 9;
    other[0].checkpoint = path;
    fit(&other[0]);
    const bool stopped = !same(&one, &other[0]);
    other[0].stop_after = 0;
    other[0].resume = true;
    fit(&other[0]);
    tap_ok(stopped && same(&one, &other[0]),
           "stopped and resumed on the last of two levels: the same bits");
    remove(path);
}

/* ---- Where they are refused ----------------------------------------------------------- */

static enum imp_status refused(const char *file, const char *defines, const char *glob,
                               enum imp_loss loss, enum imp_optimizer optimizer,
                               enum imp_variates wanted, const char **text)
{
    static char reason[400];
    imp_scene *scene = test_scene(ctx, file, IMP_RGB, defines);
    imp_problem *p;
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    const struct imp_fit_result *result = NULL;
    const struct imp_film_desc *film = &scene->sensors[0]->film;
    float *pixels =
        calloc(3 * (size_t)film->crop_w * (size_t)film->crop_h, sizeof *pixels);
    if (!pixels) exit(99);
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, glob));
    t.width = film->crop_w, t.height = film->crop_h, t.channels = 3;
    t.pixels = pixels;
    t.loss = loss;
    test_must(ctx, imp_problem_add_target(p, &t));
    o.optimizer = optimizer;
    o.max_iterations = 2;
    o.control_variate = wanted;
    run.spp = 4;
    const enum imp_status st = imp_fit(p, &o, &run, &result);
    snprintf(reason, sizeof reason, "%s",
             st != IMP_OK              ? imp_last_error(ctx)
             : result->control_variate ? result->control_variate
                                       : "");
    *text = reason;
    free(pixels);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    return st;
}

static void refusals(void)
{
    static const struct {
        const char *file, *defines, *glob;
        enum imp_loss loss;
        enum imp_optimizer optimizer;
        enum imp_status status;
        const char *word;
    } row[] = {
        {"cornell.xml", "res=4", "red.*", IMP_LOSS_LOG, IMP_ADAM, IMP_E_UNSUPPORTED,
         "not quadratic"},
        {"cornell.xml", "res=4", "red.*", IMP_LOSS_L1, IMP_ADAM, IMP_E_UNSUPPORTED,
         "not quadratic"},
        {"cornell.xml", "res=4", "red.*", IMP_LOSS_L2, IMP_LM, IMP_E_ARG, "is Adam's"},
        {"fog.xml", "res=4", "*sigma_t*", IMP_LOSS_L2, IMP_ADAM, IMP_E_UNSUPPORTED,
         "collisions"},
        {"headlamp.xml", "width=6 height=2", "*reflectance*", IMP_LOSS_L2, IMP_ADAM,
         IMP_E_UNSUPPORTED, "begin at the sensor"},
    };
    for (size_t k = 0; k < imp_count(row); k++) {
        const char *text;
        const enum imp_status on =
            refused(row[k].file, row[k].defines, row[k].glob, row[k].loss,
                    row[k].optimizer, IMP_VARIATES_ON, &text);
        tap_ok(on == row[k].status && strstr(text, row[k].word), "refused: %s", text);
        const enum imp_status off =
            refused(row[k].file, row[k].defines, row[k].glob, row[k].loss,
                    row[k].optimizer, IMP_VARIATES_OFF, &text);
        tap_ok(off == IMP_OK && !*text, "... and without them it goes on # %s", text);
    }
}

int main(int argc, char **argv)
{
    const bool more = argc > 1 && strcmp(argv[1], "long") == 0;
    ctx = test_context(0);
    elsewhere("textured.xml", IMP_RGB, "width=16 height=12", "*");
    elsewhere("textured.xml", IMP_RGB, "width=16 height=12", "lamp.*");
    elsewhere("cornell.xml", IMP_RGB, "res=8", "*");
    elsewhere("cornell.xml", IMP_MONO, "res=8", "*");
    elsewhere("cornell.xml", IMP_SPECTRAL, "res=8", "*");
    elsewhere("stam.xml", IMP_RGB, NULL, "*");
    elsewhere("lamps.xml", IMP_RGB, "res=16", "*");
    elsewhere("skin.xml", IMP_RGB, NULL, "*albedo*");
    elsewhere("fog.xml", IMP_RGB, "res=8", "*radiance*");
    along_a_path("cornell.xml", "res=4", "*", IMP_LOSS_L2, PLAIN, more ? 20000 : 800);
    along_a_path("cornell.xml", "res=4", "*", IMP_LOSS_RELATIVE_L2, MASKED,
                 more ? 20000 : 1200);
    along_a_path("cornell.xml", "res=4", "*", IMP_LOSS_L2, POINTS, more ? 5000 : 300);
    along_a_path("cornell.xml", "res=9", "*", IMP_LOSS_L2, ALLOCATED, more ? 5000 : 150);
    rests();
    same_bits(IMP_ALLOCATION_EVEN);
    same_bits(IMP_ALLOCATION_VARIANCE);
    refusals();
    imp_context_destroy(ctx);
    return tap_done();
}

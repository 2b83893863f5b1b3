/* SPDX-License-Identifier: Apache-2.0
 *
 * Standard errors of losses and their gradients through filters wider than a pixel, whose
 * pixels share walks, against the spread over seeds: at the optimum, where adjoints are
 * noise that neighbours share, and away from it. Run with "long" for all filters.
 *
 * 100 seeds know told/seen to 7 to 10 %, so that of hundreds of rows some lie outside of the
 * band by chance. A row that does is seen again by 4 times as many seeds, then by 4 times as many
 * again, and fails once it is outside by 4.5 of its standard errors: in one of 100 runs of all rows,
 * were all of them on the edge (Sidak's bound of some 3,000 looks). */
#include "imp_cornell.h"
#include "imp_tap.h"
#include <stdbool.h>

enum { MOST = 16, SEEDS = 100, MOST_SEEDS = 16 * SEEDS };

/* told/seen of one number, as the long run of all rows allows it. */
static const double EDGES[2] = {.85, 1.2}, EDGES_ONE[2] = {.7, 1.4};
static const double Z = 4.5, VAGUE = .2;

static imp_context *ctx;

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}
static double median(double *x, size_t n)
{
    qsort(x, n, sizeof *x, by_value);
    return x[n / 2];
}

/* ---- A few numbers ----------------------------------------------------------------- */

struct setting {
    const char *filter; /* its element */
    int side, spp;
    enum imp_points points;
    enum imp_loss loss;
    double away; /* factor of all numbers */
    bool fixed;  /* an adjoint image, not a loss */
};

static void name_of(const struct setting *s, char name[200])
{
    static const char *const losses[] = {"l2", "relative l2", "l1", "log"};
    snprintf(name, 200, "%s, %d spp, %s, %s%s", s->filter, s->spp,
             s->points == IMP_POINTS_SOBOL ? "sobol" : "independent",
             s->fixed ? "fixed adjoint" : losses[s->loss],
             s->fixed       ? ""
             : s->away == 1 ? " at the optimum"
                            : " away from it");
}

static imp_problem *problem_of(const struct setting *s, imp_scene *scene, imp_film **film)
{
    static const char *const active[] = {
        "white.reflectance.value", "red.reflectance.value", "green.reflectance.value",
        "light.radiance.value"};
    struct imp_run run = IMP_RUN_INIT;
    struct imp_target target = IMP_TARGET_INIT;
    imp_problem *p;
    double x[MOST];
    run.spp = 1024;
    run.seed = 7;
    test_must(ctx, imp_render(scene, &run, film));
    test_must(ctx, imp_problem_create(scene, &p));
    for (int k = 0; k < 4; k++) test_must(ctx, imp_problem_activate(p, active[k]));
    target.pixels = imp_film_mean(*film);
    target.width = target.height = s->side;
    target.channels = 3;
    target.loss = s->loss;
    target.epsilon = 0.05;
    test_must(ctx, imp_problem_add_target(p, &target));
    imp_problem_get_x(p, x);
    for (size_t k = 0; k < imp_problem_n_variables(p); k++) x[k] *= s->away;
    test_must(ctx, imp_problem_set_x(p, x));
    return p;
}

/* Of each number by each seed; the last is the loss. */
static struct draws {
    double value[MOST + 1][MOST_SEEDS], variance[MOST + 1][MOST_SEEDS];
} draws;

static void evaluate(const struct setting *s, imp_problem *p, const float *adjoint,
                     int from, int to)
{
    const size_t n = imp_problem_n_variables(p);
    struct imp_run run = IMP_RUN_INIT;
    double g[MOST], se[MOST];
    run.spp = s->spp;
    run.points = s->points;
    for (int seed = from; seed < to; seed++) {
        struct imp_estimate f = {0};
        run.seed = 100 + (uint64_t)seed;
        if (s->fixed) test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, se));
        else test_must(ctx, imp_problem_objective(p, NULL, &run, &f, g, se));
        for (size_t k = 0; k <= n; k++) {
            draws.value[k][seed] = k < n ? g[k] : f.value;
            draws.variance[k][seed] = k < n ? se[k] * se[k] : f.se * f.se;
        }
    }
}

/* told/seen of number k, and the standard error of its logarithm: that of a quotient of the means
 * of what is told and of the squared distances from the mean. */
struct ratio {
    double value, se;
};

static struct ratio ratio_of(size_t k, int seeds)
{
    struct tap_stat value = {0}, told = {0}, both = {0};
    for (int i = 0; i < seeds; i++) {
        tap_add(&value, draws.value[k][i]);
        tap_add(&told, draws.variance[k][i]);
    }
    const double seen = value.m2 / (value.n - 1);
    for (int i = 0; i < seeds; i++) {
        const double d = draws.value[k][i] - value.mean;
        tap_add(&both, draws.variance[k][i] / told.mean - d * d / seen);
    }
    return (struct ratio){sqrt(told.mean / seen), tap_se(&both) / 2};
}

static int by_ratio(const void *a, const void *b)
{
    const double x = ((const struct ratio *)a)->value,
                 y = ((const struct ratio *)b)->value;
    return (x > y) - (x < y);
}

/* Standard errors by which it lies outside of the edges; 0: inside; infinite: no number. */
static double outside(struct ratio r, const double edges[2])
{
    if (!(isfinite(r.value) && r.value > 0 && isfinite(r.se))) return INFINITY;
    return fmax(0, fmax(log(edges[0] / r.value), log(r.value / edges[1])) / r.se);
}

static void errors(const struct setting *s)
{
    char name[200];
    imp_film *film;
    imp_scene *scene = test_cornell_through(ctx, s->filter, s->side);
    imp_problem *p = problem_of(s, scene, &film);
    const size_t n = imp_problem_n_variables(p);
    struct ratio ratio[MOST], loss = {1, 0};
    double z[2] = {0, 0};
    int seeds = 0;
    for (int next = SEEDS; next <= MOST_SEEDS; next *= 4) {
        evaluate(s, p, imp_film_mean(film), seeds, next);
        seeds = next;
        for (size_t k = 0; k < n; k++) ratio[k] = ratio_of(k, seeds);
        double worst = 0;
        for (size_t k = 0; k < n; k++) worst = fmax(worst, outside(ratio[k], EDGES_ONE));
        qsort(ratio, n, sizeof *ratio, by_ratio);
        z[0] = fmax(worst, outside(ratio[n / 2], EDGES));
        if (!s->fixed) {
            loss = ratio_of(n, seeds);
            z[1] = outside(loss, EDGES);
        }
        if (fmax(z[0], z[1]) == 0 || fmax(z[0], z[1]) > Z) break;
    }
    name_of(s, name);
    tap_ok(z[0] <= Z && ratio[n / 2].se < VAGUE,
           "%s: errors of the gradient # told/seen %.2f (%.2f to %.2f), se %.2f, by %d "
           "seeds",
           name, ratio[n / 2].value, ratio[0].value, ratio[n - 1].value, ratio[n / 2].se,
           seeds);
    if (!s->fixed)
        tap_ok(z[1] <= Z && loss.se < VAGUE,
               "%s: error of the loss # told/seen %.2f, se %.2f, by %d seeds", name,
               loss.value, loss.se, seeds);
    imp_film_destroy(film);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* ---- Many numbers, in fixed point -------------------------------------------------- */

/* A lamp before a wall of texels, through a filter; a ball shades some of it. */
static imp_scene *wall_of(const char *filter, int side, int texels)
{
    const double camera[16] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 4, 0, 0, 0, 1};
    const double before[16] = {.5, 0, 0, -1, 0, -.5, 0, 1, 0, 0, -1, 2, 0, 0, 0, 1};
    const double ball[16] = {.3, 0, 0, -.5, 0, .3, 0, .5, 0, 0, .3, .6, 0, 0, 0, 1};
    float *pixels = malloc(3 * (size_t)(texels * texels) * sizeof *pixels);
    imp_scene *s;
    for (int k = 0; k < 3 * texels * texels; k++)
        pixels[k] = .3f + .4f * (float)(k * 37 % 101) / 101;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "integrator", "path", NULL, NULL);
    imp_scene_integer(s, "max_depth", 3);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_transform(s, "to_world", camera);
    imp_scene_float(s, "fov", 30);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", side);
    imp_scene_integer(s, "height", side);
    imp_scene_begin(s, "rfilter", filter, NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "rectangle", NULL, NULL);
    imp_scene_transform(s, "to_world", before);
    imp_scene_begin(s, "emitter", "area", NULL, NULL);
    imp_scene_float(s, "radiance", 8);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "sphere", NULL, NULL);
    imp_scene_transform(s, "to_world", ball);
    imp_scene_end(s);
    test_picture_wall(s, texels, texels, pixels);
    test_must(ctx, imp_scene_commit(s));
    free(pixels);
    return s;
}

static void texels(const char *filter, enum imp_points points, int spp, int seeds)
{
    enum { SIDE = 24, TEXELS = 20, N = 3 * TEXELS * TEXELS };
    static struct tap_stat value[N];
    static double told[N], g[N], se[N], ratio[N];
    imp_scene *scene = wall_of(filter, SIDE, TEXELS);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_target target = IMP_TARGET_INIT;
    imp_film *film;
    double off = 0, all = 0;
    run.spp = 256;
    test_must(ctx, imp_render(scene, &run, &film));
    imp_problem *p = test_problem(ctx, scene, "*reflectance.data");
    target.pixels = imp_film_mean(film);
    target.width = target.height = SIDE;
    target.channels = 3;
    test_must(ctx, imp_problem_add_target(p, &target));
    if (imp_problem_n_variables(p) != N) exit(99);
    memset(value, 0, sizeof value);
    memset(told, 0, sizeof told);
    for (int seed = 0; seed < seeds; seed++) {
        run.spp = spp;
        run.seed = 100 + (uint64_t)seed;
        run.points = points;
        test_must(ctx, imp_problem_objective(p, NULL, &run, NULL, g, se));
        for (int k = 0; k < N; k++) {
            tap_add(&value[k], g[k]);
            told[k] += se[k] * se[k] / seeds;
        }
    }
    size_t used = 0;
    for (int k = 0; k < N; k++) {
        const double seen = value[k].m2 / (value[k].n - 1);
        all += seen;
        off += told[k];
        if (seen > 0) ratio[used++] = sqrt(told[k] / seen);
    }
    const double mid = median(ratio, used);
    tap_ok(
        mid >= 0.85 && mid <= 1.3 && sqrt(off / all) < 1.4 && sqrt(off / all) > 0.8,
        "%s, %d spp, %s, %d texels # told/seen %.2f (10 %% below %.2f, above %.2f), of "
        "all %.2f",
        filter, spp, points == IMP_POINTS_SOBOL ? "sobol" : "independent", N, mid,
        ratio[used / 10], ratio[9 * used / 10], sqrt(off / all));
    imp_film_destroy(film);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    static const enum imp_points ONE = IMP_POINTS_INDEPENDENT, SETS = IMP_POINTS_SOBOL;
    static const char *const filters[] = {"box", "tent", "gaussian", "mitchell",
                                          "lanczos"};
    static const enum imp_loss losses[] = {IMP_LOSS_L2, IMP_LOSS_LOG, IMP_LOSS_L1};
    const bool all = argc > 1 && strcmp(argv[1], "long") == 0;
    ctx = test_context(1);
    errors(&(struct setting){"<rfilter type='gaussian'/>", 16, 32, ONE, IMP_LOSS_L2, 1,
                             false});
    errors(&(struct setting){"<rfilter type='gaussian'/>", 16, 8, ONE, IMP_LOSS_L2, .7,
                             false});
    errors(&(struct setting){"<rfilter type='tent'/>", 16, 16, SETS, IMP_LOSS_LOG, 1,
                             false});
    errors(
        &(struct setting){"<rfilter type='tent'/>", 16, 2, ONE, IMP_LOSS_L1, 1, false});
    errors(&(struct setting){"<rfilter type='mitchell'/>", 16, 8, SETS, IMP_LOSS_L2, 1,
                             true});
    texels("gaussian", ONE, 8, 60);
    for (int f = 0; all && f < 5; f++)
        for (int sets = 0; sets < 2; sets++) {
            const enum imp_points kind = sets ? SETS : ONE;
            char filter[40];
            snprintf(filter, sizeof filter, "<rfilter type='%s'/>", filters[f]);
            struct setting s = {filter, 24, 32, kind, IMP_LOSS_L2, 1, true};
            errors(&s);
            for (int k = 0; k < 12; k++) {
                static const int spp[] = {8, 32};
                s = (struct setting){
                    filter, 24, spp[k % 2], kind, losses[k / 4], k / 2 % 2 ? .7 : 1,
                    false};
                errors(&s);
            }
            for (int spp = 8; f > 0 && spp <= 32; spp *= 4)
                texels(filters[f], kind, spp, 100);
        }
    if (all) /* a filter that reaches beyond a block */
        errors(&(struct setting){"<rfilter type='gaussian'><float name='stddev' "
                                 "value='1'/></rfilter>",
                                 24, 32, ONE, IMP_LOSS_L2, 1, false});
    imp_context_destroy(ctx);
    return tap_done();
}

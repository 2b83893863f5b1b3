/* SPDX-License-Identifier: Apache-2.0
 *
 * Errors of losses and gradients that two sets tell (docs/estimators.md 14), beside the variances of
 * these estimates: closed forms for normal sets, the draws' own for skewed ones and for counts.
 * Which samples have such errors, and that they are the same in arrays and in hash tables. */
#include "color/rgb.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/estimate/adjoint.h"
#include "inverse/estimate/replicates.h"
#include "math/rng.h"

enum { DRAWS = 200000, MOST = 3, TEXELS = 32, SIDE = 24 };

/* A set's mean of L and of dL: standard deviations, correlation, in each channel. */
struct kind {
    const char *name;
    enum { NORMAL, SKEWED, COUNT } draws;
    int channels, points;
    double m, d, s_a, s_d, rho;
    double
        square;   /* 1, or of luminance, which is then what the target has, the sum of the
                      squares of its weights */
    double share; /* of counts; 0: anywhere */
};

static double normal(struct imp_key key, uint32_t k)
{
    return sqrt(-2 * log(1 - imp__u01(key, 2 * k))) *
           cos(2 * M_PI * imp__u01(key, 2 * k + 1));
}

/* z[0], z[1] of variance 1: means of `points` draws, or what a count has over its mean. */
static void pair(const struct kind *k, uint64_t i, int set, int c, double share,
                 double z[2])
{
    const struct imp_key key = imp__key(5 + (uint64_t)set, i, (uint64_t)c);
    for (int j = 0; j < 2; j++) {
        z[j] = 0;
        for (int q = 0; q < k->points; q++)
            z[j] += k->draws == NORMAL ? normal(key, (uint32_t)(2 * q + j))
                    : k->draws == SKEWED
                        ? -log(1 - imp__u01(key, (uint32_t)(2 * q + j))) - 1
                        : (imp__u01(key, (uint32_t)(2 * q + j)) < share) - share;
        z[j] /= sqrt(k->points);
    }
    z[1] = k->rho * z[0] + sqrt(1 - k->rho * k->rho) * z[1];
}

struct seen {
    struct tap_stat value, gradient; /* estimates */
    struct tap_stat told[2];         /* variances */
};

static void draw(const struct kind *k, struct seen *out)
{
    float pixels[MOST] = {.2f, .3f, .4f};
    const double scale = 1.7;
    struct imp__target t = {.pixels = pixels,
                            .desc = {.loss = IMP_LOSS_L2,
                                     .channels = k->square < 1 ? 1 : k->channels,
                                     .scale = scale,
                                     .pixels = pixels}};
    *out = (struct seen){0};
    for (uint64_t i = 0; i < DRAWS; i++) {
        imp_spec L[2] = {{0}}, dL[2] = {{0}}, P[2], E[2];
        const double share = k->share > 0 ? k->share : imp__u01(imp__key(4, i, 0), 0);
        for (int s = 0; s < 2; s++)
            for (int c = 0; c < k->channels; c++) {
                double z[2];
                pair(k, i, s, c, share, z);
                L[s][c] = pixels[k->square < 1 ? 0 : c] + k->m + k->s_a * z[0];
                dL[s][c] = k->d + k->s_d * z[1];
            }
        const double value = imp__replicate_adjoints(&t, k->channels, 0, 2, L, L, P);
        const double variance = imp__replicate_errors(&t, k->channels, 0, L, P, E);
        double g = 0, e = 0;
        for (int s = 0; s < 2; s++)
            for (int c = 0; c < k->channels; c++) {
                g += P[s][c] * dL[s][c];
                e += E[s][c] * dL[s][c];
            }
        tap_add(&out->value, value);
        tap_add(&out->gradient, g);
        tap_add(&out->told[0], variance);
        tap_add(&out->told[1], e * e);
    }
}

static void normal_sets(const struct kind *k)
{
    struct seen s;
    const double w = 1.7, V = k->s_a * k->s_a * k->square,
                 D = k->s_d * k->s_d * k->square,
                 C = k->rho * k->s_a * k->s_d * k->square,
                 n = k->square < 1 ? 1 : k->channels;
    const double value = n * w * w / 4 * (2 * k->m * k->m * V + V * V);
    const double gradient =
        n * w * w / 2 *
        (k->m * k->m * D + k->d * k->d * V + 2 * k->m * k->d * C + V * D + C * C);
    /* What is added for edges: (sum over channels of w (a - b)^2/4)^2 / 10, the square of a sum of
     * n squares of mean w V/2. */
    const double edges = 0.1 * w * w * V * V / 4 * (n * n + 2 * n);
    draw(k, &s);
    const double z[4] = {(s.value.mean - n * w / 2 * k->m * k->m) / tap_se(&s.value),
                         (s.gradient.mean - n * w * k->m * k->d) / tap_se(&s.gradient),
                         (s.told[0].mean - value - edges) / tap_se(&s.told[0]),
                         (s.told[1].mean - gradient) / tap_se(&s.told[1])};
    bool good = tap_se(&s.told[1]) < .02 * gradient && tap_se(&s.told[0]) < .02 * value;
    for (int j = 0; j < 4; j++) good &= fabs(z[j]) < 4.5;
    tap_ok(good,
           "%s, m %g, d %g: loss, gradient, their variances # z %.2f %.2f %.2f %.2f",
           k->name, k->m, k->d, z[0], z[1], z[2], z[3]);
}

/* told/seen of value and gradient within these bounds. */
static void other_sets(const struct kind *k, double low, double high)
{
    struct seen s;
    draw(k, &s);
    const double value = sqrt(s.told[0].mean / (s.value.m2 / (s.value.n - 1)));
    const double gradient = sqrt(s.told[1].mean / (s.gradient.m2 / (s.gradient.n - 1)));
    tap_ok(value > low && value < high && gradient > low && gradient < high,
           "%s of %d points, m %g: errors # told/seen %.3f of the loss, %.3f of the "
           "gradient, %g to %g",
           k->name, k->points, k->m, value, gradient, low, high);
}

/* Counts of one share, whose kurtosis is from 1 at a half to any: what is told of the loss has its
 * closed form, and is right of its first order only. */
static void counts_of(double share, double m)
{
    const struct kind k = {"counts", COUNT, 1, 1, m, 1, 1, .1, 0, 1, share};
    struct seen s;
    const double w = 1.7, V = share * (1 - share), kurtosis = 1 / V - 3,
                 third = V * (1 - 2 * share);
    const double told = w * w / 4 *
                        (2 * m * m * V + (kurtosis - 1) / 2 * V * V + 2 * m * third +
                         .1 * (kurtosis + 3) / 2 * V * V);
    const double seen = w * w / 4 * (2 * m * m * V + V * V);
    draw(&k, &s);
    const double z = (s.told[0].mean - told) / tap_se(&s.told[0]);
    tap_ok(fabs(z) < 4.5 && tap_se(&s.told[0]) < .02 * told &&
               fabs(s.value.m2 / (s.value.n - 1) / seen - 1) < .03,
           "counts of %g, kurtosis %.2f, m %g: variance of the loss # told/seen %.3f, z "
           "%.2f",
           share, kurtosis, m, sqrt(told / seen), z);
}

/* ---- Which samples ------------------------------------------------------------------ */

static imp_scene *wall(imp_context *ctx)
{
    static float pixels[TEXELS * TEXELS * 3];
    imp_scene *s;
    for (int k = 0; k < TEXELS * TEXELS * 3; k++) pixels[k] = .2f + .6f * (k % 7 < 3);
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    test_camera(s, 3, 30, SIDE, SIDE);
    test_picture_wall(s, TEXELS, TEXELS, pixels);
    test_must(ctx, imp_scene_commit(s));
    return s;
}

/* Samples taken of `spp`, and the replicates they are. */
static void plan(const imp_problem *p, int spp, enum imp_points points, int R, int q)
{
    struct imp_run run = IMP_RUN_INIT;
    int taken;
    run.spp = spp;
    run.points = points;
    test_must(p->ctx, imp_problem_get_spp(p, 0, &run, &taken));
    run.points = points == IMP_POINTS_SCENE ? IMP_POINTS_SOBOL : points;
    const struct imp__replicates r = imp__replicates_loss(p, &p->targets[0], &run);
    tap_ok(taken == r.n * r.R && r.R == R && r.lone == (R == 1) && r.n / r.m == q,
           "%d samples # %d taken, %d replicates of %d sets of %d, %d", spp, taken, r.R,
           r.m, r.n / r.m, r.lone);
}

static void plans(imp_context *ctx, imp_scene *scene, const float *target)
{
    imp_problem *p = test_problem(ctx, scene, "*data*");
    test_target(ctx, p, 0, SIDE, SIDE, target);
    plan(p, 16, IMP_POINTS_SCENE, 2, 4);
    plan(p, 31, IMP_POINTS_SCENE, 3, 7);
    plan(p, 32, IMP_POINTS_SCENE, 1, 16);
    plan(p, 33, IMP_POINTS_SCENE, 1, 17);
    plan(p, 127, IMP_POINTS_SCENE, 1, 64);
    plan(p, 128, IMP_POINTS_SCENE, 1, 64);
    plan(p, 130, IMP_POINTS_SCENE, 2, 32);
    plan(p, 256, IMP_POINTS_SCENE, 2, 64);
    plan(p, 64, IMP_POINTS_INDEPENDENT, 2, 1);
    p->use = IMP_LOSS_SOUGHT;
    plan(p, 4, IMP_POINTS_SCENE, 1, 2);
    plan(p, 5, IMP_POINTS_SCENE, 1, 3);
    plan(p, 7, IMP_POINTS_SCENE, 1, 4);
    plan(p, 16, IMP_POINTS_SCENE, 1, 8);
    p->use = IMP_LOSS_COMPARED;
    plan(p, 64, IMP_POINTS_SCENE, 2, 16);
    imp_problem_destroy(p);
}

/* The sky's gradient from arrays, and beside texels from a hash table. */
static void arrays_and_tables(imp_context *ctx, imp_scene *scene, const float *target)
{
    enum { N = 3 + TEXELS * TEXELS * 3 };
    static double g[2][N], se[2][N];
    double off = 0;
    size_t at[2];
    for (int many = 0; many < 2; many++) {
        imp_problem *p = test_problem(ctx, scene, "*radiance*");
        struct imp_run run = IMP_RUN_INIT;
        run.spp = 32;
        if (many) test_must(ctx, imp_problem_activate(p, "*data*"));
        test_target(ctx, p, 0, SIDE, SIDE, target);
        test_must(ctx, imp_problem_objective(p, NULL, &run, NULL, g[many], se[many]));
        for (size_t k = 0; k < p->scene->n_params; k++)
            if (strstr(p->scene->params[k].info.name, "radiance"))
                at[many] = (size_t)p->active.base[k];
        imp_problem_destroy(p);
    }
    for (size_t c = 0; c < 3; c++) {
        const size_t i = at[0] + c, j = at[1] + c;
        off = fmax(off, fabs(g[0][i] / g[1][j] - 1) + fabs(se[0][i] / se[1][j] - 1));
    }
    tap_ok(se[0][at[0]] > 0 && off < 1e-8,
           "a gradient and its errors, in arrays and in a table # off by %.1e", off);
}

int main(void)
{
    static const struct kind normals[] = {
        {"normal sets", NORMAL, 1, 1, 0, 1, 1, .5, .3, 1, 0},
        {"normal sets", NORMAL, 1, 1, .6, 1, 1, .5, -.8, 1, 0},
        {"normal sets", NORMAL, 1, 1, -2, .5, .7, .9, .5, 1, 0},
        {"normal sets of three channels", NORMAL, 3, 1, .3, 1, 1, .5, .6, 1, 0},
        {"normal sets of a luminance", NORMAL, 3, 1, .3, 1, 1, .5, .6,
         IMP_LUM_R * IMP_LUM_R + IMP_LUM_G * IMP_LUM_G + IMP_LUM_B * IMP_LUM_B, 0}};
    /* Of long tails errors are large; a pixel that an edge divides has counts, and their kurtosis
     * is 2 where the edge is anywhere. */
    static const struct kind skewed[] = {
        {"skewed sets", SKEWED, 1, 16, 0, 1, .25, .25, .9, 1, 0},
        {"skewed sets", SKEWED, 1, 16, -.5, 1, .25, .25, .9, 1, 0},
        {"skewed sets", SKEWED, 1, 2, 0, 1, .7, .7, .9, 1, 0},
        {"counts", COUNT, 1, 1, 0, 1, .5, .1, .9, 1, 0}};
    static const double bounds[][2] = {{1, 1.25}, {.85, 1.25}, {1.2, 2}, {.82, 1.1}};
    static float target[SIDE * SIDE * 3];
    for (size_t k = 0; k < imp_count(normals); k++) normal_sets(&normals[k]);
    for (size_t k = 0; k < imp_count(skewed); k++)
        other_sets(&skewed[k], bounds[k][0], bounds[k][1]);
    static const double shares[] = {.5, .31, .23, .2, .1};
    for (size_t k = 0; k < imp_count(shares); k++) counts_of(shares[k], 0);
    counts_of(.31, -1);
    counts_of(.1, 1);
    imp_context *ctx = test_context(1);
    imp_scene *scene = wall(ctx);
    plans(ctx, scene, target);
    arrays_and_tables(ctx, scene, target);
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
    return tap_done();
}

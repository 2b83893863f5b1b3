/* SPDX-License-Identifier: Apache-2.0
 *
 * Loss, gradient, their standard errors and the Gauss-Newton matrices of a small picture,
 * from its walks one by one: radiances and derivatives of every walk are taken from the
 * walk itself, and the estimators' formulas (docs/estimators.md 5.2, 14, 15) are summed
 * here in full. A wrong error bar or a lost weight leaves every mean right. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/estimate/channel_sink.h"
#include "inverse/estimate/problem_tracer.h"
#include "inverse/estimate/replicates.h"
#include "inverse/gauss/gauss_newton.h"
#include "inverse/problem/loss.h"

static imp_context *ctx;

enum { WIDTH = 3, HEIGHT = 2, PIXELS = WIDTH * HEIGHT, SPP_MAX = 16, C = 3 };

struct setting {
    imp_scene *scene;
    imp_problem *problem;
    struct imp_run run;
    int n, R; /* samples of a replicate, replicates */
    size_t K;
    float target[PIXELS * C], weight[PIXELS], noise[PIXELS * C];
    double *walk;                  /* [pixel][sample][1 + K][C] */
    double at[PIXELS][SPP_MAX][2]; /* film positions */
};

/* A wall whose reflectance is a picture: more numbers than are kept in arrays. */
static imp_scene *wall(void)
{
    enum { SIDE = 32 };
    static float pixels[SIDE * SIDE * 3];
    imp_scene *s;
    for (int k = 0; k < SIDE * SIDE * 3; k++) pixels[k] = (float)(0.2 + 0.1 * (k % 7));
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    test_camera(s, 3, 20, WIDTH, HEIGHT);
    test_picture_wall(s, SIDE, SIDE, pixels);
    test_must(ctx, imp_scene_commit(s));
    return s;
}

static imp_scene *ball_of(const char *filter, const char *colour)
{
    char xml[4096];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'>"
             "<integer name='max_depth' value='3'/></integrator>"
             "<sensor type='perspective'><float name='fov' value='20'/>"
             "<transform name='to_world'><lookat origin='0,0,4' target='0,0,0' "
             "up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' "
             "value='3'/><integer name='height' value='2'/><rfilter type='%s'/></film>"
             "</sensor><shape type='sphere'><bsdf type='diffuse' id='ball'><rgb "
             "name='reflectance' value='%s'/></bsdf></shape>"
             "<emitter type='constant'/><emitter type='point'>"
             "<point name='position' x='2' y='2' z='3'/></emitter></scene>",
             filter, colour);
    return test_scene_text(ctx, xml, IMP_RGB);
}
static imp_scene *ball(const char *filter) { return ball_of(filter, ".3,.5,.7"); }

static void begin(struct setting *s, imp_scene *scene, const char *active, int spp,
                  enum imp_loss loss)
{
    *s = (struct setting){.scene = scene};
    s->run = (struct imp_run)IMP_RUN_INIT;
    s->run.spp = spp;
    s->run.points = IMP_POINTS_INDEPENDENT; /* the sums below are over walks */
    s->run.seed = 11;
    s->problem = test_problem(ctx, s->scene, active);
    s->K = imp_problem_n_variables(s->problem);
    for (int p = 0; p < PIXELS; p++) {
        s->weight[p] = (float)(0.5 + 0.25 * p);
        for (int c = 0; c < C; c++) {
            s->target[C * p + c] = (float)(0.1 + 0.05 * p + 0.02 * c);
            s->noise[C * p + c] = (float)(0.01 + 0.002 * p);
        }
    }
    struct imp_target t = IMP_TARGET_INIT;
    t.width = WIDTH, t.height = HEIGHT, t.channels = C;
    t.pixels = s->target, t.weights = s->weight, t.noise_se = s->noise;
    t.loss = loss, t.scale = 3;
    test_must(ctx, imp_problem_add_target(s->problem, &t));

    struct imp_tracer tracer;
    struct imp_arena arena;
    const size_t size = (s->K + 1) * C;
    test_must(ctx, imp__problem_tracer(s->problem, &s->run, NULL, &tracer));
    imp__arena_init(&arena, ctx);
    s->walk = calloc(PIXELS * SPP_MAX * size, sizeof *s->walk);
    for (int p = 0; p < PIXELS; p++)
        for (int i = 0; i < spp; i++) {
            const struct imp_arena_mark mark = imp__arena_mark(&arena);
            struct imp_sample sample = {.x = p % WIDTH,
                                        .y = p / WIDTH,
                                        .index = i,
                                        .arena = &arena,
                                        .value =
                                            s->walk + (size_t)(p * SPP_MAX + i) * size};
            struct imp_walk walk;
            imp__sample_walk(&sample, &tracer, &walk);
            imp__lanes_values(&tracer, &walk, sample.value);
            s->at[p][i][0] = sample.px;
            s->at[p][i][1] = sample.py;
            imp__arena_rewind(&arena, mark);
        }
    imp__arena_free(&arena);
}
static void end(struct setting *s)
{
    free(s->walk);
    imp_problem_destroy(s->problem);
    imp_scene_destroy(s->scene);
}

static double L(const struct setting *s, int p, int i, int c)
{
    return s->walk[(size_t)(p * SPP_MAX + i) * (s->K + 1) * C + (size_t)c];
}
static double X(const struct setting *s, int p, int i, size_t k, int c)
{
    return s->walk[((size_t)(p * SPP_MAX + i) * (s->K + 1) + k + 1) * C + (size_t)c];
}
static double weight(const struct setting *s, int p) { return 3 * (double)s->weight[p]; }
static double target(const struct setting *s, int p, int c)
{
    return s->target[C * p + c];
}

static double worst_of(const double *a, const double *b, size_t n)
{
    double worst = 0, size = 0;
    for (size_t k = 0; k < n; k++) {
        worst = fmax(worst, fabs(a[k] - b[k]));
        size = fmax(size, fabs(b[k]));
    }
    return worst / size;
}

static double relative(double a, double b) { return fabs(a - b) / fabs(b); }

/* ---- Leave-one-out ------------------------------------------------------------- */

/* Replicate b of a pixel: value[0], then its gradient. */
static void replicate(const struct setting *s, int p, int b, double *value)
{
    const double n = s->n;
    memset(value, 0, (s->K + 1) * sizeof *value);
    for (int c = 0; c < C; c++) {
        double mean = 0, variance = 0;
        for (int i = b * s->n; i < (b + 1) * s->n; i++) mean += L(s, p, i, c) / n;
        for (int i = b * s->n; i < (b + 1) * s->n; i++)
            variance += pow(L(s, p, i, c) - mean, 2) / (n - 1);
        value[0] += 0.5 * weight(s, p) * (pow(mean - target(s, p, c), 2) - variance / n);
        for (int i = b * s->n; i < (b + 1) * s->n; i++) {
            const double others = (n * mean - L(s, p, i, c)) / (n - 1);
            for (size_t k = 0; k < s->K; k++)
                value[1 + k] +=
                    weight(s, p) * (others - target(s, p, c)) * X(s, p, i, k, c) / n;
        }
    }
}

static void leave_one_out(imp_scene *scene, const char *active, int spp, const char *what)
{
    struct setting s;
    begin(&s, scene, active, spp, IMP_LOSS_L2);
    s.n = spp < 4 ? spp : spp / 2;
    s.R = spp / s.n;
    const size_t n = s.K + 1;
    double *sum = calloc(6 * n, sizeof *sum), *se_ref = sum + n, *mine = sum + 2 * n;
    double *se = sum + 3 * n, *v[2] = {sum + 4 * n, sum + 5 * n};
    const bool paired = s.R == 1; /* pixels two by two stand in for replicates */
    for (int p = 0; p < PIXELS; p += paired ? 2 : 1) {
        for (int b = 0; b < 2; b++)
            replicate(&s, paired ? p + b : p, paired ? 0 : b, v[b]);
        for (size_t k = 0; k < n; k++) {
            sum[k] += (v[0][k] + v[1][k]) / (paired ? 1 : 2);
            se_ref[k] += pow((v[0][k] - v[1][k]) / (paired ? 1 : 2), 2);
        }
    }
    for (size_t k = 0; k < n; k++) se_ref[k] = sqrt(se_ref[k]);
    struct imp_estimate f;
    test_must(ctx, imp_problem_objective(s.problem, NULL, &s.run, &f, mine + 1, se + 1));
    int used = 0;
    for (size_t k = 1; k < n; k++) used += sum[k] != 0;
    const double off = worst_of(mine + 1, sum + 1, s.K),
                 off_se = worst_of(se + 1, se_ref + 1, s.K);
    tap_ok(relative(f.value, sum[0]) < 1e-12 && relative(f.se, se_ref[0]) < 1e-12,
           "%s: loss # %g +- %g", what, f.value, f.se);
    tap_ok(used >= 3 && off < 1e-11 && off_se < 1e-11,
           "%s: gradient %.1e and its errors %.1e, %d numbers", what, off, off_se, used);
    free(sum);
    end(&s);
}

/* ---- Filters wider than a pixel -------------------------------------------------- */

/* What sample i of pixel q gives to pixel p, through a tent of radius 1. */
static double tent(const struct setting *s, int q, int i, int p)
{
    return fmax(0, 1 - fabs(s->at[q][i][0] - (p % WIDTH + 0.5))) *
           fmax(0, 1 - fabs(s->at[q][i][1] - (p / WIDTH + 0.5)));
}

/* One picture of n samples a pixel: its loss, the variance of the pixels taken off; the
 * adjoint of a sample has l' of every pixel that it reaches, without the sample itself.
 */
static void wide_replicate(const struct setting *s, int b, double *value)
{
    const int from = b * s->n, to = from + s->n;
    memset(value, 0, 4 * sizeof *value);
    for (int p = 0; p < PIXELS; p++)
        for (int c = 0; c < C; c++) {
            double W = 0, sum = 0, variance = 0;
            for (int q = 0; q < PIXELS; q++)
                for (int i = from; i < to; i++) {
                    W += tent(s, q, i, p);
                    sum += tent(s, q, i, p) * L(s, q, i, c);
                }
            for (int q = 0; q < PIXELS; q++) {
                double e = 0, e2 = 0;
                for (int i = from; i < to; i++) {
                    const double one = tent(s, q, i, p) * (L(s, q, i, c) - sum / W);
                    e += one;
                    e2 += one * one;
                }
                variance += (e2 - e * e / s->n) * s->n / (s->n - 1) / (W * W);
            }
            value[0] +=
                0.5 * weight(s, p) * (pow(sum / W - target(s, p, c), 2) - variance);
            for (int q = 0; q < PIXELS; q++)
                for (int i = from; i < to; i++) {
                    const double w = tent(s, q, i, p);
                    const double others = (sum - w * L(s, q, i, c)) / (W - w);
                    for (size_t k = 0; k < 3; k++)
                        value[1 + k] += weight(s, p) * (others - target(s, p, c)) *
                                        X(s, q, i, k, c) * w / W;
                }
        }
}

static void wide(void)
{
    struct setting s;
    struct imp_estimate f;
    enum { R = 4 };
    double g[3], ref[3] = {0}, v[R][4], mean = 0, variance = 0;
    begin(&s, ball("tent"), "ball.*", 16, IMP_LOSS_L2);
    s.n = 4, s.R = R;
    for (int b = 0; b < R; b++) {
        wide_replicate(&s, b, v[b]);
        mean += v[b][0] / R;
        for (int k = 0; k < 3; k++) ref[k] += v[b][1 + k] / R;
    }
    for (int b = 0; b < R; b++) variance += pow(v[b][0] - mean, 2) / (R * (R - 1));
    test_must(ctx, imp_problem_objective(s.problem, NULL, &s.run, &f, g, NULL));
    /* Pictures are kept in float. Errors count what tiles have in common, with more degrees
     * of freedom than the three of whole pictures (stat/wide_errors). */
    const double by_pictures = sqrt(variance);
    tap_ok(relative(f.value, mean) < 1e-5 && f.se > by_pictures / 3 &&
               f.se < 3 * by_pictures,
           "wide filter: loss # %g +- %g", f.value, f.se);
    tap_ok(worst_of(g, ref, 3) < 1e-5, "wide filter: gradient # %.1e",
           worst_of(g, ref, 3));
    end(&s);
}

/* ---- Gauss-Newton -------------------------------------------------------------- */

/* h_ij of a pixel: half the sum over channels of w (r_i X_j + r_j X_i). */
static double pair_of(struct setting *s, int p, int i, int j, size_t k)
{
    double h = 0;
    for (int c = 0; c < C; c++) {
        const double T = target(s, p, c);
        h += 0.5 * weight(s, p) *
             ((L(s, p, i, c) - T) * X(s, p, j, k, c) +
              (L(s, p, j, c) - T) * X(s, p, i, k, c));
    }
    return h;
}

/* Unbiased variance of the mean of h over pairs: its square, less the mean of products of
 * pairs that have no walk in common. */
static void covariance_of(struct setting *s, int p, int n, double *g, double *cov)
{
    double h[8][8][3], apart[9] = {0}, mean[3] = {0};
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            for (size_t k = 0; k < 3; k++) {
                h[i][j][k] = pair_of(s, p, i, j, k);
                if (i != j) mean[k] += h[i][j][k] / (n * (n - 1));
            }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            for (int a = 0; a < n; a++)
                for (int b = 0; b < n; b++) {
                    if (i == j || i == a || i == b || j == a || j == b || a == b)
                        continue;
                    for (size_t k = 0; k < 9; k++)
                        apart[k] += h[i][j][k / 3] * h[a][b][k % 3] /
                                    (n * (n - 1) * (n - 2) * (n - 3));
                }
    for (size_t k = 0; k < 9; k++) cov[k] += mean[k / 3] * mean[k % 3] - apart[k];
    for (size_t k = 0; k < 3; k++) g[k] += mean[k];
}

/* Likewise of chi^2, h_ij the sum over channels of w r_i r_j. */
static void chi2_of(struct setting *s, int p, int n, double *chi2, double *variance)
{
    double h[8][8] = {{0}}, mean = 0, apart = 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            for (int c = 0; c < C; c++)
                h[i][j] += weight(s, p) * (L(s, p, i, c) - target(s, p, c)) *
                           (L(s, p, j, c) - target(s, p, c));
            if (i != j) mean += h[i][j] / (n * (n - 1));
        }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            for (int a = 0; a < n; a++)
                for (int b = 0; b < n; b++)
                    if (i != j && i != a && i != b && j != a && j != b && a != b)
                        apart += h[i][j] * h[a][b] / (n * (n - 1) * (n - 2) * (n - 3));
    *chi2 += mean;
    *variance += mean * mean - apart;
}

static void gauss_newton(void)
{
    struct setting s;
    enum { K = 3, n = 8 };
    double chi2 = 0, chi2_variance = 0;
    double H[9] = {0}, same[9] = {0}, meas[9] = {0}, cov[9] = {0}, g[3] = {0};
    double mine[5][9], mine_g[3];
    begin(&s, ball("box"), "ball.*", n, IMP_LOSS_L2);
    s.n = 4, s.R = 2;
    for (int p = 0; p < PIXELS; p++) {
        covariance_of(&s, p, n, g, cov);
        chi2_of(&s, p, n, &chi2, &chi2_variance);
        for (int c = 0; c < C; c++) {
            const double w = weight(&s, p), sigma = s.noise[C * p + c];
            for (int i = 0; i < n; i++)
                for (int j = 0; j < n; j++)
                    for (size_t k = 0; k < 9; k++) {
                        const double x = X(&s, p, i, k / 3, c) * X(&s, p, j, k % 3, c);
                        same[k] += w * x / (n * n);
                        if (i == j) continue;
                        H[k] += w * x / (n * (n - 1));
                        meas[k] += w * w * sigma * sigma * x / (n * (n - 1));
                    }
        }
    }
    struct imp__gauss_newton out = {.H = mine[0],
                                    .H_same = mine[1],
                                    .H_meas = mine[2],
                                    .cov_g = mine[3],
                                    .cov_excess = mine[4],
                                    .g = mine_g};
    test_must(ctx, imp__gauss_newton(s.problem, NULL, &s.run, &out));
    for (int k = 0; k < 9; k++) mine[3][k] -= mine[4][k];
    const double off[5] = {worst_of(mine[0], H, 9), worst_of(mine[1], same, 9),
                           worst_of(mine[2], meas, 9), worst_of(mine[3], cov, 9),
                           worst_of(mine_g, g, 3)};
    static const char *const names[] = {"J^T W J", "its biased twin",
                                        "noise of the target",
                                        "covariance of the gradient", "gradient"};
    for (int k = 0; k < 5; k++) tap_ok(off[k] < 1e-10, "%s # %.1e", names[k], off[k]);
    tap_ok(relative(out.chi2, chi2) < 1e-10 &&
               relative(out.chi2_se, sqrt(fmax(chi2_variance, 0))) < 1e-9,
           "chi^2 and its error # %g +- %g, off %.1e, %.1e", out.chi2, out.chi2_se,
           relative(out.chi2, chi2), relative(out.chi2_se, sqrt(chi2_variance)));
    end(&s);
}

/* Of a loss that is not quadratic: the jackknife over all walks of a pixel. */
static void gauss_newton_log(void)
{
    struct setting s;
    enum { n = 8 };
    struct imp_estimate f;
    double H[9], mine[3], g[3] = {0};
    begin(&s, ball("box"), "ball.*", n, IMP_LOSS_LOG);
    struct imp__gauss_newton out = {.H = H, .g = mine};
    test_must(ctx, imp__gauss_newton(s.problem, NULL, &s.run, &out));
    test_must(ctx, imp_problem_objective(s.problem, NULL, &s.run, &f, NULL, NULL));
    s.n = 4, s.R = 2;
    for (int p = 0; p < PIXELS; p++)
        for (int c = 0; c < C; c++)
            for (int left_out = -1; left_out < n; left_out++) {
                const double count = n - (left_out >= 0);
                const double factor = left_out < 0 ? n : -(n - 1.0) / n;
                const double eps = s.problem->targets[0].desc.epsilon;
                double I = 0, x[3] = {0};
                for (int i = 0; i < n; i++) {
                    if (i == left_out) continue;
                    I += L(&s, p, i, c) / count;
                    for (size_t k = 0; k < 3; k++) x[k] += X(&s, p, i, k, c) / count;
                }
                const double slope =
                    weight(&s, p) * log((I + eps) / (target(&s, p, c) + eps)) / (I + eps);
                for (size_t k = 0; k < 3; k++) g[k] += factor * slope * x[k];
            }
    tap_ok(worst_of(mine, g, 3) < 1e-9 && relative(out.objective.value, f.value) < 1e-12,
           "log: gradient # %.1e, and the loss is the objective's, %.1e",
           worst_of(mine, g, 3), relative(out.objective.value, f.value));
    end(&s);
}

/* ---- Regularisers, and differences with fresh random numbers -------------------- */

static void regularisers(void)
{
    struct setting s;
    double H[9], off = 0;
    begin(&s, ball("box"), "ball.*", 2, IMP_LOSS_L2);
    test_must(ctx, imp_problem_add_tikhonov(s.problem, "ball.*", 2.5, 1));
    test_must(ctx, imp__regularise_second(s.problem, H));
    for (int k = 0; k < 9; k++) off = fmax(off, fabs(H[k] - (k % 4 ? 0 : 2.5)));
    tap_ok(off < 1e-15, "Tikhonov about where x was: H = w 1 # %.1e", off);
    end(&s);
}

/* References of the check itself, where they are nearly free of noise: inside the bounds,
 * and on both of them. */
static void fresh(const char *colour)
{
    struct setting s;
    const struct imp_check_row *rows;
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    size_t n;
    double worst = 0, noise = 0;
    int seen = 0;
    begin(&s, ball_of("box", colour), "ball.*", 2, IMP_LOSS_L2);
    o.draws_s = 0.02;
    o.paths = 10;
    o.fresh_spp = 2048;
    test_must(ctx, imp_check(s.problem, &o, &s.run, &rows, &n));
    for (size_t k = 0; k < n; k++) {
        if (strcmp(rows[k].method, "fresh") != 0) continue;
        worst = fmax(worst, relative(rows[k].reference, rows[k].value));
        noise = fmax(noise, rows[k].se / fabs(rows[k].value));
        seen++;
    }
    tap_ok(seen == 3 && noise < 0.03 && worst < 4 * noise,
           "reflectance %s: differences with fresh walks # %.1e, noise %.1e", colour,
           worst, noise);
    end(&s);
}

int main(void)
{
    ctx = test_context(1);
    leave_one_out(ball("box"), "ball.*", 8, "two replicates");
    leave_one_out(ball("box"), "ball.*", 3, "one replicate");
    leave_one_out(wall(), "*.data", 8, "texels");
    wide();
    gauss_newton();
    gauss_newton_log();
    regularisers();
    fresh(".3,.5,.7");
    fresh("0,0,0");
    fresh("1,1,1");
    imp_context_destroy(ctx);
    return tap_done();
}

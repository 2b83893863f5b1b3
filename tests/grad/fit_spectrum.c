/* SPDX-License-Identifier: Apache-2.0
 *
 * A reflectance spectrum of 36 samples from three pictures of one paint, under daylight,
 * tungsten and a fluorescent lamp: nine numbers, so most of the spectrum is not determined
 * by them. The fit says so, what the lamps see agrees, and with a smooth prior the spectrum
 * itself comes back. Its intervals are those of the posterior, whose closed form they are
 * compared with; of spectra drawn from the prior itself, 95 % lie in them (1000 fits as
 * "long"). */
#include "imp_scene.h"
#include "imp_tap.h"
#include "macbeth.h"
#include "math/linalg.h"
#include "math/rng.h"
#include "math/vec.h"
#include <math.h>

#define PATCH 1 /* light skin */
#define N     36
#define SEED  1000000 /* of the spectra that are drawn */

static imp_context *ctx;

/* Three cells that do not see each other; each has the paint, its lamp and its camera. */
static imp_scene *scene_make(const double *rho)
{
    static const char *const lamp[3] = {"D65", "A", "F11"};
    char text[16384], list[1024];
    size_t n = 0;
    for (int k = 0, used = 0; k < N; k++)
        used += snprintf(list + used, sizeof list - (size_t)used, "%s%d:%.9g",
                         k ? "," : "", 380 + 10 * k, rho[k]);
    n += (size_t)snprintf(text, sizeof text,
                          "<scene version='3.0.0'><integrator type='direct'/><bsdf "
                          "type='diffuse' id='paint'><spectrum name='reflectance' "
                          "value='%s'/></bsdf>",
                          list);
    for (int c = 0; c < 3; c++)
        n += (size_t)snprintf(
            text + n, sizeof text - n,
            "<shape type='rectangle'><transform name='to_world'><translate x='%d'/>"
            "</transform><ref id='paint'/></shape>"
            "<shape type='rectangle'><transform name='to_world'><rotate x='1' "
            "angle='180'/>"
            "<translate x='%d' z='2'/></transform><emitter type='area'><spectrum "
            "type='illuminant' name='radiance'><string name='name' "
            "value='%s'/></spectrum>"
            "</emitter></shape>"
            "<sensor type='perspective'><float name='fov' value='40'/><transform "
            "name='to_world'><lookat origin='%d,-3,1' target='%d,0,0' up='0,0,1'/>"
            "</transform><film type='hdrfilm'><integer name='width' value='6'/><integer "
            "name='height' value='6'/><rfilter type='box'/></film></sensor>",
            1000 * c, 1000 * c, lamp[c], 1000 * c, 1000 * c);
    snprintf(text + n, sizeof text - n, "</scene>");
    return test_scene_text(ctx, text, IMP_SPECTRAL);
}

static const struct imp_fit_result *fit(imp_problem *p, double smooth,
                                        const double *start, int spp, uint64_t seed)
{
    const struct imp_fit_result *r;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    test_must(ctx, imp_problem_activate(p, "paint.reflectance.values"));
    test_must(ctx, imp_problem_set_x(p, start));
    if (smooth > 0)
        test_must(ctx, imp_problem_add_smoothness(p, "paint.reflectance.values", smooth));
    o.optimizer = IMP_LM;
    o.intervals = 1;
    o.max_iterations = 12;
    run.spp = spp;
    run.seed = seed;
    test_must(ctx, imp_fit(p, &o, &run, &r));
    return r;
}

/* ---- Intervals ------------------------------------------------------------------------- */

#define NOISE 0.05 /* of a channel of a pixel */
#define STEP  0.02 /* standard deviation of the difference of neighbours of a spectrum */
#define CELLS (3 * 6 * 6 * 3) /* lamps, pixels, channels */
#define Z95   1.959963984540054

static double normal(uint64_t seed, uint32_t k)
{
    const struct imp_key key = imp__key(seed, 7, 0);
    return sqrt(-2 * log(1 - imp__u01(key, 2 * k))) *
           cos(IMP_2PI * imp__u01(key, 2 * k + 1));
}

/* The pictures are linear in the reflectance, I = J rho, so that the posterior is a normal
 * distribution that is known in closed form:
 *
 *     C = (J^T J / NOISE^2 + D^T D / STEP^2)^-1,     mean C J^T T / NOISE^2,
 *
 * D the differences of neighbours, T the pictures. */
struct posterior {
    double J[CELLS][N], C[N][N], se[N];
};

static void posterior_find(imp_scene *s, struct posterior *q)
{
    double A[N * N] = {0};
    imp_problem *p;
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "paint.reflectance.values"));
    for (int k = 0; k < N; k++) {
        double one[N] = {0};
        one[k] = 1;
        test_must(ctx, imp_problem_set_x(p, one));
        for (int c = 0; c < 3; c++) {
            struct imp_run run = IMP_RUN_INIT;
            imp_film *film;
            run.sensor = c;
            run.spp = 2048;
            run.seed = 77;
            test_must(ctx, imp_render(s, &run, &film));
            for (int i = 0; i < 108; i++)
                q->J[108 * c + i][k] = (double)imp_film_mean(film)[i];
            imp_film_destroy(film);
        }
    }
    imp_problem_destroy(p);
    for (int k = 0; k < N; k++)
        for (int l = 0; l < N; l++)
            for (int i = 0; i < CELLS; i++)
                A[k * N + l] += q->J[i][k] * q->J[i][l] / (NOISE * NOISE);
    for (int k = 0; k + 1 < N; k++) {
        A[k * N + k] += 1 / (STEP * STEP);
        A[(k + 1) * N + k + 1] += 1 / (STEP * STEP);
        A[k * N + k + 1] -= 1 / (STEP * STEP);
        A[(k + 1) * N + k] -= 1 / (STEP * STEP);
    }
    tap_ok(imp__cholesky(N, A), "the posterior is a normal distribution");
    imp__cholesky_inverse(N, A, q->C[0]);
    for (int k = 0; k < N; k++) q->se[k] = sqrt(q->C[k][k]);
}

static void posterior_mean(const struct posterior *q, const double *seen, double *mean)
{
    double b[N] = {0};
    for (int i = 0; i < CELLS; i++)
        for (int k = 0; k < N; k++) b[k] += q->J[i][k] * seen[i] / (NOISE * NOISE);
    for (int k = 0; k < N; k++) {
        mean[k] = 0;
        for (int l = 0; l < N; l++) mean[k] += q->C[k][l] * b[l];
    }
}

/* Variances over fits of what exact intervals would give: the mean of z^2 over the numbers
 * of a fit, and the share of 95 % intervals that hold the truth. Both depend on the
 * correlations r of the numbers, by Mehler's series:
 *
 *     cov(z_i^2, z_j^2) = 2 r^2,     cov(|z_i| < c, |z_j| < c) = sum_m r^m a_m^2 / m!,
 *
 * over even m >= 2, a_m = -2 He_m-1(c) phi(c). h: He_m/sqrt(m!), so that a_m/sqrt(m!) =
 * -2 phi(c) h_m-1/sqrt(m). */
static void spread_find(const struct posterior *q, double *z2, double *inside)
{
    const double phi = exp(-Z95 * Z95 / 2) / sqrt(IMP_2PI);
    *z2 = *inside = 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const double r = q->C[i][j] / (q->se[i] * q->se[j]);
            double h[2] = {1, Z95}, sum = 0; /* h_0, h_1 */
            for (int m = 2; m < 400; m++) {
                if (m % 2 == 0) sum += pow(r, m) * 4 * phi * phi * h[1] * h[1] / m;
                const double next = (Z95 * h[1] - sqrt(m - 1.0) * h[0]) / sqrt(m);
                h[0] = h[1];
                h[1] = next;
            }
            *z2 += 2 * r * r / (N * N);
            *inside += (i == j ? .95 * .05 : sum) / (N * N);
        }
}

/* J = 1/2 sum (I - T)^2 + 1/2 w sum (x_k+1 - x_k)^2 over NOISE^2 is the negative logarithm
 * of the posterior density of a random walk with steps of STEP if w = (NOISE/STEP)^2. Over
 * spectra that are drawn from this prior, 95 % of the intervals must hold the truth; the
 * level of a spectrum, which the prior leaves open, changes nothing. */
static void coverage(int fits)
{
    static struct posterior exact;
    double start[N], flat[N], z2_var, inside_var;
    for (int k = 0; k < N; k++) start[k] = flat[k] = 0.5;
    imp_scene *s = scene_make(flat);
    struct tap_stat z2 = {0}, inside = {0}, z2_exact = {0}, width = {0}, apart = {0};
    int open = 0, determined = 0;
    posterior_find(s, &exact);
    spread_find(&exact, &z2_var, &inside_var);
    for (int f = 0; f < fits; f++) {
        double truth[N], seen[CELLS], ideal[N], mean = 0;
        float noisy[3][6 * 6 * 3], se[3][6 * 6 * 3];
        imp_problem *p;
        for (int k = 0; k < N; k++) {
            truth[k] =
                k ? truth[k - 1] + STEP * normal(SEED + (uint64_t)f, (uint32_t)k) : 0;
            mean += truth[k] / N;
        }
        for (int k = 0; k < N; k++) truth[k] += 0.5 - mean; /* far from the bounds */
        test_must(ctx, imp_problem_create(s, &p));
        test_must(ctx, imp_problem_activate(p, "paint.reflectance.values"));
        test_must(ctx, imp_problem_set_x(p, truth));
        for (int c = 0; c < 3; c++) {
            struct imp_run run = IMP_RUN_INIT;
            struct imp_target t = IMP_TARGET_INIT;
            imp_film *film;
            run.sensor = c;
            run.spp = 1024;
            run.seed = 5000 + (uint64_t)(3 * f + c);
            test_must(ctx, imp_render(s, &run, &film));
            for (int i = 0; i < 6 * 6 * 3; i++) {
                noisy[c][i] = imp_film_mean(film)[i] +
                              (float)(NOISE * normal(2 * SEED + (uint64_t)f,
                                                     (uint32_t)(108 * c + i)));
                se[c][i] = (float)hypot(NOISE, imp_film_se(film)[i]);
                seen[108 * c + i] = (double)noisy[c][i];
            }
            imp_film_destroy(film);
            t.sensor = c;
            t.width = t.height = 6;
            t.channels = 3;
            t.pixels = noisy[c];
            t.noise_se = se[c];
            test_must(ctx, imp_problem_add_target(p, &t));
        }
        const double w = NOISE * NOISE / (STEP * STEP);
        const struct imp_fit_result *r = fit(p, w, start, 512, 100000 + (uint64_t)f);
        double held = 0, square = 0, square_exact = 0;
        posterior_mean(&exact, seen, ideal);
        for (int k = 0; k < N; k++) {
            const struct imp_fit_variable *v = &r->variables[k];
            open += !isfinite(v->se);
            determined += v->determined;
            held += (v->lo95 <= truth[k] && truth[k] <= v->hi95) / (double)N;
            square += imp__sqr((v->value - truth[k]) / v->se) / N;
            square_exact += imp__sqr((ideal[k] - truth[k]) / exact.se[k]) / N;
            tap_add(&width, v->se / exact.se[k]);
            tap_add(&apart, imp__sqr((v->value - ideal[k]) / exact.se[k]));
        }
        tap_add(&inside, held);
        tap_add(&z2, square);
        tap_add(&z2_exact, square_exact);
        imp_problem_destroy(p);
    }
    printf("# %d of %d numbers determined by the pictures\n", determined, fits * N);
    tap_ok(open == 0, "a smooth prior gives each number an interval");
    /* Its own noise, of walks that are its own in each fit, and that of the pictures'
     * 1024 walks a pixel come on top. */
    tap_ok(width.mean > .995 && width.mean < 1.02,
           "standard error over that of the closed form # %.4f", width.mean);
    tap_ok(apart.mean < .03, "mean square distance from its mean, of a variance # %.4f",
           apart.mean);
    tap_ok(fabs(inside.mean - .95) < 3.5 * sqrt(inside_var / fits),
           "95 %% intervals # hold the truth in %.2f %%, 95 +- %.2f", 100 * inside.mean,
           100 * sqrt(inside_var / fits));
    tap_ok(fabs(z2.mean - 1) < 3.5 * sqrt(z2_var / fits),
           "mean z^2 # %.3f, 1 +- %.3f (closed form, same draws: %.3f)", z2.mean,
           sqrt(z2_var / fits), z2_exact.mean);
    imp_scene_destroy(s);
}

/* What the answer x leaves of the targets, by walks that are many: the loss of an answer by
 * the 512 samples of its fit has a standard error of .0025, which is .09 of the targets. */
static double left_over(imp_problem *p, imp_film *const *seen, const double *x)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate J;
    double square = 0;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < 108; i++) square += pow(imp_film_mean(seen[c])[i], 2);
    run.spp = 32768;
    run.seed = 99;
    test_must(ctx, imp_problem_objective(p, x, &run, &J, NULL, NULL));
    return sqrt(2 * fmax(J.value, 0) / square);
}

int main(int argc, char **argv)
{
    ctx = test_context(0);
    const int many = argc > 1 && !strcmp(argv[1], "long");
    coverage(many ? 1000 : 12);
    double start[N];
    for (int k = 0; k < N; k++) start[k] = 0.5;
    imp_scene *truth = scene_make(macbeth[PATCH].rho), *s = scene_make(start);
    imp_film *seen[3];
    for (int c = 0; c < 3; c++) {
        struct imp_run run = IMP_RUN_INIT;
        run.sensor = c;
        run.spp = 4096;
        run.seed = 42;
        test_must(ctx, imp_render(truth, &run, &seen[c]));
    }
    for (int prior = 0; prior < 2; prior++) {
        imp_problem *p;
        test_must(ctx, imp_problem_create(s, &p));
        for (int c = 0; c < 3; c++) {
            struct imp_target t = IMP_TARGET_INIT;
            t.sensor = c;
            t.width = t.height = 6;
            t.channels = 3;
            t.pixels = imp_film_mean(seen[c]);
            t.noise_se = imp_film_se(seen[c]);
            test_must(ctx, imp_problem_add_target(p, &t));
        }
        const struct imp_fit_result *r = fit(p, prior ? 0.03 : 0, start, 512, 5);
        int open = 0;
        double rms = 0, x[N];
        for (int k = 0; k < N; k++) {
            const struct imp_fit_variable *v = &r->variables[k];
            const double error = v->value - macbeth[PATCH].rho[k];
            x[k] = v->value;
            open += !v->determined;
            if (k >= 5 && k <= 29) rms += error * error / 25; /* 430 to 670 nm */
        }
        rms = sqrt(rms);
        printf(
            "# %d iterations, %s; residual %.4f; %d not determined; rms error %.3f; %s\n",
            r->iterations, r->reason, r->residual, open, rms,
            r->warning ? r->warning : "no warning");
        const double left = left_over(p, seen, x);
        if (!prior) tap_ok(left < 0.06, "the pictures agree # %.4f", left);
        if (!prior)
            tap_ok(open > 0 && r->warning,
                   "and the fit says what they do not determine # %d of 36", open);
        else tap_ok(rms < 0.05, "a smooth prior gives the spectrum # rms %.3f", rms);
        imp_problem_destroy(p);
    }
    for (int c = 0; c < 3; c++) imp_film_destroy(seen[c]);
    imp_scene_destroy(truth);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return tap_done();
}

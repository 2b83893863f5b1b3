/* SPDX-License-Identifier: Apache-2.0
 *
 * A reflectance spectrum of 36 samples from three pictures of one paint, under daylight,
 * tungsten and a fluorescent lamp: nine numbers, so most of the spectrum is not determined
 * by them. The fit says so, what the lamps see agrees, and with a smooth prior the spectrum
 * itself comes back. Its intervals are those of the posterior: of spectra drawn from the
 * prior itself, 95 % or a few more lie in them (200 fits as "long"). */
#include "imp_scene.h"
#include "imp_tap.h"
#include "macbeth.h"
#include "math/rng.h"
#include "math/vec.h"
#include <math.h>

#define PATCH 1 /* light skin */
#define N     36

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
                                        const double *start, int spp)
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
    run.seed = 5;
    test_must(ctx, imp_fit(p, &o, &run, &r));
    return r;
}

/* ---- Intervals ------------------------------------------------------------------------- */

#define NOISE 0.05 /* of a channel of a pixel */
#define STEP  0.02 /* standard deviation of the difference of neighbours of a spectrum */

static double normal(uint64_t seed, uint32_t k)
{
    const struct imp_key key = imp__key(seed, 7, 0);
    return sqrt(-2 * log(1 - imp__u01(key, 2 * k))) *
           cos(IMP_2PI * imp__u01(key, 2 * k + 1));
}

/* J = 1/2 sum (I - T)^2 + 1/2 w sum (x_k+1 - x_k)^2 over NOISE^2 is the negative logarithm
 * of the posterior density of a random walk with steps of STEP if w = (NOISE/STEP)^2. */
static void coverage(int fits)
{
    double start[N], flat[N];
    for (int k = 0; k < N; k++) start[k] = flat[k] = 0.5;
    imp_scene *s = scene_make(flat);
    struct tap_stat z2 = {0}, inside = {0}, spread = {0};
    int open = 0, determined = 0;
    for (int f = 0; f < fits; f++) {
        double truth[N], mean = 0;
        float noisy[3][6 * 6 * 3], se[3][6 * 6 * 3];
        imp_problem *p;
        for (int k = 0; k < N; k++) {
            truth[k] =
                (k ? truth[k - 1] : 0) + STEP * normal(100 + (uint64_t)f, (uint32_t)k);
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
                noisy[c][i] =
                    imp_film_mean(film)[i] +
                    (float)(NOISE * normal(9000 + (uint64_t)f, (uint32_t)(108 * c + i)));
                se[c][i] = (float)hypot(NOISE, imp_film_se(film)[i]);
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
        const struct imp_fit_result *r = fit(p, w, start, 256);
        double held = 0, square = 0;
        for (int k = 0; k < N; k++) {
            const struct imp_fit_variable *v = &r->variables[k];
            const double error = v->value - truth[k];
            open += !isfinite(v->se);
            determined += v->determined;
            held += (v->lo95 <= truth[k] && truth[k] <= v->hi95) / (double)N;
            square += error * error / (v->se * v->se) / N;
            tap_add(&spread, v->se);
        }
        tap_add(&inside, held); /* the numbers of one fit depend on each other */
        tap_add(&z2, square);
        imp_problem_destroy(p);
    }
    printf("# %d of %d numbers determined by the pictures; mean se %.4f\n", determined,
           fits * N, spread.mean);
    tap_ok(open == 0, "a smooth prior gives each number an interval");
    /* Measured with 200: 96.7 +- .4 %, .89 +- .03: a bit too wide, for a reason that is not
     * known. Too narrow fails. */
    tap_ok(inside.mean > .95 - 3.5 * tap_se(&inside) &&
               inside.mean < .975 + 3.5 * tap_se(&inside),
           "95 %% intervals # hold the truth in %.2f %% +- %.2f", 100 * inside.mean,
           100 * tap_se(&inside));
    tap_ok(z2.mean > .85 - 3.5 * tap_se(&z2) && z2.mean < 1 + 3.5 * tap_se(&z2),
           "mean z^2 # %.3f +- %.3f", z2.mean, tap_se(&z2));
    imp_scene_destroy(s);
}

int main(int argc, char **argv)
{
    ctx = test_context(0);
    const int many = argc > 1 && !strcmp(argv[1], "long");
    coverage(many ? 200 : 12);
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
        const struct imp_fit_result *r = fit(p, prior ? 0.03 : 0, start, 512);
        int open = 0;
        double rms = 0;
        for (int k = 0; k < N; k++) {
            const struct imp_fit_variable *v = &r->variables[k];
            const double error = v->value - macbeth[PATCH].rho[k];
            open += !v->determined;
            if (k >= 5 && k <= 29) rms += error * error / 25; /* 430 to 670 nm */
        }
        rms = sqrt(rms);
        printf(
            "# %d iterations, %s; residual %.4f; %d not determined; rms error %.3f; %s\n",
            r->iterations, r->reason, r->residual, open, rms,
            r->warning ? r->warning : "no warning");
        if (!prior) tap_ok(r->residual < 0.06, "the pictures agree # %.4f", r->residual);
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

/* SPDX-License-Identifier: Apache-2.0
 *
 * The z-test of pictures, on pictures whose noise is known: it passes what has the same
 * expectation as often as it says, and catches a bias of 1 %. */
#include "base/film.h"
#include "color/rgb.h"
#include "imp_tap.h"
#include "math/rng.h"

enum { SIDE = 64, N = 256 };
static imp_context *ctx;

static double gauss(uint64_t seed, uint64_t i)
{
    const struct imp_key key = imp__key(seed, i, 5);
    return sqrt(-2 * log(1 - imp__u01(key, 0))) *
           cos(6.283185307179586 * imp__u01(key, 1));
}
static double truth(int i) { return 0.2 + 0.1 * sin(0.37 * i); }
static double spread(int i) { return 0.5 * truth(i); } /* of one sample */

/* Mean of `n` samples of every pixel; n 0: exact. */
static imp_film *picture(uint64_t seed, double n, double factor, bool with_se)
{
    imp_film *f = NULL;
    if (imp__film_create(ctx, SIDE, SIDE, "R,G,B", with_se, &f) != IMP_OK) return NULL;
    f->spp = (int64_t)n;
    for (int i = 0; i < SIDE * SIDE * 3; i++) {
        const double se = n > 0 ? spread(i) / sqrt(n) : 0;
        f->mean[i] = (float)(factor * truth(i) + se * gauss(seed, (uint64_t)i));
        if (with_se) f->se[i] = (float)se;
    }
    return f;
}

int main(void)
{
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 1;
    imp_film *variance = picture(0, 0, 1, false);
    for (int i = 0; i < SIDE * SIDE * 3; i++)
        variance->mean[i] = (float)(spread(i) * spread(i));
    struct imp_compare_options o = IMP_COMPARE_OPTIONS_INIT;
    struct imp_compare_result r = {.size = sizeof r};
    struct tap_stat over2 = {0};
    int agreed[3] = {0}, caught[3] = {0};
    enum { SEEDS = 100 };

    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        imp_film *a = picture(2 * seed + 1, N, 1, true),
                 *b = picture(2 * seed + 2, 4 * N, 1, true);
        imp_film *biased = picture(2 * seed + 1, N, 1.01, true);
        imp_film *exact = picture(0, 0, 1, false);
        /* 1: both pictures' own errors; 2: variance picture; 3: exact reference */
        for (int k = 0; k < 3; k++) {
            o = (struct imp_compare_options)IMP_COMPARE_OPTIONS_INIT;
            if (k > 0) {
                o.variance = variance;
                o.n_test = N;
                o.n_reference = k == 1 ? 4 * N : 0;
            }
            imp_film *reference = k == 2 ? exact : b;
            if (imp_compare(ctx, a, reference, &o, &r) == IMP_OK) agreed[k] += r.agree;
            tap_add(&over2, r.over2);
            if (imp_compare(ctx, biased, reference, &o, &r) == IMP_OK)
                caught[k] += !r.agree;
        }
        imp_film_destroy(a);
        imp_film_destroy(b);
        imp_film_destroy(biased);
        imp_film_destroy(exact);
    }
    /* A variance of X, Y, Z kept as a colour: independent noise of each. */
    imp_film *white = NULL, *noisy = NULL, *xyz_variance = NULL;
    if (imp_film_create(ctx, SIDE, SIDE, "R,G,B", &white) != IMP_OK ||
        imp_film_create(ctx, SIDE, SIDE, "R,G,B", &noisy) != IMP_OK ||
        imp_film_create(ctx, SIDE, SIDE, "R,G,B", &xyz_variance) != IMP_OK)
        return 1;
    for (int i = 0; i < SIDE * SIDE; i++) {
        double n[3], rgb[3], v[3];
        for (int c = 0; c < 3; c++)
            n[c] = 0.1 / sqrt(N) * gauss(77, (uint64_t)(3 * i + c));
        imp__xyz_to_rgb(n, rgb);
        imp__xyz_to_rgb((double[3]){.01, .01, .01}, v);
        for (int c = 0; c < 3; c++) {
            imp_film_mean(white)[3 * i + c] = 0.5f;
            imp_film_mean(noisy)[3 * i + c] = (float)(0.5 + rgb[c]);
            imp_film_mean(xyz_variance)[3 * i + c] = (float)v[c];
        }
    }
    o = (struct imp_compare_options)IMP_COMPARE_OPTIONS_INIT;
    o.variance = xyz_variance;
    o.n_test = N;
    o.xyz = 1;
    enum imp_status st = imp_compare(ctx, noisy, white, &o, &r);
    tap_ok(st == IMP_OK && r.agree &&
               fabs(r.over2 - 0.0455) < 4 * sqrt(0.0455 / (3 * SIDE * SIDE)),
           "a variance of X, Y, Z # |z| > 2: %.4f", r.over2);
    o.xyz = 0;
    st = imp_compare(ctx, noisy, white, &o, &r);
    tap_ok(st == IMP_OK && r.over2 > 0.2, "is not one of R, G, B # |z| > 2: %.4f",
           r.over2);
    imp_film_destroy(white);
    imp_film_destroy(noisy);
    imp_film_destroy(xyz_variance);

    static const char *const how[] = {"by the pictures' errors", "by a variance picture",
                                      "against an exact reference"};
    for (int k = 0; k < 3; k++) {
        tap_ok(agreed[k] >= 98, "same expectation, %s # %d of %d agree", how[k],
               agreed[k], SEEDS);
        tap_ok(caught[k] == SEEDS, "1 %% too bright, %s # %d of %d caught", how[k],
               caught[k], SEEDS);
    }
    tap_z(&over2, 0.04550026, 5e-4, "fraction beyond two standard errors");

    /* Numbers that can be worked out by hand. */
    imp_film *a = NULL, *b = NULL, *c = NULL;
    if (imp_film_create(ctx, 2, 2, "Y", &a) != IMP_OK ||
        imp_film_create(ctx, 2, 2, "Y", &b) != IMP_OK ||
        imp_film_create(ctx, 2, 3, "Y", &c) != IMP_OK)
        return 1;
    const float av[4] = {1, 2, 3, 4}, bv[4] = {1, 2, 3, 6};
    memcpy(imp_film_mean(a), av, sizeof av);
    memcpy(imp_film_mean(b), bv, sizeof bv);
    tap_ok(imp_compare(ctx, a, b, NULL, &r) == IMP_OK && r.rmse == 1 && r.max_abs == 2 &&
               r.mean_a == 2.5 && r.mean_b == 3 && !r.has_z && !r.agree &&
               fabs(r.relative_rmse - sqrt(4 / 50.0)) < 1e-15,
           "rmse, largest error, means");
    tap_ok(imp_compare(ctx, a, a, NULL, &r) == IMP_OK && r.agree && r.rmse == 0,
           "itself");
    imp_film_mean(a)[0] = NAN;
    tap_ok(imp_compare(ctx, a, b, NULL, &r) == IMP_OK && !r.agree && isinf(r.max_abs),
           "NaN in one picture disagrees");
    tap_ok(imp_compare(ctx, c, b, NULL, &r) == IMP_E_ARG, "other size # %s",
           imp_last_error(ctx));
    o = (struct imp_compare_options)IMP_COMPARE_OPTIONS_INIT;
    o.variance = b;
    tap_ok(imp_compare(ctx, b, b, &o, &r) == IMP_E_ARG, "variance without samples # %s",
           imp_last_error(ctx));
    tap_ok(imp_compare(ctx, variance, b, NULL, &r) == IMP_E_ARG, "other channels # %s",
           imp_last_error(ctx));
    imp_film_destroy(a);
    imp_film_destroy(b);
    imp_film_destroy(c);
    imp_film_destroy(variance);
    imp_context_destroy(ctx);
    return tap_done();
}

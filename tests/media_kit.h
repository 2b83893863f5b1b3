/* SPDX-License-Identifier: Apache-2.0
 *
 * What tests of media share: the mean of a picture with its error, compared with truths. */
#ifndef IMP_TEST_MEDIA_KIT_H
#define IMP_TEST_MEDIA_KIT_H

#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>

/* By channels; those that the picture does not have are 0. Returns how many walks were
 * dropped for `cause`. */
static inline uint64_t media_mean_run(imp_context *ctx, imp_scene *s,
                                      const struct imp_run *run, double mean[3],
                                      double se[3], int cause)
{
    struct imp_film_info info = {.size = sizeof info};
    imp_film *film;
    test_must(ctx, imp_render(s, run, &film));
    test_must(ctx, imp_film_get_info(film, &info));
    const int n = info.width * info.height, channels = info.channels;
    for (int c = 0; c < 3; c++) {
        mean[c] = se[c] = 0;
        for (int k = 0; k < n && c < channels; k++) {
            mean[c] += (double)imp_film_mean(film)[k * channels + c] / n;
            se[c] += pow((double)imp_film_se(film)[k * channels + c] / n, 2);
        }
        se[c] = sqrt(se[c]);
    }
    imp_film_destroy(film);
    return info.dropped_by_cause[cause];
}
static inline void media_mean(imp_context *ctx, imp_scene *s, int spp, double mean[3],
                              double se[3])
{
    struct imp_run run = IMP_RUN_INIT;
    run.spp = spp;
    run.seed = 5;
    run.points = IMP_POINTS_INDEPENDENT; /* variances of single samples are known */
    media_mean_run(ctx, s, &run, mean, se, IMP_DROP_NONE);
}

static inline void media_near(double mean, double se, double ref, double tight,
                              const char *what)
{
    const double z = (mean - ref) / se;
    tap_ok(fabs(z) <= 4 && se <= tight, "%s # %.6f se %.1e ref %.6f z %.2f", what, mean,
           se, ref, z);
}

/* Simpson's rule. */
static inline double media_integral(double (*f)(double x, const void *with),
                                    const void *with, double a, double b, int n)
{
    double sum = f(a, with) + f(b, with);
    for (int i = 1; i < 2 * n; i++)
        sum += (i % 2 ? 4 : 2) * f(a + (b - a) * i / (2 * n), with);
    return sum * (b - a) / (6 * n);
}

/* A scene in one colour is refused, for a reason that says `why`. */
static inline void media_refused(imp_context *ctx, const char *text, const char *why)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    imp_scene *s;
    o.mode = IMP_MONO;
    const enum imp_status st =
        imp_scene_load_string(ctx, text, strlen(text), "test", &o, &s);
    tap_ok(st != IMP_OK && strstr(imp_last_error(ctx), why), "refused: %s # %s", why,
           imp_last_error(ctx));
    if (st == IMP_OK) imp_scene_destroy(s);
}

#endif

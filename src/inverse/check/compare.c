/* SPDX-License-Identifier: Apache-2.0
 *
 * Test of whether two pictures have the same expectation: a z-test of every pixel and
 * channel, with Sidak's level so that the picture as a whole fails by chance once in a
 * hundred, and one of every channel's mean, which sees a bias far below a pixel's noise
 * (docs/scene-format.md 14). Pixels must be independent: compare pictures made with box
 * filters. */
#include "base/arguments.h"
#include "base/film.h"
#include "color/rgb.h"
#include "math/stat.h"
#include <math.h>
#include <string.h>

#define LEVEL           0.01   /* of the whole picture */
#define PIXELS_MAX_FAIL 0.0025 /* pixels beyond the level: fireflies are not normal */
#define MEAN_Z_MAX      4
#define OVER2_MAX       0.1 /* 0.0455 by chance; used if the variance is a reference's */
/* One sigma of the relative systematic difference between pictures of equal scenes:
 * Mitsuba's white has moved by 3e-4 between versions with its colour tables. */
#define MEAN_SYSTEMATIC 1e-4
#define WITHOUT_Z       1e-3 /* relative rmse allowed where noise is unknown */

struct pair {
    const imp_film *test, *reference;
    const struct imp_compare_options *options;
    int *of_test,
        *of_variance; /* [reference->channels] the channels with the same name */
    size_t pixels;
};

struct sums {
    double square, reference_square, max_abs, a, b, n;
    double fail, over2, n_z, mean_z;
    bool broken; /* not finite in one picture only */
};

/* Channel of `film` to set beside channel c of the reference: by name, else by place. */
static int partner(const imp_film *film, const imp_film *reference, int c)
{
    const int by_name = imp__film_find(film, reference->names[c]);
    if (by_name >= 0) return by_name;
    return film->channels == reference->channels ? c : -1;
}

static enum imp_status match(imp_context *ctx, const imp_film *film,
                             const imp_film *reference, const char *what, int *of)
{
    if (film->width != reference->width || film->height != reference->height)
        return imp__error(ctx, IMP_E_ARG, "the %s is %d x %d, the reference %d x %d",
                          what, film->width, film->height, reference->width,
                          reference->height);
    for (int c = 0; c < reference->channels; c++)
        if ((of[c] = partner(film, reference, c)) < 0)
            return imp__error(ctx, IMP_E_ARG, "the %s has no channel '%s'", what,
                              reference->names[c]);
    return IMP_OK;
}

/* Degrees of freedom of a picture's errors; those from samples one by one have many. */
static double freedom_of(const imp_film *film)
{
    return film->sets > 1 ? (double)(film->sets - 1) : INFINITY;
}

/* Variance of test - reference in value i of channel c, from the variances that are
 * known; < 0: none is. `floor`: the least variance of one sample. *freedom: its degrees of
 * freedom (Welch 1947). */
static double variance_at(const struct pair *p, size_t pixel, int c, double floor,
                          double *freedom)
{
    *freedom = INFINITY;
    const struct imp_compare_options *o = p->options;
    const size_t r = pixel * (size_t)p->reference->channels + (size_t)c;
    const size_t t = pixel * (size_t)p->test->channels + (size_t)p->of_test[c];
    if (o->variance) {
        const size_t v =
            pixel * (size_t)o->variance->channels + (size_t)p->of_variance[c];
        const double one = fmax(o->variance->mean[v], floor);
        return one / o->n_test + (o->n_reference > 0 ? one / o->n_reference : 0);
    }
    if (!p->test->se && !p->reference->se) return -1;
    const double n = fmax(o->n_test > 0 ? o->n_test : (double)p->test->spp, 1);
    double a = 0, b = 0;
    if (p->test->se) a = (double)p->test->se[t] * p->test->se[t];
    if (p->reference->se) b = (double)p->reference->se[r] * p->reference->se[r];
    if (a + b >= floor / n && a + b > 0)
        *freedom = (a + b) * (a + b) /
                   (a * a / freedom_of(p->test) + b * b / freedom_of(p->reference));
    return fmax(a + b, floor / n);
}

static void channel(const struct pair *p, int c, double level, struct sums *s)
{
    double a = 0, b = 0, n = 0, var = 0;
    bool has_z = true;
    for (size_t i = 0; i < p->pixels; i++) {
        const double r =
            p->reference->mean[i * (size_t)p->reference->channels + (size_t)c];
        if (isfinite(r)) b += r, n++;
    }
    const double mean = n > 0 ? b / n : 0;
    const double floor = p->options->floor > 0 ? p->options->floor : 1e-4 * mean * mean;
    b = n = 0;
    for (size_t i = 0; i < p->pixels; i++) {
        const double t =
            p->test->mean[i * (size_t)p->test->channels + (size_t)p->of_test[c]];
        const double r =
            p->reference->mean[i * (size_t)p->reference->channels + (size_t)c];
        if (!isfinite(t) || !isfinite(r)) {
            s->broken |= isfinite(t) != isfinite(r) || (isinf(t) && t != r);
            continue;
        }
        double freedom;
        const double d = t - r, v = variance_at(p, i, c, floor, &freedom);
        a += t, b += r, n++;
        s->square += d * d;
        s->reference_square += r * r;
        s->max_abs = fmax(s->max_abs, fabs(d));
        has_z &= v >= 0;
        if (v < 0 || (v == 0 && d == 0)) continue;
        const double z = imp__normal_of_student(fabs(d) / sqrt(v), freedom);
        s->n_z++;
        s->fail += !(erfc(z / sqrt(2)) > level);
        s->over2 += z > 2;
        var += v;
    }
    s->a += a;
    s->b += b;
    s->n += n;
    var += MEAN_SYSTEMATIC * MEAN_SYSTEMATIC * b * b;
    if (has_z && n > 0 && a != b)
        s->mean_z = fmax(s->mean_z, var > 0 ? fabs(a - b) / sqrt(var) : INFINITY);
}

static enum imp_status options_check(imp_context *ctx,
                                     const struct imp_compare_options *o)
{
    if (!(o->n_test >= 0) || !(o->n_reference >= 0) || !(o->floor >= 0) ||
        !isfinite(o->n_test + o->n_reference + o->floor))
        return imp__error(ctx, IMP_E_ARG,
                          "n_test %g, n_reference %g and floor %g must be >= 0",
                          o->n_test, o->n_reference, o->floor);
    if (o->variance && !(o->n_test > 0))
        return imp__error(ctx, IMP_E_ARG,
                          "a variance picture needs the test's samples per pixel");
    if (o->xyz && !o->variance)
        return imp__error(ctx, IMP_E_ARG, "xyz needs a variance picture");
    return IMP_OK;
}

/* X, Y, Z of R, G, B; Y alone is all three, as `moment` has it in mono mode. */
static enum imp_status xyz_make(imp_context *ctx, const imp_film *from, const char *what,
                                imp_film **out)
{
    const int r = imp__film_find(from, "R"), g = imp__film_find(from, "G"),
              b = imp__film_find(from, "B"), y = imp__film_find(from, "Y");
    const bool rgb = r >= 0 && g >= 0 && b >= 0;
    if (!rgb && y < 0)
        return imp__error(ctx, IMP_E_ARG, "the %s has neither R, G, B nor Y", what);
    const enum imp_status st =
        imp_film_create(ctx, from->width, from->height, "X,Y,Z", out);
    if (st != IMP_OK) return st;
    (*out)->spp = from->spp;
    for (size_t i = 0; i < (size_t)from->width * (size_t)from->height; i++) {
        const float *pixel = from->mean + i * (size_t)from->channels;
        double xyz[3];
        if (rgb) imp__rgb_to_xyz((double[3]){pixel[r], pixel[g], pixel[b]}, xyz);
        else xyz[0] = xyz[1] = xyz[2] = pixel[y];
        for (int c = 0; c < 3; c++) (*out)->mean[3 * i + (size_t)c] = (float)xyz[c];
    }
    return IMP_OK;
}

enum imp_status imp_compare(imp_context *ctx, const imp_film *test,
                            const imp_film *reference,
                            const struct imp_compare_options *options,
                            struct imp_compare_result *result)
{
    enum imp_status st = IMP_OK;
    struct imp_compare_options own = IMP_COMPARE_OPTIONS_INIT;
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, test, "test");
    IMP_REQUIRE(ctx, reference, "reference");
    IMP_REQUIRE(ctx, result, "result");
    IMP_OPTIONS(ctx, own, options, "options");
    IMP_SIZED(ctx, result, "result");
    IMP_FLOAT_MODE;
    struct pair p = {.test = test, .reference = reference, .options = &own};
    struct sums s = {0};
    imp_film *xyz[3] = {NULL, NULL, NULL};

    if (own.variance && own.n_test == 0) own.n_test = (double)test->spp;
    IMP_TRY(options_check(ctx, &own));
    if (own.xyz) {
        IMP_TRY(xyz_make(ctx, test, "test", &xyz[0]));
        IMP_TRY(xyz_make(ctx, reference, "reference", &xyz[1]));
        IMP_TRY(xyz_make(ctx, own.variance, "variance", &xyz[2]));
        p.test = test = xyz[0];
        p.reference = reference = xyz[1];
        own.variance = xyz[2];
    }
    const size_t channels = (size_t)reference->channels;
    p.pixels = (size_t)reference->width * (size_t)reference->height;
    p.of_test = imp__alloc(ctx, 2 * channels, sizeof *p.of_test);
    if (!p.of_test)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory to compare pictures"));
    p.of_variance = p.of_test + channels;
    IMP_TRY(match(ctx, test, reference, "test", p.of_test));
    if (own.variance)
        IMP_TRY(match(ctx, own.variance, reference, "variance", p.of_variance));

    const double level = imp__sidak(LEVEL, (double)p.pixels);
    for (int c = 0; c < reference->channels; c++) channel(&p, c, level, &s);
    const double n = fmax(s.n, 1), n_z = fmax(s.n_z, 1);
    struct imp_compare_result r = {
        .size = sizeof r,
        .rmse = sqrt(s.square / n),
        .relative_rmse = s.square > 0 ? sqrt(s.square / s.reference_square) : 0,
        .max_abs = s.broken ? INFINITY : s.max_abs,
        .mean_a = s.a / n,
        .mean_b = s.b / n,
        .p_fail_fraction = s.fail / n_z,
        .mean_z = s.mean_z,
        .over2 = s.over2 / n_z,
        .has_z = own.variance || test->se || reference->se,
        .agree = !s.broken && s.n > 0};
    if (r.has_z)
        r.agree &= r.p_fail_fraction <= PIXELS_MAX_FAIL && r.mean_z < MEAN_Z_MAX &&
                   (!own.variance || r.over2 <= OVER2_MAX);
    else r.agree &= r.relative_rmse <= WITHOUT_Z;
    IMP_TRY(imp__info_give(ctx, __func__, "result", result, &r, sizeof r));
out:
    imp__release(ctx, p.of_test);
    for (int k = 0; k < 3; k++) imp_film_destroy(xyz[k]);
    return st;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Standard errors of numbers made of a picture against the spread over seeds: the mean, a
 * sum with a random adjoint image, and the table of derivative pictures. Through filters
 * wider than a pixel neighbours share samples; errors added as if pixels were independent
 * are 1.3 (tent) to 1.9 (Gaussian) times too small.
 *
 * A standard deviation over SEEDS = 128 runs is known to 1/sqrt(2 128) = 6 %; the limits
 * 0.8 and 1.25 are 3.2 and 4 of that away from 1. The seeds are 1000 .. 1127, the first
 * that were tried. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"

enum { RES = 12, SEEDS = 128, N_MAX = 16 };

static imp_context *ctx;

/* A lamp whose edge runs through the picture, in front of a coloured wall. */
static imp_scene *scene_of(const char *filter, enum imp_color_mode mode)
{
    char xml[2048];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'/><sensor type='perspective'>"
             "<float name='fov' value='40'/><transform name='to_world'><lookat "
             "origin='0,0,4' target='0,0,0' up='0,1,0'/></transform>"
             "<film type='hdrfilm'><integer name='width' value='%d'/><integer "
             "name='height' value='%d'/>%s</film></sensor>"
             "<shape type='rectangle'><transform name='to_world'><scale value='3'/>"
             "<translate z='-1'/></transform><bsdf type='diffuse' id='wall'><rgb "
             "name='reflectance' value='.2,.5,.8'/></bsdf></shape>"
             "<shape type='rectangle'><transform name='to_world'><scale value='.5'/>"
             "<rotate z='1' angle='20'/></transform><emitter type='area' id='lamp'><rgb "
             "name='radiance' value='8,4,2'/></emitter></shape>"
             "<emitter type='constant' id='sky'><rgb name='radiance' "
             "value='.2'/></emitter></scene>",
             RES, RES, filter);
    return test_scene_text(ctx, xml, mode);
}

struct spread {
    struct tap_stat value;
    double variance; /* mean of the reported se^2 */
};

static void spread_add(struct spread *s, struct imp_estimate e)
{
    tap_add(&s->value, e.value);
    s->variance += e.se * e.se / SEEDS;
}

static double ratio(const struct spread *s)
{
    return sqrt(s->value.m2 / (s->value.n - 1) / s->variance);
}

static void ratio_ok(const struct spread *s, const char *filter, int spp,
                     const char *what, int k)
{
    const double r = ratio(s);
    tap_ok(r > 0.8 && r < 1.25, "%s, %d spp: %s %d # spread/reported %.3f", filter, spp,
           what, k, r);
}

/* What adding pixels' errors as if they were independent gives, for comparison. */
static double naive_variance(imp_film *film, const float *adjoint, int channels)
{
    double sum = 0;
    for (int p = 0; p < RES * RES; p++) {
        double e = 0;
        for (int c = 0; c < channels; c++)
            e += fabs(adjoint[p * channels + c] * imp_film_se(film)[p * channels + c]);
        sum += e * e;
    }
    return sum;
}

static void errors(const char *filter, enum imp_color_mode mode, int spp)
{
    imp_scene *scene = scene_of(filter, mode);
    imp_problem *p = test_problem(ctx, scene, "*");
    const size_t n = imp_problem_n_variables(p);
    const int channels = mode == IMP_RGB ? 3 : 1, n_groups = (int)n / channels;
    static float adjoint[RES * RES * 3], flat[RES * RES * 3];
    static struct spread mean, given, table[N_MAX + 1];
    int group[N_MAX];
    double naive = 0;
    if (n > N_MAX) return;
    for (size_t k = 0; k < n; k++) group[k] = (int)k / channels;
    for (int i = 0; i < RES * RES * channels; i++) {
        adjoint[i] = (float)(2 * imp__u01(imp__key(77, (uint64_t)i, 0), 0) - 1);
        flat[i] = (float)(1. / (RES * RES * channels));
    }
    mean = given = (struct spread){0};
    memset(table, 0, sizeof table);
    for (int k = 0; k < SEEDS; k++) {
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate e, sums[N_MAX];
        imp_film *primal = NULL, *films[N_MAX];
        run.spp = spp;
        run.seed = 1000 + (uint64_t)k;
        test_must(ctx, imp_problem_functional(p, NULL, &run, &e, NULL, NULL));
        spread_add(&mean, e);
        test_must(ctx, imp_problem_functional(p, adjoint, &run, &e, NULL, NULL));
        spread_add(&given, e);
        test_must(ctx, imp_problem_jacobian(p, &run, &primal, films));
        test_must(ctx, imp_problem_jacobian_sums(p, NULL, &run, primal, films, group,
                                                 n_groups, &e, sums));
        spread_add(&table[n_groups], e);
        for (int g = 0; g < n_groups; g++) spread_add(&table[g], sums[g]);
        naive += naive_variance(primal, flat, channels) / SEEDS;
        for (size_t i = 0; i < n; i++) imp_film_destroy(films[i]);
        imp_film_destroy(primal);
    }
    printf("# errors added as if independent: spread/reported %.2f\n",
           sqrt(mean.value.m2 / (SEEDS - 1) / naive));
    ratio_ok(&mean, filter, spp, "mean", channels);
    ratio_ok(&given, filter, spp, "random adjoint", channels);
    ratio_ok(&table[n_groups], filter, spp, "table, picture", channels);
    for (int g = 0; g < n_groups; g++) ratio_ok(&table[g], filter, spp, "table", g);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* Values are those of the picture, gradients those of imp_problem_reverse. */
static void values(const char *filter)
{
    imp_scene *scene = scene_of(filter, IMP_RGB);
    imp_problem *p = test_problem(ctx, scene, "*");
    const size_t n = imp_problem_n_variables(p);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate e, sums[N_MAX], one;
    imp_film *primal = NULL, *films[N_MAX];
    static float adjoint[RES * RES * 3];
    double g[N_MAX], se[N_MAX], g2[N_MAX], se2[N_MAX], sum = 0, d = 0;
    for (int i = 0; i < RES * RES * 3; i++)
        adjoint[i] = (float)(2 * imp__u01(imp__key(78, (uint64_t)i, 0), 0) - 1);
    run.spp = 8;
    test_must(ctx, imp_problem_functional(p, adjoint, &run, &e, g, se));
    test_must(ctx, imp_problem_reverse(p, adjoint, &run, g2, se2));
    test_must(ctx, imp_problem_jacobian(p, &run, &primal, films));
    for (int i = 0; i < RES * RES * 3; i++) {
        sum += (double)adjoint[i] * imp_film_mean(primal)[i];
        d += (double)adjoint[i] * imp_film_mean(films[1])[i];
    }
    test_must(ctx, imp_problem_jacobian_sums(p, adjoint, &run, primal, films, NULL, 0,
                                             &one, sums));
    tap_ok(e.value == sum && e.bias_order == 0 && one.value == sum && sums[1].value == d,
           "%s: sums of pictures # %.9g", filter, e.value);
    tap_ok(fabs(one.se / e.se - 1) < 1e-6, "one error in both # %.3g %.3g", one.se, e.se);
    tap_ok(!memcmp(g, g2, n * sizeof *g) && !memcmp(se, se2, n * sizeof *se),
           "gradients of imp_problem_reverse");
    run.spp = 1;
    test_must(ctx, imp_problem_functional(p, NULL, &run, &e, NULL, NULL));
    tap_ok(isfinite(e.se) && e.se > 0, "one sample has an error too # %.3g", e.se);
    enum imp_status st = imp_problem_functional(p, NULL, &run, NULL, NULL, NULL);
    tap_ok(st == IMP_E_ARG, "nothing asked for # %s", imp_last_error(ctx));
    st = imp_problem_jacobian_sums(p, NULL, &run, NULL, films, NULL, 0, NULL, sums);
    tap_ok(st == IMP_E_ARG, "no picture # %s", imp_last_error(ctx));
    const int bad[N_MAX] = {3};
    st = imp_problem_jacobian_sums(p, NULL, &run, primal, films, bad, 2, NULL, sums);
    tap_ok(st == IMP_E_ARG, "group out of range # %s", imp_last_error(ctx));
    double ones[N_MAX], flat[N_MAX];
    const float n_values = RES * RES * 3;
    for (int i = 0; i < RES * RES * 3; i++) adjoint[i] = 1;
    test_must(ctx, imp_problem_functional(p, NULL, &run, &e, flat, NULL));
    test_must(ctx, imp_problem_functional(p, adjoint, &run, &one, ones, NULL));
    tap_ok(e.value == one.value / n_values && flat[0] == ones[0] / n_values,
           "without an adjoint, the mean # %g", e.value);
    for (size_t i = 0; i < n; i++) imp_film_destroy(films[i]);
    imp_film_destroy(primal);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    static const char *const filters[] = {
        "<rfilter type='box'/>", "<rfilter type='gaussian'/>", "<rfilter type='tent'/>"};
    ctx = test_context(0);
    for (size_t k = 0; k < sizeof filters / sizeof *filters; k++) {
        if (is_long || k == 0) errors(filters[k], IMP_RGB, 8);
        if (is_long || k == 2) errors(filters[k], IMP_MONO, 4);
        values(filters[k]);
    }
    errors(filters[1], IMP_MONO, 100); /* two passes, and a part of the walks */
    imp_context_destroy(ctx);
    return tap_done();
}

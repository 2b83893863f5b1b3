/* SPDX-License-Identifier: Apache-2.0
 *
 * Importance by finite elements guides light walks: less noise, the same means
 * of pictures, readings and gradients. */
#include "base/film.h"
#include "elements/elements.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "scene/guide.h"
#include <string.h>

static const char *const offices = "elements/offices.xml";

static imp_guide *guide_of(imp_scene *s, int sensor, int no_importance, double share,
                           imp_elements **e)
{
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    struct imp_elements_guide_options how = IMP_ELEMENTS_GUIDE_OPTIONS_INIT;
    imp_guide *g;
    o.sensor = sensor;
    o.stop = 0.05;
    o.no_importance = no_importance;
    how.share = share;
    test_must(s->ctx, imp_elements_create(s, &o, e));
    test_must(s->ctx, imp_elements_solve(*e));
    test_must(s->ctx, imp_elements_guide(*e, &how, &g));
    return g;
}

static imp_film *picture(imp_scene *s, const struct imp_run *run, struct tap_stat *all)
{
    imp_film *f;
    test_must(s->ctx, imp_render(s, run, &f));
    double mean = 0;
    const size_t n = imp__film_values(f);
    for (size_t k = 0; k < n; k++) mean += f->mean[k] / (double)n;
    if (all) tap_add(all, mean);
    return f;
}

static bool same(const imp_film *a, const imp_film *b)
{
    return memcmp(a->mean, b->mean, imp__film_values(a) * sizeof *a->mean) == 0;
}

/* Means over seeds, and their variances, which take the place of standard errors: from the
 * sensor, from the lights without a guide, and with it. gain: of variances, at most. */
static void means(imp_context *ctx, const char *file, const char *defines, int sensor,
                  int spp, double share, double gain)
{
    enum { SEEDS = 24 };
    imp_scene *s = test_scene(ctx, file, IMP_MONO, defines);
    imp_elements *e;
    imp_guide *g = guide_of(s, sensor, 0, share, &e);
    struct imp_run run = IMP_RUN_INIT;
    struct tap_stat to[3] = {{0}};
    run.sensor = sensor;
    for (uint64_t k = 0; k < 3 * SEEDS; k++) {
        run.from = k % 3 ? IMP_FROM_LIGHTS : IMP_FROM_SENSOR;
        run.guide = k % 3 == 2 ? g : NULL;
        run.seed = k;
        run.spp = spp;
        imp_film_destroy(picture(s, &run, &to[k % 3]));
    }
    for (int other = 0; other < 2; other++) {
        const double apart = to[2].mean - to[other].mean,
                     z = apart / hypot(tap_se(&to[2]), tap_se(&to[other]));
        tap_ok(fabs(z) < 3.5 && tap_se(&to[2]) < 0.03 * to[2].mean,
               "%s, %s, share %g: the mean of walks from the %s # %.5g +- %.2g, z %.2f",
               file, defines, share, other ? "lights" : "sensor", to[2].mean,
               tap_se(&to[2]), z);
    }
    const double ratio = pow(tap_se(&to[2]) / tap_se(&to[1]), 2);
    tap_ok(ratio < gain, "%s, %s, share %g: less noise # variance %.3f", file, defines,
           share, ratio);
    imp_guide_destroy(g);
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

/* Beginnings of walks: the density of what `emit` makes of uniform numbers is what it
 * says, E[1/q] = 1, and the mean of h/q is that of h; emit_pdf says the same. */
static void beginnings(imp_context *ctx)
{
    imp_scene *s = test_scene(ctx, offices, IMP_MONO, "res=16");
    imp_elements *e;
    imp_guide *g = guide_of(s, 1, 0, 0, &e);
    double last = 0;
    int wrong = 0, strong = 0;
    for (int l = 0; l < s->n_emitters; l++) {
        wrong += !(g->send[l] - last >= 0.099 / s->n_emitters);
        strong += g->send[l] - last > 0.5;
        last = g->send[l];
    }
    tap_ok(wrong == 0 && strong == 1 && last == 1, "one of %d lights sends most walks",
           s->n_emitters);
    for (int field = IMP_GUIDE_CONNECTED; field <= IMP_GUIDE_MET; field++) {
        struct tap_stat one[2] = {{0}}, h = {0};
        double apart = 0;
        for (uint32_t i = 0; i < 40000; i++) {
            const struct imp_key key = imp__key(3, (uint64_t)field, i);
            double u[4], point;
            for (uint64_t k = 0; k < 4; k++) u[k] = imp__u01(key, k);
            const double q = g->emit(g, (enum imp_guide_field)field, 0, u, &point);
            apart = fmax(apart,
                         fabs(g->emit_pdf(g, (enum imp_guide_field)field, 0, u) - q) / q);
            tap_add(&one[0], 1 / point);
            tap_add(&one[1], 1 / q);
            tap_add(&h, u[0] * u[2] * u[3] / (point * q));
        }
        tap_z(&one[0], 1, 0.01, "density of points");
        tap_z(&one[1], 1, 0.01, "density of directions");
        tap_z(&h, 0.125, 0.01, "both");
        tap_ok(apart < 1e-9, "the density is known of any number # %.1e", apart);
    }
    imp_guide_destroy(g);
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

/* The same bits on one thread; without importance, as without a guide. */
static void bits(imp_context *ctx)
{
    imp_context *one = test_context(1);
    imp_film *f[4];
    for (int k = 0; k < 4; k++) { /* on two threads, on one; no directions; no guide */
        imp_scene *s = test_scene(k == 1 ? one : ctx, "cornell.xml", IMP_MONO, "res=8");
        struct imp_run run = IMP_RUN_INIT;
        imp_elements *e;
        imp_guide *g = guide_of(s, 0, 0, k == 2 ? 0 : 0.5, &e);
        run.from = IMP_FROM_LIGHTS;
        run.spp = 16;
        run.guide = k < 3 ? g : NULL;
        f[k] = picture(s, &run, NULL);
        imp_guide_destroy(g);
        imp_elements_destroy(e);
        imp_scene_destroy(s);
    }
    tap_ok(same(f[0], f[1]), "the same bits on one thread");
    tap_ok(!same(f[0], f[3]), "other walks with a guide");
    tap_ok(!same(f[0], f[2]) && !same(f[2], f[3]), "... and with directions");
    for (int k = 0; k < 4; k++) imp_film_destroy(f[k]);
    imp_context_destroy(one);
}

/* Gradients of the picture's sum, also by a lamp that is off; for forward
 * mode see grad/light_walks. */
static void gradients(imp_context *ctx)
{
    enum { PIXELS = 64, N = 64 };
    imp_scene *s = test_scene(ctx, offices, IMP_MONO, "res=8");
    double off = 0, g[2][N], se[2][N], worst = 0;
    static float seed[PIXELS];
    size_t index;
    int tight = 0;
    test_must(ctx, imp_scene_find_param(s, "lamp00.emitter.radiance.value", &index));
    test_must(ctx, imp_scene_set_values(s, index, 1, &off));
    imp_elements *e;
    imp_guide *guide = guide_of(s, 0, 0, 0.4, &e);
    imp_problem *p = test_problem(ctx, s, "*");
    const size_t n = imp_problem_n_variables(p);
    struct imp_run run = IMP_RUN_INIT;
    run.from = IMP_FROM_LIGHTS;
    run.spp = 256;
    for (int k = 0; k < PIXELS; k++) seed[k] = 1;
    for (int way = 0; way < 2 && n <= N; way++) {
        run.seed = 5 + (uint64_t)way;
        run.guide = way ? guide : NULL;
        test_must(ctx, imp_problem_reverse(p, seed, &run, g[way], se[way]));
    }
    for (size_t i = 0; i < n && n <= N; i++) {
        const double both = hypot(se[0][i], se[1][i]);
        if (!(both > 0)) continue;
        worst = fmax(worst, fabs(g[0][i] - g[1][i]) / both);
        tight += se[1][i] < 0.1 * fabs(g[1][i]);
    }
    tap_ok(n <= N && tight >= 2 && worst < 4,
           "gradients: those without a guide # worst z %.2f of %zu, %d known to 10 %%",
           worst, n, tight);
    imp_guide_destroy(guide);
    imp_problem_destroy(p);
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

/* Bidirectional walks, a guide without importance. */
static void refused(imp_context *ctx)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_elements *e;
    imp_film *f;
    run.spp = 1;
    imp_scene *s = test_scene(ctx, offices, IMP_MONO, "res=4 integrator=bdpt");
    imp_guide *g = guide_of(s, 0, 0, 0, &e);
    run.guide = g;
    tap_ok(imp_render(s, &run, &f) == IMP_E_UNSUPPORTED &&
               strstr(imp_last_error(ctx), "bdpt"),
           "refused: bidirectional walks");
    imp_guide_destroy(g);
    imp_elements_destroy(e);
    imp_scene_destroy(s);
    s = test_scene(ctx, "cornell.xml", IMP_MONO, "res=4");
    run.guide = g = guide_of(s, 0, 1, 0, &e);
    run.from = IMP_FROM_LIGHTS;
    tap_ok(imp_render(s, &run, &f) == IMP_E_UNSUPPORTED &&
               strstr(imp_last_error(ctx), "importance"),
           "refused: a guide without importance");
    imp_guide_destroy(g);
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    imp_context *ctx = test_context(2);
    beginnings(ctx);
    if (is_long) means(ctx, offices, "res=16", 0, 8, 0, 0.7);
    means(ctx, offices, "res=16", 0, 8, 0.25, 0.7);
    means(ctx, offices, "res=16", 1, 1024, 0.25, 0.5);
    means(ctx, offices, "res=4 integrator=photons", 1, 6144, 0.25, 0.6);
    if (is_long) means(ctx, "elements/glossy.xml", "res=8", 0, 64, 0.25, 1.2);
    means(ctx, "cornell.xml", "res=8", 0, 32, 0.25, 1.2);
    bits(ctx);
    gradients(ctx);
    refused(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}

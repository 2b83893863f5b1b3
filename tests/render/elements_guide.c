/* SPDX-License-Identifier: Apache-2.0
 *
 * Finite elements as a guide for walks: its densities against its draws, and that it
 * changes the noise of pictures and gradients but not their means. */
#include "base/film.h"
#include "elements/elements.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/warp.h"
#include "scene/guide.h"
#include "walk/core/walk_integrator.h"

static imp_elements *solved_to(imp_scene *s, int order)
{
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    imp_elements *e;
    o.order = order;
    o.stop = -1;
    o.eps_last = 3e-3;
    test_must(s->ctx, imp_elements_create(s, &o, &e));
    test_must(s->ctx, imp_elements_solve(e));
    return e;
}

static imp_elements *solved(imp_scene *s) { return solved_to(s, 4); }

static imp_guide *guide_of(const imp_elements *e, double share, double roulette)
{
    struct imp_elements_guide_options o = IMP_ELEMENTS_GUIDE_OPTIONS_INIT;
    imp_guide *g;
    o.share = share;
    o.roulette = roulette;
    test_must(e->ctx, imp_elements_guide(e, &o, &g));
    return g;
}

/* A place on the floor, found as walks find it. */
static bool place_on(const imp_scene *s, const imp_guide *g, double x, double z,
                     struct imp_guide_place *place)
{
    const imp_v3 o = imp__v3(x, 0.9, z), d = imp__v3(0, -1, 0);
    struct imp_hit hit;
    struct imp_surface at;
    if (!imp__intersect(s, &o, &d, 0, INFINITY, &hit)) return false;
    const struct imp_shape *shape = s->shapes[hit.shape];
    shape->ops->surface(shape, &hit, &o, &d, &at);
    return g->find(g, IMP_GUIDE_LIGHT, &hit, &at, d, place);
}

/* The density is 1 over all directions, and draws follow it: E[h(w)/p(w)] by draws is the
 * integral of h over where the density is not 0, for every h; lights likewise. */
static void densities(imp_context *ctx)
{
    imp_scene *s = test_scene(ctx, "elements/glossy.xml", IMP_MONO, "res=16 kd=0.7 ks=0");
    imp_elements *e = solved(s);
    imp_guide *g = guide_of(e, 0.5, 1);
    enum { SIDE = 240, DRAWS = 40000 };
    for (int k = 0; k < 3; k++) {
        struct imp_guide_place p;
        if (!place_on(s, g, 0.1 + 0.1 * k, 0.9 - 0.05 * k, &p)) {
            tap_ok(0, "a place on the floor");
            continue;
        }
        double whole = 0, seen[2] = {0};
        for (int i = 0; i < SIDE * SIDE; i++) {
            const double u[2] = {(i / SIDE + 0.5) / SIDE, (i % SIDE + 0.5) / SIDE};
            const imp_v3 w = imp__cosine_hemisphere(u);
            const double f = g->pdf(g, &p, imp__to_world(p.frame, w)) /
                             imp__cosine_hemisphere_pdf(w) / (SIDE * SIDE);
            whole += f;
            for (int c = 0; c < 2; c++) seen[c] += f * w[c];
        }
        tap_near(whole, 1, 1e-6, 0, "density over all directions");
        struct tap_stat mean[2] = {{0}};
        bool above = true;
        for (uint32_t i = 0; i < DRAWS; i++) {
            const struct imp_key key = imp__key(5, (uint64_t)k, i);
            const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
            const imp_v3 w = imp__to_local(p.frame, g->draw(g, &p, u));
            above &= w[2] > 0 && g->pdf(g, &p, imp__to_world(p.frame, w)) > 0 &&
                     fabs(imp__length(w) - 1) < 1e-12;
            for (int c = 0; c < 2; c++) tap_add(&mean[c], w[c]);
        }
        tap_ok(above, "draws are unit vectors on the front with a density");
        for (int c = 0; c < 2; c++)
            tap_z(&mean[c], seen[c], 0.01, "draws follow the density");
        double sum = 0;
        int wrong = 0;
        double last = 0;
        for (int l = 0; l < s->n_emitters; l++) {
            const double q = g->light_pmf(g, &p, l);
            wrong += !(q >= 0.099 * 0.25) || g->light(g, &p, last + 0.5 * q) != l;
            last += q;
            sum += q;
        }
        tap_ok(fabs(sum - 1) < 1e-12 && wrong == 0,
               "lights: chosen as often as they say");
    }
    imp_guide_destroy(g);
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

static void mean_of(const imp_film *f, double *mean, double *se)
{
    *mean = *se = 0;
    const size_t n = imp__film_values(f);
    for (size_t k = 0; k < n; k++) {
        *mean += f->mean[k] / (double)n;
        *se += imp__sqr(f->se[k] / (double)n);
    }
    *se = sqrt(*se);
}

static void pictures(imp_context *ctx, const char *file, double gain)
{
    static const struct {
        const char *name;
        double share, roulette;
    } ways[] = {{"lights", 0, 0},
                {"directions", 0.4, 0},
                {"directions and roulette", 0.2, 1},
                {"roulette that is weak", 0, 4},
                {"roulette that ends most", 0, 0.1}};
    imp_scene *s = test_scene(ctx, file, IMP_MONO, "res=16");
    imp_elements *e = solved(s);
    struct imp_run run = IMP_RUN_INIT;
    imp_film *plain, *film, *again;
    double m0, se0, m, se;
    run.spp = 1024;
    test_must(ctx, imp_render(s, &run, &plain));
    mean_of(plain, &m0, &se0);
    for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
        imp_guide *g = guide_of(e, ways[k].share, ways[k].roulette);
        run.guide = g;
        run.seed = 7 + k;
        test_must(ctx, imp_render(s, &run, &film));
        mean_of(film, &m, &se);
        const double z = (m - m0) / hypot(se, se0);
        tap_ok(fabs(z) < 4 && se < 0.02 * m,
               "%s, %s: the same picture # %.5g, plain %.5g, z %.2f, variance %.2g", file,
               ways[k].name, m, m0, z, imp__sqr(se / se0));
        if (k == 0)
            tap_ok(imp__sqr(se / se0) < gain, "%s: less noise, by %g at least", file,
                   1 / gain);
        if (k == 2) {
            imp_context *one = test_context(1);
            imp_scene *t = test_scene(one, file, IMP_MONO, "res=16");
            imp_elements *f = solved(t);
            imp_guide *h = guide_of(f, ways[k].share, ways[k].roulette);
            run.guide = h;
            test_must(one, imp_render(t, &run, &again));
            tap_ok(memcmp(film->mean, again->mean,
                          imp__film_values(film) * sizeof *film->mean) == 0,
                   "the same bits on one thread");
            imp_film_destroy(again);
            imp_guide_destroy(h);
            imp_elements_destroy(f);
            imp_scene_destroy(t);
            imp_context_destroy(one);
        }
        imp_film_destroy(film);
        imp_guide_destroy(g);
    }
    run.guide = NULL;
    run.seed = 0;
    test_must(ctx, imp_render(s, &run, &film));
    tap_ok(memcmp(film->mean, plain->mean, imp__film_values(film) * sizeof *film->mean) ==
               0,
           "%s: without a guide again, the same bits", file);
    imp_film_destroy(film);
    imp_film_destroy(plain);
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

/* What a guide expects, at what the camera sees, against pictures: all light reflected
 * there, and the part that was reflected before, which pictures of two depths tell. */
static void expectations(imp_context *ctx, const char *file, double slack)
{
    enum { SIDE = 16, RAYS = 6 };
    imp_scene *s = test_scene(ctx, file, IMP_MONO, "res=16");
    imp_elements *e = solved_to(s, 0);
    imp_guide *g = guide_of(e, 0, 1);
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    double mean[3], se[3], all = 0, beyond = 0;
    int wrong = 0;
    run.spp = 512;
    for (int k = 0; k < 3; k++) { /* emission, direct light too, everything */
        ((struct imp_walk_integrator *)s->integrator->self)->max_depth =
            k < 2 ? k + 1 : -1;
        test_must(ctx, imp_render(s, &run, &film));
        mean_of(film, &mean[k], &se[k]);
        imp_film_destroy(film);
        run.guide = g;
        run.seed++;
    }
    for (int k = 0; k < SIDE * SIDE * RAYS * RAYS; k++) {
        const int row = k / (SIDE * RAYS), column = k % (SIDE * RAYS);
        struct imp_sensor_ray ray;
        struct imp_hit hit;
        struct imp_surface at;
        struct imp_guide_place p;
        double part;
        s->sensors[0]->ops->ray(s->sensors[0], (column + 0.5) / RAYS, (row + 0.5) / RAYS,
                                (double[2]){0.5, 0.5}, &ray);
        if (!imp__intersect(s, &ray.o, &ray.d, 0, INFINITY, &hit)) continue;
        s->shapes[hit.shape]->ops->surface(s->shapes[hit.shape], &hit, &ray.o, &ray.d,
                                           &at);
        if (!g->find(g, IMP_GUIDE_LIGHT, &hit, &at, ray.d, &p)) continue;
        all += g->expected(g, &p, -ray.d, &part) / (SIDE * SIDE * RAYS * RAYS);
        wrong += !(part >= 0);
        beyond += part / (SIDE * SIDE * RAYS * RAYS);
    }
    const double see_all = mean[2] - mean[0], see_beyond = mean[2] - mean[1];
    tap_ok(fabs(all / see_all - 1) < slack,
           "%s: what leaves # %.5g, pictures %.5g +- %.2g", file, all, see_all,
           hypot(se[2], se[0]));
    tap_ok(wrong == 0 && fabs(beyond / see_beyond - 1) < slack,
           "%s: the part beyond # %.5g, pictures %.5g +- %.2g", file, beyond, see_beyond,
           hypot(se[2], se[1]));
    imp_guide_destroy(g);
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

/* Gradients by all numbers, with a lamp that is off and no diffuse part: what has no
 * value still has its derivative. */
static void gradients(imp_context *ctx)
{
    imp_scene *s =
        test_scene(ctx, "elements/glossy.xml", IMP_MONO, "res=12 kd=0.6 ks=0.05");
    imp_elements *e = solved(s); /* of the scene as it was: a guide may be old */
    imp_problem *p = test_problem(ctx, s, "*");
    const size_t n = imp_problem_n_variables(p);
    static float seed[12 * 12];
    static const struct {
        const char *name;
        double share, roulette;
    } ways[] = {{"lights", 0, 0},
                {"directions", 0.4, 0},
                {"roulette", 0, 1},
                {"all of it", 0.3, 0.5}};
    double g[2][64], se[2][64], off = 0;
    size_t index;
    for (size_t k = 0; k < 12 * 12; k++) seed[k] = 1.0f + 0.001f * (float)k;
    test_must(ctx, imp_scene_find_param(s, "light_back.emitter.radiance.value", &index));
    test_must(ctx, imp_scene_set_values(s, index, 1, &off));
    test_must(ctx, imp_scene_find_param(s, "wall.diffuse_reflectance.value", &index));
    test_must(ctx, imp_scene_set_values(s, index, 1, &off));
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 2048;
    run.seed = 3;
    if (n <= 64) test_must(ctx, imp_problem_reverse(p, seed, &run, g[0], se[0]));
    run.spp = 1024;
    for (size_t way = 0; way < sizeof ways / sizeof *ways && n <= 64; way++) {
        imp_guide *guide = guide_of(e, ways[way].share, ways[way].roulette);
        struct imp_guide_place place;
        if (ways[way].share > 0)
            tap_ok(place_on(s, guide, 0.2, 0.85, &place) && place.share > 0,
                   "%s: directions are in use", ways[way].name);
        int compared = 0, tight = 0;
        double worst = 0;
        run.seed = 4 + way;
        run.guide = guide;
        test_must(ctx, imp_problem_reverse(p, seed, &run, g[1], se[1]));
        imp_guide_destroy(guide);
        for (size_t i = 0; i < n; i++) {
            const double both = hypot(se[0][i], se[1][i]);
            if (!(both > 0)) continue;
            compared++;
            tight += se[1][i] < 0.1 * fabs(g[1][i]);
            worst = fmax(worst, fabs(g[0][i] - g[1][i]) / both);
            if (fabs(g[0][i] - g[1][i]) > 4 * both)
                printf("# %zu: plain %g +- %g, guided %g +- %g\n", i, g[0][i], se[0][i],
                       g[1][i], se[1][i]);
        }
        tap_ok(compared > 8 && tight > compared / 2 && worst < 4.2,
               "gradients, %s: those without # worst z %.2f of %d, %d known to 10 %%",
               ways[way].name, worst, compared, tight);
    }
    imp_problem_destroy(p);
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

static void refused(imp_context *ctx)
{
    struct imp_elements_guide_options o = IMP_ELEMENTS_GUIDE_OPTIONS_INIT;
    imp_scene *s = test_scene(ctx, "elements/b.xml", IMP_MONO, "res=8");
    imp_elements *e;
    imp_guide *g = NULL;
    test_must(ctx, imp_elements_create(s, NULL, &e));
    const enum imp_status early = imp_elements_guide(e, NULL, &g);
    tap_ok(early == IMP_E_ARG && !g, "not before it is solved # %s", imp_last_error(ctx));
    imp_elements_destroy(e);
    e = solved(s);
    o.share = 1;
    const enum imp_status share = imp_elements_guide(e, &o, &g);
    tap_ok(share == IMP_E_ARG && !g, "a share of all # %s", imp_last_error(ctx));
    o.share = 0;
    o.roulette = -1;
    const enum imp_status roulette = imp_elements_guide(e, &o, &g);
    tap_ok(roulette == IMP_E_ARG && !g, "roulette below 0 # %s", imp_last_error(ctx));
    imp_guide_destroy(NULL);
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    imp_context *ctx = test_context(2);
    densities(ctx);
    if (is_long) pictures(ctx, "elements/glossy.xml", 0.25);
    pictures(ctx, "elements/b.xml", 0.6);
    if (is_long) expectations(ctx, "elements/b.xml", 0.08);
    expectations(ctx, "elements/glossy.xml", 0.25); /* by bins of 15 degrees */
    gradients(ctx);
    refused(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}

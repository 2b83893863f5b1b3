/* SPDX-License-Identifier: Apache-2.0
 *
 * Finite elements against Monte Carlo: the library's path tracer on diffuse scenes, and
 * on scene d a small one of this file's own, which shares the scene and the BRDF only. */
#include "base/film.h"
#include "elements/elements.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/warp.h"

enum { RES = 32, BLOCK = 8 };

static void compare(const char *name, imp_film *fe, const float *mc, double mc_se,
                    double limit)
{
    double a = 0, b = 0, apart = 0, sum = 0;
    const size_t n = imp__film_values(fe), ch = (size_t)fe->channels;
    for (size_t k = 0; k < n; k++) a += fe->mean[k], b += mc[k];
    for (int y = 0; y < RES; y += BLOCK)
        for (int x = 0; x < RES; x += BLOCK) {
            double p = 0, q = 0;
            for (int k = 0; k < BLOCK * BLOCK; k++) {
                const size_t i =
                    ((size_t)(y + k / BLOCK) * RES + (size_t)(x + k % BLOCK)) * ch;
                for (size_t c = 0; c < ch; c++) p += fe->mean[i + c], q += mc[i + c];
            }
            apart += (p - q) * (p - q);
            sum += q * q;
        }
    const double off = a / b - 1, se = mc_se / b * (double)n;
    tap_ok(fabs(off) < fmax(0.005, 3 * se) && se < 0.0045,
           "%s: mean picture # %.6g ref %.6g off %.2f %% se %.2f %%", name, a / (double)n,
           b / (double)n, 100 * off, 100 * se);
    tap_ok(sqrt(apart / sum) < limit, "%s: RMS of blocks # %.2f %%", name,
           100 * sqrt(apart / sum));
}

static imp_film *picture(imp_scene *s, struct imp_elements_options *o,
                         enum imp_elements_image kind, int rays)
{
    imp_elements *e;
    imp_film *f;
    o->stop = -1;
    test_must(s->ctx, imp_elements_create(s, o, &e));
    test_must(s->ctx, imp_elements_solve(e));
    test_must(s->ctx, imp_elements_image(e, 0, kind, rays, &f));
    printf("# %zu links, measure %.8g\n", e->n_links, imp__el_measure(e, NULL));
    imp_elements_destroy(e);
    return f;
}

static void diffuse(imp_context *ctx, const char *file, const char *name, int spp,
                    double eps)
{
    imp_scene *s = test_scene(ctx, file, IMP_MONO, "res=32");
    struct imp_run run = IMP_RUN_INIT;
    imp_film *mc;
    run.spp = spp;
    test_must(ctx, imp_render(s, &run, &mc));
    double var = 0;
    const size_t n = imp__film_values(mc);
    for (size_t k = 0; k < n; k++) var += (double)mc->se[k] * mc->se[k];
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    o.eps_last = eps;
    imp_film *fe =
        picture(s, &o, IMP_ELEMENTS_FLAT, 12); /* the light's edge needs rays */
    compare(name, fe, mc->mean, sqrt(var) / (double)n, 0.03);
    imp_film_destroy(fe);
    imp_film_destroy(mc);
    imp_scene_destroy(s);
}

/* Scene a comes to its truth as eps falls: 26 million walks and the lamp in closed form
 * give a mean of 0.212780 with a standard error of 0.00002 (docs/elements.md). */
static void converges(imp_context *ctx)
{
    const double truth = 0.212780, eps[3] = {1e-3, 1e-4, 1e-5}, limit[3] = {4, 1.6, 0.5};
    imp_scene *s = test_scene(ctx, "elements/a.xml", IMP_MONO, NULL);
    double before = INFINITY;
    for (int k = 0; k < 3; k++) {
        struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
        imp_elements *e;
        o.stop = -1;
        o.eps_last = eps[k];
        test_must(ctx, imp_elements_create(s, &o, &e));
        test_must(ctx, imp_elements_solve(e));
        const double off = 100 * (imp__el_measure(e, NULL) / truth - 1);
        tap_ok(fabs(off) < limit[k] && fabs(off) < before,
               "scene a, eps %g: mean # off %.2f %%, %zu links", eps[k], off, e->n_links);
        before = fabs(off);
        imp_elements_destroy(e);
    }
    imp_scene_destroy(s);
}

/* Derivatives of the mean picture: adjoint elements against the library's walks. */
static void gradient(imp_context *ctx)
{
    imp_scene *s = test_scene(ctx, "elements/b.xml", IMP_MONO, "res=32");
    imp_problem *p = test_problem(ctx, s, "*");
    static float seed[RES * RES];
    double g[64], se[64];
    struct imp_run run = IMP_RUN_INIT;
    const size_t n = imp_problem_n_variables(p);
    for (int k = 0; k < RES * RES; k++) seed[k] = 1.0f / (RES * RES);
    run.spp = 256;
    if (n > 64) return;
    test_must(ctx, imp_problem_reverse(p, seed, &run, g, se));
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    const struct imp_elements_row *rows;
    imp_elements *e;
    size_t n_rows;
    o.stop = -1;
    o.eps_last = 2e-5;
    o.rays = 8; /* the lamps hide what they light: 3 rays a side alias by 1 % */
    test_must(ctx, imp_elements_create(s, &o, &e));
    test_must(ctx, imp_elements_solve(e));
    test_must(ctx, imp_elements_sensitivity(e, &rows, &n_rows));
    for (size_t i = 0; i < n; i++) {
        const size_t param = test_param_of(ctx, p, i);
        for (size_t k = 0; k < n_rows; k++)
            if (rows[k].param == (int)param) {
                const double off = rows[k].derivative - g[i];
                /* 3 standard errors, and 1 % for the mesh. */
                tap_ok(fabs(off) < 3 * se[i] + 0.01 * fabs(g[i]) &&
                           se[i] < 0.05 * fabs(g[i]),
                       "d mean / d %s # %.5g walks %.5g se %.2g z %.2f", rows[k].name,
                       rows[k].derivative, g[i], se[i], off / se[i]);
            }
    }
    imp_elements_destroy(e);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* A lamp designed for a picture of mean 0.1: walks see that picture. */
static void design(imp_context *ctx)
{
    imp_scene *s = test_scene(ctx, "elements/b.xml", IMP_MONO, "res=32");
    imp_problem *p = test_problem(ctx, s, "light_left*");
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    struct imp_elements_fit_options f = IMP_ELEMENTS_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_elements_fit_result *r;
    const double target = 0.1;
    imp_elements *e;
    imp_film *film;
    o.stop = -1;
    o.eps_last = 2e-5;
    o.rays = 12;
    f.targets = &target;
    test_must(ctx, imp_elements_create(s, &o, &e));
    test_must(ctx, imp_elements_fit(e, p, &f, &r));
    run.spp = 1024;
    test_must(ctx, imp_render(s, &run, &film));
    double mean = 0, var = 0;
    for (int k = 0; k < RES * RES; k++) {
        mean += film->mean[k] / (RES * RES);
        var += imp__sqr(film->se[k] / (RES * RES));
    }
    tap_ok(fabs(mean - target) < 3 * sqrt(var) + 0.005 * target &&
               sqrt(var) < 0.0045 * target,
           "a lamp of %.4g for a mean of %g # walks %.5g se %.1g z %.2f",
           r->variables[0].value, target, mean, sqrt(var), (mean - target) / sqrt(var));
    imp_film_destroy(film);
    imp_elements_destroy(e);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* ---- Scene d: beams and glossy walls ------------------------------------------- */

static double beam(const imp_scene *s, int shape, imp_v3 n, imp_v3 w)
{
    const double c = imp__dot(n, w);
    return c > 0 ? s->emitters[s->shapes[shape]->emitter]->input[0]->value[0] * pow(c, 20)
                 : 0;
}

static double phong(imp_v3 n, imp_v3 wo, imp_v3 wi)
{
    const imp_v3 r = n * (2 * imp__dot(n, wi)) - wi;
    return 0.1 / IMP_PI + 0.6 * 17 / IMP_2PI * pow(fmax(0, imp__dot(r, wo)), 15);
}

/* Light at every vertex, then on by a cosine direction; one sample. */
static double trace(const imp_scene *s, struct imp_sensor_ray ray, struct imp_key key)
{
    double sum = 0, weight = 1;
    uint32_t dim = 8;
    for (int bounce = 0; bounce < 60; bounce++) {
        struct imp_hit hit;
        struct imp_surface at;
        if (!imp__intersect(s, &ray.o, &ray.d, 0, INFINITY, &hit)) break;
        const struct imp_shape *shape = s->shapes[hit.shape];
        shape->ops->surface(shape, &hit, &ray.o, &ray.d, &at);
        if (imp__dot(at.ng, ray.d) >= 0) break;
        if (shape->emitter >= 0) {
            if (bounce == 0) sum += beam(s, hit.shape, at.ng, -ray.d);
            break;
        }
        for (int k = 0; k < s->n_emitters; k++) { /* every light, one point each */
            const struct imp_emitter *em = s->emitters[k];
            const double u[2] = {imp__u01(key, dim), imp__u01(key, dim + 1)};
            struct imp_light_sample l;
            dim += 2;
            if (!em->shape->ops->sample_toward(em->shape, &at.p, u, &l)) continue;
            const double c = imp__dot(l.wi, at.ng);
            const double le = beam(s, em->shape->index, l.ng, -l.wi);
            if (c <= 0 || le <= 0 || l.cos_light <= 0) continue;
            const imp_v3 from = imp__offset(at.p, at.ng, l.wi);
            if (imp__occluded(s, &from, &l.wi, 0, l.dist * (1 - 1e-3))) continue;
            sum += weight * phong(at.ng, -ray.d, l.wi) * c * le / l.pdf;
        }
        const struct imp_frame f = imp__frame_from_normal(at.ng);
        const double u[2] = {imp__u01(key, dim), imp__u01(key, dim + 1)};
        dim += 3;
        imp_v3 wi;
        const imp_v3 wo = imp__to_local(&f, -ray.d);
        /* Half the draws follow the lobe, half the cosine; the density is the mixture's.
         */
        const imp_v3 r = imp__v3(-wo[0], -wo[1], wo[2]);
        if (u[0] < 0.5) {
            wi = imp__cosine_hemisphere((double[2]){2 * u[0], u[1]});
        } else {
            const double z = pow(2 * u[0] - 1, 1.0 / 16), q = sqrt(fmax(0, 1 - z * z));
            const struct imp_frame lobe = imp__frame_from_normal(r);
            wi = imp__to_world(
                &lobe, imp__v3(q * cos(IMP_2PI * u[1]), q * sin(IMP_2PI * u[1]), z));
        }
        if (wi[2] <= 0) break;
        const double pdf =
            0.5 * wi[2] / IMP_PI + 0.5 * 16 / IMP_2PI * pow(fmax(0, imp__dot(r, wi)), 15);
        const imp_v3 d = imp__to_world(&f, wi);
        weight *= phong(at.ng, -ray.d, d) * wi[2] / pdf;
        if (bounce > 3) {
            const double keep = fmin(0.9, weight);
            if (imp__u01(key, dim - 1) >= keep) break;
            weight /= keep;
        }
        ray.o = imp__offset(at.p, at.ng, d);
        ray.d = d;
    }
    return sum;
}

static void glossy(imp_context *ctx, int spp)
{
    imp_scene *s = test_scene(ctx, "elements/d.xml", IMP_MONO, "res=32");
    static float mc[RES * RES];
    double var = 0;
    for (int p = 0; p < RES * RES; p++) {
        struct tap_stat pixel = {0};
        for (int k = 0; k < spp; k++) {
            const struct imp_key key = imp__key(3, (uint64_t)p, (uint64_t)k);
            struct imp_sensor_ray ray;
            const struct imp_sensor *sensor = s->sensors[0];
            sensor->ops->ray(sensor, p % RES + imp__u01(key, 0),
                             p / RES + imp__u01(key, 1), (double[2]){0.5, 0.5}, &ray);
            tap_add(&pixel, trace(s, ray, key));
        }
        mc[p] = (float)pixel.mean;
        var += tap_se(&pixel) * tap_se(&pixel);
    }
    const struct imp_elements_phong wall = {
        sizeof wall, "*", {0.1, 0.1, 0.1}, {0.6, 0.6, 0.6}, 15};
    static const struct imp_elements_beam beams[4] = {
        {sizeof *beams, "light_left", {0}, 20},
        {sizeof *beams, "light_right", {0}, 20},
        {sizeof *beams, "light_ceiling", {0}, 20},
        {sizeof *beams, "light_back", {0}, 20}};
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    o.phong = &wall;
    o.beams = beams;
    o.n_phong = 1;
    o.n_beams = 4;
    o.eps_last = 4e-5;
    o.order = 10;
    imp_film *fe = picture(s, &o, IMP_ELEMENTS_FLAT, 4);
    compare("scene d, flat", fe, mc, sqrt(var) / (RES * RES), 0.04);
    imp_film_destroy(fe);
    o.eps_last = 1e-4;
    fe = picture(s, &o, IMP_ELEMENTS_GATHER, 3); /* a coarse solution is enough */
    compare("scene d, final gather", fe, mc, sqrt(var) / (RES * RES), 0.03);
    imp_film_destroy(fe);
    imp_scene_destroy(s);
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    imp_context *ctx = test_context(2);
    diffuse(ctx, "elements/a.xml", "scene a", 384, 1e-5);
    converges(ctx);
    if (is_long) diffuse(ctx, "elements/b.xml", "scene b", 1024, 5e-5);
    gradient(ctx);
    design(ctx);
    glossy(ctx, 384);
    imp_context_destroy(ctx);
    return tap_done();
}

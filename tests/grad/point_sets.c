/* SPDX-License-Identifier: Apache-2.0
 *
 * Losses, gradients, Gauss-Newton matrices and fixed adjoints from points in sets have the
 * means that those from independent points have, through a box filter and a wide one, and
 * state the errors that they have. Where a loss is not quadratic both have a bias: that of
 * sets is no larger. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/estimate/replicates.h"
#include "inverse/gauss/gauss_newton.h"
#include <stdbool.h>
#include <string.h>

enum { SEEDS = 60, RES = 8, N = 4, MOST = 1 + 2 * N + N * N };

static imp_context *ctx;

static imp_scene *scene_of(const char *filter, const char *sampler)
{
    char xml[2048];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
             "value='3'/></integrator><sensor type='perspective'><float name='fov' "
             "value='40'/><transform name='to_world'><lookat origin='0,0,4' "
             "target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'><integer "
             "name='width' value='%d'/><integer name='height' value='%d'/>%s</film>"
             "%s</sensor><shape type='rectangle'><transform name='to_world'><scale "
             "value='3'/><translate z='-1'/></transform><bsdf type='diffuse' id='wall'>"
             "<float name='reflectance' value='.5'/></bsdf></shape>"
             "<shape type='sphere'><point name='center' x='.5' y='0' z='0'/><float "
             "name='radius' value='.6'/><bsdf type='roughconductor' id='ball'><float "
             "name='alpha' value='.3'/></bsdf></shape>"
             "<shape type='rectangle'><transform name='to_world'><scale value='.5'/>"
             "<rotate y='1' angle='180'/><translate x='-1' z='1.5'/></transform>"
             "<emitter type='area' id='lamp'><float name='radiance' value='8'/></emitter>"
             "</shape><emitter type='constant' id='sky'><float name='radiance' "
             "value='.4'/></emitter></scene>",
             RES, RES, filter, sampler);
    return test_scene_text(ctx, xml, IMP_MONO);
}

static imp_problem *problem_of(imp_scene *scene, enum imp_loss loss, imp_film **film)
{
    static const char *const active[N] = {"wall.reflectance.value", "ball.alpha*",
                                          "sky.radiance.value", "lamp.radiance.value"};
    struct imp_run run = IMP_RUN_INIT;
    struct imp_target target = IMP_TARGET_INIT;
    imp_problem *p;
    run.spp = 256;
    run.seed = 77;
    test_must(ctx, imp_render(scene, &run, film));
    test_must(ctx, imp_problem_create(scene, &p));
    for (int k = 0; k < N; k++) test_must(ctx, imp_problem_activate(p, active[k]));
    target.pixels = imp_film_mean(*film);
    for (int i = 0; i < RES * RES; i++) imp_film_mean(*film)[i] *= 1.2f;
    target.width = target.height = RES;
    target.channels = 1;
    target.loss = loss;
    target.epsilon = 0.05;
    test_must(ctx, imp_problem_add_target(p, &target));
    return p;
}

struct answer {
    struct tap_stat value[MOST];
    double stated[1 + N]; /* of loss and gradient: mean of the squared errors */
};

static void answers(imp_problem *p, enum imp_points points, int spp, int seeds,
                    struct answer *a)
{
    memset(a, 0, sizeof *a);
    for (int seed = 0; seed < seeds; seed++) {
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate f;
        double g[N], se[N], H[N * N], gn[N];
        struct imp__gauss_newton normal = {.H = H, .g = gn};
        run.spp = spp;
        run.points = points;
        run.seed = 100 + (uint64_t)seed + (points == IMP_POINTS_SOBOL ? 5000 : 0);
        test_must(ctx, imp_problem_objective(p, NULL, &run, &f, g, se));
        tap_add(&a->value[0], f.value);
        a->stated[0] += f.se * f.se / seeds;
        for (int k = 0; k < N; k++) {
            tap_add(&a->value[1 + k], g[k]);
            a->stated[1 + k] += se[k] * se[k] / seeds;
        }
        test_must(ctx, imp__gauss_newton(p, NULL, &run, &normal));
        for (int k = 0; k < N; k++) tap_add(&a->value[1 + N + k], gn[k]);
        for (int k = 0; k < N * N; k++) tap_add(&a->value[1 + 2 * N + k], H[k]);
    }
}

static double variance(const struct tap_stat *s) { return s->m2 / (s->n - 1); }

static void losses(const char *filter, const char *name, enum imp_loss loss, int spp)
{
    static struct answer one, sets, truth;
    const bool quadratic = loss == IMP_LOSS_L2 || loss == IMP_LOSS_RELATIVE_L2;
    imp_scene *scene = scene_of(filter, "");
    imp_film *film;
    imp_problem *p = problem_of(scene, loss, &film);
    answers(p, IMP_POINTS_INDEPENDENT, spp, SEEDS, &one);
    answers(p, IMP_POINTS_SOBOL, spp, SEEDS, &sets);
    answers(p, IMP_POINTS_INDEPENDENT, 16 * spp, SEEDS / 3, &truth);
    double z[3] = {0}, gain = 0, low = INFINITY, high = 0, low_one = INFINITY;
    for (int k = 0; k < MOST; k++) {
        const struct tap_stat *a = &one.value[k], *b = &sets.value[k],
                              *t = &truth.value[k];
        const int which = k == 0 ? 0 : k <= 2 * N ? 1 : 2;
        const double bias = quadratic ? 0 : fabs(a->mean - t->mean);
        const double off = fmax(0, fabs(b->mean - t->mean) - bias);
        const double se = sqrt(pow(tap_se(b), 2) + pow(tap_se(t), 2) +
                               (quadratic ? 0 : pow(tap_se(a), 2)));
        z[which] = fmax(z[which], off / se);
        if (k > N) continue;
        const double ratio = sqrt(sets.stated[k] / variance(b));
        low_one = fmin(low_one, sqrt(one.stated[k] / variance(a)));
        low = fmin(low, ratio);
        high = fmax(high, ratio);
        if (k > 0) gain += variance(b) / variance(a) / N;
    }
    tap_ok(z[0] < 4 && z[1] < 4.2 && z[2] < 4.5,
           "%s, %d spp: the means # loss z %.2f, gradient %.2f, J^T J %.2f", name, spp,
           z[0], z[1], z[2]);
    /* An error from 60 seeds is known to 9 %. */
    tap_ok(low > 0.7 && low_one > 0.7 && high < 1.5,
           "%s, %d spp: the errors # stated/seen %.2f to %.2f, independent from %.2f",
           name, spp, low, high, low_one);
    /* Few samples through a wide filter are single points. */
    tap_ok(gain < (spp < 16 ? 1.5 : 0.9),
           "%s, %d spp: variance of the gradient # %.2f of before", name, spp, gain);
    imp_problem_destroy(p);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
}

/* Gradients of a fixed linear function, and pictures of derivatives. */
static void fixed(const char *filter, const char *name)
{
    imp_scene *scene = scene_of(filter, "");
    imp_film *film;
    imp_problem *p = problem_of(scene, IMP_LOSS_L2, &film);
    static struct tap_stat value[2][2 * N];
    double stated[N] = {0}, z = 0, low = INFINITY, high = 0;
    memset(value, 0, sizeof value);
    for (int kind = 0; kind < 2; kind++)
        for (int seed = 0; seed < SEEDS; seed++) {
            struct imp_run run = IMP_RUN_INIT;
            double g[N], se[N];
            const double x_dot[N] = {1, .5, 1, .1};
            imp_film *d;
            run.spp = 26; /* sets of unequal size */
            run.seed = 100 + (uint64_t)seed + (uint64_t)kind * 5000;
            run.points = kind ? IMP_POINTS_SOBOL : IMP_POINTS_INDEPENDENT;
            test_must(ctx, imp_problem_reverse(p, imp_film_mean(film), &run, g, se));
            for (int k = 0; k < N; k++) {
                tap_add(&value[kind][k], g[k]);
                if (kind) stated[k] += se[k] * se[k] / SEEDS;
            }
            test_must(ctx, imp_problem_forward(p, x_dot, &run, &d));
            for (int k = 0; k < N; k++)
                tap_add(&value[kind][N + k], imp_film_mean(d)[k * 13 + 4]);
            imp_film_destroy(d);
        }
    for (int k = 0; k < 2 * N; k++) {
        const struct tap_stat *a = &value[0][k], *b = &value[1][k];
        const double se = sqrt(pow(tap_se(a), 2) + pow(tap_se(b), 2));
        z = fmax(z, fabs(a->mean - b->mean) / se);
        if (k >= N) continue;
        low = fmin(low, sqrt(stated[k] / variance(b)));
        high = fmax(high, sqrt(stated[k] / variance(b)));
    }
    tap_ok(z < 4, "%s, fixed adjoint and tangent: the means # z %.2f", name, z);
    tap_ok(low > 0.65 && high < 1.5,
           "%s, fixed adjoint: errors # stated/seen %.2f to %.2f", name, low, high);
    imp_problem_destroy(p);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
}

/* The mean of a picture, whose error comes from independent sets. */
static void number(int spp)
{
    enum { REPEATS = 120 };
    imp_scene *scene = scene_of("<rfilter type='box'/>", "");
    struct tap_stat value[2] = {0};
    double stated = 0;
    imp_problem *p;
    test_must(ctx, imp_problem_create(scene, &p));
    for (int kind = 0; kind < 2; kind++)
        for (int seed = 0; seed < REPEATS; seed++) {
            struct imp_run run = IMP_RUN_INIT;
            struct imp_estimate e;
            run.spp = spp;
            run.seed = (uint64_t)seed + (uint64_t)kind * 5000;
            run.points = kind ? IMP_POINTS_SOBOL : IMP_POINTS_INDEPENDENT;
            test_must(ctx, imp_problem_functional(p, NULL, &run, &e, NULL, NULL));
            tap_add(&value[kind], e.value);
            if (kind) stated += e.se * e.se / REPEATS;
        }
    const double seen = variance(&value[1]), before = variance(&value[0]);
    const double z = (value[1].mean - value[0].mean) / sqrt((seen + before) / REPEATS);
    /* An error from 120 seeds is known to 6.5 %. */
    tap_ok(fabs(sqrt(stated / seen) - 1) < .2 && fabs(z) < 4 && seen < before,
           "mean of a picture, %d spp # stated/seen %.2f, variance %.2f, z %.2f", spp,
           sqrt(stated / seen), seen / before, z);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* A meter on a disk of radius 1 before a lamp like it, both of reflectance 1/2, at a distance of 1.
 * With F = (3 - sqrt 5)/2 between them, and light that returns once, E = pi F (1 + F^2/4). */
static void meter(void)
{
    static const char xml[] =
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='3'/></integrator><shape type='disk'><bsdf type='diffuse'><float "
        "name='reflectance' value='.5'/></bsdf><sensor type='irradiancemeter'><film "
        "type='hdrfilm'><integer name='width' value='1'/><integer name='height' "
        "value='1'/><rfilter type='box'/></film></sensor></shape><shape type='disk'>"
        "<transform name='to_world'><rotate y='1' angle='180'/><translate z='1'/>"
        "</transform><bsdf type='diffuse'><float name='reflectance' value='.5'/></bsdf>"
        "<emitter type='area'><float name='radiance' "
        "value='1'/></emitter></shape></scene>";
    const double F = (3 - sqrt(5)) / 2, truth = IMP_PI * F * (1 + F * F / 4);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    struct tap_stat value = {0};
    imp_problem *p;
    test_must(ctx, imp_problem_create(scene, &p));
    for (int seed = 0; seed < 40; seed++) {
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate e;
        run.spp = 1024;
        run.seed = (uint64_t)seed;
        run.points = IMP_POINTS_SOBOL;
        test_must(ctx, imp_problem_functional(p, NULL, &run, &e, NULL, NULL));
        tap_add(&value, e.value);
    }
    tap_z(&value, truth, 3e-3 * truth,
          "a meter's directions do not depend on its places");
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* Where nothing is said, or `independent` by a sampler, losses and pictures have points in sets. */
static void unsaid(void)
{
    static const char *const sampler[] = {"", "<sampler type='independent'/>",
                                          "<sampler type='multijitter'/>"};
    for (int k = 0; k < 3; k++) {
        imp_scene *scene = scene_of("<rfilter type='box'/>", sampler[k]);
        imp_film *target, *film[3];
        imp_problem *p = problem_of(scene, IMP_LOSS_L2, &target);
        double value[3];
        for (int j = 0; j < 3; j++) { /* IMP_POINTS_SCENE, independent, Sobol's */
            struct imp_estimate e;
            struct imp_run run = IMP_RUN_INIT;
            run.spp = 16;
            run.points = (enum imp_points)j;
            test_must(ctx, imp_problem_objective(p, NULL, &run, &e, NULL, NULL));
            test_must(ctx, imp_render(scene, &run, &film[j]));
            value[j] = e.value;
        }
        const size_t bytes = RES * RES * sizeof(float);
        tap_ok(value[0] == value[IMP_POINTS_SOBOL] && value[1] != value[2],
               "sampler \"%s\": the points of a loss", sampler[k]);
        tap_ok(memcmp(imp_film_mean(film[0]), imp_film_mean(film[IMP_POINTS_SOBOL]),
                      bytes) == 0,
               "sampler \"%s\": the points of a picture", sampler[k]);
        for (int j = 0; j < 3; j++) imp_film_destroy(film[j]);
        imp_film_destroy(target);
        imp_problem_destroy(p);
        imp_scene_destroy(scene);
    }
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    const char *box = "<rfilter type='box'/>", *wide = "<rfilter type='gaussian'/>";
    ctx = test_context(1);
    losses(box, "box, l2", IMP_LOSS_L2, 16);
    if (is_long) {
        losses(box, "box, l2", IMP_LOSS_L2, 22);
        losses(box, "box, relative l2", IMP_LOSS_RELATIVE_L2, 16);
        losses(wide, "wide, l2", IMP_LOSS_L2, 32);
        number(16);
        number(64);
    }
    losses(box, "box, log", IMP_LOSS_LOG, 32);
    losses(box, "box, l1", IMP_LOSS_L1, 32);
    losses(wide, "wide, l2", IMP_LOSS_L2, 8);
    losses(wide, "wide, log", IMP_LOSS_LOG, 32);
    fixed(box, "box");
    fixed(wide, "wide");
    number(100);
    meter();
    unsaid();
    imp_context_destroy(ctx);
    return tap_done();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * A ball of 164 vertices becomes an ellipsoid, of which two pictures are given, by Adam in smooth steps:
 * its vertices come near that surface, and nearer than in steps of single vertices. Fits have the same
 * bits on one and two threads, and when they were stopped; a seam stays closed, and held vertices stay
 * where they are. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/vec.h"
#include <string.h>

enum { RINGS = 9, SIDES = 18, SPP = 16, STEPS = 32 };
#define VERTICES (RINGS * SIDES + 2)
#define BALL     "mesh_fits.obj"
#define STATE    "mesh_fits.checkpoint"
static imp_context *ctx;
static const double axes[3] = {1.25, 0.8, 0.95};

/* With a seam, two vertices in place of each along a meridian. */
static void ball_write(const double size[3], bool seam)
{
    FILE *f = fopen(BALL, "w");
    const int columns = seam ? SIDES + 1 : SIDES;
    if (!f) exit(99);
    for (int r = 0; r < RINGS; r++)
        for (int k = 0; k < columns; k++) {
            const double t = IMP_PI * (r + 1) / (RINGS + 1),
                         p = IMP_2PI * (k % SIDES) / SIDES;
            const double n[3] = {sin(t) * cos(p), sin(t) * sin(p), cos(t)};
            fprintf(f, "v %.9g %.9g %.9g\nvn %.9g %.9g %.9g\n", n[0] * size[0],
                    n[1] * size[1], n[2] * size[2], n[0], n[1], n[2]);
        }
    for (int s = 1; s >= -1; s -= 2)
        fprintf(f, "v 0 0 %.9g\nvn 0 0 %d\n", s * size[2], s);
    const int top = RINGS * columns + 1, bottom = top + 1;
    for (int k = 0; k < SIDES; k++) {
        const int next = seam ? k + 1 : (k + 1) % SIDES;
        fprintf(f, "f %d//%d %d//%d %d//%d\n", top, top, k + 1, k + 1, next + 1,
                next + 1);
        for (int r = 0; r + 1 < RINGS; r++) {
            const int a = r * columns + k + 1, b = r * columns + next + 1;
            const int c = b + columns, d = a + columns;
            fprintf(f, "f %d//%d %d//%d %d//%d\nf %d//%d %d//%d %d//%d\n", a, a, d, d, c,
                    c, a, a, c, c, b, b);
        }
        const int a = (RINGS - 1) * columns + k + 1, b = (RINGS - 1) * columns + next + 1;
        fprintf(f, "f %d//%d %d//%d %d//%d\n", a, a, bottom, bottom, b, b);
    }
    fclose(f);
}

#define CAMERA(id, at)                                                                   \
    "<sensor type='perspective' id='" id "'><float name='fov' value='34'/><transform "   \
    "name='to_world'><lookat origin='" at "' target='0,0,0' up='0,0,1'/></transform>"    \
    "<film type='hdrfilm'><integer name='width' value='16'/><integer name='height' "     \
    "value='16'/><rfilter type='box'/></film></sensor>"

static imp_scene *ball_scene(imp_context *c)
{
    return test_scene_text(
        c,
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='2'/></integrator>" CAMERA("one", "0,-5,1") CAMERA(
            "two", "5,0.5,0.5") "<shape type='obj' id='ball'><string name='filename' "
                                "value='" BALL "'/><bsdf type='diffuse'/></shape>"
                                "<emitter type='constant'><rgb name='radiance' "
                                "value='0.3,0.3,0.3'/></emitter><shape type='rectangle'>"
                                "<transform name='to_world'><lookat origin='2,-3,4' "
                                "target='0,0,0' up='0,1,0'/></transform><emitter "
                                "type='area'><rgb name='radiance' value='8,8,8'/>"
                                "</emitter></shape></scene>",
        IMP_RGB);
}

/* The ball of a fit, and the pictures of the ellipsoid. */
static imp_problem *problem_of(imp_context *c, bool seam, imp_scene **scene)
{
    const double one[3] = {1, 1, 1};
    imp_film *film[2];
    ball_write(axes, false);
    imp_scene *truth = ball_scene(c);
    for (int k = 0; k < 2; k++) {
        struct imp_run run = IMP_RUN_INIT;
        run.spp = 256;
        run.sensor = k;
        run.seed = 5;
        test_must(c, imp_render(truth, &run, &film[k]));
    }
    ball_write(one, seam);
    *scene = ball_scene(c);
    remove(BALL);
    test_must(c, imp_scene_add_geometry(*scene, "ball.vertex_positions"));
    imp_problem *p = test_problem(c, *scene, "ball.vertex_positions");
    for (int k = 0; k < 2; k++) {
        test_target(c, p, k, 16, 16, imp_film_mean(film[k]));
        imp_film_destroy(film[k]);
    }
    imp_scene_destroy(truth);
    return p;
}

static int stop_at;
static int step(const struct imp_fit_step *s, void *payload)
{
    (void)payload;
    return stop_at > 0 && s->iteration >= stop_at;
}

static struct imp_fit_options options(double lambda)
{
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    o.max_iterations = STEPS;
    o.mesh_lambda = lambda;
    o.step = step;
    return o;
}

/* A fit; its answer to x [at most 3 (VERTICES + SIDES)], whose number is returned. */
static size_t fit(imp_problem *p, const struct imp_fit_options *o, double *x,
                  enum imp_status wanted)
{
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *r;
    run.spp = SPP;
    const enum imp_status st = imp_fit(p, o, &run, &r);
    if (st != wanted) test_must(ctx, st);
    imp_problem_get_x(p, x);
    return imp_problem_n_variables(p);
}

/* The mean distance of vertices from the ellipsoid, to first order. */
static double distance(const double *x, size_t n)
{
    double sum = 0;
    for (size_t v = 0; v < n / 3; v++) {
        double f = -1, slope = 0;
        for (int i = 0; i < 3; i++) {
            f += imp__sqr(x[3 * v + (size_t)i] / axes[i]);
            slope += imp__sqr(2 * x[3 * v + (size_t)i] / imp__sqr(axes[i]));
        }
        sum += fabs(f) / sqrt(slope);
    }
    return 3 * sum / (double)n;
}

enum { MOST = 3 * (VERTICES + SIDES) };

static void near_test(double *smooth)
{
    static double start[MOST], single[MOST];
    imp_scene *scene;
    struct imp_fit_options o = options(0);
    imp_problem *p = problem_of(ctx, false, &scene);
    imp_problem_get_x(p, start);
    const size_t n = fit(p, &o, smooth, IMP_OK);
    tap_ok(n == 3 * VERTICES, "numbers # %zu", n);
    const double before = distance(start, n), after = distance(smooth, n);
    tap_ok(after < 0.5 * before, "distance %.4f, from %.4f", after, before);
    test_must(ctx, imp_problem_set_x(p, start));
    o.mesh_lambda = -1;
    fit(p, &o, single, IMP_OK);
    tap_ok(after < 0.7 * distance(single, n), "steps of single vertices # %.4f",
           distance(single, n));
    o.mesh_lambda = 10;
    o.optimizer = IMP_LM;
    const struct imp_fit_result *r;
    tap_ok(imp_fit(p, &o, NULL, &r) == IMP_E_ARG, "smooth steps are Adam's # %s",
           imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

static void bits_test(const double *smooth)
{
    static double x[MOST];
    imp_scene *scene;
    imp_context *two = test_context(2);
    struct imp_fit_options o = options(0);
    imp_problem *p = problem_of(two, false, &scene);
    const size_t n = fit(p, &o, x, IMP_OK);
    tap_ok(memcmp(x, smooth, n * sizeof *x) == 0, "the same bits on two threads");
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    imp_context_destroy(two);

    p = problem_of(ctx, false, &scene);
    static double start[MOST];
    imp_problem_get_x(p, start);
    o.checkpoint = STATE;
    o.resume = true;
    stop_at = STEPS / 2;
    fit(p, &o, x, IMP_CANCELLED);
    stop_at = 0;
    test_must(ctx, imp_problem_set_x(p, start));
    fit(p, &o, x, IMP_OK);
    tap_ok(memcmp(x, smooth, n * sizeof *x) == 0, "and when it was stopped");
    o.mesh_lambda = 5;
    const struct imp_fit_result *r;
    struct imp_run run = IMP_RUN_INIT;
    run.spp = SPP;
    tap_ok(imp_fit(p, &o, &run, &r) == IMP_E_ARG,
           "a checkpoint of another lambda is another fit's # %s", imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    remove(STATE);
}

static void seam_test(void)
{
    static double start[MOST], x[MOST];
    imp_scene *scene;
    struct imp_fit_options o = options(0);
    o.max_iterations = 48; /* the held vertex is in the way of its neighbours */
    imp_problem *p = problem_of(ctx, true, &scene);
    imp_problem_get_x(p, start);
    test_must(ctx, imp_problem_hold(p, "ball.vertex_positions[6-8]"));
    const size_t n = fit(p, &o, x, IMP_OK);
    tap_ok(n == 3 * (VERTICES + RINGS), "numbers with a seam # %zu", n);
    double apart = 0;
    int pairs = 0;
    for (size_t a = 0; a < n; a += 3)
        for (size_t b = 0; b < a; b += 3) {
            if (memcmp(start + a, start + b, 3 * sizeof *x)) continue;
            pairs++;
            for (int i = 0; i < 3; i++)
                apart = fmax(apart, fabs(x[a + (size_t)i] - x[b + (size_t)i]));
        }
    tap_ok(pairs == RINGS && apart == 0, "a seam stays closed # %d, %g", pairs, apart);
    /* A vertex near the top is held, and its neighbours with it. */
    tap_ok(distance(x, n) < 0.65 * distance(start, n), "distance with a seam # %.4f",
           distance(x, n));
    tap_ok(memcmp(x + 6, start + 6, 3 * sizeof *x) == 0, "a held vertex stays");
    test_must(ctx, imp_problem_hold(p, "ball.vertex_positions[9]"));
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *r;
    run.spp = SPP;
    tap_ok(imp_fit(p, &o, &run, &r) == IMP_E_UNSUPPORTED,
           "a third of a vertex is not held # %s", imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(void)
{
    static double smooth[MOST];
    ctx = test_context(1);
    near_test(smooth);
    bits_test(smooth);
    seam_test();
    imp_context_destroy(ctx);
    return tap_done();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Surfaces of bsplinecurves that move: velocities by points of control against differences of circles that
 * are swept again, whose normals and areas are products of differences; transposes; how normals turn over
 * the surface; outlines against a search all round; in instances; what is refused. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/warp.h"
#include "move/strand.h"
#include "scene/pose.h"
#include <stdio.h>

static imp_context *ctx;
enum { POINTS = 7 };
typedef double line_points[POINTS][4];
static const line_points bent = {
    {-1.4, -.9, .2, .30}, {-.8, -.2, 0, .25}, {-.1, .3, .4, .32}, {.6, .1, .1, .28},
    {1.1, .8, -.2, .2},   {1.5, 1.3, .3, .3}, {1.2, 2, .9, .1}};

static imp_scene *scene_of(const line_points p, const char *before, const char *behind)
{
    char xml[2048];
    FILE *f = fopen("strands.txt", "w");
    if (!f) exit(99);
    for (int k = 0; k < POINTS; k++)
        fprintf(f, "%.9g %.9g %.9g %.9g\n", p[k][0], p[k][1], p[k][2], p[k][3]);
    fclose(f);
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'/><sensor "
             "type='perspective'><transform name='to_world'><lookat origin='0,0,6' "
             "target='0,0,0' up='0,1,0'/></transform></sensor><emitter "
             "type='constant'/>%s<shape type='bsplinecurve' id='it'><string "
             "name='filename' value='strands.txt'/></shape>%s</scene>",
             before, behind);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    remove("strands.txt");
    return scene;
}

/* ---- The surface again -------------------------------------------------------------------- */

/* Point, radius and derivative of the line, by de Boor's rule of the four points. */
static void line_at(const double p[POINTS][4], int k, double v, double c[4], double d[4])
{
    double q[4][4];
    memcpy(q, p[k], sizeof q);
    for (int level = 1; level <= 3; level++) {
        if (level == 3)
            for (int i = 0; i < 4; i++) d[i] = q[3][i] - q[2][i];
        for (int j = 3; j >= level; j--)
            for (int i = 0; i < 4; i++) {
                const double a = (v + 3 - j) / (4 - level);
                q[j][i] = q[j - 1][i] * (1 - a) + q[j][i] * a;
            }
    }
    memcpy(c, q[3], sizeof q[3]);
}
static imp_v3 vector(const double v[4]) { return imp__v3(v[0], v[1], v[2]); }

/* The rotation that takes the unit vector a to b, of v. */
static imp_v3 turned(imp_v3 a, imp_v3 b, imp_v3 v)
{
    const imp_v3 w = imp__cross(a, b);
    return v + imp__cross(w, v) +
           imp__cross(w, imp__cross(w, v)) * (1 / (1 + imp__dot(a, b)));
}

/* A place of the surface, by a vector e from the line that is turned with its direction, which was a, as
 * little as possible, and then by t about that. */
static imp_v3 place_at(const double p[POINTS][4], int k, double v, imp_v3 a, imp_v3 e,
                       double t)
{
    double c[4], d[4];
    line_at(p, k, v, c, d);
    const imp_v3 b = imp__normalize(vector(d)), x = turned(a, b, e), y = imp__cross(b, x);
    return vector(c) + (x * cos(t) + y * sin(t)) * c[3];
}

struct place {
    imp_v3 p, n;
    double area; /* logarithm */
};
static struct place surface_at(const double p[POINTS][4], int k, double v, imp_v3 a,
                               imp_v3 e)
{
    const double h = 1e-4;
    imp_v3 d[2];
    for (int i = 0; i < 2; i++) {
        imp_v3 at[4];
        for (int j = 0; j < 4; j++) {
            const double x = h * (j < 2 ? 1 - 2 * j : 2 * (5 - 2 * j));
            at[j] = place_at(p, k, i ? v : v + x, a, e, i ? x : 0);
        }
        d[i] = ((at[0] - at[1]) * 8 - (at[2] - at[3])) * (1 / (12 * h));
    }
    const imp_v3 c = imp__cross(d[1], d[0]);
    struct place out = {place_at(p, k, v, a, e, 0), imp__normalize(c),
                        log(imp__length(c))};
    if (imp__dot(out.n, e) < 0) out.n = -out.n;
    return out;
}

static void floats_of(const line_points p, double out[POINTS][4])
{
    for (int k = 0; k < POINTS; k++)
        for (int i = 0; i < 4; i++) out[k][i] = (float)p[k][i];
}

/* ---- Tests ------------------------------------------------------------------------------ */

static double apart(imp_v3 a, imp_v3 b) { return imp__length(a - b); }

static void velocities_test(void)
{
    imp_scene *scene = scene_of(bent, "", "");
    struct imp__moves m = imp__moves_begin(scene, NULL);
    test_must(ctx, imp__moves_add(&m, IMP_MOVE_CONTROL, 0));
    double rest[POINTS][4], worst[3] = {0}, transposed = 0, bend = 0, back = 0;
    floats_of(bent, rest);
    tap_ok(m.n == 4 * POINTS, "four numbers a point");
    for (uint32_t i = 0; i < 200; i++) {
        const struct imp_key key = imp__key(7, 1, i);
        double theta[4 * POINTS], bar[4 * POINTS] = {0}, c[4], d[4];
        for (uint32_t j = 0; j < 4 * POINTS; j++) theta[j] = imp__u01(key, 20 + j) - 0.5;
        const int segment = (int)(i % (POINTS - 3));
        const double v = imp__u01(key, 0), side = i % 3 == 0 ? -1 : 1;
        line_at((const double(*)[4])rest, segment, v, c, d);
        const imp_v3 a = imp__normalize(vector(d));
        const double u[2] = {imp__u01(key, 1), imp__u01(key, 2)};
        imp_v3 e = imp__uniform_sphere(u);
        e = imp__normalize(e - a * imp__dot(a, e));
        const struct place at = surface_at((const double(*)[4])rest, segment, v, a, e);
        const struct imp__glued x =
            imp__glued_near(scene, 0, segment, 0, 0, at.p, at.n * side);
        back = fmax(back, fmax(apart(x.p, at.p), apart(x.n, at.n * side)));
        /* Velocities. */
        struct place by[4];
        const double h = 1e-3;
        for (int j = 0; j < 4; j++) {
            double moved[POINTS][4];
            for (int k = 0; k < 4 * POINTS; k++)
                moved[k / 4][k % 4] =
                    rest[k / 4][k % 4] +
                    theta[k] * h * (j < 2 ? 1 - 2 * j : 2 * (5 - 2 * j));
            by[j] = surface_at((const double(*)[4])moved, segment, v, a, e);
        }
        const struct imp__velocity got = imp__velocity_of(&m, &x, theta);
        const imp_v3 V = ((by[0].p - by[1].p) * 8 - (by[2].p - by[3].p)) * (1 / (12 * h)),
                     n = ((by[0].n - by[1].n) * 8 - (by[2].n - by[3].n)) *
                         (side / (12 * h));
        const double area =
            ((by[0].area - by[1].area) * 8 - (by[2].area - by[3].area)) / (12 * h);
        worst[0] = fmax(worst[0], apart(got.v, V));
        worst[1] = fmax(worst[1], apart(got.n, n) / fmax(imp__length(n), 1));
        worst[2] = fmax(worst[2], fabs(got.area - area) / fmax(fabs(area), 1));
        /* Their transpose. */
        const struct imp__velocity ones = {
            .v = imp__v3(.3, -1, .7), .n = imp__v3(-.4, .8, .5), .area = 1.3};
        double sum = 0;
        imp__velocity_bar(&m, &x, &ones, bar);
        for (int k = 0; k < 4 * POINTS; k++) sum += bar[k] * theta[k];
        const double own =
            imp__dot(ones.v, got.v) + imp__dot(ones.n, got.n) + ones.area * got.area;
        transposed = fmax(transposed, fabs(sum - own) / fmax(fabs(own), 1));
        /* How the normal turns over the surface. */
        for (int k = 0; k < 2; k++) {
            imp_v3 shift = {0}, turn = {0};
            const double step = 1e-3;
            for (int s = 0; s < 2; s++) {
                const double by_step = s ? -step : step;
                line_at((const double(*)[4])rest, segment, v + (k ? 0 : by_step), c, d);
                const imp_v3 b = imp__normalize(vector(d)), there = turned(a, b, e);
                const imp_v3 e_there =
                    k ? there * cos(by_step) + imp__cross(b, there) * sin(by_step)
                      : there;
                const struct place y = surface_at((const double(*)[4])rest, segment,
                                                  v + (k ? 0 : by_step), b, e_there);
                shift += y.p * (s ? -0.5 / step : 0.5 / step);
                turn += y.n * (s ? -0.5 / step : 0.5 / step);
            }
            const imp_v3 own_turn = x.turn[0] * imp__dot(x.slope[0], shift) +
                                    x.turn[1] * imp__dot(x.slope[1], shift);
            bend = fmax(bend, apart(own_turn, turn * side) / fmax(imp__length(turn), 1));
        }
    }
    tap_ok(back < 1e-7, "points are glued where they are # off %.1e", back);
    tap_ok(worst[0] < 1e-8 && worst[1] < 1e-6 && worst[2] < 1e-6,
           "velocities of points, normals and areas # off %.1e %.1e %.1e", worst[0],
           worst[1], worst[2]);
    tap_ok(transposed < 1e-12, "their transpose # off %.1e", transposed);
    tap_ok(bend < 1e-4, "how normals turn over the surface # off %.1e", bend);
    imp__moves_free(&m);
    imp_scene_destroy(scene);
}

/* As sharp as its radius allows, nearly, and swelling. */
static const line_points sharp = {{-1, 0, 0, .5},  {-.5, .1, .1, .1}, {0, .3, 0, .5},
                                  {.5, .1, 0, .1}, {.9, -.5, .2, .6}, {1.4, 0, .3, .1},
                                  {2, .5, .1, .5}};

/* All turns at which N.(X - from) changes its sign, at many steps. */
static void outlines_test(const line_points line)
{
    enum { STEPS = 5000 };
    imp_scene *scene = scene_of(line, "", "");
    double worst = 0;
    int missed = 0, many = 0;
    for (uint32_t i = 0; i < 400; i++) {
        const struct imp_key key = imp__key(9, 1, i);
        const double v = imp__u01(key, 0), u[2] = {imp__u01(key, 1), imp__u01(key, 2)};
        const bool parallel = i % 4 == 0;
        struct imp__strand x;
        struct imp__strand_point at;
        double turn[IMP_STRAND_OUTLINES];
        imp__strand_at(scene, 0, 0, (int)(i % (POINTS - 3)), v, &x);
        const struct imp__strand_axes axes = imp__strand_axes(&x);
        const imp_v3 away = imp__uniform_sphere(u) * (parallel ? 1 : 0.4 + 2 * v);
        const imp_v3 from = parallel ? away : x.c + away;
        const int n = imp__strand_outline(&x, &axes, from, parallel, turn);
        int changes = 0;
        bool before = false;
        for (int k = 0; k <= STEPS; k++) {
            const double t = IMP_2PI * (k + 0.31) / STEPS;
            if (!imp__strand_point(&x, &axes, axes.s * cos(t) + axes.t * sin(t), &at))
                continue;
            const bool faces = imp__dot(at.n, parallel ? from : at.p - from) < 0;
            changes += k > 0 && faces != before;
            before = faces;
        }
        missed += changes != n;
        many += n == 4;
        for (int k = 0; k < n; k++) {
            imp__strand_point(&x, &axes, axes.s * cos(turn[k]) + axes.t * sin(turn[k]),
                              &at);
            worst =
                fmax(worst,
                     fabs(imp__dot(at.n, imp__normalize(parallel ? from : at.p - from))));
        }
    }
    tap_ok(missed == 0 && worst < 1e-12,
           "outlines of 400 circles, %d with four points # %d other than by search, off "
           "%.1e",
           many, missed, worst);
    imp_scene_destroy(scene);
}

static void instance_test(void)
{
    imp_scene *scene = scene_of(
        bent, "<shape type='shapegroup' id='g'>",
        "</shape><shape type='instance' id='i'><transform name='to_world'><scale "
        "value='1.7'/><rotate x='1' y='2' z='-1' angle='40'/><scale x='-1'/><translate "
        "x='.3' y='-.2' z='.5'/></transform><ref id='g'/></shape>");
    int shape = 0;
    while (scene->shapes[shape]->geometry != IMP_CURVES) shape++;
    double worst = 0;
    struct imp_map map[2];
    imp__place_map(scene, 1, 0, &map[0], &map[1]);
    for (uint32_t i = 0; i < 60; i++) {
        const struct imp_key key = imp__key(11, 1, i);
        const struct imp_located at = {
            (int)(i % 4), {(float)imp__u01(key, 0), (float)imp__u01(key, 1)}};
        struct imp_surface here;
        imp__located_surface(scene, shape, &at, 1, 0, &here);
        const struct imp__glued x = imp__glued_at(scene, shape, &at, 1, 0, here.ng),
                                own = imp__glued_at(scene, shape, &at, 0, 0, here.ng);
        worst = fmax(worst, fmax(apart(x.p, here.p), apart(x.n, here.ng)));
        const imp_v3 shift = x.slope[0] + x.slope[1] * 0.3;
        const imp_v3 inside = imp__map_vector(&map[1], shift);
        imp_v3 turn = own.turn[0] * imp__dot(own.slope[0], inside) +
                      own.turn[1] * imp__dot(own.slope[1], inside);
        turn = imp__map_vector(&map[0], turn) * (1 / 1.7);
        const imp_v3 got = x.turn[0] * imp__dot(x.slope[0], shift) +
                           x.turn[1] * imp__dot(x.slope[1], shift);
        worst = fmax(worst, fmin(apart(turn, got), apart(turn, -got)));
    }
    tap_ok(worst < 1e-6, "points in an instance that is mirrored # off %.1e", worst);
    imp_scene_destroy(scene);
}

int main(void)
{
    ctx = test_context(1);
    velocities_test();
    outlines_test(bent);
    outlines_test(sharp);
    instance_test();
    imp_context_destroy(ctx);
    return tap_done();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Instances that move in time, by the numbers of both places: velocities of points, normals and
 * directions against differences of the scene with other numbers, at several times, and against their
 * transpose; that of a pose that is not zero is what its numbers get. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/warp.h"
#include "moves_kit.h"
#include "scene/pose.h"

#define NUMBERS 12
#define START   0.2
#define END     1.4

static imp_context *ctx;

static imp_scene *scene_of(const char *from, const char *to)
{
    char xml[4096];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'/><emitter type='constant'/>"
             "<sensor type='perspective'><float name='shutter_open' value='%g'/><float "
             "name='shutter_close' value='%g'/></sensor><shape type='shapegroup' id='g'>"
             "<shape type='cube'><transform name='to_world'><scale x='.7' y='.4' z='.9'/>"
             "<translate x='.3' y='-.2' z='.5'/></transform></shape></shape><shape "
             "type='instance' id='a'><ref id='g'/><transform name='to_world'>%s"
             "</transform><transform name='to_world_end'>%s</transform></shape></scene>",
             START, END, from, to);
    return test_scene_text(ctx, xml, IMP_MONO);
}

static void place(imp_scene *scene, const size_t param[2], const double *numbers)
{
    for (int k = 0; k < 2; k++)
        test_must(ctx, imp_scene_set_values(scene, param[k], 6, numbers + 6 * k));
    test_must(ctx, imp__poses_settle(scene));
}

/* What is told of a point: place, normal and a direction in its triangle. */
static struct imp__glued read_at(const imp_scene *scene, const struct imp_located *at,
                                 double time, imp_v3 side)
{
    struct imp__glued x = imp__glued_at(scene, 0, at, 1, time, side);
    const struct imp__corners f = imp__corners(scene, 0, at->prim, 1, time);
    x.smooth = true;
    x.s = x.shade = imp__normalize((f.p[1] - f.p[0]) * 0.3 + (f.p[2] - f.p[0]) * 0.8);
    return x;
}

static imp_v3 slope(const imp_v3 f[4], double h)
{
    return (8 * (f[0] - f[1]) - (f[2] - f[3])) / (12 * h);
}

/* Where its places have the numbers `here`; NULL: 0. */
static void keys_test(const char *what, const char *from, const char *to,
                      const double *here)
{
    static const double zero[NUMBERS];
    static const double times[] = {0, START, .35, .8, 1.3, END, 2};
    enum { N = sizeof times / sizeof *times };
    static const char *const name[2] = {"a.pose", "a.pose_end"};
    imp_scene *scene = scene_of(from, to);
    size_t param[2];
    double worst = 0, transposed = 0, numbers = 0, fastest = 0;
    for (int k = 0; k < 2; k++) {
        test_must(ctx, imp_scene_add_geometry(scene, name[k]));
        test_must(ctx, imp_scene_find_param(scene, name[k], &param[k]));
    }
    const double *q = here ? here : zero;
    for (uint32_t i = 0; i < 12 * N; i++) {
        const struct imp_key key = imp__key(11, 0, i);
        const double time = times[i % N], h = 2e-3;
        double b[2], theta[NUMBERS], bar[NUMBERS] = {0}, moved[NUMBERS];
        imp__uniform_triangle((double[2]){imp__u01(key, 0), imp__u01(key, 1)}, b);
        const struct imp_located at = {(int)(i / N), {(float)b[0], (float)b[1]}};
        const imp_v3 side = imp__v3(imp__u01(key, 2) - 0.5, imp__u01(key, 3) - 0.5, 0.1);
        for (int k = 0; k < NUMBERS; k++)
            theta[k] = imp__u01(key, 10 + (uint32_t)k) - 0.5;
        place(scene, param, q);
        struct imp__moves m = imp__moves_begin(scene, scene->sensors[0]);
        for (int k = 0; k < 2; k++)
            test_must(ctx, imp__moves_add_pose(&m, imp__pose_of(scene, (int)param[k])));
        const struct imp__glued x = read_at(scene, &at, time, side);
        const struct imp__velocity v = imp__velocity_of(&m, &x, theta);
        struct imp__velocity w = {.turn = imp__u01(key, 5) - 0.5};
        for (uint32_t k = 0; k < 3; k++) {
            w.v[k] = imp__u01(key, 30 + k) - 0.5;
            w.n[k] = imp__u01(key, 40 + k) - 0.5;
            w.shade[k] = imp__u01(key, 50 + k) - 0.5;
        }
        imp__velocity_bar(&m, &x, &w, bar);
        double reverse = 0;
        for (int k = 0; k < NUMBERS; k++) reverse += bar[k] * theta[k];
        transposed = fmax(transposed,
                          fabs(reverse - (imp__dot(w.v, v.v) + imp__dot(w.n, v.n) +
                                          imp__dot(w.shade, v.shade) + w.turn * v.turn)));
        for (int k = 0; k < 2; k++)
            imp__pose_numbers_bar(&m, &m.mover[k], imp__pose_of(scene, (int)param[k]),
                                  bar + 6 * k);
        imp_v3 p[4], n[4], s[4];
        for (int f = 0; f < 4; f++) {
            for (int k = 0; k < NUMBERS; k++)
                moved[k] = q[k] + difference_at[f] * h * theta[k];
            place(scene, param, moved);
            const struct imp__glued there = read_at(scene, &at, time, side);
            p[f] = there.p, n[f] = there.n, s[f] = there.s;
        }
        const imp_v3 dp = slope(p, h), dn = slope(n, h), ds = slope(s, h);
        const double dt = imp__dot(imp__cross(x.n, x.s), ds);
        if (!here) {
            worst = fmax(worst, imp__length(v.v - dp));
            worst = fmax(worst, imp__length(v.n - dn));
            worst = fmax(worst, imp__length(v.shade - ds));
            worst = fmax(worst, fabs(v.turn - dt));
        }
        reverse = 0;
        for (int k = 0; k < NUMBERS; k++) reverse += bar[k] * theta[k];
        numbers = fmax(numbers, fabs(reverse - (imp__dot(w.v, dp) + imp__dot(w.n, dn) +
                                                imp__dot(w.shade, ds) + w.turn * dt)));
        fastest = fmax(fastest, imp__length(dp));
        imp__moves_free(&m);
    }
    if (!here)
        tap_ok(worst < 1e-11 && fastest > 0.3,
               "%s: velocities at %d times # %.1e of %.2g", what, N, worst, fastest);
    tap_ok(transposed < 1e-14, "%s: their transpose # %.1e", what, transposed);
    tap_ok(numbers < 1e-11, "%s: what the numbers get # %.1e", what, numbers);
    imp_scene_destroy(scene);
}

int main(void)
{
    static const double here[NUMBERS] = {.1, -.3, .2,  .4, -.7, .3,
                                         .2, .1,  -.4, .9, .2,  -.5};
#define FROM    "<rotate x='1' y='2' z='-1' angle='33'/><translate x='.3' y='-.2' z='2'/>"
#define SHIFTED "<translate x='-.4' y='.9' z='-.3'/>"
    ctx = test_context(1);
    keys_test("a turn", FROM, FROM "<rotate x='2' y='-1' z='.5' angle='70'/>" SHIFTED,
              NULL);
    keys_test("almost half a turn", FROM,
              FROM "<rotate x='-1' z='2' angle='172'/>" SHIFTED, NULL);
    keys_test("a small turn", FROM, FROM "<rotate x='1' z='2' angle='.002'/>" SHIFTED,
              NULL);
    keys_test("a shift alone", FROM, FROM SHIFTED, NULL);
    keys_test("a mirrored one of another size", "<scale x='-1.5' y='2' z='.7'/>" FROM,
              "<scale x='-1.5' y='2' z='.7'/><rotate y='1' angle='50'/>" SHIFTED, NULL);
    keys_test("places that are moved", FROM,
              FROM "<rotate x='2' y='-1' z='.5' angle='70'/>" SHIFTED, here);
    imp_context_destroy(ctx);
    return tap_done();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * What moves: velocities of points, normals and areas against differences of triangles that are
 * moved in long double, and of scenes that are built again; transposes; the camera's rays; the
 * list of edges of boxes, of walls that overlap in part, and what makes it not whole. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/warp.h"
#include "move/edge_choice.h"
#include "moves_kit.h"
#include <stdarg.h>

static imp_context *ctx;

static imp_scene *scene_of(const char *format, ...)
{
    char shapes[4096], xml[8192];
    va_list args;
    va_start(args, format);
    vsnprintf(shapes, sizeof shapes, format, args);
    va_end(args);
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'/>"
             "<emitter type='constant'/>%s</scene>",
             shapes);
    return test_scene_text(ctx, xml, IMP_MONO);
}

#define CUBE                                                                             \
    "<shape type='cube' id='a'><transform name='to_world'><scale x='.7' y='.4' z='.9'/>" \
    "<rotate x='1' y='2' z='-1' angle='33'/><translate x='.3' y='-.2' z='2'/>"           \
    "</transform></shape>"
#define CAMERA(transform)                                                                \
    "<sensor type='perspective'><float name='fov' value='50'/>"                          \
    "<float name='principal_point_offset_x' value='.1'/>"                                \
    "<transform name='to_world'><lookat origin='.5,1,-4' target='0,.2,1' "               \
    "up='0,1,.1'/>" transform                                                            \
    "</transform><film type='hdrfilm'><integer name='width' value='30'/>"                \
    "<integer name='height' value='20'/></film></sensor>"

/* ---- Velocities against differences ---------------------------------------------------- */

/* Point with weights b, unit normal, logarithm of the area: [7]. */
static void triangle_read(const struct triangle *t, const double b[3], real *out)
{
    triangle_point(t, b, out);
    out[6] = logl(triangle_normal(t, out + 3));
}

static void kind_test(enum imp__move_kind kind, const char *name)
{
    imp_scene *scene = scene_of(CUBE);
    struct imp__moves m = imp__moves_begin(scene, NULL);
    test_must(ctx, imp__moves_add(&m, kind, 0));
    const struct imp_triangles *t = &scene->shapes[0]->triangles;
    double *theta = calloc(m.n, sizeof *theta), *bar = calloc(m.n, sizeof *bar);
    double worst = 0, transposed = 0;
    for (uint32_t i = 0; i < 60; i++) {
        const struct imp_key key = imp__key(5, (uint64_t)kind, i);
        double b[2];
        const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
        imp__uniform_triangle(u, b);
        const struct imp_located at = {(int)(i % t->n_triangles),
                                       {(float)b[0], (float)b[1]}};
        for (size_t k = 0; k < m.n; k++) {
            theta[k] = imp__u01(key, (uint32_t)(10 + k)) - 0.5;
            bar[k] = 0;
        }
        const imp_v3 side = imp__v3(imp__u01(key, 2) - 0.5, imp__u01(key, 3) - 0.5, 0.1);
        struct imp__glued x = imp__glued_at(scene, 0, &at, 0, 0, side);
        const struct triangle rest = triangle_moved(&m, 0, at.prim, theta, 0);
        real along[3];
        triangle_grain(&rest, along);
        x.s = imp__v3((double)along[0], (double)along[1], (double)along[2]);
        const imp_v3 across = imp__cross(x.n, x.s);
        const struct imp__velocity v = imp__velocity_of(&m, &x, theta);
        real out[4][7];
        real grain[4];
        const real h = 1e-4L;
        for (int k = 0; k < 4; k++) {
            const struct triangle moved =
                triangle_moved(&m, 0, at.prim, theta, difference_at[k] * h);
            triangle_read(&moved, x.b, out[k]);
            real s[3];
            triangle_grain(&moved, s);
            grain[k] = across[0] * s[0] + across[1] * s[1] + across[2] * s[2];
        }
        double d[7];
        for (int k = 0; k < 7; k++) {
            const real f[4] = {out[0][k], out[1][k], out[2][k], out[3][k]};
            d[k] = (double)difference(f, h);
        }
        /* The normal is on the side that was asked for. */
        const double turn = imp__dot(x.n, imp__v3((double)out[0][3], (double)out[0][4],
                                                  (double)out[0][5])) < 0
                                ? -1
                                : 1;
        worst = fmax(worst, imp__dot(x.n, side) < 0);
        for (int k = 0; k < 3; k++) {
            worst = fmax(worst, fabs(v.v[k] - d[k]));
            worst = fmax(worst, fabs(v.n[k] - turn * d[3 + k]));
        }
        worst = fmax(worst, fabs(v.area - d[6]));
        worst = fmax(worst, fabs(v.turn - (double)difference(grain, h)));
        struct imp__velocity w = {.area = imp__u01(key, 4), .turn = imp__u01(key, 5)};
        double forward = w.area * v.area + w.turn * v.turn, reverse = 0;
        for (int k = 0; k < 3; k++) {
            w.v[k] = imp__u01(key, (uint32_t)(500 + k)) - 0.5;
            w.n[k] = imp__u01(key, (uint32_t)(600 + k)) - 0.5;
            forward += w.v[k] * v.v[k] + w.n[k] * v.n[k];
        }
        imp__velocity_bar(&m, &x, &w, bar);
        for (size_t k = 0; k < m.n; k++) reverse += bar[k] * theta[k];
        transposed = fmax(transposed, fabs(forward - reverse));
    }
    tap_ok(worst < 1e-10, "%s: velocity, turn and area of 60 points # %.1e", name, worst);
    tap_ok(transposed < 1e-12, "%s: the transpose # %.1e", name, transposed);
    free(theta);
    free(bar);
    imp__moves_free(&m);
    imp_scene_destroy(scene);
}

/* The same shape from a file with the motion written into it: the rounding of floats is
 * 6e-8 of a coordinate, over a step of .02. */
static void file_test(void)
{
    const double h = 0.02;
    double p[3][3] = {{0}}, worst = 0;
    imp_scene *at[3];
    for (int k = 0; k < 3; k++) {
        const double angle = (k - 1) * h * 180 / IMP_PI;
        at[k] = scene_of("<shape type='cube'><transform name='to_world'><scale x='.7' "
                         "y='.4' z='.9'/><rotate x='1' y='2' z='-1' angle='33'/>"
                         "<rotate x='2' y='1' z='2' angle='%.17g'/><translate x='%.17g' "
                         "y='-.2' z='2'/></transform></shape>",
                         angle, 0.3 + (k - 1) * h);
    }
    struct imp__moves m = imp__moves_begin(at[1], NULL);
    test_must(ctx, imp__moves_add(&m, IMP_MOVE_POSE, 0));
    const double theta[6] = {1, 0, 0, 2. / 3, 1. / 3, 2. / 3};
    for (int prim = 0; prim < 12; prim++) {
        const struct imp_located x = {prim, {0.3f, 0.5f}};
        struct imp_surface s[3];
        for (int k = 0; k < 3; k++) {
            imp__located_surface(at[k], 0, &x, 0, 0, &s[k]);
            for (int i = 0; i < 3; i++) p[k][i] = s[k].p[i];
        }
        const struct imp__glued g = imp__glued_at(at[1], 0, &x, 0, 0, s[1].ng);
        const struct imp__velocity v = imp__velocity_of(&m, &g, theta);
        for (int i = 0; i < 3; i++) {
            worst = fmax(worst, fabs(v.v[i] - (p[2][i] - p[0][i]) / (2 * h)));
            worst = fmax(worst, fabs(v.n[i] - (s[2].ng[i] - s[0].ng[i]) / (2 * h)));
        }
    }
    tap_ok(worst < 2e-4, "a pose is what the file's translate and rotate do # %.1e",
           worst);
    imp__moves_free(&m);
    for (int k = 0; k < 3; k++) imp_scene_destroy(at[k]);
}

static void camera_test(void)
{
    const double h = 1e-4;
    imp_scene *at[3];
    struct imp__moves m;
    double worst = 0, transposed = 0;
    for (int k = 0; k < 3; k++) {
        char text[512];
        const double angle = (k - 1) * h * 180 / IMP_PI;
        /* A turn about the camera's own place, then a shift. */
        snprintf(text, sizeof text,
                 "<translate x='-.5' y='-1' z='4'/><rotate x='2' y='1' z='2' "
                 "angle='%.17g'/><translate x='%.17g' y='1' z='-4'/>",
                 angle, 0.5 + (k - 1) * h);
        char sensor[2048];
        snprintf(sensor, sizeof sensor, CAMERA("%s"), text);
        at[k] = scene_of("%s" CUBE, sensor);
    }
    m = imp__moves_begin(at[1], at[1]->sensors[0]);
    test_must(ctx, imp__moves_add(&m, IMP_MOVE_POSE, IMP_MOVE_CAMERA));
    tap_ok(imp__length(m.mover[0].centre - imp__v3(.5, 1, -4)) < 1e-9,
           "the camera turns about the place where its rays meet # %.1e",
           imp__length(m.mover[0].centre - imp__v3(.5, 1, -4)));
    const double theta[6] = {1, 0, 0, 2. / 3, 1. / 3, 2. / 3};
    for (int i = 0; i < 20; i++) {
        struct imp_sensor_ray ray[3];
        for (int k = 0; k < 3; k++)
            at[k]->sensors[0]->ops->ray(at[k]->sensors[0], 1.5 * i, i, (double[2]){0},
                                        &ray[k]);
        const double t = 0.5 + 0.3 * i;
        const imp_v3 p = ray[1].o + ray[1].d * t;
        const imp_v3 d = (ray[2].o + ray[2].d * t - ray[0].o - ray[0].d * t) * (0.5 / h);
        const imp_v3 u = imp__camera_velocity(&m, ray[1].o, p, theta);
        worst = fmax(worst, imp__length(u - d));
        double bar[6] = {0}, sum = 0;
        imp__camera_velocity_bar(&m, ray[1].o, p, imp__v3(.3, -.4, .7), bar);
        for (int k = 0; k < 6; k++) sum += bar[k] * theta[k];
        transposed = fmax(transposed, fabs(sum - imp__dot(u, imp__v3(.3, -.4, .7))));
    }
    tap_ok(worst < 1e-7, "what a camera sees through a film position # %.1e", worst);
    tap_ok(transposed < 1e-13, "the transpose # %.1e", transposed);
    imp__moves_free(&m);
    for (int k = 0; k < 3; k++) imp_scene_destroy(at[k]);
}

/* ---- Edges -------------------------------------------------------------------------------- */

static double total(const struct imp__edges *e)
{
    double sum = 0;
    for (size_t k = 0; k < e->n; k++) sum += imp__length(e->edge[k].b - e->edge[k].a);
    return sum;
}

static void edges_test(void)
{
    struct imp__edges e;
    imp_scene *scene = scene_of(CUBE);
    test_must(ctx, imp__edges_build(scene, IMP_EDGES_ALL, &e));
    bool pairs = e.n == 12;
    for (size_t k = 0; k < e.n; k++) pairs &= e.edge[k].n_faces == 2;
    tap_ok(pairs && fabs(total(&e) - 8 * (.7 + .4 + .9)) < 1e-5,
           "a box of 24 vertices has 12 edges with two faces each # length %g",
           total(&e));

    /* Silhouettes close: at each corner their directions, with m to the left, add up to as
     * many that come as go. The solid angle inside is that of the box. */
    int odd = 0, counts[13] = {0};
    for (uint32_t i = 0; i < 200; i++) {
        const struct imp_key key = imp__key(2, 1, i);
        const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
        const imp_v3 eye = imp__v3(.3, -.2, 2) + imp__uniform_sphere(u) * 3;
        int n = 0;
        imp_v3 sum = {0};
        for (size_t k = 0; k < e.n; k++) {
            const struct imp__edge *x = &e.edge[k];
            const imp_v3 m = imp__cross(x->b - x->a, x->a - eye);
            const int side = imp__edge_side(&e, x, m);
            n += side != 0;
            sum += (x->b - x->a) * (double)side;
        }
        odd += !(imp__length(sum) < 1e-5) || (n != 4 && n != 6);
        counts[n]++;
    }
    tap_ok(odd == 0 && counts[6] > 20,
           "from outside 4 or 6 of them are silhouettes, and close # 4: %d, 6: %d",
           counts[4], counts[6]);
    struct tap_stat x[3] = {0};
    struct imp__edge_choice c;
    test_must(ctx, imp__edge_choice_begin(&e, NULL, NULL, 1, &c));
    for (uint32_t i = 0; i < 20000; i++) {
        struct imp__edge_point at;
        imp__edge_choice_draw(&c, imp__u01(imp__key(3, 0, i), 0), &at);
        for (int k = 0; k < 3; k++) tap_add(&x[k], at.p[k]);
    }
    const double middle[3] = {.3, -.2, 2};
    for (int k = 0; k < 3; k++)
        tap_z(&x[k], middle[k], 6e-3, "points by length have the middle of the box");
    imp__edge_choice_free(&c);
    imp__edges_free(&e);
    imp_scene_destroy(scene);

    /* Two boxes of one face in common: 12 + 12 - 4 edges, 4 of which have 4 faces. */
    scene = scene_of("<shape type='cube'/><shape type='cube'><transform name='to_world'>"
                     "<translate x='2'/></transform></shape>");
    test_must(ctx, imp__edges_build(scene, IMP_EDGES_ALL, &e));
    int four = 0;
    for (size_t k = 0; k < e.n; k++) four += e.edge[k].n_faces == 4;
    tap_ok(e.n == 20 && four == 4, "edges that lie on each other count once # %zu, %d",
           e.n, four);
    struct imp__moves m = imp__moves_begin(scene, NULL);
    const bool whole = !imp__edges_torn(&e, &m);
    test_must(ctx, imp__moves_add(&m, IMP_MOVE_SCALE, 1));
    tap_ok(whole && imp__edges_torn(&e, &m) != NULL,
           "one of them moves, and they are torn");
    imp__moves_free(&m);
    m = imp__moves_begin(scene, NULL);
    test_must(ctx, imp__moves_add(&m, IMP_MOVE_VERTICES, 0));
    tap_ok(imp__edges_torn(&e, &m) != NULL,
           "so are vertices that only lie on each other");
    imp__moves_free(&m);
    imp__edges_free(&e);
    imp_scene_destroy(scene);

    /* Squares of sides 2 and 1, the smaller one upright on the middle of an edge: cut into
     * 1/2, 1, 1/2. */
    scene = scene_of("<shape type='rectangle'/><shape type='rectangle'><transform "
                     "name='to_world'><scale value='.5'/><rotate x='1' angle='90'/>"
                     "<translate y='-1' z='.5'/></transform></shape>");
    test_must(ctx, imp__edges_build(scene, IMP_EDGES_ALL, &e));
    int two = 0;
    for (size_t k = 0; k < e.n; k++) {
        const struct imp__edge *x = &e.edge[k];
        if (x->n_faces != 2) continue;
        two += fabs(imp__length(x->b - x->a) - 1) < 1e-6 && fabs(x->a[1] + 1) < 1e-6;
    }
    tap_ok(e.n == 9 && two == 1 && fabs(total(&e) - 11) < 1e-5,
           "overlaps in part are cut # %zu edges of %g", e.n, total(&e));
    int other;
    tap_ok(imp__edges_pierced(&e, scene, &other) < 0, "and pierce nothing");
    imp__edges_free(&e);
    imp_scene_destroy(scene);

    scene = scene_of("<shape type='rectangle' id='floor'/>" CUBE
                     "<shape type='cube' id='b'><transform name='to_world'><scale "
                     "value='.2'/><rotate x='1' y='1' angle='20'/></transform></shape>");
    test_must(ctx, imp__edges_build(scene, IMP_EDGES_ALL, &e));
    int seams = 0;
    for (size_t k = 0; k < e.n; k++) seams += e.edge[k].seam;
    tap_ok(imp__edges_pierced(&e, scene, &other) < 0 && seams >= 4,
           "a box in a floor meets it in %d seams", seams);
    imp__edges_free(&e);
    imp_scene_destroy(scene);

    scene = scene_of("<shape type='cylinder' id='ball'><transform name='to_world'><scale "
                     "x='2'/></transform></shape>");
    const enum imp_status refused = imp__edges_build(scene, IMP_EDGES_ALL, &e);
    tap_ok(refused == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), "'ball'"),
           "what has no edges is refused by name # %s", imp_last_error(ctx));
    m = imp__moves_begin(scene, NULL);
    const enum imp_status no_pose = imp__moves_add(&m, IMP_MOVE_POSE, 0);
    tap_ok(no_pose == IMP_E_UNSUPPORTED, "and so is its pose # %s", imp_last_error(ctx));
    imp__moves_free(&m);
    imp_scene_destroy(scene);
}

/* Walls of a room that are made one by one, with blocks in it: brute force says which sides of
 * triangles are not covered. */
static void cornell_test(void)
{
    imp_scene *scene = test_scene(ctx, "cornell.xml", IMP_MONO, NULL);
    struct imp__edges e;
    test_must(ctx, imp__edges_build(scene, IMP_EDGES_ALL, &e));
    size_t shared = 0, open = 0;
    for (size_t k = 0; k < e.n; k++) {
        shared += e.edge[k].n_faces > 1;
        open += e.edge[k].n_faces == 1;
    }
    /* No point of an edge lies on another one. */
    int twice = 0;
    for (size_t k = 0; k < e.n; k++) {
        const imp_v3 p = e.edge[k].a * 0.39 + e.edge[k].b * 0.61;
        for (size_t j = 0; j < e.n; j++) {
            const imp_v3 d = e.edge[j].b - e.edge[j].a, r = p - e.edge[j].a;
            const double t = imp__dot(r, d) / imp__dot(d, d);
            if (j != k && t > 0 && t < 1) twice += imp__length(r - d * t) < 1e-3;
        }
    }
    int other;
    tap_ok(e.n > 30 && twice == 0,
           "cornell: %zu edges, none twice # %zu shared, %zu open", e.n, shared, open);
    tap_ok(imp__edges_pierced(&e, scene, &other) < 0, "its blocks stand in nothing");
    imp__edges_free(&e);
    imp_scene_destroy(scene);
}

/* ---- A number does not depend on what it was before ------------------------------------ */

static void number_set(imp_scene *s, const char *name, double v)
{
    struct imp_param_info info = {.size = sizeof info};
    double value[3] = {v, v, v};
    size_t at;
    test_must(ctx, imp_scene_find_param(s, name, &at));
    test_must(ctx, imp_scene_get_param(s, at, &info));
    test_must(ctx, imp_scene_set_values(s, at, info.count, value));
}

/* Area, and length, of a cylinder with one number at these values, one after the other. */
static void tube_after(const char *name, int n, const double v[], double out[2])
{
    imp_scene *s =
        scene_of("<shape type='cylinder' id='tube'><point name='p0' x='0' y='0' "
                 "z='0'/><point name='p1' x='0' y='0' z='2'/><float "
                 "name='radius' value='.5'/></shape>");
    struct imp__tube tube;
    test_must(ctx, imp_scene_add_geometry(s, name));
    for (int k = 0; k < n; k++) number_set(s, name, v[k]);
    out[0] = s->shapes[0]->area;
    out[1] = imp__moves_cylinder(s, 0, 0, &tube) ? tube.length : NAN;
    imp_scene_destroy(s);
}

static void again_test(void)
{
    static const char *const names[] = {"tube.radius", "tube.p0", "tube.p1",
                                        "tube.scale"};
    static const double many[] = {.3, 1.5, 1.5, .7};
    for (size_t k = 0; k < imp_count(names); k++) {
        double once[2], after[2];
        tube_after(names[k], 1, many + 3, once);
        tube_after(names[k], 4, many, after);
        tap_ok(once[0] == after[0] && once[1] == after[1],
               "%s: area %g and length %g, after other values %g and %g", names[k],
               once[0], once[1], after[0], after[1]);
    }
}

int main(void)
{
    ctx = test_context(1);
    kind_test(IMP_MOVE_POSE, "pose");
    kind_test(IMP_MOVE_AFFINE, "affine");
    kind_test(IMP_MOVE_SCALE, "scale");
    kind_test(IMP_MOVE_VERTICES, "vertices");
    file_test();
    camera_test();
    edges_test();
    cornell_test();
    again_test();
    imp_context_destroy(ctx);
    return tap_done();
}

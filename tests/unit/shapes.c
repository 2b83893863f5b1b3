/* SPDX-License-Identifier: Apache-2.0
 *
 * Shapes alone: areas, bounds, orientation, uv and their derivatives, vertex normals, and
 * what hostile input gets. */
#include "imp_fail_alloc.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/warp.h"
#include "shape_nodes.h"

static imp_context *ctx;

static struct imp_mat4 scale_then_turn(double x, double y, double z)
{
    const struct imp_mat4 s = imp__scale(imp__v3(x, y, z));
    const struct imp_mat4 r = imp__rotate(imp__normalize(imp__v3(2, -1, 0.7)), 61);
    const struct imp_mat4 t = imp__translate(imp__v3(3, -1, 2));
    const struct imp_mat4 m = imp__mat4_multiply(&r, &s);
    return imp__mat4_multiply(&t, &m);
}

static bool is_curve(const struct imp_shape_ops *ops)
{
    return !strcmp(ops->name, "bsplinecurve") || !strcmp(ops->name, "linearcurve");
}

/* Area of an affine image of the octahedron: eight triangles, Heron's formula. */
static double octahedron_area(const struct imp_mat4 *m)
{
    double sum = 0;
    for (int k = 0; k < 8; k++) {
        imp_v3 p[3];
        for (int i = 0; i < 3; i++) {
            const float *q = octa_positions + 3 * octa_indices[3 * k + i];
            p[i] = imp__point(m, imp__v3(q[0], q[1], q[2]));
        }
        const double a = imp__length(p[0] - p[1]), b = imp__length(p[1] - p[2]),
                     c = imp__length(p[2] - p[0]), h = (a + b + c) / 2;
        sum += sqrt(h * (h - a) * (h - b) * (h - c));
    }
    return sum;
}

/* Trapezoids of |(-a sin, b cos)|, which is periodic: exact to all digits. */
static double circumference(double a, double b)
{
    double sum = 0;
    for (int i = 0; i < 400; i++) {
        const double phi = IMP_2PI * i / 400;
        sum += hypot(a * sin(phi), b * cos(phi)) * IMP_2PI / 400;
    }
    return sum;
}

static void areas(void)
{
    const struct imp_mat4 even = scale_then_turn(3, 3, 3),
                          uneven = scale_then_turn(2, 3, 5);
    static const char *const kinds[] = {
        "rectangle", "disk", "sphere",     "cylinder",     "cube",       "mesh",
        "obj",       "ply",  "serialized", "bsplinecurve", "linearcurve"};
    for (size_t k = 0; k < imp_count(kinds); k++) {
        const double expected[] = {4 * 2 * 3,
                                   IMP_PI * 2 * 3,
                                   4 * IMP_PI * 9,
                                   5 * circumference(2, 3),
                                   8 * (2 * 3 + 3 * 5 + 5 * 2),
                                   octahedron_area(&uneven)},
                     /* A tube along x, whose radius stays. */
            curve = IMP_2PI * 0.4 * 2 * (k == 9 ? 0.8 : 2.4);
        world_begin(ctx);
        struct imp_node *n = kind_node(shape_kind(kinds[k]));
        node_transform(n, k == 2 ? even : uneven);
        struct imp_shape *s = shape_build(n, NULL);
        /* Meshes hold floats. */
        tap_near(s ? s->area : NAN, k < 9 ? expected[imp_min(k, (size_t)5)] : curve,
                 k < 4 ? 1e-13 : 5e-7, 0, kinds[k]);
        world_end();
    }
    int n_kinds = 0;
    while (imp__shape_kinds[n_kinds]) n_kinds++;
    tap_ok(n_kinds == (int)imp_count(kinds), "every kind has a closed-form area here");

    world_begin(ctx);
    struct imp_node *ball = node_new("shape", "sphere"),
                    *tube = node_new("shape", "cylinder");
    node_vector(ball, "center", imp__v3(1, 2, 3));
    node_float(ball, "radius", 0.25);
    node_transform(ball, scale_then_turn(2, 2, 2));
    node_vector(tube, "p0", imp__v3(1, 0, 0));
    node_vector(tube, "p1", imp__v3(1, 3, 4));
    node_float(tube, "radius", 0.5);
    const struct imp_shape *a = shape_build(ball, NULL), *b = shape_build(tube, NULL);
    const struct imp_mat4 m = scale_then_turn(2, 2, 2);
    tap_near(a ? a->area : NAN, IMP_PI, 1e-13, 0, "sphere of radius 0.25, scaled by 2");
    tap_ok(a && imp__length((a->lo + a->hi) * 0.5 - imp__point(&m, imp__v3(1, 2, 3))) <
                    1e-13,
           "its centre went with to_world");
    tap_near(b ? b->area : NAN, 5 * IMP_PI, 1e-13, 0, "cylinder of length 5, radius 0.5");
    tap_ok(b && fabs(b->lo[1] + 0.4) < 1e-13 && fabs(b->hi[2] - 4.3) < 1e-13 &&
               fabs(b->lo[0] - 0.5) < 1e-13,
           "its bounds are tight # %g %g %g", b->lo[0], b->lo[1], b->hi[2]);
    world_end();
}

/* Random surface points through random rays: the frame is orthonormal, the point is in
 * the bounds, and p(uv) has the derivatives dp_du, dp_dv. */
static void surfaces(const struct imp_shape_ops *ops, int even, int flip, int mirror)
{
    world_begin(ctx);
    struct imp_node *node = kind_node(ops);
    node_transform(node, even ? scale_then_turn(1.5, 1.5, mirror ? -1.5 : 1.5)
                              : scale_then_turn(1.5, 0.7, mirror ? -1.2 : 1.2));
    node_bool(node, "flip_normals", flip);
    struct imp_shape *s = shape_build(node, NULL);
    double worst_frame = 0, worst_slope = 0, worst_bounds = 0, worst_side = 1;
    int hits = 0, pairs = 0, inward = 0, bad_uv = 0;
    const int closed = s && strcmp(ops->name, "rectangle") && strcmp(ops->name, "disk");
    if (s && imp__intersector_create(&world) == IMP_OK) {
        const imp_v3 center = (s->lo + s->hi) * 0.5;
        const double size = imp__length(s->hi - s->lo);
        for (uint32_t i = 0; i < 6000; i++) {
            const struct imp_key key = imp__key(3, 0, i);
            const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
            const imp_v3 o = center + imp__uniform_sphere(u) * size;
            const double v[2] = {imp__u01(key, 2), imp__u01(key, 3)};
            const imp_v3 d =
                imp__normalize(center + imp__uniform_sphere(v) * (0.25 * size) - o);
            struct imp_hit hit;
            struct imp_surface a, b;
            if (!imp__intersect(&world, &o, &d, 0, INFINITY, &hit)) continue;
            hits++;
            ops->surface(s, &hit, &o, &d, &a);
            worst_frame = fmax(worst_frame, fabs(imp__length(a.n) - 1));
            worst_frame = fmax(worst_frame, fabs(imp__length(a.ng) - 1));
            worst_frame = fmax(worst_frame, fabs(imp__length(a.s) - 1));
            worst_frame = fmax(worst_frame, fabs(imp__dot(a.s, a.n)));
            worst_frame = fmax(worst_frame, imp__length(imp__cross(a.n, a.s) - a.t));
            for (int k = 0; k < 3; k++)
                worst_bounds =
                    fmax(worst_bounds, fmax(s->lo[k] - a.p[k], a.p[k] - s->hi[k]));
            /* Shading and geometric normal on one side, whatever was mirrored. */
            worst_side = fmin(worst_side, imp__dot(a.n, a.ng));
            inward += imp__dot(a.ng, a.p - center) < 0;
            bad_uv += !(a.uv[0] >= -1e-6 && a.uv[0] <= 1 + 1e-6 && a.uv[1] >= -1e-6 &&
                        a.uv[1] <= 1 + 1e-6);
            worst_frame = fmax(worst_frame, fabs(imp__dot(a.dp_du, a.ng)) /
                                                imp__length(a.dp_du) * (1 - 1e-3));
            const double h = 1e-4;
            const imp_v3 d2 = imp__normalize(
                d + imp__v3(h * (v[0] - 0.5), h * (u[1] - 0.5), h * (u[0] - 0.5)));
            struct imp_hit near;
            if (!imp__intersect(&world, &o, &d2, 0, INFINITY, &near) ||
                near.prim != hit.prim)
                continue;
            ops->surface(s, &near, &o, &d2, &b);
            const double du = b.uv[0] - a.uv[0], dv = b.uv[1] - a.uv[1];
            if (fabs(du) > 0.1 || fabs(dv) > 0.1)
                continue; /* over the seam of the angle */
            if (fabs(imp__dot(a.ng, d)) < 0.2) continue;
            if (s->geometry == IMP_CURVES && (a.uv[1] <= 0 || a.uv[1] >= 1))
                continue; /* a ball at an end */
            if (imp__length(a.dp_du) < 0.2 || imp__length(a.dp_dv) < 0.2)
                continue; /* pole */
            pairs++;
            const imp_v3 error = b.p - a.p - a.dp_du * du - a.dp_dv * dv;
            worst_slope = fmax(worst_slope, imp__length(error) / (h * size));
        }
    }
    /* Analytic shapes turn their normal when mirrored; meshes keep their outside. */
    const int turned = s && s->geometry == IMP_ANALYTIC ? flip != mirror : flip;
    const int expected = !closed ? inward : turned ? hits : 0;
    /* The box of a spline is that of its control points. */
    tap_ok(hits > (is_curve(ops) ? 500 : 1000) && pairs > 500 && worst_frame < 1e-6 &&
               worst_bounds < 1e-6 && worst_side > 0.2 && worst_slope < 3e-3 &&
               bad_uv == 0 && inward == expected,
           "%s%s%s%s: frame, bounds, side, derivatives # hits %d pairs %d frame %.1e "
           "bounds %.1e "
           "slope %.1e side %.2f inward %d",
           even ? "" : "uneven ", ops->name, flip ? " flipped" : "",
           mirror ? " mirrored" : "", hits, pairs, worst_frame, worst_bounds, worst_slope,
           worst_side, inward);
    world_end();
}

/* Normal seen by a ray straight down on a shape around the origin. */
static void seen_from_above(const char *type, double sx, double sz, int flip,
                            double expected, const char *what)
{
    world_begin(ctx);
    struct imp_node *n = kind_node(shape_kind(type));
    node_transform(n, imp__scale(imp__v3(sx, 1, sz)));
    node_bool(n, "flip_normals", flip);
    struct imp_shape *s = shape_build(n, NULL);
    const imp_v3 o = imp__v3(0.1, 0.2, 9), d = imp__v3(0, 0, -1);
    struct imp_hit hit;
    struct imp_surface at = {.uv = {NAN, NAN}};
    if (s && imp__intersector_create(&world) == IMP_OK &&
        imp__intersect(&world, &o, &d, 0, INFINITY, &hit))
        s->ops->surface(s, &hit, &o, &d, &at);
    tap_ok(at.ng[2] * expected > 0.5 && at.n[2] * expected > 0.5,
           "%s: normal %+g # ng_z %g", what, expected, at.ng[2]);
    world_end();
}

static struct imp_surface look(struct imp_shape *s, imp_v3 o, imp_v3 d)
{
    struct imp_hit hit;
    struct imp_surface at = {.uv = {NAN, NAN}};
    d = imp__normalize(d);
    if (s && imp__intersect(&world, &o, &d, 0, INFINITY, &hit))
        s->ops->surface(s, &hit, &o, &d, &at);
    return at;
}
static int uv_is(const struct imp_surface *at, double u, double v)
{
    return fabs(at->uv[0] - u) < 2e-6 && fabs(at->uv[1] - v) < 2e-6;
}

/* uv by docs/scene-format.md 4.2, at points whose uv can be said without computing. */
static void uvs(void)
{
    static const char *const kinds[] = {"rectangle", "disk", "sphere", "cylinder",
                                        "cube"};
    world_begin(ctx);
    struct imp_shape *s[5];
    for (int k = 0; k < 5; k++) {
        struct imp_node *n = node_new("shape", kinds[k]);
        node_transform(n, imp__translate(imp__v3(10 * k, 0, 0)));
        s[k] = shape_build(n, NULL);
    }
    if (imp__intersector_create(&world) != IMP_OK) return;
    const imp_v3 down = imp__v3(0, 0, -1);
    struct imp_surface a = look(s[0], imp__v3(0.5, -0.2, 5), down);
    tap_ok(uv_is(&a, 0.75, 0.4), "rectangle uv # %g %g", a.uv[0], a.uv[1]);
    tap_ok(imp__length(a.dp_du - imp__v3(2, 0, 0)) == 0 &&
               imp__length(a.dp_dv - imp__v3(0, 2, 0)) == 0,
           "rectangle dp_du, dp_dv");
    a = look(s[1], imp__v3(10, -0.5, 5), down);
    tap_ok(uv_is(&a, 0.5, 0.75), "disk uv: radius, turn # %g %g", a.uv[0], a.uv[1]);
    a = look(s[2], imp__v3(20, 5, 0), imp__v3(0, -1, 0));
    tap_ok(uv_is(&a, 0.25, 0.5), "sphere uv on +y # %g %g", a.uv[0], a.uv[1]);
    a = look(s[2], imp__v3(25, 0, 5), imp__v3(-1, 0, -1));
    tap_ok(uv_is(&a, 0, 0.25), "sphere uv 45 degrees up # %g %g", a.uv[0], a.uv[1]);
    a = look(s[2], imp__v3(20, 0, 5), down);
    tap_ok(imp__is_finite(a.s) && imp__is_finite(a.t) && a.n[2] == 1 && a.uv[1] == 0,
           "sphere at the pole: a frame without dp_du");
    a = look(s[3], imp__v3(25, 0, 0.3), imp__v3(1, 0, 0));
    tap_ok(uv_is(&a, 0.5, 0.3), "cylinder uv on -x # %g %g", a.uv[0], a.uv[1]);
    /* +Z face: (+,-)(+,+)(-,+)(-,-) have uv (0,1)(1,1)(1,0)(0,0). */
    a = look(s[4], imp__v3(40.5, -0.2, 5), down);
    tap_ok(uv_is(&a, 0.4, 0.75), "cube uv on +Z # %g %g", a.uv[0], a.uv[1]);
    a = look(s[4], imp__v3(40.5, -5, 0.2), imp__v3(0, 1, 0));
    tap_ok(uv_is(&a, 0.6, 0.75), "cube uv on -Y # %g %g", a.uv[0], a.uv[1]);
    world_end();

    /* No uv in a mesh: the weights of the file's second and third vertex, also reversed.
     */
    for (int flip = 0; flip < 2; flip++) {
        static const float p[9 + 4] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
        static const uint32_t i[3] = {0, 1, 2};
        const struct imp_mesh_data one = {
            .n_vertices = 3, .n_triangles = 1, .positions = p, .indices = i};
        world_begin(ctx);
        struct imp_node *n = node_new("shape", "mesh");
        n->mesh = &one;
        node_bool(n, "flip_normals", flip);
        struct imp_shape *t = shape_build(n, NULL);
        if (imp__intersector_create(&world) != IMP_OK) return;
        a = look(t, imp__v3(0.3, 0.2, 5), down);
        tap_ok(uv_is(&a, 0.3, 0.2) && a.ng[2] == (flip ? -1 : 1) && a.n[2] == a.ng[2] &&
                   imp__length(a.dp_du - imp__v3(1, 0, 0)) == 0,
               "mesh without uv%s # %g %g", flip ? ", flipped" : "", a.uv[0], a.uv[1]);
        world_end();
    }
}

/* Vertex normals of a cube: angles make all corners (1,1,1)/sqrt(3) although one, two or
 * three of a corner's triangles lie in each face; areas or a plain mean would not. */
static void vertex_normals(void)
{
    static const float split[24 * 3 + 4] = {
        1,  -1, -1, 1,  -1, 1,  -1, -1, 1,  -1, -1, -1, 1,  1,  -1, -1, 1,  -1,
        -1, 1,  1,  1,  1,  1,  1,  -1, -1, 1,  1,  -1, 1,  1,  1,  1,  -1, 1,
        1,  -1, 1,  1,  1,  1,  -1, 1,  1,  -1, -1, 1,  -1, -1, 1,  -1, 1,  1,
        -1, 1,  -1, -1, -1, -1, 1,  1,  -1, 1,  -1, -1, -1, -1, -1, -1, 1,  -1};
    uint32_t index[36];
    float normal[72];
    for (uint32_t f = 0; f < 6; f++) {
        const uint32_t q[6] = {4 * f, 4 * f + 1, 4 * f + 2, 4 * f + 3, 4 * f, 4 * f + 2};
        memcpy(index + 6 * f, q, sizeof q);
    }
    double worst = 0;
    const int st = imp__mesh_normals(ctx, 24, 12, split, index, normal);
    for (int k = 0; k < 72; k++)
        worst = fmax(worst, fabs(normal[k] - split[k] / sqrt(3)));
    tap_ok(st == IMP_OK && worst < 1e-7,
           "angle-weighted normals over split vertices # worst %.1e", worst);

    /* -0 and +0 are one place; an unused vertex has (1,0,0). */
    static const float tent[7 * 3 + 4] = {0, 0.0f, 0, 1, 0, 0, 0, 1, 0, 0, -0.0f,
                                          0, 0,    1, 0, 0, 0, 1, 7, 7, 7};
    static const uint32_t two[6] = {0, 1, 2, 3, 4, 5};
    const int st2 = imp__mesh_normals(ctx, 7, 2, tent, two, normal);
    tap_ok(st2 == IMP_OK && fabs(normal[0] - sqrt(0.5)) < 1e-7 &&
               fabs(normal[2] - sqrt(0.5)) < 1e-7 && normal[9] == normal[0],
           "normals meet over -0 # %g %g", normal[0], normal[2]);
    tap_ok(normal[18] == 1 && normal[19] == 0 && normal[20] == 0, "an unused vertex");

    /* Normals of the file: inverse transpose, flip, face_normals. */
    static const float p[9 + 4] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    static const float given[9] = {0, 1, 1, 0, 1, 1, 0, 1, 1};
    static const uint32_t i[3] = {0, 1, 2};
    const struct imp_mesh_data one = {.n_vertices = 3,
                                      .n_triangles = 1,
                                      .positions = p,
                                      .normals = given,
                                      .indices = i,
                                      .normals_from_file = true};
    for (int k = 0; k < 4; k++) {
        world_begin(ctx);
        struct imp_node *n = node_new("shape", "mesh");
        n->mesh = &one;
        /* y doubled: normal (0, 1/2, 1); mirrored in x changes the winding, no normal. */
        node_transform(n, imp__scale(imp__v3(k == 2 ? -1 : 1, 2, 1)));
        node_bool(n, "flip_normals", k == 1);
        node_bool(n, "face_normals", k == 3);
        struct imp_shape *s = shape_build(n, NULL);
        if (imp__intersector_create(&world) != IMP_OK) return;
        const struct imp_surface a =
            look(s, imp__v3(k == 2 ? -0.2 : 0.2, 0.2, 5), imp__v3(0, 0, -1));
        const double sign = k == 1 ? -1 : 1;
        const imp_v3 n_ref =
            k == 3 ? imp__v3(0, 0, 1) : imp__normalize(imp__v3(0, 0.5, 1)) * sign;
        tap_ok(imp__length(a.n - n_ref) < 1e-6 && a.ng[2] == sign,
               "normals from the file %d # %g %g %g, ng_z %g", k, a.n[0], a.n[1], a.n[2],
               a.ng[2]);
        world_end();
    }

    /* Between the vertices they are interpolated, and made unit again. */
    static const float turned[9] = {0, 0, 1, 1, 0, 1, 0, 2, 1};
    struct imp_mesh_data bent = one;
    bent.normals = turned;
    world_begin(ctx);
    struct imp_node *node = node_new("shape", "mesh");
    node->mesh = &bent;
    struct imp_shape *s = shape_build(node, NULL);
    if (imp__intersector_create(&world) != IMP_OK) return;
    const struct imp_surface a = look(s, imp__v3(0.5, 0.2, 5), imp__v3(0, 0, -1));
    imp_v3 sum = imp__v3(0, 0, 0);
    const double weight[3] = {0.3, 0.5, 0.2};
    for (int k = 0; k < 3; k++)
        sum += imp__normalize(imp__v3(turned[3 * k], turned[3 * k + 1], 1)) * weight[k];
    tap_ok(imp__length(a.n - imp__normalize(sum)) < 1e-6 && a.ng[2] == 1,
           "normals between the vertices # %g %g %g", a.n[0], a.n[1], a.n[2]);
    world_end();
}

static void expect_error(struct imp_node *n, enum imp_status expected, const char *words)
{
    enum imp_status st;
    shape_build(n, &st);
    const char *text = imp_last_error(ctx);
    tap_ok(st == expected && strstr(text, words), "error: %s # %s", words, text);
}

static struct imp_node *mesh_node(const struct imp_mesh_data *data)
{
    struct imp_node *n = node_new("shape", "mesh");
    n->mesh = data;
    return n;
}

static void errors(void)
{
    world_begin(ctx);
    static float p[12 + 4] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
    static float uv[8], normals[12];
    static uint32_t i[6] = {0, 1, 2, 1, 3, 2};
    struct imp_mesh_data m = {
        .n_vertices = 4, .n_triangles = 2, .positions = p, .indices = i};
    p[7] = NAN;
    expect_error(mesh_node(&m), IMP_E_SCENE, "vertex 2 is not finite");
    p[7] = INFINITY;
    expect_error(mesh_node(&m), IMP_E_SCENE, "vertex 2 is not finite");
    p[7] = 2e18f;
    expect_error(mesh_node(&m), IMP_E_SCENE, "vertex 2 is not finite, or further");
    p[7] = 1;
    i[4] = 4;
    expect_error(mesh_node(&m), IMP_E_SCENE, "triangle 1 names vertex 4; there are 4");
    i[4] = UINT32_MAX;
    expect_error(mesh_node(&m), IMP_E_SCENE, "triangle 1 names vertex 4294967295");
    i[4] = 3;
    uv[5] = NAN;
    m.uvs = uv;
    expect_error(mesh_node(&m), IMP_E_SCENE, "uv of vertex 2");
    m.uvs = NULL;
    normals[3] = INFINITY;
    m.normals = normals;
    expect_error(mesh_node(&m), IMP_E_SCENE, "normal of vertex 1");
    m.normals = NULL;
    m.n_triangles = 0;
    expect_error(mesh_node(&m), IMP_E_SCENE, "no triangles");
    expect_error(mesh_node(NULL), IMP_E_SCENE, "no triangles were given");
    m.n_triangles = (size_t)1 << 40;
    expect_error(mesh_node(&m), IMP_E_SCENE, "more than 2^31");

    for (int k = 0; imp__shape_kinds[k]; k++) {
        struct imp_node *n = kind_node(imp__shape_kinds[k]);
        node_transform(n, imp__scale(imp__v3(1, 0, 1)));
        expect_error(n, IMP_E_SCENE, "to_world is singular");
        n = kind_node(imp__shape_kinds[k]);
        node_transform(n, imp__scale(imp__v3(1, NAN, 1)));
        expect_error(n, IMP_E_SCENE, "to_world is not finite");
        struct imp_mat4 project = imp__mat4_identity();
        project.m[14] = 1;
        n = kind_node(imp__shape_kinds[k]);
        node_transform(n, project);
        expect_error(n, IMP_E_SCENE, "not affine");
        n = kind_node(imp__shape_kinds[k]);
        node_float(n, "colour", 1);
        expect_error(n, IMP_E_SCENE, "'colour'");
    }
    struct imp_node *n = node_new("shape", "sphere");
    node_float(n, "radius", 0);
    expect_error(n, IMP_E_SCENE, "its length, 0, is outside (0, ");
    n = node_new("shape", "sphere");
    node_float(n, "radius", 1e200);
    expect_error(n, IMP_E_SCENE, "its length, 1e+200, is outside (0, ");
    n = node_new("shape", "cylinder");
    node_vector(n, "p1", imp__v3(0, 0, 0));
    expect_error(n, IMP_E_SCENE, "p0 and p1 are 0 apart");
    n = node_new("shape", "sphere");
    node_string(n, "radius", "large");
    expect_error(n, IMP_E_SCENE, "must be a float, not a string");
    world_end();
}

/* Slivers, degenerate triangles and far-off scenes: finite everywhere, never drawn. */
static void degenerate(void)
{
    static const float p[7 * 3 + 4] = {0, 0, 0, 1,      0, 0, 0.5f, 0, 0, /* collinear */
                                       0, 1, 0, 1e-30f, 1, 0, 0,    2, 0, 1, 1, 0};
    static const uint32_t i[5 * 3] = {0, 1, 2, 0, 0, 0, 0, 1, 3, 3, 4, 5, 5, 5, 1};
    const struct imp_mesh_data m = {
        .n_vertices = 7, .n_triangles = 5, .positions = p, .indices = i};
    world_begin(ctx);
    struct imp_shape *s = shape_build(mesh_node(&m), NULL);
    tap_near(s ? s->area : NAN, 0.5, 1e-12, 0, "only the triangle with area counts");
    const double *areas = s ? ((struct imp__mesh *)s->self)->cumulative : NULL;
    tap_ok(s && imp__shape_measure(ctx, &world.arena, s) == IMP_OK &&
               ((struct imp__mesh *)s->self)->cumulative == areas && s->area == 0.5,
           "it is measured once");
    int other = 0, bad = 0;
    const imp_v3 ref = imp__v3(0.2, 0.3, 2);
    for (uint32_t k = 0; s && k < 2000; k++) {
        const struct imp_key key = imp__key(1, 0, k);
        const double u[2] = {k == 0   ? 0
                             : k == 1 ? 0x1.fffffffffffffp-1
                                      : imp__u01(key, 0),
                             imp__u01(key, 1)};
        struct imp_light_sample l;
        if (!s->ops->sample_toward(s, &ref, u, &l)) other++;
        else if (!(l.pdf > 0 && isfinite(l.pdf) && fabs(l.p[2]) < 1e-12 &&
                   l.p[0] + l.p[1] <= 1 + 1e-6))
            bad++;
    }
    tap_ok(s && other == 0 && bad == 0, "and is drawn # none %d bad %d", other, bad);
    for (int k = 0; s && k < 5; k++) {
        const struct imp_hit hit = {.prim = k, .u = 0.25, .v = 0.5};
        struct imp_surface at;
        s->ops->surface(s, &hit, &ref, &ref, &at);
        bad +=
            !(imp__is_finite(at.p) && imp__is_finite(at.ng) && imp__is_finite(at.n) &&
              imp__is_finite(at.s) && imp__is_finite(at.t) && isfinite(at.uv[0]) &&
              fabs(imp__length(at.s) - 1) < 1e-9 && fabs(imp__length(at.n) - 1) < 1e-6);
    }
    tap_ok(bad == 0, "surfaces of degenerate triangles are finite");
    int rays = 0;
    if (s && imp__intersector_create(&world) == IMP_OK)
        for (uint32_t k = 0; k < 5000; k++) {
            const struct imp_key key = imp__key(2, 0, k);
            const imp_v3 o = imp__v3(imp__u01(key, 0) * 2 - 0.5,
                                     imp__u01(key, 1) * 3 - 0.5, k % 2 ? 1 : 0);
            const imp_v3 d = k % 2 ? imp__v3(0, 0, -1) : imp__v3(1, 0, 0);
            struct imp_hit hit;
            if (!imp__intersect(&world, &o, &d, 0, INFINITY, &hit)) continue;
            struct imp_surface at;
            rays++;
            s->ops->surface(s, &hit, &o, &d, &at);
            bad += !imp__is_finite(at.p) || !imp__is_finite(at.s) || !isfinite(hit.t);
        }
    tap_ok(rays > 100 && bad == 0, "rays on and across them # hits %d bad %d", rays, bad);
    world_end();

    /* A mesh that has no area at all is fine until it has to shine. */
    static const struct imp_mesh_data flat = {
        .n_vertices = 7, .n_triangles = 2, .positions = p, .indices = i};
    world_begin(ctx);
    struct imp_light_sample l;
    s = shape_build(mesh_node(&flat), NULL);
    tap_ok(s && s->area == 0 &&
               !s->ops->sample_toward(s, &ref, (double[2]){0.5, 0.5}, &l),
           "a mesh without area is not sampled");
    world_end();

    for (int k = 0; imp__shape_kinds[k]; k++) {
        world_begin(ctx);
        struct imp_node *n = kind_node(imp__shape_kinds[k]);
        const imp_v3 far = imp__v3(1e6, -1e6, 1e6);
        node_transform(n, imp__translate(far));
        s = shape_build(n, NULL);
        int hits = 0;
        bad = 0;
        if (s && imp__intersector_create(&world) == IMP_OK)
            for (uint32_t r = 0; r < 2000; r++) {
                const struct imp_key key = imp__key(4, 0, r);
                const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
                const imp_v3 d = imp__uniform_sphere(u),
                             o = far - d * 40.0 +
                                 imp__v3(imp__u01(key, 2), imp__u01(key, 3),
                                         imp__u01(key, 4)) *
                                     0.2;
                struct imp_hit hit;
                struct imp_surface at;
                if (!imp__intersect(&world, &o, &d, 0, INFINITY, &hit)) continue;
                hits++;
                s->ops->surface(s, &hit, &o, &d, &at);
                bad += !(imp__length(at.p - far) < 2) || !imp__is_finite(at.s) ||
                       fabs(imp__length(at.n) - 1) > 1e-6;
            }
        tap_ok(hits > 400 && bad == 0, "%s at 1e6 # hits %d bad %d",
               imp__shape_kinds[k]->name, hits, bad);
        world_end();
    }
}

/* Numbers of any size where numbers go: an error, or a shape whose answers are numbers.
 */
static double wild(struct imp_key key, uint32_t dim)
{
    static const double special[] = {0,    -0.0, 1,    -1,       1e-300, 1e300, 1e-30,
                                     1e17, 1e18, 1e19, INFINITY, NAN,    3e38,  1e-45};
    const double u = imp__u01(key, dim);
    if (u < 0.15) return special[(int)(imp__u01(key, dim + 1) * imp_count(special))];
    const double size = pow(10, 24 * imp__u01(key, dim + 1) - 12);
    return u < 0.6 ? 2 * u : (u < 0.8 ? -size : size);
}
static void hostile(void)
{
    int refused = 0, built = 0, hits = 0, bad = 0;
    for (uint64_t round = 0; round < 4000; round++) {
        const struct imp_key key = imp__key(99, 0, round);
        int n_kinds = 0;
        while (imp__shape_kinds[n_kinds]) n_kinds++;
        const struct imp_shape_ops *ops = imp__shape_kinds[round % (uint64_t)n_kinds];
        float p[18 + 4] = {0};
        for (uint32_t i = 0; i < 18; i++)
            p[i] = imp__u01(key, 100 + i) < 0.9 ? octa_positions[i]
                                                : (float)wild(key, 200 + 2 * i);
        struct imp_mesh_data m = octahedron;
        m.positions = p;
        world_begin(ctx);
        struct imp_node *n = node_new("shape", ops->name);
        if (kind_node(ops)->mesh) n->mesh = &m;
        float q[16 + 4] = {0};
        struct imp_curve_data c = tube_curves;
        for (uint32_t i = 0; i < 16; i++)
            q[i] = imp__u01(key, 100 + i) < 0.9 ? tube_points[i]
                                                : (float)wild(key, 200 + 2 * i);
        c.points = q;
        if (kind_node(ops)->curves) n->curves = &c;
        struct imp_mat4 to_world = imp__mat4_identity();
        for (uint32_t i = 0; i < 12; i++)
            if (imp__u01(key, i) < 0.3) to_world.m[i] = wild(key, 20 + 2 * i);
        node_transform(n, to_world);
        if (!strcmp(ops->name, "sphere") || !strcmp(ops->name, "cylinder"))
            node_float(n, "radius", wild(key, 60));
        if (!strcmp(ops->name, "cylinder"))
            node_vector(n, "p1", imp__v3(wild(key, 62), wild(key, 64), wild(key, 66)));
        struct imp_shape *s = shape_build(n, NULL);
        if (!s || imp__intersector_create(&world) != IMP_OK) {
            refused++;
            bad += !*imp_last_error(ctx);
            world_end();
            continue;
        }
        built++;
        bad += !isfinite(s->area) || !(s->area >= 0);
        const imp_v3 center = (s->lo + s->hi) * 0.5;
        const double size = imp__length(s->hi - s->lo);
        for (uint32_t i = 0; i < 8; i++) {
            const double u[2] = {imp__u01(key, 300 + 2 * i), imp__u01(key, 301 + 2 * i)};
            const imp_v3 d = imp__uniform_sphere(u), o = center - d * size;
            struct imp_hit hit;
            struct imp_surface at;
            if (imp__intersect(&world, &o, &d, 0, INFINITY, &hit)) {
                hits++;
                ops->surface(s, &hit, &o, &d, &at);
                bad += !imp__is_finite(at.p) || !(fabs(imp__length(at.n) - 1) < 1e-6) ||
                       !(fabs(imp__length(at.s) - 1) < 1e-6) || !isfinite(at.uv[0]) ||
                       (ops->pdf_toward && !(ops->pdf_toward(s, &o, &hit, &at) >= 0));
            }
            struct imp_light_sample l;
            if (ops->sample_toward && ops->sample_toward(s, &o, u, &l))
                bad += !(l.pdf > 0) || !(fabs(imp__length(l.wi) - 1) < 1e-6) ||
                       !isfinite(l.dist) || !isfinite(l.cos_light);
        }
        world_end();
    }
    tap_ok(bad == 0 && refused > 500 && built > 500 && hits > 1000,
           "numbers of any size # refused %d built %d hits %d bad %d", refused, built,
           hits, bad);
}

/* ---- the n-th allocation fails ------------------------------------------------- */

static void starved(void)
{
    imp_context *whole = ctx;
    int tries = 0, wrong = 0, done = 0;
    long leaked = 0;
    for (long n = 1; n < 200 && !done; n++) {
        struct fail_alloc heap = {.fail_at = n};
        struct imp_context_options options = IMP_CONTEXT_OPTIONS_INIT;
        options.threads = 1;
        options.allocator = fail_alloc_hooks(&heap);
        tries++;
        if (imp_context_create(&options, &ctx) != IMP_OK) continue;
        world_begin(ctx);
        enum imp_status st = IMP_OK;
        for (int k = 0; imp__shape_kinds[k] && st == IMP_OK; k++) {
            struct imp_node *node =
                imp__node_create(&world.arena, "shape", imp__shape_kinds[k]->name, NULL,
                                 NULL, (struct imp_loc){0});
            if (!node) {
                st = IMP_E_NOMEM;
                break;
            }
            node->mesh = &octahedron;
            node->curves = &tube_curves;
            shape_build(node, &st);
        }
        if (st == IMP_OK) st = imp__intersector_create(&world);
        done = st == IMP_OK;
        wrong += st != IMP_OK && st != IMP_E_NOMEM;
        world_end();
        imp_context_destroy(ctx);
        leaked += heap.live;
    }
    ctx = whole;
    tap_ok(done && wrong == 0 && leaked == 0 && tries > 4,
           "allocation 1, 2, 3, ... fails # tries %d wrong %d leaked %ld", tries, wrong,
           leaked);
}

int main(void)
{
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 1;
    areas();
    for (int k = 0; imp__shape_kinds[k]; k++)
        for (int c = 0; c < 8; c++) {
            const struct imp_shape_ops *ops = imp__shape_kinds[k];
            if (c & 1 && is_curve(ops)) continue; /* refused */
            if (c < 4 ? !strcmp(ops->name, "sphere") : !ops->round) continue;
            surfaces(ops, c >> 2, c & 1, c >> 1 & 1);
        }
    seen_from_above("rectangle", 1, 1, 0, 1, "rectangle");
    seen_from_above("rectangle", 1, 1, 1, -1, "rectangle, flip_normals");
    seen_from_above("rectangle", 1, -1, 0, -1, "rectangle, z mirrored");
    seen_from_above("rectangle", 1, -1, 1, 1, "rectangle, both");
    seen_from_above("disk", 1, -1, 0, -1, "disk, z mirrored");
    seen_from_above("disk", 1, 1, 1, -1, "disk, flip_normals");
    seen_from_above("sphere", -1, 1, 0, -1, "sphere, mirrored");
    seen_from_above("sphere", -1, 1, 1, 1, "sphere, both");
    seen_from_above("cube", -1, 1, 0, 1, "cube, mirrored: a mesh keeps its outside");
    seen_from_above("cube", 1, 1, 1, -1, "cube, flip_normals");
    uvs();
    vertex_normals();
    errors();
    degenerate();
    hostile();
    starved();
    imp_context_destroy(ctx);
    return tap_done();
}

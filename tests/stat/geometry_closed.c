/* SPDX-License-Identifier: Apache-2.0
 *
 * Gradients by what moves against closed forms: the irradiance of a point light that moves, and of a
 * rectangle; the penumbra of a half plane that moves before a square lamp; the picture of a lit
 * square by the field of view; the
 * solid angle of a ball before a sky; and an identity of fields of view and turns of a camera, the flux of
 * radiance through the frame of the picture, with the argument `long`. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "mean_gradient.h"
#include "walk/core/walk.h"

static imp_context *ctx;
enum { NUMBERS_MAX = 16 };

static void scene_of(const char *camera, int size, const char *rest, const char *name,
                     imp_scene **out)
{
    char xml[4096];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='direct'/><sensor "
        "type='perspective' id='camera'>%s<film type='hdrfilm'><integer name='width' "
        "value='%d'/><integer name='height' value='%d'/><rfilter type='box'/></film>"
        "</sensor>%s</scene>",
        camera, size, size, rest);
    *out = test_scene_text(ctx, xml, IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(*out, name));
}

#define FLOOR                                                                            \
    "<shape type='rectangle' id='floor'><transform name='to_world'><scale value='9'/>"   \
    "</transform><bsdf type='diffuse'><rgb name='reflectance' "                          \
    "value='.6'/></bsdf></shape>"
/* Looks at the origin along (-1, 0, -1), of so small a field that the picture is one point. */
#define NARROW                                                                           \
    "<float name='fov' value='.01'/><transform name='to_world'><lookat "                 \
    "origin='.6,0,.6' target='0,0,0' up='0,0,1'/></transform>"

/* I h/(h^2 + r^2)^1.5 of a light at (x, y, h). */
static void point_test(void)
{
    const double at[3] = {.5, -.3, 1.2}, rho = .6, power = 2;
    struct tap_stat d[3] = {{0, 0, 0}};
    imp_scene *scene;
    scene_of(NARROW, 4,
             FLOOR
             "<emitter type='point' id='bulb'><point name='position' x='.5' y='-.3' "
             "z='1.2'/><rgb name='intensity' value='2'/></emitter>",
             "bulb.position", &scene);
    mean_gradient(ctx, scene, "bulb.position", 16, 4, d);
    const double r2 = at[0] * at[0] + at[1] * at[1] + at[2] * at[2];
    for (int k = 0; k < 3; k++) {
        const double ref = rho / IMP_PI * power *
                           ((k == 2) * pow(r2, -1.5) - 3 * at[2] * at[k] * pow(r2, -2.5));
        tap_near(d[k].mean, ref, 1e-3, 0, "irradiance of a point light that moves");
    }
    imp_scene_destroy(scene);
}

/* A spot whose axis has the angle t to the direction of the origin: I z/r^3 (c - t)/(c - b). */
static double spot(const double at[3], const double v[3])
{
    const double r = sqrt(at[0] * at[0] + at[1] * at[1] + at[2] * at[2]),
                 l = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    const double t = acos(-(at[0] * v[0] + at[1] * v[1] + at[2] * v[2]) / (r * l));
    const double k = (40 - t * 180 / IMP_PI) / 35;
    return .6 / IMP_PI * 2 * at[2] / (r * r * r) * fmin(fmax(k, 0), 1);
}

/* A light `bulb` at (.5, -.3, 1.2) over the floor, aimed along v: its irradiance by place and aim. */
static void aimed_test(const char *what, const char *light, const double v[3],
                       double (*irradiance)(const double at[3], const double v[3]),
                       double within)
{
    const double at[3] = {.5, -.3, 1.2}, h = 1e-5;
    struct tap_stat d[2][3] = {{{0, 0, 0}}};
    imp_scene *scene;
    size_t index;
    scene_of(NARROW, 4, light, "bulb.position", &scene);
    test_must(ctx, imp_scene_add_geometry(scene, "bulb.direction"));
    test_must(ctx, imp_scene_find_param(scene, "bulb.direction", &index));
    test_must(ctx, imp_scene_set_values(scene, index, 3, v));
    mean_gradient(ctx, scene, "bulb.position", 16, 4, d[0]);
    mean_gradient(ctx, scene, "bulb.direction", 16, 4, d[1]);
    for (int k = 0; k < 3; k++) {
        double lo[2][3], hi[2][3];
        char moves[64], turns[64];
        for (int i = 0; i < 3; i++) {
            lo[0][i] = at[i] - h * (i == k), hi[0][i] = at[i] + h * (i == k);
            lo[1][i] = v[i] - h * (i == k), hi[1][i] = v[i] + h * (i == k);
        }
        snprintf(moves, sizeof moves, "irradiance of a %s that moves", what);
        snprintf(turns, sizeof turns, "irradiance of a %s that turns", what);
        tap_near(d[0][k].mean, (irradiance(hi[0], v) - irradiance(lo[0], v)) / (2 * h),
                 within, 0, moves);
        tap_near(d[1][k].mean, (irradiance(at, hi[1]) - irradiance(at, lo[1])) / (2 * h),
                 within, 0, turns);
    }
    imp_scene_destroy(scene);
}

static void spot_test(void)
{
    aimed_test("spot",
               FLOOR
               "<emitter type='spot' id='bulb'><float name='cutoff_angle' value='40'/>"
               "<float name='beam_width' value='5'/><transform name='to_world'><lookat "
               "origin='.5,-.3,1.2' target='0,0,0' up='1,0,0'/></transform><rgb "
               "name='intensity' value='2'/></emitter>",
               (const double[3]){-.3, .6, -1.9}, spot, 1e-3);
}

/* ---- A luminaire ---------------------------------------------------------------- */

/* Its nadir and C0 where the file has it, and nadir n: turned on the shortest way. */
static void turned(const double rest[2][3], const double n[3], double out[2][3])
{
    const double *a = rest[0];
    double b[3], t[3], c = 0, l = 0;
    for (int i = 0; i < 3; i++) l += n[i] * n[i];
    for (int i = 0; i < 3; i++) b[i] = n[i] / sqrt(l), c += a[i] * b[i];
    for (int i = 0; i < 3; i++)
        t[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
    for (int k = 0; k < 2; k++) {
        double v[3], once[3];
        for (int i = 0; i < 3; i++) v[i] = rest[k][i];
        for (int i = 0; i < 3; i++)
            once[i] = t[(i + 1) % 3] * v[(i + 2) % 3] - t[(i + 2) % 3] * v[(i + 1) % 3];
        for (int i = 0; i < 3; i++)
            out[k][i] = v[i] + once[i] +
                        (t[(i + 1) % 3] * once[(i + 2) % 3] -
                         t[(i + 2) % 3] * once[(i + 1) % 3]) /
                            (1 + c);
    }
}

/* 1 + 3 h/90 at nadir, and 0 at 90 degrees, linear between, h from C0. */
static double luminaire(const double at[3], const double n[3])
{
    /* lookat's x is up x forward, and C0 is x. */
    static const double rest[2][3] = {{0, 0.6, -0.8}, {1, 0, 0}};
    double f[2][3], r = 0, down = 0, across = 0;
    turned(rest, n, f);
    for (int i = 0; i < 3; i++) r += at[i] * at[i];
    r = sqrt(r);
    for (int i = 0; i < 3; i++)
        down -= at[i] * f[0][i] / r, across -= at[i] * f[1][i] / r;
    const double v = acos(down) * 180 / IMP_PI;
    const double h = acos(fabs(across) / sin(acos(down))) * 180 / IMP_PI;
    return .6 / IMP_PI * (1 + 3 * h / 90) * (1 - v / 90) * at[2] / (r * r * r);
}

static void luminaire_test(void)
{
    const char *file = "luminaire.ies";
    FILE *f = fopen(file, "w");
    if (!f) {
        tap_ok(false, "%s can be written", file);
        return;
    }
    fprintf(f, "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 2 1 2 0 0 0 1 1 0\n0 90\n0 90\n"
               "1 0 4 0\n");
    fclose(f);
    aimed_test("luminaire",
               FLOOR
               "<emitter type='ies' id='bulb'><string name='filename' "
               "value='luminaire.ies'/><transform name='to_world'><lookat "
               "origin='.5,-.3,1.2' target='.5,.3,.4' up='0,0,1'/></transform></emitter>",
               (const double[3]){-.7, .5, -1.5}, luminaire, 1e-4);
    remove(file);
}

/* Form factor of a square of sides 2 b, parallel to the floor at the height h, centred at (x, y). */
static double form_factor(double x, double y, double h, double b)
{
    double sum = 0;
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++) {
            const double X = (x + (i ? b : -b)) / h, Y = (y + (j ? b : -b)) / h;
            const double u = sqrt(1 + X * X), v = sqrt(1 + Y * Y);
            sum += (i == j ? 1 : -1) * (X / u * atan(Y / u) + Y / v * atan(X / v));
        }
    return sum / (2 * IMP_PI);
}

static void rectangle_test(void)
{
    struct tap_stat d[6] = {{0, 0, 0}};
    imp_scene *scene;
    scene_of(NARROW, 4,
             FLOOR "<shape type='rectangle' id='lamp'><transform name='to_world'><scale "
                   "value='.4'/><rotate x='1' angle='180'/><translate x='.3' y='.2' "
                   "z='1.5'/></transform><emitter type='area'><rgb name='radiance' "
                   "value='5'/></emitter></shape>",
             "lamp.pose", &scene);
    mean_gradient(ctx, scene, "lamp.pose", 4096, 16, d);
    const double h = 1e-5;
    for (int k = 0; k < 3; k++) {
        const double x = .3, y = .2, z = 1.5,
                     e[3] = {h * (k == 0), h * (k == 1), h * (k == 2)};
        const double ref = .6 * 5 *
                           (form_factor(x + e[0], y + e[1], z + e[2], .4) -
                            form_factor(x - e[0], y - e[1], z - e[2], .4)) /
                           (2 * h);
        tap_z(&d[k], ref, 3e-3 * fabs(ref), "form factor of a rectangle that moves");
    }
    imp_scene_destroy(scene);
}

/* A lamp |X|, |Y| < b at the height 2 over a floor; a half plane x < 0 at the height 1. From (x, y)
 * its edge is seen at X = -x, and shifted by e at 2 e - x. */
static double penumbra(double x, double y, double b)
{
    const double h = 2, c = sqrt(h * h + 4 * x * x);
    double sum = 0;
    if (fabs(x) > b) return 0;
    for (int k = 0; k < 2; k++) {
        const double s = (k ? b : -b) - y;
        sum += (k ? 1 : -1) *
               (s / (2 * c * c * (c * c + s * s)) + atan(s / c) / (2 * c * c * c));
    }
    return -2 * h * h * sum;
}

static void penumbra_test(void)
{
    enum { N = 400 };
    struct tap_stat d[6] = {{0, 0, 0}};
    imp_scene *scene;
    scene_of("<float name='fov' value='80'/><transform name='to_world'><lookat "
             "origin='.1,.1,.9' target='.1,.1,0' up='0,1,0'/></transform>",
             16,
             FLOOR
             "<shape type='rectangle' id='screen'><transform name='to_world'><scale "
             "x='5' y='10'/><translate x='-5' z='1'/></transform><bsdf "
             "type='diffuse'><rgb name='reflectance' value='0'/></bsdf></shape>"
             "<shape type='rectangle'><transform name='to_world'><scale value='.5'/>"
             "<rotate x='1' angle='180'/><translate z='2'/></transform><emitter "
             "type='area'><rgb name='radiance' value='5'/></emitter></shape>",
             "screen.pose", &scene);
    mean_gradient(ctx, scene, "screen.pose", 256, 16, d);
    const double half = .9 * tan(40 * IMP_PI / 180);
    double ref = 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++)
            ref += penumbra(.1 + half * (2 * (i + .5) / N - 1),
                            .1 + half * (2 * (j + .5) / N - 1), .5) /
                   ((double)N * N);
    ref *= 5 * .6 / IMP_PI;
    tap_z(&d[0], ref, 3e-3 * fabs(ref), "the penumbra of a half plane that moves");
    imp_scene_destroy(scene);
}

/* A bright square of sides 2 at the distance 4 has the area (W/(4 t))^2 pixels. */
static void view_test(void)
{
    struct tap_stat d[1] = {{0, 0, 0}};
    imp_scene *scene;
    scene_of("<float name='fov' value='50'/><transform name='to_world'><lookat "
             "origin='.1,-.2,4' target='.1,-.2,0' up='.3,1,0'/></transform>",
             24,
             "<shape type='rectangle'><emitter type='area'><rgb name='radiance' "
             "value='5'/></emitter></shape>",
             "camera.x_fov", &scene);
    mean_gradient(ctx, scene, "camera.x_fov", 256, 16, d);
    const double t = tan(25 * IMP_PI / 180);
    const double ref = -5 / (16 * t * t) * (1 + t * t) / t * (IMP_PI / 180);
    tap_z(&d[0], ref, 3e-3 * fabs(ref), "a square's picture by the field of view");
    imp_scene_destroy(scene);
}

/* A black ball before a sky: seen straight on it is a disc of the area pi f^2 r^2/(D^2 - r^2). */
static void ball_test(void)
{
    struct tap_stat place[6] = {{0, 0, 0}}, scale[1] = {{0, 0, 0}};
    imp_scene *scene;
    scene_of("<float name='fov' value='50'/><transform name='to_world'><lookat "
             "origin='.1,-.2,4' target='.1,-.2,0' up='.3,1,0'/></transform>",
             24,
             "<emitter type='constant'><rgb name='radiance' value='5'/></emitter><shape "
             "type='sphere' id='ball'><float name='radius' value='.8'/><point "
             "name='center' x='.1' y='-.2' z='0'/><bsdf type='diffuse'><rgb "
             "name='reflectance' value='0'/></bsdf></shape>",
             "ball.pose", &scene);
    test_must(ctx, imp_scene_add_geometry(scene, "ball.scale"));
    mean_gradient(ctx, scene, "ball.pose", 64, 16, place);
    mean_gradient(ctx, scene, "ball.scale", 64, 16, scale);
    const double t = tan(25 * IMP_PI / 180), D = 4, r = .8, q = D * D - r * r;
    const double film = -5 * IMP_PI / (4 * t * t);
    /* All of the circle brings the same. */
    tap_near(place[2].mean, film * 2 * r * r * D / (q * q), 1e-6, 0,
             "solid angle of a ball that nears");
    tap_near(scale[0].mean, film * 2 * r * r * D * D / (q * q), 1e-6, 0,
             "and that grows");
    imp_scene_destroy(scene);
}

/* The same disc through a lens has the radius  R = u (1 + k1 u^2 + k2 u^4 + k3 u^6),  u that of the
 * pinhole. */
static void lens_test(void)
{
    static const char *const name[4] = {"camera.opencv_k1", "camera.opencv_k2",
                                        "camera.opencv_k3", "camera.x_fov"};
    imp_scene *scene;
    scene_of("<float name='fov' value='50'/><float name='opencv_k1' value='-.2'/><float "
             "name='opencv_k2' value='.08'/><float name='opencv_k3' value='-.02'/>"
             "<transform name='to_world'><lookat origin='.1,-.2,4' target='.1,-.2,0' "
             "up='.3,1,0'/></transform>",
             24,
             "<emitter type='constant'><rgb name='radiance' value='5'/></emitter><shape "
             "type='sphere' id='ball'><float name='radius' value='1.1'/><point "
             "name='center' x='.1' y='-.2' z='0'/><bsdf type='diffuse'><rgb "
             "name='reflectance' value='0'/></bsdf></shape>",
             name[0], &scene);
    const double t = tan(25 * IMP_PI / 180), u = 1.1 / sqrt(16 - 1.1 * 1.1), u2 = u * u;
    const double R = u * (1 + u2 * (-.2 + u2 * (.08 - u2 * .02)));
    const double by_R = -5 * 2 * IMP_PI * R / (4 * t * t);
    const double truth[4] = {by_R * u * u2, by_R * u * u2 * u2, by_R * u * u2 * u2 * u2,
                             -by_R * R / t * (1 + t * t) / 2 * (IMP_PI / 180)};
    for (int k = 1; k < 4; k++) test_must(ctx, imp_scene_add_geometry(scene, name[k]));
    for (int k = 0; k < 4; k++) {
        struct tap_stat d[1] = {{0, 0, 0}};
        mean_gradient(ctx, scene, name[k], 64, 16, d);
        tap_near(d[0].mean, truth[k], 1e-6, 0, name[k]);
    }
    imp_scene_destroy(scene);
}

/* Radiance at a film position of the unit square. */
static double radiance_at(const struct imp_tracer *t, struct imp_arena *arena, double x,
                          double y, uint64_t number)
{
    const double lens[2] = {.5, .5}, w = t->sensor->film.width;
    const struct imp_arena_mark mark = imp__arena_mark(arena);
    struct imp_sensor_ray ray;
    struct imp_walk walk;
    t->sensor->ops->ray(t->sensor, x * w, y * w, lens, &ray);
    imp__walk_along(t, arena, imp__key(99, 1, number), 0, &ray, NULL, 0, NULL,
                    (imp_v3){0}, NULL, &walk);
    imp__arena_rewind(arena, mark);
    return walk.L[0];
}

/* What a film position x sees moves by T'(x): d mean = flux of L T' through the frame - mean of
 * L div T'. Field of view: T' = r (x - 1/2), about the axis: T' = (1/2 - y, x - 1/2) up to a sign of
 * axes that point left and up. */
static void frame_test(void)
{
    enum { GROUPS = 32, DRAWS = 16000 };
    struct tap_stat view[1] = {{0, 0, 0}}, turn[6] = {{0, 0, 0}}, flux[2] = {{0, 0, 0}};
    imp_scene *scene;
    struct imp_arena arena;
    scene_of("<float name='fov' value='50'/><transform name='to_world'><lookat "
             "origin='.5,-3.5,2' target='.3,0,.4' up='0,0,1'/></transform>",
             24,
             FLOOR "<shape type='cube'><transform name='to_world'><scale value='.5'/>"
                   "<rotate x='1' y='1' angle='25'/><translate z='1.1'/></transform>"
                   "</shape><shape type='rectangle'><transform name='to_world'><scale "
                   "value='.5'/><rotate x='1' angle='170'/><translate x='.6' z='3.5'/>"
                   "</transform><emitter type='area'><rgb name='radiance' value='9'/>"
                   "</emitter></shape>",
             "camera.x_fov", &scene);
    test_must(ctx, imp_scene_add_geometry(scene, "camera.pose"));
    mean_gradient(ctx, scene, "camera.x_fov", 64, 16, view);
    mean_gradient(ctx, scene, "camera.pose", 256, 24, turn);
    struct imp_tracer t = {.scene = scene,
                           .integrator = imp__walk_integrator(scene),
                           .sensor = scene->sensors[0],
                           .seed = 5};
    const double tangent = tan(25 * IMP_PI / 180);
    const double rate = (1 + tangent * tangent) / (2 * tangent) * (IMP_PI / 180);
    imp__arena_init(&arena, ctx);
    for (int g = 0; g < GROUPS; g++) {
        double sum[2] = {0};
        for (int i = 0; i < DRAWS; i++) {
            const uint64_t number = (uint64_t)g * DRAWS + (uint64_t)i;
            const struct imp_key key = imp__key(98, 2, number);
            const double a = imp__u01(key, 0), b = imp__u01(key, 1);
            const int side = i % 4;
            const double x = side < 2 ? side : a, y = side < 2 ? a : side - 2;
            const double border = radiance_at(&t, &arena, x, y, 2 * number),
                         inside = radiance_at(&t, &arena, a, b, 2 * number + 1);
            const double nx = side < 2 ? 2 * x - 1 : 0, ny = side < 2 ? 0 : 2 * y - 1;
            /* Four sides of length 1, each by a quarter of the draws. */
            sum[0] += rate * (4 * border * .5 - 2 * inside) / DRAWS;
            sum[1] += 4 * border * ((.5 - y) * nx + (x - .5) * ny) / DRAWS;
        }
        tap_add(&flux[0], sum[0]);
        tap_add(&flux[1], sum[1]);
    }
    const imp_v3 axis = imp__normalize(imp__v3(-.2, 3.5, -1.6));
    double about = 0, about2 = 0;
    for (int k = 0; k < 3; k++) {
        about += axis[k] * turn[3 + k].mean;
        about2 += imp__sqr(axis[k] * tap_se(&turn[3 + k]));
    }
    const double z =
        (view[0].mean - flux[0].mean) / hypot(tap_se(&view[0]), tap_se(&flux[0]));
    tap_ok(fabs(z) < 3.5 && tap_se(&view[0]) < 0.01 * fabs(flux[0].mean) &&
               tap_se(&flux[0]) < 0.05 * fabs(flux[0].mean),
           "field of view and the frame's flux # %.6f se %.6f, %.6f se %.6f z %.2f",
           view[0].mean, tap_se(&view[0]), flux[0].mean, tap_se(&flux[0]), z);
    const double size = 0.5 * fabs(flux[0].mean) / rate;
    const double y = (about - flux[1].mean) / hypot(sqrt(about2), tap_se(&flux[1]));
    tap_ok(
        fabs(y) < 3.5 && sqrt(about2) < 0.05 * size && tap_se(&flux[1]) < 0.05 * size,
        "a turn about the axis and the frame's flux # %.6f se %.6f, %.6f se %.6f z %.2f",
        about, sqrt(about2), flux[1].mean, tap_se(&flux[1]), y);
    imp__arena_free(&arena);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    ctx = test_context(2);
    point_test();
    spot_test();
    luminaire_test();
    rectangle_test();
    penumbra_test();
    view_test();
    ball_test();
    lens_test();
    if (tap_is_long(argc, argv)) frame_test();
    imp_context_destroy(ctx);
    return tap_done();
}

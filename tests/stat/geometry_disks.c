/* SPDX-License-Identifier: Apache-2.0
 *
 * Gradients by the pose and the scale of disks, and by the place of lamps that are disks or
 * spheres, against closed forms and quadrature: the solid angle of a disk before a sky, straight
 * on and leaning; the form factor of a disk that moves; the irradiance of a ball that shines; the
 * shadow of a disk before a point light. What is refused. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/vec.h"
#include "mean_gradient.h"

static imp_context *ctx;
enum { NUMBERS_MAX = 6, N = 400 };

static imp_scene *scene_of(const char *camera, int size, const char *rest)
{
    char xml[4096];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='direct'/><sensor "
        "type='perspective' id='camera'>%s<film type='hdrfilm'><integer name='width' "
        "value='%d'/><integer name='height' value='%d'/><rfilter type='box'/></film>"
        "</sensor>%s</scene>",
        camera, size, size, rest);
    return test_scene_text(ctx, xml, IMP_MONO);
}

#define FLOOR                                                                            \
    "<shape type='rectangle' id='floor'><transform name='to_world'><scale value='9'/>"   \
    "</transform><bsdf type='diffuse'><rgb name='reflectance' "                          \
    "value='.6'/></bsdf></shape>"
#define BLACK "<bsdf type='diffuse'><rgb name='reflectance' value='0'/></bsdf></shape>"
/* Looks at the origin, of so small a field that the picture is one point. */
#define NARROW                                                                           \
    "<float name='fov' value='.01'/><transform name='to_world'><lookat "                 \
    "origin='.6,0,.6' target='0,0,0' up='0,0,1'/></transform>"

/* ---- A black disk before a sky -------------------------------------------------------- */

/* Part of a film of half width t that sees it, from the height 4 above (.1, -.2, 0): a disk of
 * radius r, moved by e, turned by a about x and then by b about y. */
static double film_part(const double e[3], double a, double b, double r, double t)
{
    double sum = 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) { /* of its own polar coordinates */
            const double rho = r * (i + .5) / N, phi = IMP_2PI * (j + .5) / N;
            const double x = rho * cos(phi), y = rho * sin(phi);
            const double z1 = y * sin(a), x2 = x * cos(b) + z1 * sin(b),
                         z2 = z1 * cos(b) - x * sin(b);
            const imp_v3 n = {sin(b) * cos(a), -sin(a), cos(a) * cos(b)},
                         p = {x2 + e[0], y * cos(a) + e[1], z2 + e[2] - 4};
            /* dA (n.p)/z^3 is its area on a film at the distance 1. */
            sum += fabs(imp__dot(n, p) / (p[2] * p[2] * p[2])) * rho;
        }
    return sum * (r / N) * (IMP_2PI / N) / (4 * t * t);
}

static void sky_test(void)
{
    const double t = tan(25 * IMP_PI / 180), h = 1e-4, a = .6, r = .8;
    for (int leans = 0; leans < 2; leans++) {
        struct tap_stat pose[6] = {{0, 0, 0}}, scale[1] = {{0, 0, 0}};
        imp_scene *scene = scene_of(
            "<float name='fov' value='50'/><transform name='to_world'><lookat "
            "origin='.1,-.2,4' target='.1,-.2,0' up='.3,1,0'/></transform>",
            24,
            "<emitter type='constant'><rgb name='radiance' value='5'/></emitter><shape "
            "type='disk' id='plate'><transform name='to_world'><scale value='.8'/>"
            "<translate x='.1' y='-.2'/></transform>" BLACK);
        const double at[6] = {0, 0, 0, leans ? a : 0, 0, 0};
        size_t index;
        test_must(ctx, imp_scene_add_geometry(scene, "plate.pose"));
        test_must(ctx, imp_scene_add_geometry(scene, "plate.scale"));
        test_must(ctx, imp_scene_find_param(scene, "plate.pose", &index));
        test_must(ctx, imp_scene_set_values(scene, index, 6, at));
        mean_gradient(ctx, scene, "plate.pose", 64, 16, pose);
        mean_gradient(ctx, scene, "plate.scale", 64, 16, scale);
        const double largest = 5 * 2 * film_part((double[3]){0}, at[3], 0, r, t) / 4;
        for (int k = 0; k < 5;
             k++) { /* at a = 0 the axes of both rotations are at right angles */
            const double e[3] = {h * (k == 0), h * (k == 1), h * (k == 2)},
                         f[3] = {-e[0], -e[1], -e[2]}, x = h * (k == 3), y = h * (k == 4);
            const double ref =
                -5 *
                (film_part(e, at[3] + x, y, r, t) - film_part(f, at[3] - x, -y, r, t)) /
                (2 * h);
            if (!leans && k == 2) /* all of the rim brings the same */
                tap_near(pose[k].mean, ref, 1e-6, 0, "a disk before a sky that nears");
            else tap_z(&pose[k], ref, 3e-3 * largest, "a disk before a sky, its pose");
        }
        const double ref = -5 *
                           (film_part((double[3]){0}, at[3], 0, r + h, t) -
                            film_part((double[3]){0}, at[3], 0, r - h, t)) /
                           (2 * h) * r;
        if (leans)
            tap_z(&scale[0], ref, 3e-3 * fabs(ref), "a disk before a sky that grows");
        else tap_near(scale[0].mean, ref, 1e-6, 0, "a disk before a sky that grows");
        imp_scene_destroy(scene);
    }
}

/* ---- Lamps ------------------------------------------------------------------------------ */

/* Irradiance over radiance at the origin of a disk of radius r at p, whose normal is down, turned
 * by a about x. */
static double irradiance(imp_v3 p, double a, double r)
{
    double sum = 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const double rho = r * (i + .5) / N, phi = IMP_2PI * (j + .5) / N;
            const imp_v3 y = {p[0] + rho * cos(phi), p[1] + rho * sin(phi) * cos(a),
                              p[2] + rho * sin(phi) * sin(a)};
            const imp_v3 n = {0, sin(a), -cos(a)};
            const double d2 = imp__dot(y, y);
            sum += y[2] * -imp__dot(n, y) / (d2 * d2) * rho;
        }
    return sum * (r / N) * (IMP_2PI / N);
}

static void lamp_test(void)
{
    struct tap_stat d[6] = {{0, 0, 0}};
    const double h = 1e-4;
    imp_scene *scene =
        scene_of(NARROW, 4,
                 FLOOR "<shape type='disk' id='lamp'><transform name='to_world'><scale "
                       "value='.4'/><rotate x='1' angle='180'/><translate x='.3' y='.2' "
                       "z='1.5'/></transform><emitter type='area'><rgb name='radiance' "
                       "value='5'/></emitter></shape>");
    test_must(ctx, imp_scene_add_geometry(scene, "lamp.pose"));
    mean_gradient(ctx, scene, "lamp.pose", 512, 16, d);
    for (int k = 0; k < 4; k++) {
        const imp_v3 e = {h * (k == 0), h * (k == 1), h * (k == 2)}, p = {.3, .2, 1.5};
        const double a = h * (k == 3);
        const double ref = .6 / IMP_PI * 5 *
                           (irradiance(p + e, a, .4) - irradiance(p - e, -a, .4)) /
                           (2 * h);
        tap_z(&d[k], ref, 3e-3 * fabs(ref), "form factor of a disk that moves");
    }
    imp_scene_destroy(scene);
}

/* All of it is above the floor: pi L r^2 z/|c|^3. */
static void ball_test(void)
{
    struct tap_stat d[6] = {{0, 0, 0}};
    const double c[3] = {.3, .2, 1.5}, r = .4;
    imp_scene *scene = scene_of(
        NARROW, 4,
        FLOOR "<shape type='sphere' id='lamp'><float name='radius' value='.4'/><point "
              "name='center' x='.3' y='.2' z='1.5'/><emitter type='area'><rgb "
              "name='radiance' value='5'/></emitter></shape>");
    test_must(ctx, imp_scene_add_geometry(scene, "lamp.pose"));
    mean_gradient(ctx, scene, "lamp.pose", 512, 16, d);
    const double d2 = c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
    for (int k = 0; k < 3; k++) {
        const double ref =
            .6 * 5 * r * r * ((k == 2) * pow(d2, -1.5) - 3 * c[2] * c[k] * pow(d2, -2.5));
        /* Points near its limb, which turn away, have much noise. */
        tap_z(&d[k], ref, 2e-2 * fabs(ref), "irradiance of a ball that moves");
    }
    imp_scene_destroy(scene);
}

/* ---- A shadow ----------------------------------------------------------------------------- */

/* A point light above the middle of a disk: its shadow on the floor is a circle of radius
 * R = r H/(H - z) about it, of which each point has been lit by I H/(H^2 + s^2)^1.5. A camera that
 * looks down from under the disk sees all of it. */
static double shadow(double r, double z)
{
    const double H = 2, R = r * H / (H - z);
    return IMP_2PI * 3 * (1 - H / sqrt(H * H + R * R)); /* lost flux */
}

static void shadow_test(void)
{
    struct tap_stat pose[6] = {{0, 0, 0}}, scale[1] = {{0, 0, 0}};
    imp_scene *scene = scene_of(
        "<float name='fov' value='80'/><transform name='to_world'><lookat "
        "origin='.1,.1,.9' target='.1,.1,0' up='0,1,0'/></transform>",
        16,
        FLOOR "<shape type='disk' id='plate'><transform name='to_world'><scale "
              "value='.25'/><translate z='1'/></transform>" BLACK
              "<emitter type='point'><point name='position' x='0' y='0' z='2'/><rgb "
              "name='intensity' value='3'/></emitter>");
    const double side = 2 * .9 * tan(40 * IMP_PI / 180), h = 1e-4;
    test_must(ctx, imp_scene_add_geometry(scene, "plate.pose"));
    test_must(ctx, imp_scene_add_geometry(scene, "plate.scale"));
    mean_gradient(ctx, scene, "plate.pose", 64, 16, pose);
    mean_gradient(ctx, scene, "plate.scale", 64, 16, scale);
    const double by = -.6 / IMP_PI / (side * side);
    const double z = by * (shadow(.25, 1 + h) - shadow(.25, 1 - h)) / (2 * h),
                 r = by * (shadow(.25 + h, 1) - shadow(.25 - h, 1)) / (2 * h) * .25;
    tap_z(&pose[0], 0, 3e-3 * fabs(z), "a shadow that moves aside");
    tap_z(&pose[2], z, 3e-3 * fabs(z), "a shadow of a disk that rises");
    tap_z(&scale[0], r, 3e-3 * fabs(r), "a shadow of a disk that grows");
    imp_scene_destroy(scene);
}

static void refused_test(void)
{
    static const char *const rest[] = {
        /* through the ball; through the floor; through another disk */
        "<shape type='sphere'><point name='center' x='0' y='0' z='1'/><float "
        "name='radius' value='.3'/></shape>",
        "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/>"
        "<translate z='1'/></transform></shape>",
        "<shape type='disk'><transform name='to_world'><rotate x='1' angle='80'/>"
        "<translate x='.7' z='1'/></transform></shape>"};
    int wrong = 0;
    for (size_t k = 0; k < sizeof rest / sizeof *rest; k++) {
        char xml[2048];
        float adjoint[16] = {1};
        double g[6];
        snprintf(xml, sizeof xml,
                 FLOOR
                 "<emitter type='constant'/><shape type='disk' id='plate'><transform "
                 "name='to_world'><translate z='1'/></transform></shape>%s",
                 rest[k]);
        imp_scene *scene = scene_of(NARROW, 4, xml);
        test_must(ctx, imp_scene_add_geometry(scene, "plate.pose"));
        imp_problem *p = test_problem(ctx, scene, "plate.pose");
        struct imp_run run = IMP_RUN_INIT;
        run.spp = 4;
        wrong += imp_problem_reverse(p, adjoint, &run, g, NULL) != IMP_E_UNSUPPORTED;
        printf("# %s\n", imp_last_error(ctx));
        imp_problem_destroy(p);
        imp_scene_destroy(scene);
    }
    tap_ok(wrong == 0, "disks that pass through others are refused");
}

int main(void)
{
    ctx = test_context(2);
    sky_test();
    lamp_test();
    ball_test();
    shadow_test();
    refused_test();
    imp_context_destroy(ctx);
    return tap_done();
}

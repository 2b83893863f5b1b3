/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves under skies that are not the same from everywhere: imp_problem_reverse
 * against central differences. A block above a floor, and a camera that sees the sky, under a map of
 * a few texels, a CIE sky, a clear sky with its sun, and two skies at once. A camera that turns
 * before a map or a sun alone, against closed forms. What is refused. */
#include "math/rng.h"
#include "math/warp.h"
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"
#include "sky_field.h"
#include "walk/moved/moved_sky.h"
#include <unistd.h>

/* ---- Where skies jump ----------------------------------------------------------------------- */

static bool crosses(const struct imp_emitter *e, imp_v3 a, imp_v3 b)
{
    struct imp_sky_circle c[IMP_SKY_CIRCLES];
    const int n = e->ops->jumps(e, c);
    for (int k = 0; k < n; k++)
        if ((imp__dot(a, c[k].axis) > c[k].cosine) !=
            (imp__dot(b, c[k].axis) > c[k].cosine))
            return true;
    return false;
}

/* On arcs between drawn directions the half with the larger difference is halved again: what is left of
 * it between two neighbours is a jump, which a circle must explain. */
static void jumps_test(const char *what, imp_scene *scene)
{
    enum { ARCS = 4000, HALVES = 34 };
    double most = 0, left = 0;
    int jumps = 0;
    for (uint32_t k = 0; k < ARCS; k++) {
        const struct imp_key key = imp__key(3, 1, k);
        const double u[4] = {imp__u01(key, 0), imp__u01(key, 1), imp__u01(key, 2),
                             imp__u01(key, 3)};
        const int sky = scene->environments[k % (uint32_t)scene->n_environments];
        const struct imp_emitter *e = scene->emitters[sky];
        imp_v3 a = imp__uniform_sphere(u), b = imp__uniform_sphere(u + 2);
        double x = imp__sky_radiance_from(scene, sky, a, NULL)[0],
               y = imp__sky_radiance_from(scene, sky, b, NULL)[0];
        most = fmax(most, fabs(x - y));
        for (int i = 0; i < HALVES; i++) {
            const imp_v3 c = imp__normalize(a + b);
            const double z = imp__sky_radiance_from(scene, sky, c, NULL)[0];
            if (fabs(x - z) > fabs(y - z)) {
                b = c;
                y = z;
            } else {
                a = c;
                x = z;
            }
        }
        if (crosses(e, a, b)) jumps++;
        else left = fmax(left, fabs(x - y));
    }
    tap_ok(left < 1e-4 * most,
           "%s jumps at its circles alone # %d of them, left %.1e of %.1e", what, jumps,
           left, most);
}

/* ---- Closed forms: a camera that turns before a sky alone ---------------------------------- */

#define HALF_ANGLE (25 * IMP_PI / 180)

/* Mean over a square film of CIE's overcast sky with the zenith at 4, from a camera that looks along
 * the zenith and is turned by a: the film's rows end at the horizon, v sin a + cos a = 0. */
static double overcast(double a)
{
    enum { N = 400 };
    const double t = tan(HALF_ANGLE), from = fmax(-t, -1 / tan(a));
    double sum = 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const double x = t * (2 * (i + .5) / N - 1),
                         v = from + (t - from) * (j + .5) / N;
            const double z = (v * sin(a) + cos(a)) / sqrt(x * x + v * v + 1);
            sum += 4 * (1 + 2 * z) / 3;
        }
    return sum * (t - from) / (2 * t) / ((double)N * N);
}

/* Part of the film that a disc of the angular radius r about c, seen in whole, takes: the integral of
 * dw/cos^3 over the square's area. */
static double disc_part(imp_v3 c, double r)
{
    enum { N = 400 };
    const struct imp_frame f = imp__frame_from_normal(c);
    double sum = 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const double x = r * (i + .5) / N, phi = IMP_2PI * (j + .5) / N;
            const imp_v3 w = c * cos(x) + (f.s * cos(phi) + f.t * sin(phi)) * sin(x);
            sum += sin(x) / (w[2] * w[2] * w[2]);
        }
    return sum * (r / N) * (IMP_2PI / N) / (4 * imp__sqr(tan(HALF_ANGLE)));
}

static void turn_test(const char *sky, double from, double ref, const char *what)
{
    char xml[2048];
    struct tap_stat pose[6] = {{0, 0, 0}};
    const double at[6] = {0, 0, 0, from, 0, 0};
    size_t index;
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='direct'/><sensor "
             "type='perspective' id='camera'><float name='fov' value='50'/><film "
             "type='hdrfilm'><integer name='width' value='16'/><integer name='height' "
             "value='16'/><rfilter type='box'/></film></sensor>%s</scene>",
             sky);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(scene, "camera.pose"));
    test_must(ctx, imp_scene_find_param(scene, "camera.pose", &index));
    test_must(ctx, imp_scene_set_values(scene, index, 6, at));
    mean_gradient(ctx, scene, "camera.pose", 64, 16, pose);
    tap_z(&pose[3], ref, 5e-3 * fabs(ref), what);
    tap_ok(pose[0].mean == 0 && pose[2].mean == 0, "a sky does not see shifts");
    imp_scene_destroy(scene);
}

static imp_v3 turned(imp_v3 w, double a)
{
    return imp__v3(w[0], w[1] * cos(a) + w[2] * sin(a), w[2] * cos(a) - w[1] * sin(a));
}

static void turns_test(void)
{
    const double h = 1e-3, r = .2;
    const imp_v3 c = imp__normalize(imp__v3(.1, .15, 1));
    for (int k = 0; k < 2; k++) {
        const double a = k ? 1.4 : .5;
        turn_test("<emitter type='ciesky'><float name='zenith' value='4'/></emitter>", a,
                  (overcast(a + h) - overcast(a - h)) / (2 * h),
                  k ? "a camera that turns before the horizon"
                    : "a camera that turns under an overcast sky");
    }
    turn_test("<emitter type='sun'><vector name='direction' value='-.1,-.15,-1'/><float "
              "name='radius' value='.2'/><rgb name='radiance' value='7'/></emitter>",
              0, 7 * (disc_part(turned(c, h), r) - disc_part(turned(c, -h), r)) / (2 * h),
              "a camera that turns before the sun");
}

/* ---- Rooms ----------------------------------------------------------------------------------- */

static void jumps_of(const char *what, const char *sky)
{
    imp_scene *scene = sky_field(sky);
    jumps_test(what, scene);
    imp_scene_destroy(scene);
}

static const struct number numbers[] = {{"block.pose", 0, .03},  {"block.pose", 5, .03},
                                        {"camera.pose", 0, .03}, {"camera.pose", 3, .01},
                                        {"camera.x_fov", 0, .5}, {NULL, 0, 0}};
static const struct number few[] = {
    {"block.pose", 2, .03}, {"camera.pose", 5, .01}, {NULL, 0, 0}};

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    char folder[] = "moved_skies_XXXXXX";
    ctx = test_context(2);
    adjoint_make();
    if (!mkdtemp(folder) || chdir(folder) != 0)
        exit(99); /* the long form may run beside it */
    sky_map_write();
    turns_test();
    jumps_of("a map", SKY_ENVMAP);
    jumps_of("a CIE sky", SKY_CIE);
    jumps_of("an overcast sky", "<emitter type='ciesky'/>");
    jumps_of("Perez' sky",
             "<emitter type='perezsky'><float name='diffuse' value='100'/><float "
             "name='direct' value='300'/><vector name='sun_direction' "
             "value='.5,-.6,.7'/></emitter>");
    jumps_of("sky and sun", SKY_CLEAR);
    jumps_of("the sun", SKY_SUN);
    if (is_long) {
        numbers_compare("a map", sky_field(SKY_DIRECT SKY_ENVMAP), 256, 1024, .06,
                        numbers);
        numbers_compare("a CIE sky", sky_field(SKY_PATH SKY_CIE), 256, 1024, .06,
                        numbers);
        numbers_compare("sky and sun", sky_field(SKY_DIRECT SKY_CLEAR), 256, 1024, .06,
                        numbers);
        numbers_compare("a map and a sun", sky_field(SKY_DIRECT SKY_ENVMAP SKY_SUN), 256,
                        1024, .2, numbers);
    } else {
        numbers_compare("a map", sky_field(SKY_DIRECT SKY_ENVMAP), 32, 64, .06, few);
        numbers_compare("a CIE sky", sky_field(SKY_PATH SKY_CIE), 32, 32, .06, few);
        numbers_compare("a map and a sun", sky_field(SKY_DIRECT SKY_ENVMAP SKY_SUN), 16,
                        32, .2, few);
    }
    if (remove(SKY_MAP) != 0 || chdir("..") != 0 || rmdir(folder) != 0) exit(99);
    imp_context_destroy(ctx);
    return tap_done();
}

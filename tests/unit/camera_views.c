/* SPDX-License-Identifier: Apache-2.0
 *
 * The numbers of a camera's view (imp_sensor_ops.view): what is set is read, rays follow it, and
 * view_velocity, or lens_velocity of a thin lens, is the difference of rays. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "scene/scene.h"
#include <math.h>

enum { POINTS = 35 }; /* of the film, 7 by 5 */
static imp_context *ctx;
enum { PINHOLE = 8 }; /* numbers */
static const char *const names[IMP_VIEW_NUMBERS] = {
    "x_fov", "offset x", "offset y", "k1", "k2", "p1", "p2", "k3", "aperture", "focus"};

static imp_scene *camera(const char *lens, bool thin)
{
    char xml[2048];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><sensor type='%s' id='camera'><float "
             "name='fov' value='60'/>%s%s"
             "<transform name='to_world'><lookat origin='1,2,3' target='-1,.5,7' "
             "up='.1,1,0'/></transform><film type='hdrfilm'><integer name='width' "
             "value='64'/><integer name='height' value='36'/></film></sensor><emitter "
             "type='constant'/></scene>",
             thin ? "thinlens" : "perspective",
             thin ? "<float name='aperture_radius' value='.3'/><float "
                    "name='focus_distance' value='4'/>"
                  : "<float name='principal_point_offset_x' value='.04'/>",
             lens);
    return test_scene_text(ctx, xml, IMP_MONO);
}

static const double through[2] = {.85, .3}; /* the lens */

static imp_v3 seen(const struct imp_sensor *s, double px, double py)
{
    struct imp_sensor_ray r;
    s->ops->ray(s, px, py, through, &r);
    return r.d;
}

/* Where the ray is in the plane at this depth, from the middle of the lens. */
static imp_v3 met(const struct imp_sensor *s, double px, double py, imp_v3 middle,
                  imp_v3 axis, double depth)
{
    struct imp_sensor_ray r;
    s->ops->ray(s, px, py, through, &r);
    const imp_v3 o = r.o - middle;
    return o + r.d * ((depth - imp__dot(o, axis)) / imp__dot(r.d, axis));
}

static void slopes(const char *lens, bool thin, const char *what)
{
    imp_scene *scene = camera(lens, thin);
    struct imp_sensor *s = scene->sensors[0];
    const int n = thin ? IMP_VIEW_NUMBERS : PINHOLE;
    double number[IMP_VIEW_NUMBERS], again[IMP_VIEW_NUMBERS];
    const imp_v3 middle = imp__v3(1, 2, 3),
                 axis = imp__normalize(imp__v3(-1, .5, 7) - middle);
    tap_ok(s->ops->view(s, number, false), "%s: its numbers are read", what);
    for (int k = 0; k < n; k++) {
        const double h = k == 0 ? 1e-3 : 1e-5;
        const double depth = 2.5;
        double worst = 0;
        imp_v3 at[3][POINTS]; /* below, above, and as it is */
        for (int side = 0; side < 3; side++) {
            memcpy(again, number, sizeof again);
            again[k] += side == 2 ? 0 : side ? h : -h;
            s->ops->view(s, again, true);
            for (int i = 0; i < POINTS; i++)
                at[side][i] =
                    met(s, 64 * (i % 7) / 6., 36 * (i / 7) / 4., middle, axis, depth);
        }
        for (int i = 0; i < POINTS; i++) {
            const imp_v3 slope = (at[1][i] - at[0][i]) * (.5 / h);
            const imp_v3 other =
                met(s, 64 * (i % 7) / 6., 36 * (i / 7) / 4., middle, axis, .1);
            imp_v3 velocity;
            if (thin) s->ops->lens_velocity(s, k, &at[2][i], &other, &velocity);
            else s->ops->view_velocity(s, k, &at[2][i], &velocity);
            worst =
                fmax(worst, imp__length(slope - velocity) / (1e-3 + imp__length(slope)));
        }
        tap_ok(worst < 1e-6, "%s: what a pixel sees by %s # off by %.1e", what, names[k],
               worst);
    }
    s->ops->view(s, again, false);
    double worst = 0;
    for (int k = 0; k < n; k++) worst = fmax(worst, fabs(again[k] - number[k]));
    tap_ok(worst < 1e-12, "%s: what is set is read # off by %.1e", what, worst);
    imp_scene_destroy(scene);
}

/* A lens whose numbers become 0 is none, to the last bit; one that folds is refused. */
static void limits(void)
{
    imp_scene *plain = camera("", false),
              *lens = camera("<float name='opencv_k1' value='-.1'/>", false);
    struct imp_sensor *s = lens->sensors[0], *pinhole = plain->sensors[0];
    double number[IMP_VIEW_NUMBERS];
    s->ops->view(s, number, false);
    tap_ok(number[3] == -.1, "k1 of the file # %g", number[3]);
    number[3] = -20;
    tap_ok(!s->ops->view(s, number, true), "a lens that folds the picture");
    number[3] = NAN;
    tap_ok(!s->ops->view(s, number, true), "a lens without a number");
    pinhole->ops->view(pinhole, number, false);
    pinhole->ops->view(pinhole, number, true);
    tap_ok(s->ops->view(s, number, true), "and none");
    int differ = 0;
    for (int i = 0; i < 100; i++) {
        const imp_v3 a = seen(s, .64 * i, .36 * (99 - i)),
                     b = seen(pinhole, .64 * i, .36 * (99 - i));
        for (int c = 0; c < 3; c++) differ += a[c] != b[c];
    }
    tap_ok(differ == 0, "without distortion it is a pinhole # %d numbers differ", differ);
    imp_scene_destroy(plain);
    imp_scene_destroy(lens);
}

int main(void)
{
    static const char lens[] =
        "<float name='opencv_k1' value='-.12'/><float name='opencv_k2' value='.05'/>"
        "<float name='opencv_k3' value='-.01'/><float name='opencv_p1' value='.004'/>"
        "<float name='opencv_p2' value='-.007'/>";
    ctx = test_context(1);
    slopes("", false, "a pinhole");
    slopes(lens, false, "a lens");
    slopes("", true, "an aperture");
    slopes(lens, true, "an aperture behind a lens");
    limits();
    imp_context_destroy(ctx);
    return tap_done();
}

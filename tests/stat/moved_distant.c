/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of what distant sensors read: of a lamp that turns and is stretched, and of the sensor that
 * turns, against closed forms; of a block on a floor against central differences. What is refused. */
#include "math/motion.h"
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"

#define SENSOR(direction, more)                                                          \
    "<sensor type='distant' id='far'><vector name='direction' value='" direction         \
    "'/>" more "<film type='hdrfilm'>"
#define FILM(w, h)                                                                       \
    "<integer name='width' value='" w "'/><integer name='height' value='" h              \
    "'/><rfilter type='box'/></film></sensor>"
#define BLACK "<bsdf type='diffuse'><rgb name='reflectance' value='0'/></bsdf>"
/* They hold the ball around the scene where it is. */
#define HOLDERS                                                                          \
    "<shape type='rectangle' id='floor'><transform name='to_world'><scale value='2'/>"   \
    "</transform>%s</shape><shape type='rectangle'><transform name='to_world'><scale "   \
    "value='.01'/><translate x='1.9' y='1.9' z='2.5'/></transform>" BLACK "</shape>"
#define LAMP                                                                             \
    "<shape type='rectangle' id='lamp'><transform name='to_world'><scale x='.6' "        \
    "y='.4'/><rotate y='1' angle='35'/><translate x='.2' y='.1' z='1.5'/></transform>"   \
    "<emitter type='area'><rgb name='radiance' value='7'/></emitter></shape>"

/* L A n.(-d)/(pi R^2), of the lamp's n and A = 4 |u x v|. */
static void closed_test(void)
{
    const double s = sin(35 * IMP_PI / 180), c = cos(35 * IMP_PI / 180);
    struct tap_stat turn[3] = {{0}}, pose[6] = {{0}}, world[12] = {{0}};
    char xml[4096];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='direct'/>" SENSOR("0,0,-1", "")
                 FILM("1", "1") HOLDERS LAMP "</scene>",
             BLACK);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO), *other;
    const double R = scene->ball.radius, lit = 7 * 4 * .6 * .4 / (IMP_PI * R * R);
    test_must(ctx, imp_scene_add_geometry(scene, "far.turn"));
    test_must(ctx, imp_scene_add_geometry(scene, "lamp.pose"));
    mean_gradient(ctx, scene, "far.turn", 16384, 16, turn);
    mean_gradient(ctx, scene, "lamp.pose", 16384, 16, pose);
    tap_z(&turn[1], lit * s, 3e-3 * lit, "a sensor that turns against a lamp's tilt");
    tap_z(&turn[0], 0, 3e-3 * lit, "a sensor that turns along its edge");
    tap_z(&pose[4], -lit * s, 3e-3 * lit, "a lamp that turns");
    for (int k = 0; k < 3; k++) {
        char what[64];
        snprintf(what, sizeof what, "a lamp that is shifted along %c", "xyz"[k]);
        tap_z(&pose[k], 0, 1e-2 * lit, what);
    }
    imp_scene_destroy(scene);
    other = test_scene_text(ctx, xml, IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(other, "lamp.to_world"));
    mean_gradient(ctx, other, "lamp.to_world", 16384, 16, world);
    /* 4 (M_00 M_11 - M_01 M_10) of it is seen, with M_00 = .6 c, M_11 = .4. */
    tap_z(&world[0], lit / .6, 3e-3 * lit / .6, "a lamp that grows along x");
    tap_z(&world[5], lit * c / .4, 3e-3 * lit / .4, "a lamp that grows along y");
    imp_scene_destroy(other);
}

static imp_scene *block(const char *sensor)
{
    char xml[8192];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
             "value='3'/></integrator>%s" HOLDERS LAMP
             "<shape type='cube' id='block'><transform name='to_world'><scale x='.5' "
             "y='.4' z='.3'/><rotate z='1' angle='25'/><translate x='-.4' y='.3' "
             "z='.5'/></transform>" THIN_GREEN "</shape><emitter type='constant'><rgb "
             "name='radiance' value='.4,.5,.6'/></emitter></scene>",
             sensor, THIN_PALE);
    return test_scene_text(ctx, xml, IMP_RGB);
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 16 : 1;
    static const struct number numbers[] = {
        {"block.pose", 0, .02}, {"block.pose", 5, .02}, {"block.scale", 0, .02},
        {"far.turn", 0, .04},   {"far.turn", 1, .04},   {NULL, 0, 0}};
    ctx = test_context(2);
    adjoint_make();
    closed_test();
    numbers_compare("a block from far away",
                    block(SENSOR(".3,.5,-.8", "") FILM("24", "16")), 32 * more, 48 * more,
                    .1, numbers);
    number_refused("a floor at the border",
                   block(SENSOR(".3,.5,-.8", "") FILM("24", "16")), "floor.pose",
                   "border");
    number_refused("a distant sensor has no pose",
                   block(SENSOR(".3,.5,-.8", "") FILM("24", "16")), "far.pose",
                   "it has a turn");
    imp_context_destroy(ctx);
    return tap_done();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves of pictures by a thin lens: a disk out of focus before a sky against the
 * closed form of what one pixel sees; imp_problem_reverse against central differences by poses of a
 * block, a ball and the camera, by its aperture, focus, field of view and principal point, by a mesh
 * with vertex normals, and below the sun. */
#include "egg.h"
#include "mean_gradient.h"
#include "moves_numbers.h"

#define PATH "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
#define LAMP                                                                             \
    "<shape type='rectangle' id='lamp'><transform name='to_world'><scale x='.5' "        \
    "y='.3'/><rotate x='1' angle='160'/><translate x='.7' y='-.3' z='3'/></transform>"   \
    "<emitter type='area'><rgb name='radiance' value='9,8,7'/></emitter></shape>"
#define CLEAR                                                                            \
    "<emitter type='sunsky' id='sky'><vector name='sun_direction' value='-.5,1.2,.4'/>"  \
    "<float name='sun_aperture' value='12'/><float name='sun_scale' value='.004'/>"      \
    "<float name='sky_scale' value='20'/></emitter>"
#define BALL                                                                             \
    "<shape type='sphere' id='ball'><float name='radius' value='.4'/><point "            \
    "name='center' x='1.1' y='-.8' z='.5'/><ref id='grey'/></shape>"
#define EGG_FILE "moved_lens_egg.obj"
#define EGG      EGG_OF(EGG_FILE)

static imp_scene *room(const char *rest)
{
    char xml[8192];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><bsdf type='diffuse' id='grey'><rgb "
             "name='reflectance' value='.6,.5,.4'/></bsdf>%s"
             "<sensor type='thinlens' id='camera'><float name='fov' value='50'/><float "
             "name='aperture_radius' value='.25'/><float name='focus_distance' "
             "value='4.2'/><transform name='to_world'><lookat origin='.4,-5.5,2.3' "
             "target='0,0,.6' up='0,0,1'/></transform><film type='hdrfilm'><integer "
             "name='width' value='24'/><integer name='height' value='16'/><rfilter "
             "type='box'/></film></sensor>"
             "<shape type='rectangle' id='floor'><transform name='to_world'><scale "
             "value='3'/></transform><ref id='grey'/></shape>"
             "<shape type='cube' id='block'><transform name='to_world'><scale x='.6' "
             "y='.5' z='.4'/><rotate z='1' angle='25'/><translate x='-.2' y='.3' "
             "z='.7'/></transform><ref id='grey'/></shape></scene>",
             rest);
    return test_scene_text(ctx, xml, IMP_RGB);
}

/* A film of one pixel, t = tan(fov/2), and a black half plane x > e = z t, at its border, before a sky
 * of radiance 1, at depth z of a lens of radius a in focus at f. Through the point xi of the lens the
 * film sees black over xi (1/z - 1/f)/(2 t) of its width where that is positive; the mean of that over
 * the lens has  E max(0, xi) = 2a/(3 pi). */
static void edge_test(void)
{
    const double a = .3, f = 5, z = 3, t = tan(20 * IMP_PI / 180);
    const double mean = 2 * a / (3 * IMP_PI), near = 1 / z - 1 / f;
    struct tap_stat pose[6] = {{0, 0, 0}}, aperture[1] = {{0, 0, 0}},
                    focus[1] = {{0, 0, 0}};
    char xml[2048];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='direct'/><sensor type='thinlens' "
             "id='camera'><float name='fov' value='40'/><float name='aperture_radius' "
             "value='.3'/><float name='focus_distance' value='5'/><transform "
             "name='to_world'><lookat origin='0,0,3' target='0,0,0' up='0,1,0'/>"
             "</transform><film type='hdrfilm'><integer name='width' value='1'/><integer "
             "name='height' value='1'/><rfilter type='box'/></film></sensor><emitter "
             "type='constant'><rgb name='radiance' value='1'/></emitter><shape "
             "type='rectangle' id='half'><transform name='to_world'><scale value='2'/>"
             "<translate x='%.12g'/></transform><bsdf type='diffuse'><rgb "
             "name='reflectance' value='0'/></bsdf></shape></scene>",
             2 + z * t);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(scene, "half.pose"));
    test_must(ctx, imp_scene_add_geometry(scene, "camera.aperture_radius"));
    test_must(ctx, imp_scene_add_geometry(scene, "camera.focus_distance"));
    mean_gradient(ctx, scene, "half.pose", 4096, 32, pose);
    mean_gradient(ctx, scene, "camera.aperture_radius", 4096, 32, aperture);
    mean_gradient(ctx, scene, "camera.focus_distance", 4096, 32, focus);
    tap_z(&pose[0], 1 / (4 * z * t), 1e-2 / (4 * z * t), "an edge out of focus moves");
    tap_z(&aperture[0], -mean / a * near / (2 * t), 1e-2 * mean / a * near / (2 * t),
          "the aperture opens");
    tap_z(&focus[0], -mean / (f * f) / (2 * t), 1e-2 * mean / (f * f) / (2 * t),
          "the focus goes away");
    imp_scene_destroy(scene);
}

/* Weights that notice what is blurred. */
static void adjoint_sharpen(void)
{
    for (int p = 0; p < WIDTH * HEIGHT; p++)
        for (int c = 0; c < 3; c++)
            adjoint[3 * p + c] *=
                2 * cosf(.9f * (float)(p % WIDTH) + .6f * (float)(p / WIDTH));
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 16 : 1;
    static const struct number view[] = {
        {"camera.pose", 0, .03}, {"camera.pose", 4, .02},
        {"camera.x_fov", 0, 1},  {"camera.principal_point_offset_x", 0, .01},
        {"block.pose", 0, .03},  {"block.pose", 5, .03},
        {"lamp.pose", 0, .03},   {NULL, 0, 0}};
    static const struct number blur[] = {{"camera.aperture_radius", 0, .05},
                                         {"camera.focus_distance", 0, .2},
                                         {NULL, 0, 0}};
    static const struct number ball[] = {
        {"ball.pose", 0, .03}, {"camera.pose", 5, .02}, {NULL, 0, 0}};
    static const struct number egg[] = {{"egg.pose", 0, .02},
                                        {"egg.pose", 4, .03},
                                        {"camera.pose", 1, .02},
                                        {NULL, 0, 0}};
    static const struct number sky[] = {{"camera.pose", 3, .02},
                                        {"camera.x_fov", 0, 1},
                                        {"block.pose", 0, .03},
                                        {NULL, 0, 0}};
    ctx = test_context(2);
    adjoint_make();
    egg_write(EGG_FILE, true);
    edge_test();
    numbers_compare("sky", room(PATH CLEAR), 32 * more, 48 * more, .2, sky);
    adjoint_sharpen();
    numbers_compare("blur", room(PATH LAMP), 32 * more, 64 * more, .4, blur);
    numbers_compare("lens", room(PATH LAMP), 32 * more, 48 * more, .1, view);
    numbers_compare("ball", room(PATH LAMP BALL), 32 * more, 48 * more, .2, ball);
    numbers_compare("egg", room(PATH LAMP EGG), 32 * more, 48 * more, .2, egg);
    remove(EGG_FILE);
    return tap_done();
}

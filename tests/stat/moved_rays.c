/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of what a radiancemeter, or a distant sensor with a target, reads along one ray: of a point
 * below a blade before a sky, against Lambert's formula; in a lit room by whatever moves, and by the
 * meter's own pose, against central differences; beside a mesh with vertex normals; a grid of such rays.
 * What is refused. */
#include "egg.h"
#include "mean_gradient.h"
#include "moves_numbers.h"
#include <unistd.h>

#define FILM(w, h)                                                                       \
    "<film type='hdrfilm'><integer name='width' value='" w "'/><integer name='height' "  \
    "value='" h "'/><rfilter type='box'/></film></sensor>"
#define RAY                                                                              \
    "<sensor type='radiancemeter' id='ray'><vector name='origin' value='-2,-4,3'/>"      \
    "<vector name='direction' value='2.3,3,-3.5'/>" FILM("1", "1")
#define TO_EGG                                                                           \
    "<sensor type='radiancemeter' id='ray'><vector name='origin' value='-2,-4,3'/>"      \
    "<vector name='direction' value='3,3.2,-2.4'/>" FILM("1", "1")
#define PLACED                                                                           \
    "<sensor type='radiancemeter' id='ray'><transform name='to_world'><lookat "          \
    "origin='-2,-4,3' target='.3,-1,-.5' up='0,0,1'/></transform>" FILM("1", "1")
#define FAR                                                                              \
    "<sensor type='distant' id='ray'><vector name='direction' value='.2,.4,-1'/><point " \
    "name='target' value='.3,-.6,.1'/>" FILM("1", "1")
#define GRID                                                                             \
    "<sensor type='radiancemeter' id='ray'><vector name='origin' value='-2,-4,3'/>"      \
    "<transform name='grid'><scale value='.2'/><translate x='.5' "                       \
    "y='-1.2'/></transform>" FILM("3", "2")

/* ---- Lambert's formula ------------------------------------------------------------------------- */

/* Irradiance of the origin, facing +z, by a polygon of the radiance 1 above it:
 * sum over its sides of  angle/2 (the side's normal).z */
static double lambert(const imp_v3 *p, int n)
{
    double sum = 0;
    for (int k = 0; k < n; k++) {
        const imp_v3 a = imp__normalize(p[k]), b = imp__normalize(p[(k + 1) % n]),
                     c = imp__cross(a, b);
        sum += atan2(imp__length(c), imp__dot(a, b)) / 2 * c[2] / imp__length(c);
    }
    return fabs(sum);
}

/* The point at the origin reflects half of what a sky sends past a black blade. */
static double below_blade(double x, double z, double turn)
{
    imp_v3 p[4];
    for (int k = 0; k < 4; k++) {
        const double u = k == 0 || k == 3 ? -.8 : .8, v = k < 2 ? -.5 : .5;
        p[k] = imp__v3(x + u * cos(turn), v, z - u * sin(turn));
    }
    return .5 / IMP_PI * (IMP_PI - lambert(p, 4));
}

static void blade_test(void)
{
    static const double at[3] = {.3, .9, 25 * IMP_PI / 180};
    static const int number[3] = {0, 2, 4};
    struct tap_stat g[6] = {{0}};
    imp_scene *scene = test_scene_text(
        ctx,
        "<scene version='3.0.0'><integrator type='direct'/><sensor type='radiancemeter' "
        "id='ray'><vector name='origin' value='-3,0,1'/><vector name='direction' "
        "value='3,0,-1'/>" FILM(
            "1",
            "1") "<shape type='rectangle'><transform name='to_world'><scale value='3'/>"
                 "</transform><bsdf type='diffuse'><rgb name='reflectance' "
                 "value='.5'/></bsdf>"
                 "</shape><shape type='rectangle' id='blade'><transform "
                 "name='to_world'><scale "
                 "x='.8' y='.5'/><rotate y='1' angle='25'/><translate x='.3' "
                 "z='.9'/></transform>"
                 "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "
                 "value='0'/>"
                 "</bsdf></bsdf></shape><emitter type='constant'><rgb name='radiance' "
                 "value='1'/>"
                 "</emitter></scene>",
        IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(scene, "blade.pose"));
    mean_gradient(ctx, scene, "blade.pose", 16384, 16, g);
    for (int k = 0; k < 3; k++) {
        double value[2], there[3];
        char what[64];
        for (int s = 0; s < 2; s++) {
            memcpy(there, at, sizeof there);
            there[k] += s ? 1e-5 : -1e-5;
            value[s] = below_blade(there[0], there[1], there[2]);
        }
        snprintf(what, sizeof what, "a point below a blade by number %d", number[k]);
        tap_z(&g[number[k]], (value[1] - value[0]) / 2e-5, 2e-3, what);
    }
    imp_scene_destroy(scene);
}

/* ---- Differences ------------------------------------------------------------------------------- */

/* Derivatives of the mean of a reading of n pixels. */
static void compare(const char *what, imp_scene *scene, int n, int spp, double largest,
                    const struct number *numbers)
{
    for (int k = 0; k < 3 * n; k++) adjoint[k] = (float)(1. / (3 * n));
    numbers_compare(what, scene, spp, 4 * spp, largest, numbers);
}

static imp_scene *room(const char *sensor, const char *rest)
{
    char xml[8192];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
             "value='4'/></integrator><bsdf type='diffuse' id='grey'><rgb "
             "name='reflectance' value='.6,.5,.4'/></bsdf>%s<shape type='rectangle' "
             "id='floor'><transform name='to_world'><scale value='2'/></transform><ref "
             "id='grey'/></shape><shape type='rectangle'><transform name='to_world'>"
             "<scale value='2'/><rotate x='1' angle='90'/><translate y='1.5' z='1'/>"
             "</transform><ref id='grey'/></shape><shape type='cube' id='block'>"
             "<transform name='to_world'><scale x='.5' y='.4' z='.3'/><rotate z='1' "
             "angle='25'/><translate x='-.2' y='-.1' z='1.2'/></transform><ref "
             "id='grey'/></shape><shape type='rectangle' id='lamp'><transform "
             "name='to_world'><scale value='.7'/><rotate y='1' angle='180'/><translate "
             "x='.2' y='.1' z='2.5'/></transform><emitter type='area'><rgb "
             "name='radiance' value='7,6,5'/></emitter></shape>%s</scene>",
             sensor, rest);
    return test_scene_text(ctx, xml, IMP_RGB);
}

/* A point of the floor, behind a lamp that shines on an egg, sees the egg alone. */
#define BEHIND_LAMP                                                                      \
    "<sensor type='radiancemeter' id='ray'><vector name='origin' value='-2,-4,3'/>"      \
    "<vector name='direction' value='1.3,3.4,-3'/>" FILM("1", "1")
#define GRID_BEHIND_LAMP                                                                 \
    "<sensor type='radiancemeter' id='ray'><vector name='origin' value='-2,-4,3'/>"      \
    "<transform name='grid'><scale value='.1'/><translate x='-.7' "                      \
    "y='-.6'/></transform>" FILM("3", "2")
static imp_scene *beside_egg(const char *sensor)
{
    char xml[4096];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='3'/></integrator>%s<bsdf type='diffuse' id='grey'><rgb "
        "name='reflectance' value='.8'/></bsdf><shape type='rectangle'><transform "
        "name='to_world'><scale value='2'/></transform><ref id='grey'/></shape>"
        "<shape type='rectangle'><transform name='to_world'><scale value='.4'/>"
        "<rotate y='1' angle='80'/><translate x='-.4' y='-.8' z='1.3'/></transform>"
        "<emitter type='area'><rgb name='radiance' value='60'/></emitter></shape>" EGG_OF(
            "egg.obj") "</scene>",
        sensor);
    return test_scene_text(ctx, xml, IMP_RGB);
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 16 : 1;
    static const struct number
        ray[] = {{"block.pose", 0, .02}, {"block.pose", 2, .02},
                 {"block.pose", 4, .02}, {"lamp.pose", 1, .02},
                 {"floor.pose", 3, .02}, {"ray.pose", 0, .02},
                 {"ray.pose", 4, .01},   {NULL, 0, 0}},
        far[] = {{"block.pose", 1, .02}, {"ray.turn", 0, .02}, {NULL, 0, 0}},
        world[] = {{"ray.to_world", 3, .02}, {NULL, 0, 0}},
        egg[] = {{"egg.pose", 0, .03}, {"egg.pose", 2, .03}, {NULL, 0, 0}},
        grid[] = {{"block.pose", 2, .02}, {"ray.pose", 2, .02}, {NULL, 0, 0}};
    char folder[] = "moved_rays_XXXXXX";
    ctx = test_context(2);
    if (!mkdtemp(folder) || chdir(folder) != 0) exit(99);
    blade_test();
    compare("along a ray", room(RAY, ""), 1, 4096 * more, .05, ray);
    compare("from far away", room(FAR, ""), 1, 4096 * more, .05, far);
    compare("by its matrix", room(PLACED, ""), 1, 4096 * more, .05, world);
    compare("a grid", room(GRID, ""), 6, 1024 * more, .05, grid);
    egg_write("egg.obj", true);
    /* Without the curve where its normals turn away, 6 errors off. */
    compare("beside an egg", beside_egg(BEHIND_LAMP), 1, 16384 * more, .1, egg);
    compare("a grid beside an egg", beside_egg(GRID_BEHIND_LAMP), 6, 2048 * more, .15,
            egg);
    number_refused("masks",
                   room(RAY,
                        "<shape type='rectangle'><bsdf type='mask'><float name='opacity' "
                        "value='.5'/><bsdf type='diffuse'/></bsdf></shape>"),
                   "block.pose", "straight through");
    number_refused("mirrors",
                   room(RAY, "<shape type='rectangle'><bsdf type='conductor'/></shape>"),
                   "block.pose", "mirrors");
    number_refused("vertex normals", room(TO_EGG, EGG_OF("egg.obj")), "block.pose",
                   "meets a mesh with vertex normals");
    number_refused("a sky that turns", room(RAY, "<emitter type='ciesky' id='sky'/>"),
                   "sky.turn", "single rays");
    number_refused("a grid has no matrix", room(GRID, ""), "ray.to_world", "it has none");
    if (remove("egg.obj") != 0 || chdir("..") != 0 || rmdir(folder) != 0) exit(99);
    imp_context_destroy(ctx);
    return tap_done();
}

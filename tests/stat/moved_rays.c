/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of what a radiancemeter, or a distant sensor with a target, reads along one ray: of a point
 * below a blade before a sky, against Lambert's formula; in a lit room by whatever moves, and by the
 * meter's own pose, against central differences; a grid of such rays. What is refused. */
#include "egg.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/vec.h"
#include "mean_gradient.h"
#include <math.h>
#include <stdlib.h>
#include <unistd.h>

static imp_context *ctx;

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

static double mean_of(imp_scene *scene, int spp, uint64_t seed)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = spp;
    run.seed = seed;
    test_must(ctx, imp_render(scene, &run, &film));
    const float *y = imp_film_mean(film);
    const double mean = (y[0] + y[1] + y[2]) / 3.;
    imp_film_destroy(film);
    return mean;
}

struct number {
    const char *name;
    int k;
    double step;
};

static void compare(const char *what, imp_scene *scene, int spp, double largest,
                    const struct number *numbers)
{
    enum { SEEDS = 12, PAIRS = 12 };
    for (const struct number *x = numbers; x->name; x++)
        test_must(ctx, imp_scene_add_geometry(scene, x->name));
    for (const struct number *x = numbers; x->name; x++) {
        struct tap_stat g[MEAN_NUMBERS_MAX] = {{0}}, ref = {0};
        double rest[MEAN_NUMBERS_MAX], there[MEAN_NUMBERS_MAX], most = 0;
        struct imp_param_info info = {.size = sizeof info};
        size_t index;
        mean_gradient(ctx, scene, x->name, spp, SEEDS, g);
        test_must(ctx, imp_scene_find_param(scene, x->name, &index));
        test_must(ctx, imp_scene_get_param(scene, index, &info));
        test_must(ctx, imp_scene_get_values(scene, index, rest));
        for (size_t k = 0; k < info.count; k++) most = fmax(most, fabs(g[k].mean));
        for (int j = 0; j < PAIRS; j++) {
            double value[2];
            for (int s = 0; s < 2; s++) {
                memcpy(there, rest, sizeof there);
                there[x->k] += s ? x->step : -x->step;
                test_must(ctx, imp_scene_set_values(scene, index, info.count, there));
                value[s] = mean_of(scene, 4 * spp, 500 + (uint64_t)j);
            }
            tap_add(&ref, (value[1] - value[0]) / (2 * x->step));
        }
        test_must(ctx, imp_scene_set_values(scene, index, info.count, rest));
        const double se = tap_se(&g[x->k]),
                     z = (g[x->k].mean - ref.mean) / hypot(se, tap_se(&ref));
        tap_ok(fabs(z) < 3.5 && se < largest * most,
               "%s, %s[%d] # %.6f se %.6f ref %.6f se %.6f z %.2f", what, x->name, x->k,
               g[x->k].mean, se, ref.mean, tap_se(&ref), z);
    }
    imp_scene_destroy(scene);
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

static void refused(const char *what, imp_scene *scene, const char *name,
                    const char *word)
{
    const float adjoint[3] = {1, 1, 1};
    struct imp_run run = IMP_RUN_INIT;
    double g[16];
    imp_problem *p;
    run.spp = 2;
    enum imp_status st = imp_scene_add_geometry(scene, name);
    if (st == IMP_OK) {
        test_must(ctx, imp_problem_create(scene, &p));
        test_must(ctx, imp_problem_activate(p, name));
        st = imp_problem_reverse(p, adjoint, &run, g, NULL);
        imp_problem_destroy(p);
    }
    tap_ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), word), "%s # %s", what,
           st == IMP_OK ? "" : imp_last_error(ctx));
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 16 : 1;
    static const struct number ray[] = {{"block.pose", 0, .02}, {"block.pose", 2, .02},
                                        {"block.pose", 4, .02}, {"lamp.pose", 1, .02},
                                        {"floor.pose", 3, .02}, {"ray.pose", 0, .02},
                                        {"ray.pose", 4, .01},   {NULL, 0, 0}},
                               far[] = {{"block.pose", 1, .02},
                                        {"ray.turn", 0, .02},
                                        {NULL, 0, 0}},
                               world[] = {{"ray.to_world", 3, .02}, {NULL, 0, 0}},
                               grid[] = {{"block.pose", 2, .02},
                                         {"ray.pose", 2, .02},
                                         {NULL, 0, 0}};
    char folder[] = "moved_rays_XXXXXX";
    ctx = test_context(2);
    if (!mkdtemp(folder) || chdir(folder) != 0) exit(99);
    blade_test();
    compare("along a ray", room(RAY, ""), 4096 * more, .05, ray);
    compare("from far away", room(FAR, ""), 4096 * more, .05, far);
    compare("by its matrix", room(PLACED, ""), 4096 * more, .05, world);
    compare("a grid", room(GRID, ""), 1024 * more, .05, grid);
    refused("masks",
            room(RAY, "<shape type='rectangle'><bsdf type='mask'><float name='opacity' "
                      "value='.5'/><bsdf type='diffuse'/></bsdf></shape>"),
            "block.pose", "straight through");
    refused("mirrors",
            room(RAY, "<shape type='rectangle'><bsdf type='conductor'/></shape>"),
            "block.pose", "mirrors");
    egg_write("egg.obj", true);
    refused("vertex normals", room(TO_EGG, EGG_OF("egg.obj")), "block.pose",
            "meets a mesh with vertex normals");
    refused("a sky that turns", room(RAY, "<emitter type='ciesky' id='sky'/>"),
            "sky.turn", "single rays");
    refused("a grid has no matrix", room(GRID, ""), "ray.to_world", "it has none");
    if (remove("egg.obj") != 0 || chdir("..") != 0 || rmdir(folder) != 0) exit(99);
    imp_context_destroy(ctx);
    return tap_done();
}

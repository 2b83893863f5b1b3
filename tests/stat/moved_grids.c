/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by the place of grid volumes, and by what moves where a medium glows: slabs and balls
 * against closed forms, and imp_problem_reverse against central differences in a room. What is refused. */
#include "math/rng.h"
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"
#include "vol_write.h"

#define GRID(NAME, ID, FILE, TO_WORLD)                                                   \
    "<volume type='gridvolume' name='" NAME "' id='" ID                                  \
    "'><string name='filename' value='%s'/>" FILE "<transform name='to_world'>" TO_WORLD \
    "</transform></volume>"

/* Densities of layers of a slab, and of a cloud; how white the cloud is. */
enum { LAYERS = 5, CELLS = 6 };
static const float layer[LAYERS] = {0, 1, 1.4f, .8f, 0};
static char slab_file[64], cloud_file[64], white_file[64], full_file[64];

static void files_make(void)
{
    float cloud[CELLS * CELLS * CELLS], white[2 * 2 * 2], full[2 * 2 * 2];
    for (int k = 0; k < CELLS * CELLS * CELLS; k++) {
        const int i[3] = {k % CELLS, k / CELLS % CELLS, k / (CELLS * CELLS)};
        const double r2 =
            imp__sqr(i[0] - 2.2) + imp__sqr(i[1] - 2.7) + imp__sqr(i[2] - 2.5);
        cloud[k] = (float)(3 * exp(-.35 * r2) *
                           (.7 + .6 * imp__u01(imp__key(5, 1, 2), (uint32_t)k)));
        for (int a = 0; a < 3; a++)
            if (i[a] == 0 || i[a] == CELLS - 1) cloud[k] = 0;
    }
    for (int k = 0; k < 8; k++) {
        white[k] = .4f + .5f * (float)(k % 3 == 1);
        full[k] = 1;
    }
    vol_write(slab_file, 1, 1, LAYERS, 1, layer);
    vol_write(cloud_file, CELLS, CELLS, CELLS, 1, cloud);
    vol_write(white_file, 2, 2, 2, 1, white);
    vol_write(full_file, 2, 2, 2, 1, full);
}

/* ---- Closed forms -------------------------------------------------------------------- */

/* Layers across z, from -.8 to .8, of a width that no pixel sees; parallel rays from above. The layers
 * reach beyond the cube at which their medium ends. */
#define THICK 1.6
#define LAYERED(ALBEDO, MORE)                                                            \
    "<sensor type='orthographic' id='camera'><transform name='to_world'><lookat "        \
    "origin='0,0,3' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"        \
    "<integer name='width' value='8'/><integer name='height' value='8'/><rfilter "       \
    "type='box'/></film></sensor><shape type='cube' id='box'><transform "                \
    "name='to_world'><scale x='1.5' y='1.5' z='1'/></transform><bsdf type='null'/>"      \
    "<medium type='heterogeneous' name='interior'>" GRID(                                \
        "sigma_t", "layers", "",                                                         \
        "<scale x='4' y='4' z='1.6'/><translate x='-2' y='-2' z='-.8'/>") "<float "      \
                                                                          "name='"       \
                                                                          "albedo' "     \
                                                                          "value="       \
                                                                          "'" ALBEDO     \
                                                                          "'/>" MORE     \
                                                                          "</medium></"  \
                                                                          "shape>"
#define WALL(Z)                                                                          \
    "<shape type='rectangle' id='wall'><transform name='to_world'><scale value='1.4'/>"  \
    "<translate z='" Z "'/></transform><emitter type='area'><rgb name='radiance' "       \
    "value='3'/></emitter></shape>"

static void mean_test(const char *what, const char *objects, const char *name, int number,
                      int spp, double ref, double most)
{
    char filled[4096];
    snprintf(filled, sizeof filled, objects, slab_file);
    mean_gradient_test(ctx, what, filled, name, number, spp, ref, most);
}

static void closed_test(int more)
{
    const double dz = THICK / LAYERS;
    double depth = 0;
    for (int k = 0; k < LAYERS; k++) depth += layer[k] * dz;
    const double T = exp(-depth), by_height = -depth * T / THICK;
    const int spp = 256 * more;
    mean_test("layers before a wall, of another height",
              VOLPATH("2") LAYERED("0", "") WALL("-2"), "layers.to_world", 10, spp,
              3 * by_height, .02 * fabs(3 * by_height));
    mean_test("layers that glow",
              VOLPATH("2") LAYERED("0", "<float name='emission' value='5'/>") WALL("-2"),
              "layers.to_world", 10, spp, (3 - 5) * by_height, .03 * fabs(2 * by_height));
    mean_test("they move, and meet nothing", VOLPATH("2") LAYERED("0", "") WALL("-2"),
              "layers.pose", 2, spp, 0, .03);
    /* At .32, the middle of layer 3. */
    const double above = dz / 2 * layer[3];
    mean_test("a wall in them", VOLPATH("2") LAYERED("0", "") WALL(".32"), "layers.pose",
              2, spp, -3 * exp(-above) * layer[3], .03 * 3 * exp(-above) * layer[3]);
    /* Of a sun of irradiance 5 from above  L = .75 5/(4 pi) (1 - exp(-2 depth))/2. */
    const double scattered = .75 * 5 / (4 * IMP_PI) * exp(-2 * depth) * depth / THICK;
    mean_test("layers that scatter once",
              VOLPATH("2") LAYERED("0.75", "") "<emitter type='directional'><vector "
                                               "name='direction' value='0,0,-1'/><rgb "
                                               "name='irradiance' value='5'/></emitter>",
              "layers.to_world", 10, 2 * spp, scattered, .04 * scattered);
}

/* The mean of the picture of a ball of radius r at the distance D that emits and absorbs, before
 * nothing: see ball_seen of moved_media.c. */
static double ball_glows(double D, double r, double sigma, double radiance)
{
    enum { STEPS = 20000 };
    double sum = 0;
    for (int k = 0; k < STEPS; k++) {
        const double v = (k + .5) / STEPS, s = sqrt(1 - v * v) * r / D;
        sum += 2 * IMP_PI * (1 - exp(-sigma * 2 * r * v)) * imp__sqr(r / D) * v /
               imp__sqr(1 - s * s) / STEPS;
    }
    return radiance * sum / (4 * imp__sqr(tan(IMP_PI / 6)));
}
#define BALL                                                                             \
    "<sensor type='perspective' id='camera'><float name='fov' value='60'/><float "       \
    "name='near_clip' value='1e-6'/><transform name='to_world'><lookat "                 \
    "origin='0,0,3' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"        \
    "<integer name='width' value='16'/><integer name='height' value='16'/><rfilter "     \
    "type='box'/></film></sensor><shape type='sphere' id='ball'><bsdf type='null'/>"     \
    "<medium type='homogeneous' name='interior'><float name='sigma_t' value='1.2'/>"     \
    "<float name='albedo' value='0'/><float name='emission' value='2'/></medium>"        \
    "</shape>"

static void ball_test(int more)
{
    const double h = 1e-4;
    const double by_radius =
                     (ball_glows(3, 1 + h, 1.2, 2) - ball_glows(3, 1 - h, 1.2, 2)) /
                     (2 * h),
                 nearer = (ball_glows(3 - h, 1, 1.2, 2) - ball_glows(3 + h, 1, 1.2, 2)) /
                          (2 * h);
    const int spp = 32 * more;
    mean_test("a ball that glows becomes larger", VOLPATH("2") BALL, "ball.radius", 0,
              spp, by_radius, .01 * by_radius);
    mean_test("it comes nearer", VOLPATH("2") BALL, "ball.pose", 2, spp, nearer,
              .01 * nearer);
    mean_test("the camera comes nearer", VOLPATH("2") BALL, "camera.pose", 2, spp,
              -nearer, .01 * nearer);
}

/* A slab that glows, from -.8 to .8, with a black wall across it at -.2 or a black square before it. */
#define SLAB                                                                             \
    "<sensor type='orthographic' id='camera'><transform name='to_world'><lookat "        \
    "origin='0,0,3' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"        \
    "<integer name='width' value='8'/><integer name='height' value='8'/><rfilter "       \
    "type='box'/></film></sensor><shape type='cube' id='slab'><transform "               \
    "name='to_world'><scale x='1.5' y='1.5' z='.8'/></transform><bsdf type='null'/>"     \
    "<medium type='homogeneous' name='interior'><float name='sigma_t' value='1.2'/>"     \
    "<float name='albedo' value='0'/><float name='emission' value='4'/></medium>"        \
    "</shape>"
#define BLACK(SIZE, Z)                                                                   \
    "<shape type='rectangle' id='black'><transform name='to_world'><scale value='" SIZE  \
    "'/><translate z='" Z "'/></transform><bsdf type='diffuse'><float "                  \
    "name='reflectance' value='0'/></bsdf></shape>"

static void slab_test(int more)
{
    const double by_depth = 4 * 1.2 * exp(-1.2), glows = 4 * (1 - exp(-1.2 * 1.6));
    const int spp = 32 * more;
    mean_test("a wall in what glows", VOLPATH("2") SLAB BLACK("1.3", "-.2"), "black.pose",
              2, spp, -by_depth, .02 * by_depth);
    mean_test("what glows moves away from it", VOLPATH("2") SLAB BLACK("1.3", "-.2"),
              "slab.pose", 2, 4 * spp, by_depth, .03 * by_depth);
    mean_test("a square before it grows", VOLPATH("2") SLAB BLACK(".3", "1"),
              "black.scale", 0, spp, -2 * .09 * glows, .02 * .18 * glows);
}

/* ---- In a room ----------------------------------------------------------------------- */

/* The room of moves_kit.h, with these files. */
static imp_scene *room(const char *rest)
{
    char xml[16384], filled[16384];
    room_write(&(struct room_parts){.rest = rest}, xml, sizeof xml);
    snprintf(filled, sizeof filled, xml, cloud_file, white_file);
    return test_scene_text(ctx, filled, IMP_RGB);
}
#define CLOUD_PLACE                                                                      \
    "<translate x='-.5' y='-.5' z='-.5'/><scale x='2.4' y='2' z='1.6'/><rotate z='1' "   \
    "angle='20'/><translate x='.2' y='-.5' z='1.2'/>"
#define CLOUD                                                                            \
    "<shape type='sphere' id='around'><point name='center' value='.2,-.5,1.2'/><float "  \
    "name='radius' value='1.15'/><bsdf type='null'/><medium type='heterogeneous' "       \
    "name='interior'>" GRID("sigma_t", "cloud", "", CLOUD_PLACE)                         \
        GRID("albedo", "white", "", CLOUD_PLACE) "<rgb name='emission' "                 \
                                                 "value='5,4,3'/></medium></shape>"
#define GLOWS(SIGMA, ALBEDO)                                                             \
    "<shape type='sphere' id='ball'><point name='center' value='.3,-.8,1.5'/><float "    \
    "name='radius' value='.6'/><bsdf type='null'/><medium name='interior' "              \
    "type='homogeneous'><rgb name='sigma_t' value='" SIGMA "'/><rgb name='albedo' "      \
    "value='" ALBEDO "'/><rgb name='emission' value='6,5,3'/></medium></shape>"

static void room_test(int more)
{
    static const struct number cloud[] = {{"cloud.to_world", 0, .05},
                                          {"cloud.to_world", 10, .05},
                                          {"white.to_world", 0, .03},
                                          {"white.to_world", 11, .03},
                                          {NULL, 0, 0}},
                               ball[] = {{"ball.center", 1, .1},
                                         {"ball.radius", 0, .05},
                                         {"camera.pose", 2, .15},
                                         {NULL, 0, 0}};
    numbers_compare("a cloud of cells", room(CLOUD VOLPATH("4")), 24 * more, 24 * more,
                    .05, cloud);
    numbers_compare("a ball that glows",
                    room(GLOWS(".8,1.2,1.6", ".3,.5,.7") VOLPATH("4")), 24 * more,
                    24 * more, .05, ball);
}

/* Adds the gradients of the room by these numbers. */
static void cloud_gradient(const char *const *name, int n, double *out)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_scene *scene = room(CLOUD VOLPATH("4"));
    imp_problem *p;
    for (int k = 0; k < n; k++) test_must(ctx, imp_scene_add_geometry(scene, name[k]));
    test_must(ctx, imp_problem_create(scene, &p));
    for (int k = 0; k < n; k++) test_must(ctx, imp_problem_activate(p, name[k]));
    run.spp = 8;
    test_must(ctx, imp_problem_reverse(p, adjoint, &run, out, NULL));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* Derivatives by a pose and a scale are sums of those by to_world times its motion
 * (omega x M, e + omega x (t - c)) and (M, t - c), with c the middle of the box. */
static void pose_test(void)
{
    static const char *const world[] = {"cloud.to_world"}, *const pose[] = {
                                                               "cloud.pose",
                                                               "cloud.scale"};
    double g[12], own[7], M[12], most = 0, worst = 0;
    size_t n, index;
    imp_scene *scene = room(CLOUD VOLPATH("4"));
    test_must(ctx, imp_scene_add_geometry(scene, world[0]));
    values_get(scene, world[0], M, &n, &index);
    imp_scene_destroy(scene);
    cloud_gradient(world, 1, g);
    cloud_gradient(pose, 2, own);
    imp_v3 column[4];
    for (int j = 0; j < 4; j++) column[j] = imp__v3(M[j], M[4 + j], M[8 + j]);
    column[3] = (column[0] + column[1] + column[2]) * -.5; /* t - c */
    for (int k = 0; k < 7; k++) {
        const imp_v3 axis = imp__v3(k % 3 == 0, k % 3 == 1, k % 3 == 2);
        double sum = 0;
        for (int j = 0; j < 4; j++) {
            const imp_v3 moved = k == 6   ? column[j]
                                 : k > 2  ? imp__cross(axis, column[j])
                                 : j == 3 ? axis
                                          : imp__v3(0, 0, 0);
            for (int i = 0; i < 3; i++) sum += g[4 * i + j] * moved[i];
        }
        worst = fmax(worst, fabs(sum - own[k]));
        most = fmax(most, fabs(own[k]));
    }
    tap_ok(worst < 1e-9 * most && most > .1,
           "by a pose and a scale as by to_world # up to %.3g, off by %.2g", most, worst);
}

/* ---- What is refused, and where a volume cannot be ------------------------------------- */

#define FULL(MORE)                                                                       \
    "<shape type='cube' id='box'><bsdf type='null'/><medium type='heterogeneous' "       \
    "name='interior'>" GRID("sigma_t", "cloud", MORE,                                    \
                            "<translate x='-.5'/>") "</medium></shape>"

static imp_scene *full(const char *rest)
{
    char xml[16384], filled[16384];
    room_write(&(struct room_parts){.rest = rest}, xml, sizeof xml);
    snprintf(filled, sizeof filled, xml, full_file);
    return test_scene_text(ctx, filled, IMP_RGB);
}

static void refused_test(void)
{
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    double g[NUMBERS_MAX];
    run.spp = 2;
    imp_scene *scene = full(FULL("") VOLPATH("2"));
    test_must(ctx, imp_scene_add_geometry(scene, "cloud.pose"));
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "cloud.pose"));
    tap_ok(imp_problem_reverse(p, adjoint, &run, g, NULL) == IMP_E_BIAS &&
               strstr(imp_last_error(ctx), "the border of a box"),
           "a grid that does not end at 0 # %s", imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    number_refused(
        "cells that jump",
        full(FULL("<string name='filter_type' value='nearest'/>") VOLPATH("2")),
        "cloud.pose", "jump from cell to cell");
    number_refused("a number that volumes lack", full(FULL("") VOLPATH("2")),
                   "cloud.radius", "it is a volume");
    scene = room(CLOUD VOLPATH("2"));
    test_must(ctx, imp_scene_add_geometry(scene, "cloud.to_world"));
    tap_ok(imp_scene_add_geometry(scene, "cloud.pose") == IMP_E_UNSUPPORTED &&
               strstr(imp_last_error(ctx), "to_world says where it is"),
           "a pose beside to_world # %s", imp_last_error(ctx));
    double there[12], back[12];
    size_t n, index;
    values_get(scene, "cloud.to_world", there, &n, &index);
    double middle[3], radius;
    test_must(ctx, imp_scene_place(scene, index, middle, &radius));
    tap_ok(fabs(middle[0] - .2) + fabs(middle[1] + .5) + fabs(middle[2] - 1.2) < 1e-9 &&
               radius > 1.7 && radius < 2.2,
           "where a cloud is # %g %g %g, radius %g", middle[0], middle[1], middle[2],
           radius);
    for (int k = 0; k < 3; k++) there[k] = 0;
    tap_ok(imp_scene_set_values(scene, index, n, there) == IMP_E_NUMERIC &&
               strstr(imp_last_error(ctx), "singular"),
           "a volume that is flat # %s", imp_last_error(ctx));
    values_get(scene, "cloud.to_world", back, &n, &index);
    tap_ok(back[0] != 0, "it stays where it was");
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 8 : 1;
    ctx = test_context(2);
    adjoint_make();
    files_make();
    closed_test(more);
    ball_test(more);
    slab_test(more);
    room_test(more);
    pose_test();
    refused_test();
    unlink(slab_file);
    unlink(cloud_file);
    unlink(white_file);
    unlink(full_file);
    imp_context_destroy(ctx);
    return tap_done();
}

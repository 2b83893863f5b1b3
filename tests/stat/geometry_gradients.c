/* SPDX-License-Identifier: Apache-2.0
 *
 * Gradients by scales, vertices, a camera's field of view and principal point, point lights and
 * parallel light, through the public calls: imp_problem_reverse against central differences of
 * functionals of pictures with the numbers set and the same random numbers. Standard errors are
 * bounded; what cannot be moved is refused. */
#include "ies_table.h"
#include "moves_functional.h"

enum { NUMBERS_MAX = 80 };
static char block_file[] = "/tmp/geometry_XXXXXX.obj";

/* A welded box that is turned and leans. */
static void block_write(void)
{
    const int fd = mkstemps(block_file, 4);
    FILE *f = fdopen(fd, "w");
    for (int k = 0; k < 8; k++) {
        const double x = k & 1 ? .6 : -.6, y = k & 2 ? .5 : -.5, z = k & 4 ? .4 : -.4;
        fprintf(f, "v %.9g %.9g %.9g\n", .9 * x - .4 * y - .2,
                .4 * x + .9 * y + .3 + .1 * z, z + .7);
    }
    fputs("f 1 3 4\nf 1 4 2\nf 5 6 8\nf 5 8 7\nf 1 2 6\nf 1 6 5\nf 3 7 8\nf 3 8 4\n"
          "f 1 5 7\nf 1 7 3\nf 2 4 8\nf 2 8 6\n",
          f);
    fclose(f);
}

#define DIRECT "<integrator type='direct'/>"
#define PATH   "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"

#define TABLE "geometry_gradients.ies"
#define LEFT  "geometry_gradients_left.ies"

/* The light `bulb` by that table. */
static const char *luminaire(const char *name)
{
    static char text[512];
    snprintf(text, sizeof text,
             PATH "<emitter type='ies' id='bulb'><string name='filename' value='%s'/>"
                  "<transform name='to_world'><rotate z='1' angle='25'/><rotate x='1' "
                  "angle='14'/><translate x='1.2' y='-1' z='2.5'/></transform></emitter>",
             name);
    return text;
}

/* A floor, a wall and the block, and REST: lights, integrator. */
static imp_scene *room(const char *rest)
{
    char xml[8192];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'>%s"
        "<sensor type='perspective' id='camera'><float name='fov' value='50'/>"
        "<transform name='to_world'><lookat origin='.4,-5.5,2.3' target='0,0,.6' "
        "up='0,0,1'/></transform><film type='hdrfilm'><integer name='width' value='24'/>"
        "<integer name='height' value='16'/><rfilter type='box'/></film></sensor>"
        "<bsdf type='diffuse' id='grey'><rgb name='reflectance' value='.6,.5,.4'/></bsdf>"
        "<shape type='rectangle' id='floor'><transform name='to_world'><scale value='3'/>"
        "</transform><ref id='grey'/></shape>"
        "<shape type='rectangle' id='wall'><transform name='to_world'><scale x='3' "
        "y='1.5'/><rotate x='1' angle='90'/><translate y='3' z='1.5'/></transform>"
        "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "
        "value='.3,.5,.7'/></bsdf></bsdf></shape>"
        "<shape type='obj' id='block'><string name='filename' value='%s'/><boolean "
        "name='face_normals' value='true'/><ref id='grey'/></shape></scene>",
        rest, block_file);
    return test_scene_text(ctx, xml, IMP_RGB);
}

struct number {
    const char *name;
    size_t k;
    double step;
};

static double functional_at(imp_scene *scene, const struct number *x, double by,
                            int64_t seed, int spp)
{
    struct imp_param_info info = {.size = sizeof info};
    double v[NUMBERS_MAX];
    size_t index;
    test_must(ctx, imp_scene_find_param(scene, x->name, &index));
    test_must(ctx, imp_scene_get_param(scene, index, &info));
    test_must(ctx, imp_scene_get_values(scene, index, v));
    v[x->k] += by;
    test_must(ctx, imp_scene_set_values(scene, index, info.count, v));
    const double value = functional(scene, seed, spp);
    v[x->k] -= by;
    test_must(ctx, imp_scene_set_values(scene, index, info.count, v));
    return value;
}

/* Seeds of a derivative, pairs of a difference: a third of them in the short run. */
static int seeds = 16, groups = 32;

/* away: what is set before. Standard errors of 16 seeds are at most `largest` of the largest number
 * of the parameter. */
static void room_test(const char *name, const char *rest, const struct number *number,
                      const struct number *away, double largest, int spp, int spp_ref)
{
    imp_scene *scene = room(rest);
    imp_problem *p;
    double sum[NUMBERS_MAX] = {0}, told[NUMBERS_MAX] = {0};
    size_t first[NUMBERS_MAX], count[NUMBERS_MAX], n = 0;
    for (const struct number *x = number; x->name; x++)
        test_must(ctx, imp_scene_add_geometry(scene, x->name));
    for (const struct number *x = away; x && x->name; x++) {
        double v[NUMBERS_MAX];
        struct imp_param_info info = {.size = sizeof info};
        size_t index;
        test_must(ctx, imp_scene_find_param(scene, x->name, &index));
        test_must(ctx, imp_scene_get_param(scene, index, &info));
        test_must(ctx, imp_scene_get_values(scene, index, v));
        v[x->k] += x->step;
        test_must(ctx, imp_scene_set_values(scene, index, info.count, v));
    }
    test_must(ctx, imp_problem_create(scene, &p));
    for (const struct number *x = number; x->name; x++) {
        struct imp_param_info info = {.size = sizeof info};
        size_t index;
        test_must(ctx, imp_scene_find_param(scene, x->name, &index));
        test_must(ctx, imp_scene_get_param(scene, index, &info));
        const bool again = x > number && strcmp(x[-1].name, x->name) == 0;
        first[x - number] = again ? first[x - number - 1] : n;
        count[x - number] = info.count;
        if (!again) n += info.count;
        test_must(ctx, imp_problem_activate(p, x->name));
    }
    tap_ok(imp_problem_n_variables(p) == n, "%s: %zu numbers", name, n);
    for (int s = 0; s < seeds; s++) {
        struct imp_run run = IMP_RUN_INIT;
        double g[NUMBERS_MAX], se[NUMBERS_MAX];
        run.spp = spp;
        run.seed = 100 + (uint64_t)s;
        test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, se));
        for (size_t k = 0; k < n; k++) {
            sum[k] += g[k] / seeds;
            told[k] += se[k] * se[k] / seeds;
        }
    }
    imp_problem_destroy(p);
    for (const struct number *x = number; x->name; x++) {
        const size_t own = first[x - number], k = own + x->k;
        struct tap_stat ref = {0, 0, 0};
        double most = 0;
        for (size_t j = own; j < own + count[x - number]; j++)
            most = fmax(most, fabs(sum[j]));
        for (uint64_t g = 0; g < (uint64_t)groups; g++) {
            double value[2];
            for (int s = 0; s < 2; s++)
                value[s] =
                    functional_at(scene, x, (s ? 1 : -1) * x->step, 500 + g, spp_ref);
            tap_add(&ref, (value[1] - value[0]) / (2 * x->step));
        }
        const double se = sqrt(told[k] / seeds);
        const double z = (sum[k] - ref.mean) / hypot(se, tap_se(&ref));
        tap_ok(fabs(z) < 3.5 && se < largest * sqrt(16. / seeds) * most,
               "%s, %s[%zu] # %.5f se %.5f ref %.5f se %.5f z %.2f", name, x->name, x->k,
               sum[k], se, ref.mean, tap_se(&ref), z);
    }
    imp_scene_destroy(scene);
}

static void refused(const char *rest, const char *name, const char *word)
{
    imp_scene *scene = room(rest);
    const enum imp_status st = imp_scene_add_geometry(scene, name);
    tap_ok(st != IMP_OK && strstr(imp_last_error(ctx), word), "refused # %s",
           imp_last_error(ctx));
    imp_scene_destroy(scene);
}

#define LAMP                                                                             \
    "<shape type='rectangle' id='lamp'><transform name='to_world'><scale x='.5' "        \
    "y='.7'/><rotate x='1' angle='170'/><translate x='.9' y='-.2' z='3.2'/></transform>" \
    "<emitter type='area'><rgb name='radiance' value='9,8,7'/></emitter></shape>"
#define BULB                                                                             \
    "<emitter type='point' id='bulb'><point name='position' x='1.2' y='-1' z='2.5'/>"    \
    "<rgb name='intensity' value='6,5,4'/></emitter>"
#define SPOT                                                                             \
    "<emitter type='spot' id='bulb'><float name='cutoff_angle' value='35'/><float "      \
    "name='beam_width' value='5'/><transform name='to_world'><lookat origin='1.2,-1,3' " \
    "target='.2,.2,.3' up='0,1,0'/></transform><rgb name='intensity' "                   \
    "value='16,15,14'/></emitter>"
#define BALL                                                                             \
    "<shape type='sphere' id='ball'><float name='radius' value='.5'/><point "            \
    "name='center' x='1.3' y='.2' z='.9'/><ref id='grey'/></shape>"
#define PLATE                                                                            \
    "<shape type='disk' id='plate'><transform name='to_world'><scale x='.6' y='.45'/>"   \
    "<rotate x='1' y='.4' angle='35'/><translate x='1.2' y='.1' z='1.1'/></transform>"   \
    "<bsdf type='twosided'><ref id='grey'/></bsdf></shape>"
#define SKY "<emitter type='constant'><rgb name='radiance' value='.4,.5,.6'/></emitter>"
#define SUN                                                                              \
    "<emitter type='directional' id='sun'><vector name='direction' x='-.8' y='.3' "      \
    "z='-1.6'/><rgb name='irradiance' value='3,2.5,2'/></emitter>"

/* It becomes a parameter, and has no derivative. */
static void moved_refused(const char *rest, const char *name, const char *word)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_scene *scene = room(rest);
    imp_problem *p;
    double g[NUMBERS_MAX], se[NUMBERS_MAX];
    test_must(ctx, imp_scene_add_geometry(scene, name));
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, name));
    run.spp = 4;
    const enum imp_status st = imp_problem_reverse(p, adjoint, &run, g, se);
    tap_ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), word), "refused # %s",
           imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    static const struct number view[] = {{"camera.x_fov", 0, 1},
                                         {"camera.principal_point_offset_x", 0, .01},
                                         {"camera.principal_point_offset_y", 0, .01},
                                         {"camera.pose", 1, .03},
                                         {NULL, 0, 0}},
                               turned[] = {{"camera.pose", 0, .2},
                                           {"camera.pose", 4, .03},
                                           {"camera.principal_point_offset_x", 0, .03},
                                           {"camera.x_fov", 0, -3},
                                           {NULL, 0, 0}},
                               lens[] = {{"camera.opencv_k1", 0, .02},
                                         {"camera.opencv_k2", 0, .01},
                                         {"camera.opencv_p1", 0, .01},
                                         {"camera.opencv_p2", 0, .01},
                                         {"camera.opencv_k3", 0, .01},
                                         {"camera.x_fov", 0, 1},
                                         {"camera.principal_point_offset_x", 0, .01},
                                         {"camera.pose", 1, .03},
                                         {NULL, 0, 0}},
                               bent[] = {{"camera.opencv_k1", 0, -.3},
                                         {"camera.opencv_k2", 0, .15},
                                         {"camera.opencv_p1", 0, .02},
                                         {"camera.opencv_p2", 0, -.01},
                                         {"camera.principal_point_offset_x", 0, .03},
                                         {NULL, 0, 0}},
                               block[] = {{"block.scale", 0, .03},
                                          {"block.pose", 0, .03},
                                          {"block.pose", 5, .03},
                                          {NULL, 0, 0}},
                               larger[] = {{"block.scale", 0, .2},
                                           {"block.pose", 5, .3},
                                           {NULL, 0, 0}},
                               corners[] = {{"block.vertex_positions", 0, .03},
                                            {"block.vertex_positions", 5, .03},
                                            {"block.vertex_positions", 13, .03},
                                            {"block.vertex_positions", 18, .03},
                                            {"block.vertex_positions", 23, .03},
                                            {NULL, 0, 0}},
                               bulb[] = {{"bulb.position", 0, .03},
                                         {"bulb.position", 1, .03},
                                         {"bulb.position", 2, .03},
                                         {"block.pose", 0, .03},
                                         {NULL, 0, 0}},
                               aimed[] = {{"bulb.position", 0, .03},
                                          {"bulb.position", 2, .03},
                                          {"bulb.direction", 0, .01},
                                          {"bulb.direction", 1, .01},
                                          {NULL, 0, 0}},
                               leaning[] = {{"bulb.direction", 0, -.4},
                                            {"bulb.direction", 1, .5},
                                            {NULL, 0, 0}},
                               ball[] = {{"ball.pose", 0, .03},   {"ball.pose", 1, .03},
                                         {"ball.pose", 2, .03},   {"ball.scale", 0, .03},
                                         {"block.pose", 0, .03},  {"camera.pose", 0, .03},
                                         {"camera.pose", 5, .01}, {NULL, 0, 0}},
                               plate[] = {{"plate.pose", 0, .03},
                                          {"plate.pose", 2, .03},
                                          {"plate.pose", 3, .03},
                                          {"plate.pose", 4, .03},
                                          {"plate.scale", 0, .03},
                                          {"block.pose", 0, .03},
                                          {NULL, 0, 0}},
                               round[] = {{"bulb.position", 0, .03},
                                          {"bulb.position", 2, .03},
                                          {"ball.pose", 1, .03},
                                          {"ball.scale", 0, .03},
                                          {NULL, 0, 0}},
                               sun[] = {{"sun.direction", 0, .02},
                                        {"sun.direction", 1, .02},
                                        {"sun.direction", 2, .02},
                                        {"block.pose", 0, .03},
                                        {NULL, 0, 0}};
    if (!is_long) seeds = 6, groups = 12;
    ctx = test_context(2);
    block_write();
    table_write(TABLE, 0);
    table_write(LEFT, 300);
    adjoint_make();
    room_test("view", DIRECT LAMP, view, turned, 0.04, 64, 64);
    room_test("lens", DIRECT LAMP, lens, bent, 0.04, 64, 64);
    room_test("block", PATH LAMP, block, larger, 0.03, 64, 24);
    room_test("corners", DIRECT LAMP, corners, NULL, 0.03, 64, 24);
    room_test("bulb", PATH BULB, bulb, NULL, 0.03, 64, 24);
    if (is_long) room_test("spot", DIRECT SPOT, bulb, NULL, 0.03, 64, 24);
    room_test("luminaire", luminaire(TABLE), aimed, leaning, 0.03, 64, 24);
    if (is_long) room_test("bulb and lamp", DIRECT BULB LAMP, bulb, NULL, 0.04, 64, 24);
    room_test("sun", PATH SUN, sun, NULL, 0.03, 64, 24);
    if (is_long) room_test("ball", DIRECT BALL LAMP, ball, NULL, 0.1, 128, 32);
    room_test("ball and sky", PATH BALL SKY, ball, NULL, 0.25, 128, 32);
    room_test("plate and lamp", PATH PLATE LAMP, plate, NULL, 0.05, 64,
              is_long ? 200 : 24);
    if (is_long) room_test("plate and sky", PATH PLATE SKY, plate, NULL, 0.1, 128, 24);
    room_test("ball and bulb", PATH BALL BULB, round, NULL, 0.1, 128, 24);
    refused(DIRECT LAMP, "lamp.scale", "light");
    refused(DIRECT LAMP, "floor.vertex_positions", "no mesh");
    refused(DIRECT BULB, "bulb.direction", "bulb");
    refused(DIRECT BULB, "block.colour", "pose");
    moved_refused(luminaire(LEFT), "bulb.position", "still has light");
    remove(block_file);
    remove(TABLE);
    remove(LEFT);
    imp_context_destroy(ctx);
    return tap_done();
}

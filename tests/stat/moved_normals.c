/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves where a material has normals of its own (normalmap): a point of a floor
 * under a bulb, whose map slides beneath it, against differences of the reading, which has no noise;
 * imp_problem_reverse against central differences in a room whose floor and block have such a map.
 * What is refused. */
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"
#include <unistd.h>

#define MAP    "moved_normals.pfm"
#define PATH   "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
#define DIRECT "<integrator type='direct'/>"
#define SKY    "<emitter type='constant'><rgb name='radiance' value='.4,.5,.6'/></emitter>"

/* Normals that lean by up to half a radian, as a picture has them. */
static void map_write(void)
{
    enum { SIDE = 4 };
    FILE *f = fopen(MAP, "wb");
    if (!f) exit(99);
    fprintf(f, "PF\n%d %d\n-1\n", SIDE, SIDE);
    for (int k = 0; k < SIDE * SIDE; k++) {
        const double x = 0.45 * sin(1.7 * k + 0.3), y = 0.45 * cos(2.9 * k + 1.1);
        const float c[3] = {(float)(0.5 + 0.5 * x), (float)(0.5 + 0.5 * y),
                            (float)(0.5 + 0.5 * sqrt(1 - x * x - y * y))};
        fwrite(c, sizeof c, 1, f);
    }
    fclose(f);
}

#define TEXTURE(NAME)                                                                    \
    "<texture type='bitmap' name='" NAME "'><string name='filename' value='" MAP         \
    "'/><boolean name='raw' value='true'/></texture>"
#define MAPPED(ID, SWITCHES, BSDF)                                                       \
    "<bsdf type='normalmap'" ID ">" TEXTURE("normalmap") SWITCHES BSDF "</bsdf>"
#define CLAMPED "<boolean name='clamp_invalid_normals' value='true'/>"
#define CLAY    "<bsdf type='diffuse'><rgb name='reflectance' value='.6,.5,.4'/></bsdf>"
#define COPPER                                                                           \
    "<bsdf type='roughconductor'><string name='material' value='Cu'/><float "            \
    "name='alpha' value='.35'/></bsdf>"
#define FROSTED "<bsdf type='roughdielectric'><float name='alpha' value='.4'/></bsdf>"

/* ---- One point --------------------------------------------------------------------------------- */

static void set(imp_scene *scene, const char *name, int k, double by)
{
    double rest[NUMBERS_MAX];
    size_t n, index;
    values_get(scene, name, rest, &n, &index);
    rest[k] += by;
    test_must(ctx, imp_scene_set_values(scene, index, n, rest));
}

static double reading(imp_scene *scene)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate value;
    static const float one[1] = {1};
    imp_problem *p;
    run.spp = 2;
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_functional(p, one, &run, &value, NULL, NULL));
    imp_problem_destroy(p);
    return value.value;
}

/* The floor is the square [-2, 2]^2 of the plane z = 0, with texels of the width 1. */
static void point_test(const char *what, const char *bsdf, const char *bulb)
{
    static const char *const names[] = {"floor.pose", "bulb.position"};
    char xml[4096];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'>" DIRECT
        "<sensor type='radiancemeter'><vector name='origin' value='.3,-1.2,2'/>"
        "<vector name='direction' value='-.1,1.13,-2'/><film type='hdrfilm'>"
        "<integer name='width' value='1'/><integer name='height' value='1'/>"
        "<rfilter type='box'/></film></sensor><shape type='rectangle' id='floor'>"
        "<transform name='to_world'><scale value='2'/></transform>%s</shape><emitter "
        "type='point' id='bulb'><point name='position' value='%s'/><spectrum "
        "name='intensity' value='4'/></emitter></scene>",
        bsdf, bulb);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    for (int k = 0; k < 2; k++) test_must(ctx, imp_scene_add_geometry(scene, names[k]));
    for (int k = 0; k < 2; k++) {
        struct tap_stat g[MEAN_NUMBERS_MAX] = {{0, 0, 0}};
        double most = 0, worst = 0;
        const int n = k == 0 ? 6 : 3;
        const real h = 4e-3L;
        mean_gradient(ctx, scene, names[k], 2, 1, g);
        for (int i = 0; i < n; i++) most = fmax(most, fabs(g[i].mean));
        for (int i = 0; i < n; i++) {
            real f[4];
            for (int j = 0; j < 4; j++) {
                const double by = (double)h * difference_at[j];
                set(scene, names[k], i, by);
                f[j] = (real)reading(scene);
                set(scene, names[k], i, -by);
            }
            worst = fmax(worst, fabs(g[i].mean - (double)difference(f, h)) / most);
        }
        tap_ok(most > 1e-3 && worst < 1e-4, "%s, %s # largest %.5g, off by %.1e of it",
               what, names[k], most, worst);
    }
    imp_scene_destroy(scene);
}

/* ---- Rooms ------------------------------------------------------------------------------------- */

static imp_scene *room(const char *rest, const char *grey)
{
    return room_build(ctx, &(struct room_parts){.rest = rest, .grey = grey});
}

#define GREY " id='grey'"
#define EGG                                                                              \
    "<shape type='sphere' id='ball'><point name='center' value='1,-.6,.7'/><float "      \
    "name='radius' value='.5'/>" MAPPED("", CLAMPED, CLAY) "</shape>"

static void refused_test(void)
{
    number_refused("no clamping", room(DIRECT, MAPPED(GREY, "", CLAY)), "block.pose",
                   "clamp_invalid_normals");
    number_refused(
        "no shadowing",
        room(DIRECT,
             MAPPED(GREY,
                    CLAMPED "<boolean name='use_shadowing_function' value='false'/>",
                    CLAY)),
        "block.pose", "shadowing");
    number_refused("a mirror",
                   room(DIRECT, MAPPED(GREY, CLAMPED, "<bsdf type='conductor'/>")),
                   "block.pose", "single directions");
    number_refused("a ball", room(DIRECT EGG, NULL), "block.pose", "grain");
    number_refused("a bump map",
                   room(DIRECT, "<bsdf type='bumpmap' id='grey'>" TEXTURE("arbitrary")
                                    CLAMPED CLAY "</bsdf>"),
                   "lamp.pose", "from texel to texel");
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    static const struct number all[] = {{"block.pose", 0, .01},
                                        {"block.pose", 5, .02},
                                        {"camera.pose", 4, .005},
                                        {"lamp.pose", 0, .02},
                                        {NULL, 0, 0}},
                               few[] = {{"block.pose", 5, .02},
                                        {"camera.pose", 4, .005},
                                        {"lamp.pose", 0, .02},
                                        {NULL, 0, 0}};
    ctx = test_context(2);
    adjoint_make();
    map_write();
    point_test("diffuse", MAPPED("", CLAMPED, CLAY), "1.2,.7,1.1");
    point_test("rough copper", MAPPED("", CLAMPED, COPPER), "1.2,.7,1.1");
    point_test("through frosted glass", MAPPED("", CLAMPED, FROSTED), "-.2,.3,-1.4");
    numbers_compare("direct", room(DIRECT, MAPPED(GREY, CLAMPED, CLAY)), 48, 96, .05,
                    few);
    if (is_long) {
        numbers_compare("direct and a sky", room(DIRECT SKY, MAPPED(GREY, CLAMPED, CLAY)),
                        768, 512, .05, all);
        numbers_compare("path, rough copper", room(PATH, MAPPED(GREY, CLAMPED, COPPER)),
                        512, 512, .06, all);
    }
    refused_test();
    remove(MAP);
    imp_context_destroy(ctx);
    return tap_done();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Gradients by poses in rooms whose floor and block are of one material after the other:
 * imp_problem_reverse against central differences of functionals of pictures with the same random
 * numbers, away from the scene file's poses. Standard errors are bounded.
 * With the argument `long`: more of them, of more samples. */
#include "moves_kit.h"

enum { WIDTH = 24, HEIGHT = 16, N = ROOM_NUMBERS };
static imp_context *ctx;
static const double at[N] = {.1, -.1, .05, .2, -.1, .3,  -.1, .2,  .1,
                             .1, .05, 0,   .1, .2,  -.1, .02, .03, -.02};
static int seeds = 6, groups = 10;
static float adjoint[WIDTH * HEIGHT * 3];

static double functional(imp_scene *scene, int k, double by, uint64_t seed, int spp)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate value;
    double there[N];
    imp_problem *p;
    memcpy(there, at, sizeof there);
    there[k] += by;
    room_poses_set(ctx, scene, there);
    run.spp = spp;
    run.seed = seed;
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_functional(p, adjoint, &run, &value, NULL, NULL));
    imp_problem_destroy(p);
    return value.value;
}

struct number {
    int k;
    double step;
};

/* Standard errors are at most `largest` of the largest number of an object. */
static void material_test(const char *name, const struct room_parts *parts,
                          const struct number *number, int n, double largest)
{
    imp_scene *scene = room_posed(ctx, parts);
    double sum[N] = {0}, told[N] = {0}, most[3] = {0};
    room_poses_set(ctx, scene, at);
    imp_problem *p = test_problem(ctx, scene, "*.pose");
    for (int s = 0; s < seeds; s++) {
        struct imp_run run = IMP_RUN_INIT;
        double g[N], se[N];
        run.spp = 64;
        run.seed = 100 + (uint64_t)s;
        test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, se));
        for (int k = 0; k < N; k++) {
            sum[k] += g[k] / seeds;
            told[k] += se[k] * se[k] / (seeds * seeds);
        }
    }
    imp_problem_destroy(p);
    for (int k = 0; k < N; k++) most[k / 6] = fmax(most[k / 6], fabs(sum[k]));
    for (int i = 0; i < n; i++) {
        const struct number *x = &number[i];
        struct tap_stat ref = {0, 0, 0};
        for (uint64_t g = 0; g < (uint64_t)groups; g++)
            tap_add(&ref, (functional(scene, x->k, x->step, 500 + g, 32) -
                           functional(scene, x->k, -x->step, 500 + g, 32)) /
                              (2 * x->step));
        const double se = sqrt(told[x->k]);
        const double z = (sum[x->k] - ref.mean) / hypot(se, tap_se(&ref));
        tap_ok(fabs(z) < 3.5 && se < largest * most[x->k / 6] &&
                   tap_se(&ref) < 3 * largest * most[x->k / 6],
               "%s, %s.pose[%d] # %.5f se %.5f ref %.5f se %.5f z %.2f", name,
               room_objects[x->k / 6], x->k % 6, sum[x->k], se, ref.mean, tap_se(&ref),
               z);
    }
    imp_scene_destroy(scene);
}

#define PATH   "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
#define DIRECT "<integrator type='direct'/>"
#define SKY    "<emitter type='constant'><rgb name='radiance' value='.4,.5,.6'/></emitter>"
#define METAL                                                                            \
    "<bsdf type='roughconductor' id='grey'><string name='material' value='Cu'/><float "  \
    "name='alpha' value='.3'/></bsdf>"
#define GRAIN                                                                            \
    "<bsdf type='roughconductor' id='grey'><string name='material' value='Al'/><float "  \
    "name='alpha_u' value='.25'/><float name='alpha_v' value='.6'/></bsdf>"
#define WAX                                                                              \
    "<bsdf type='roughplastic' id='grey'><float name='alpha' value='.3'/><rgb "          \
    "name='diffuse_reflectance' value='.6,.3,.2'/></bsdf>"
#define CAR                                                                              \
    "<bsdf type='principled' id='grey'><rgb name='base_color' value='.6,.3,.2'/><float " \
    "name='roughness' value='.5'/><float name='metallic' value='.4'/></bsdf>"

#define WAVES "<string name='filename' value='" IMP_SCENES "/textured/waves.png'/>"
#define PAINT                                                                            \
    "<bsdf type='diffuse' id='grey'><texture type='bitmap' name='reflectance'>" WAVES    \
    "</texture></bsdf>"

int main(int argc, char **argv)
{
    const bool more = argc > 1 && strcmp(argv[1], "long") == 0;
    static const struct number all[] = {{0, .03},  {1, .03},  {5, .03}, {6, .05},
                                        {10, .05}, {13, .03}, {15, .01}},
                               few[] = {{0, .03}, {4, .03}, {8, .05}, {12, .03}};
    static const struct room_parts metal = {.rest = PATH, .grey = METAL},
                                   sky = {.rest = DIRECT SKY, .grey = METAL},
                                   grain = {.rest = DIRECT, .grey = GRAIN},
                                   wax = {.rest = PATH, .grey = WAX},
                                   paint = {.rest = PATH, .grey = PAINT},
                                   car = {.rest = DIRECT, .grey = CAR};
    ctx = test_context(2);
    for (int p = 0; p < WIDTH * HEIGHT; p++)
        for (int c = 0; c < 3; c++) {
            const double x = (p % WIDTH + .5) / WIDTH, y = (p / WIDTH + .5) / HEIGHT;
            adjoint[3 * p + c] =
                (float)((1 + 0.3 * sin(3 * x + 2 * y + c)) / (WIDTH * HEIGHT));
        }
    if (more) {
        seeds = 16;
        groups = 24;
        material_test("rough metal", &metal, all, 7, 0.05);
        material_test("rough metal and a sky", &sky, few, 4, 0.05);
        material_test("rough plastic", &wax, few, 4, 0.05);
        material_test("principled", &car, few, 4, 0.05);
    } else {
        material_test("rough metal", &metal, few, 4, 0.06);
    }
    material_test("metal with a grain", &grain, few, 4, 0.05);
    material_test("a texture", &paint, few, 4, 0.05);
    imp_context_destroy(ctx);
    return tap_done();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves in scenes of meshes with vertex normals: imp_problem_reverse against
 * central differences of pictures with the same random numbers. An egg of 32 triangles, on which
 * shading and geometric normals are up to 25 degrees apart, is moved, turned, scaled, and bent at
 * single vertices; the camera and the lamp move past it. Standard errors are bounded. What would
 * be biased is refused by name. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "moves_kit.h"
#include <stdio.h>

enum { WIDTH = 24, HEIGHT = 16 };
static imp_context *ctx;

/* ---- The egg ---------------------------------------------------------------------------- */

#define EGG "moved_smooth_egg.obj"

/* An octahedron with every triangle cut into four, on an ellipsoid: 18 vertices. normals: of the
 * ellipsoid, in the file; else importon computes them. */
static void egg_write(bool normals)
{
    static const int face[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                   {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    double p[18][3] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                       {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
    int n = 6, middle[6][6] = {{0}};
    FILE *f = fopen(EGG, "w");
    if (!f) exit(99);
    for (int a = 0; a < 6; a++)
        for (int b = 0; b < a; b++) {
            if (a / 2 == b / 2) continue;
            for (int i = 0; i < 3; i++) p[n][i] = (p[a][i] + p[b][i]) / sqrt(2);
            middle[a][b] = middle[b][a] = n++;
        }
    for (int k = 0; k < n; k++)
        fprintf(f, "v %.9g %.9g %.9g\n", .8 * p[k][0], .6 * p[k][1], .7 * p[k][2]);
    for (int k = 0; k < n && normals; k++)
        fprintf(f, "vn %.9g %.9g %.9g\n", p[k][0] / .8, p[k][1] / .6, p[k][2] / .7);
    for (int k = 0; k < 8; k++)
        for (int j = 0; j < 4; j++) {
            const int *v = face[k];
            const int m[3] = {middle[v[0]][v[1]], middle[v[1]][v[2]], middle[v[2]][v[0]]};
            const int c[3] = {j == 3 ? m[0] : v[j], j == 3 ? m[1] : m[j],
                              j == 3 ? m[2] : m[(j + 2) % 3]};
            for (int i = 0; i < 3; i++) {
                fprintf(f, i == 0 ? "f %d" : " %d", c[i] + 1);
                if (normals) fprintf(f, "//%d", c[i] + 1);
            }
            fprintf(f, "\n");
        }
    fclose(f);
}

#define WHITE                                                                            \
    "<bsdf type='diffuse' id='white'><rgb name='reflectance' value='.8,.7,.6'/></bsdf>"
#define METAL                                                                            \
    "<bsdf type='roughconductor' id='white'><string name='material' value='Cu'/><float " \
    "name='alpha' value='.4'/></bsdf>"
#define SKY    "<emitter type='constant'><rgb name='radiance' value='.4,.5,.6'/></emitter>"
#define DIRECT "<integrator type='direct'/>"
#define PATH   "<integrator type='path'><integer name='max_depth' value='4'/></integrator>"

static imp_scene *room(const char *rest, const char *white)
{
    char xml[16384], camera[4096];
    snprintf(camera, sizeof camera, ROOM_CAMERA, "", "type='box'");
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'>%s%s%s"
             "<bsdf type='diffuse' id='floor_white'><rgb name='reflectance' "
             "value='.6,.5,.4'/></bsdf>"
             "<shape type='rectangle' id='floor'><transform name='to_world'><scale "
             "value='3'/></transform><ref id='floor_white'/></shape>"
             "<shape type='obj' id='egg'><string name='filename' value='" EGG "'/>"
             "<transform name='to_world'><rotate x='1' y='.3' z='.2' angle='25'/>"
             "<translate x='-.2' y='-.3' z='1.1'/></transform><ref id='white'/></shape>"
             "<shape type='rectangle' id='lamp'><transform name='to_world'><scale x='.9' "
             "y='.9'/><rotate x='1' y='.3' angle='160'/><translate x='1.2' y='-.9' "
             "z='3'/></transform><emitter type='area'><rgb name='radiance' "
             "value='9,8,7'/></emitter></shape></scene>",
             rest, camera, white);
    return test_scene_text(ctx, xml, IMP_RGB);
}

/* ---- Both ways -------------------------------------------------------------------------- */

/* Smooth over the picture, in steps of pixels that no difference notices. */
static float adjoint[WIDTH * HEIGHT * 3];
static void adjoint_make(void)
{
    for (int p = 0; p < WIDTH * HEIGHT; p++)
        for (int c = 0; c < 3; c++) {
            const double x = (p % WIDTH + .5) / WIDTH, y = (p / WIDTH + .5) / HEIGHT;
            adjoint[3 * p + c] =
                (float)((1 + 0.3 * sin(3 * x + 2 * y + c)) / (WIDTH * HEIGHT));
        }
}

static double functional(imp_scene *scene, int64_t seed, int spp)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_problem *p;
    struct imp_estimate value;
    run.spp = spp;
    run.seed = (uint64_t)seed;
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_functional(p, adjoint, &run, &value, NULL, NULL));
    imp_problem_destroy(p);
    return value.value;
}

struct number {
    const char *name;
    int k;
    double step;
};

enum { NUMBERS_MAX = 80 };
static void values_get(imp_scene *scene, const char *name, double *out, size_t *n,
                       size_t *index)
{
    struct imp_param_info info = {.size = sizeof info};
    test_must(ctx, imp_scene_find_param(scene, name, index));
    test_must(ctx, imp_scene_get_param(scene, *index, &info));
    *n = info.count;
    if (*n > NUMBERS_MAX) exit(99);
    test_must(ctx, imp_scene_get_values(scene, *index, out));
}

static struct tap_stat difference_of(imp_scene *scene, const struct number *x, int spp)
{
    enum { GROUPS = 12 };
    struct tap_stat out = {0, 0, 0};
    double rest[NUMBERS_MAX], there[NUMBERS_MAX];
    size_t n, index;
    values_get(scene, x->name, rest, &n, &index);
    for (int g = 0; g < GROUPS; g++) {
        double value[2];
        for (int s = 0; s < 2; s++) {
            memcpy(there, rest, sizeof there);
            there[x->k] += (s ? 1 : -1) * x->step;
            test_must(ctx, imp_scene_set_values(scene, index, n, there));
            value[s] = functional(scene, 500 + g, spp);
        }
        tap_add(&out, (value[1] - value[0]) / (2 * x->step));
    }
    test_must(ctx, imp_scene_set_values(scene, index, n, rest));
    return out;
}

/* Parameters are added, and some of their numbers compared; the standard error is at most
 * `largest` of the largest number of the same parameter. */
static void numbers_test(const char *what, const char *rest, const char *white, int spp,
                         int spp_ref, double largest, const struct number *numbers)
{
    enum { SEEDS = 12 };
    imp_scene *scene = room(rest, white);
    imp_problem *p;
    static struct tap_stat g[3 * NUMBERS_MAX];
    double told = 0, seen = 0;
    memset(g, 0, sizeof g);
    for (const struct number *x = numbers; x->name; x++)
        test_must(ctx, imp_scene_add_geometry(scene, x->name));
    test_must(ctx, imp_problem_create(scene, &p));
    const char *active[3 * NUMBERS_MAX];
    int first[3 * NUMBERS_MAX], n_active = 0;
    for (const struct number *x = numbers; x->name; x++) {
        if (n_active > 0 && strcmp(active[n_active - 1], x->name) == 0) continue;
        first[n_active] = (int)imp_problem_n_variables(p);
        active[n_active++] = x->name;
        test_must(ctx, imp_problem_activate(p, x->name));
    }
    const size_t n = imp_problem_n_variables(p);
    if (n > 3 * NUMBERS_MAX) exit(99);
    first[n_active] = (int)n;
    static double square[3 * NUMBERS_MAX];
    memset(square, 0, sizeof square);
    for (int s = 0; s < SEEDS; s++) {
        struct imp_run run = IMP_RUN_INIT;
        double v[3 * NUMBERS_MAX], se[3 * NUMBERS_MAX];
        run.spp = spp;
        run.seed = 100 + (uint64_t)s;
        test_must(ctx, imp_problem_reverse(p, adjoint, &run, v, se));
        for (size_t k = 0; k < n; k++) {
            tap_add(&g[k], v[k]);
            square[k] += se[k] * se[k] / SEEDS;
        }
    }
    imp_problem_destroy(p);
    int counted = 0;
    for (size_t k = 0; k < n; k++) {
        if (!(square[k] > 0)) continue;
        const double own = imp__sqr(tap_se(&g[k])) * SEEDS;
        told += log(sqrt(square[k] / own));
        counted++;
        seen += own;
    }
    const double ratio = exp(told / counted);
    tap_ok(ratio > 0.75 && ratio < 1.3,
           "%s: errors told over errors seen, mean of %d numbers # %.3f", what, counted,
           ratio);
    for (const struct number *x = numbers; x->name; x++) {
        int a = 0;
        double most = 0;
        while (strcmp(active[a], x->name) != 0) a++;
        for (int k = first[a]; k < first[a + 1]; k++) most = fmax(most, fabs(g[k].mean));
        const struct tap_stat ref = difference_of(scene, x, spp_ref),
                              *own = &g[first[a] + x->k];
        const double se = sqrt(square[first[a] + x->k] / SEEDS);
        const double z = (own->mean - ref.mean) / hypot(se, tap_se(&ref));
        tap_ok(fabs(z) < 3.5 && se < largest * most,
               "%s, %s[%d] # %.5f se %.5f ref %.5f se %.5f z %.2f", what, x->name, x->k,
               own->mean, se, ref.mean, tap_se(&ref), z);
    }
    imp_scene_destroy(scene);
}

static void refused(const char *what, const char *rest, const char *white,
                    const char *name, const char *word)
{
    imp_scene *scene = room(rest, white);
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    double g[6];
    run.spp = 2;
    test_must(ctx, imp_scene_add_geometry(scene, name));
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, name));
    const enum imp_status st = imp_problem_reverse(p, adjoint, &run, g, NULL);
    tap_ok(word ? st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), word)
                : st == IMP_OK,
           "%s # %s", what, word ? imp_last_error(ctx) : "");
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

#define BULB                                                                             \
    DIRECT "<emitter type='point' id='bulb'><point name='position' value='1,-1,3'/>"     \
           "</emitter>"

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    static const struct number whole[] = {{"egg.pose", 0, .02},
                                          {"egg.pose", 5, .03},
                                          {"camera.pose", 0, .02},
                                          {"camera.pose", 5, .01},
                                          {"lamp.pose", 0, .04},
                                          {"lamp.pose", 4, .04},
                                          {NULL, 0, 0}};
    static const struct number sky[] = {
        {"camera.pose", 0, .02}, {"lamp.pose", 0, .04}, {NULL, 0, 0}};
    /* Larger steps see how the coarse silhouette bends. */
    static const struct number turns[] = {
        {"egg.pose", 3, .003}, {"egg.pose", 5, .003}, {NULL, 0, 0}};
    static const struct number metal[] = {
        {"camera.pose", 5, .01}, {"lamp.pose", 0, .04}, {NULL, 0, 0}};
    static const struct number sizes[] = {
        {"egg.scale", 0, .03}, {"camera.pose", 3, .01}, {NULL, 0, 0}};
    static const struct number vertices[] = {{"egg.vertex_positions", 1, .02},
                                             {"egg.vertex_positions", 14, .02},
                                             {"egg.vertex_positions", 20, .02},
                                             {"egg.vertex_positions", 27, .02},
                                             {"egg.vertex_positions", 31, .02},
                                             {"egg.vertex_positions", 38, .02},
                                             {NULL, 0, 0}};
    ctx = test_context(2);
    adjoint_make();
    egg_write(true);
    numbers_test("direct", DIRECT, WHITE, 64, 128, .06, whole);
    numbers_test("path and a sky", PATH SKY, WHITE, 48, 32, .06, sky);
    numbers_test("path, rough metal at grazing angles", PATH, METAL, 16, 16, .5, metal);
    numbers_test("an egg that turns under a sky", DIRECT SKY, WHITE, 64,
                 is_long ? 20000 : 96, .1, turns);
    if (is_long) {
        numbers_test("path, all", PATH, WHITE, 512, 1024, .1, whole);
        numbers_test("path, rough metal", PATH, METAL, 512, 1024, .1, whole);
        numbers_test("path, a scale", PATH, WHITE, 512, 1024, .1, sizes);
    }
    egg_write(false);
    numbers_test("vertices", DIRECT, WHITE, 64, 128, .1, vertices);
    refused("a bulb and an egg that moves", BULB, WHITE, "egg.pose", "'bulb'");
    refused("a bulb that moves", BULB, WHITE, "bulb.position", "'egg'");
    refused("a bulb, an egg, and a camera that moves", BULB, WHITE, "camera.pose", NULL);
    remove(EGG);
    imp_context_destroy(ctx);
    return tap_done();
}

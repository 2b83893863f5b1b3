/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves where media vary: a sky that turns above layers against quadrature; a grid
 * that ends at the cube around it against the same cube without a grid, far from the origin and where
 * the scene is large; and other derivatives through cells most of which are empty, which may not become
 * noisier where something moves. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/vec.h"
#include "mean_gradient.h"
#include "vol_write.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define FILM                                                                             \
    "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' "      \
    "value='8'/><rfilter type='box'/></film>"
#define GRID(TO_WORLD)                                                                   \
    "<volume type='gridvolume' name='sigma_t'><string name='filename' value='%s'/>"      \
    "<transform name='to_world'>" TO_WORLD "</transform></volume>"

static imp_context *ctx;
static char layers_file[64], full_file[64], sparse_file[64];

/* A scene of one grid. */
static imp_scene *filled_by(const char *xml, const char *file)
{
    char whole[4096];
    snprintf(whole, sizeof whole, xml, file);
    return test_scene_text(ctx, whole, IMP_MONO);
}

/* ---- A sky above layers ---------------------------------------------------------------- */

#define MAP_FILE "moved_grid_walks_sky.pfm"
enum { LAYERS = 6, ACROSS = 8, COLUMNS = 64, ROWS = 32 };
static const float layer[LAYERS] = {0, .5f, 1, 1.4f, .6f, 0};
#define LOW   -.9
#define STEP  .3
#define FLOOR -.32
#define EYE   .2

static double density(double z)
{
    const double x = (z - LOW) / STEP - .5;
    const int k = (int)floor(x);
    if (k < 0 || k > LAYERS - 2) return 0;
    return layer[k] + (x - k) * (double)(layer[k + 1] - layer[k]);
}
static double column(double from, double to)
{
    enum { STEPS = 4000 };
    double sum = 0;
    for (int k = 0; k < STEPS; k++) sum += density(from + (to - from) * (k + .5) / STEPS);
    return sum * (to - from) / STEPS;
}

/* Its radiance is 1 + .9 w_y. */
static void map_write(void)
{
    FILE *f = fopen(MAP_FILE, "wb");
    if (!f) exit(99);
    fprintf(f, "PF\n%d %d\n-1\n", COLUMNS, ROWS);
    for (int j = ROWS - 1; j >= 0; j--)
        for (int i = 0; i < COLUMNS; i++)
            for (int c = 0; c < 3; c++) {
                const float x = (float)(1 + .9 * cos(2 * IMP_PI * (i + .5) / COLUMNS) *
                                                sin(IMP_PI * (j + .5) / ROWS));
                fwrite(&x, sizeof x, 1, f);
            }
    fclose(f);
}

/* The camera looks down at a floor of reflectance r. Turned about x by an angle, the sky is
 * 1 + .9 (w_y + angle w_z), and by that the irradiance of the floor changes by
 *
 *     .9 int w_z^2 exp(-depth/w_z) dw = .9 2 pi int_0^1 c^2 exp(-depth/c) dc. */
static void sky_test(int more)
{
    enum { STEPS = 4000, SIDE = 64 };
    const double above = column(FLOOR, .9), below = column(FLOOR, EYE);
    double lit = 0, seen = 0;
    for (int k = 0; k < STEPS; k++) {
        const double c = (k + .5) / STEPS;
        lit += .9 * 2 * IMP_PI * c * c * exp(-above / c) / STEPS;
    }
    for (int k = 0; k < SIDE * SIDE; k++) {
        const double half = tan(10 * IMP_PI / 180),
                     x = half * (2 * (k % SIDE + .5) / SIDE - 1),
                     y = half * (2 * (k / SIDE + .5) / SIDE - 1);
        seen += exp(-below * sqrt(1 + x * x + y * y)) / (SIDE * SIDE);
    }
    const double ref = seen * .5 / IMP_PI * lit;
    struct tap_stat g[8] = {{0, 0, 0}};
    imp_scene *scene = filled_by(
        "<scene version='3.0.0'>" VOLPATH(
            "2") "<medium type='heterogeneous' "
                 "id='air'>" GRID("<scale x='80' y='80' "
                                  "z='1.8'/><translate x='-40' y='-40' "
                                  "z='-.9'/>") "<float name='albedo' "
                                               "value='0'/></medium>"
                                               "<shape "
                                               "type='rectangle'><"
                                               "transform "
                                               "name='to_world'><scale "
                                               "value='29'/>"
                                               "<translate "
                                               "z='-.32'/></"
                                               "transform><bsdf "
                                               "type='diffuse'/>"
                                               "<ref id='air' "
                                               "name='exterior'/></"
                                               "shape>"
                                               "<emitter type='envmap' "
                                               "id='sky'><string "
                                               "name='filename' "
                                               "value='" MAP_FILE "'/><transform "
                                               "name='to_world'><rotate "
                                               "x='1' "
                                               "angle='90'/></"
                                               "transform></emitter>"
                                               "<sensor "
                                               "type='perspective'><"
                                               "float name='fov' "
                                               "value='20'/>"
                                               "<float name='near_clip' "
                                               "value='1e-6'/"
                                               "><transform "
                                               "name='to_world'>"
                                               "<lookat origin='0,0,.2' "
                                               "target='0,0,-1' "
                                               "up='0,1,0'/></"
                                               "transform>" FILM "<ref id='air' "
                                               "name='medium'/></"
                                               "sensor></scene>",
        layers_file);
    test_must(ctx, imp_scene_add_geometry(scene, "sky.turn"));
    mean_gradient(ctx, scene, "sky.turn", 192 * more, 16, g);
    tap_z(&g[0], ref, .02 * ref, "a sky turns above layers");
    imp_scene_destroy(scene);
}

/* ---- A grid that fills a cube ----------------------------------------------------------- */

/* A cube before a wall that glows. `far`: all is there along x; `wide`: of the cube; `beside`: what else
 * there is. */
static void cube_gradient(bool grid, const char *far, const char *wide,
                          const char *beside, int spp, struct tap_stat *out)
{
    char xml[4096], medium[512];
    if (grid)
        snprintf(medium, sizeof medium,
                 "<medium type='heterogeneous' name='interior'>" GRID(
                     "<translate x='-.5' y='-.5' z='-.5'/><translate "
                     "x='%s'/>") "<float name='albedo' value='0'/></medium>",
                 full_file, far);
    else
        snprintf(medium, sizeof medium,
                 "<medium type='homogeneous' name='interior'><float name='sigma_t' "
                 "value='2'/><float name='albedo' value='0'/></medium>");
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'>" VOLPATH(
            "2") "<shape type='cube'><bsdf "
                 "type='null'/>%s<transform name='to_world'><scale "
                 "value='%s'/><translate "
                 "x='%s'/></transform></shape><shape type='rectangle'><transform "
                 "name='to_world'><scale value='10'/><translate x='%s' "
                 "z='-1'/></transform>"
                 "<emitter type='area'><rgb name='radiance' "
                 "value='1'/></emitter></shape>%s"
                 "<sensor type='perspective' id='camera'><float name='fov' value='20'/>"
                 "<transform name='to_world'><lookat origin='0.83,0.31,3' "
                 "target='0.5,0.1,0' up='0,1,0'/><translate x='%s'/></transform>" FILM
                 "</sensor></scene>",
        medium, wide, far, far, beside, far);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(scene, "camera.pose"));
    mean_gradient(ctx, scene, "camera.pose", spp, 8, out);
    imp_scene_destroy(scene);
}

static void cubes_test(int more)
{
    static const char far_off[] =
        "<shape type='rectangle'><transform name='to_world'><scale value='.1'/>"
        "<translate x='200' y='200' z='20'/></transform><bsdf type='diffuse'/></shape>";
    static const struct {
        const char *what, *far, *wide, *beside;
    } cases[] = {{"a grid ends at its cube", "0", ".5", ""},
                 {"far from the origin", "777.77", ".5", ""},
                 {"in a large scene, the cube a little larger", "0", ".5001", far_off}};
    for (int k = 0; k < 3; k++) {
        struct tap_stat plain[12] = {{0, 0, 0}}, grid[12] = {{0, 0, 0}};
        cube_gradient(false, cases[k].far, cases[k].wide, cases[k].beside, 64 * more,
                      plain);
        cube_gradient(true, cases[k].far, cases[k].wide, cases[k].beside, 64 * more,
                      grid);
        tap_z(&plain[0], .687, .05, cases[k].what);
        tap_z(&grid[0], plain[0].mean, .05, cases[k].what);
    }
}

/* ---- Sparse cells ----------------------------------------------------------------------- */

enum { CELLS = 32 };

/* What the sun's light does to the picture's mean, for each seed, with or without the camera's place. */
static struct tap_stat by_sun(bool moves, int spp)
{
    enum { SEEDS = 12 };
    static float adjoint[64];
    struct tap_stat out = {0, 0, 0};
    imp_problem *p;
    imp_scene *scene = filled_by(
        "<scene version='3.0.0'>" VOLPATH(
            "8") "<shape type='cube'><bsdf type='null'/><medium type='heterogeneous' "
                 "name='interior'>" GRID(
                     "<translate x='-.5' y='-.5' z='-.5'/><scale "
                     "value='2'/>") "<float name='albedo' value='.9'/></medium></shape>"
                                    "<emitter type='directional' id='sun'><vector "
                                    "name='direction' value='0,.3,-1'/><rgb "
                                    "name='irradiance' value='5'/></emitter>"
                                    "<sensor type='perspective' id='camera'><float "
                                    "name='fov' value='30'/><transform "
                                    "name='to_world'><lookat origin='0,.5,4' "
                                    "target='0,0,0' up='0,1,0'/></transform>" FILM
                                    "</sensor></scene>",
        sparse_file);
    for (int k = 0; k < 64; k++) adjoint[k] = 1.f / 64;
    if (moves) test_must(ctx, imp_scene_add_geometry(scene, "camera.pose"));
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "sun.irradiance.value"));
    if (moves) test_must(ctx, imp_problem_activate(p, "camera.pose"));
    for (int s = 0; s < SEEDS; s++) {
        struct imp_run run = IMP_RUN_INIT;
        double g[16];
        run.spp = spp;
        run.seed = (moves ? 300 : 3) + (uint64_t)s;
        test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, NULL));
        tap_add(&out, g[0]);
    }
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    return out;
}

static void sparse_test(int more)
{
    struct tap_stat rest = by_sun(false, 32 * more), moved = by_sun(true, 32 * more);
    const double spread = tap_se(&moved) / tap_se(&rest),
                 se = hypot(tap_se(&moved), tap_se(&rest)),
                 z = (moved.mean - rest.mean) / se;
    tap_ok(fabs(z) <= 3.5, "through sparse cells: %.5g, with a pose %.5g (z %.2f)",
           rest.mean, moved.mean, z);
    tap_ok(spread < 3, "its standard error is %.2f times that without", spread);
}

static void files_make(void)
{
    static float layers[LAYERS * ACROSS * ACROSS], full[8], sparse[CELLS * CELLS * CELLS];
    for (int k = 0; k < 8; k++) full[k] = 2;
    for (int k = 0; k < CELLS * CELLS * CELLS; k++) {
        const int i[3] = {k % CELLS, k / CELLS % CELLS, k / (CELLS * CELLS)};
        sparse[k] = imp__u01(imp__key(5, 1, 2), (uint32_t)k) < .03 ? 60 : 0;
        for (int a = 0; a < 3; a++)
            if (i[a] == 0 || i[a] == CELLS - 1) sparse[k] = 0;
    }
    for (int k = 0; k < LAYERS * ACROSS * ACROSS; k++) { /* dark far away, at its sides */
        const int x = k % ACROSS, y = k / ACROSS % ACROSS;
        const bool side = x == 0 || y == 0 || x == ACROSS - 1 || y == ACROSS - 1;
        layers[k] = side ? 0 : layer[k / (ACROSS * ACROSS)];
    }
    vol_write(layers_file, ACROSS, ACROSS, LAYERS, 1, layers);
    vol_write(full_file, 2, 2, 2, 1, full);
    vol_write(sparse_file, CELLS, CELLS, CELLS, 1, sparse);
    map_write();
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 8 : 1;
    ctx = test_context(2);
    files_make();
    sky_test(more);
    cubes_test(more);
    sparse_test(more);
    unlink(layers_file);
    unlink(full_file);
    unlink(sparse_file);
    unlink(MAP_FILE);
    imp_context_destroy(ctx);
    return tap_done();
}

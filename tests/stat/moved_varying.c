/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves in, before and behind media that vary: cameras, walls and suns in layers,
 * against closed forms and quadrature; imp_problem_reverse against central differences in a room with a
 * cloud of random cells. What is refused. */
#include "imp_check_rows.h"
#include "math/rng.h"
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"
#include "vol_write.h"

#define GRID(NAME, ID, TO_WORLD)                                                         \
    "<volume type='gridvolume' name='" NAME "' id='" ID                                  \
    "'><string name='filename' value='%s'/><transform name='to_world'>" TO_WORLD         \
    "</transform></volume>"

/* Densities of layers, upwards, and of a cloud of colours; how white that is. */
enum { LAYERS = 6, CELLS = 6, SIDE = 24, FILM = SIDE * SIDE };
static const float layer[LAYERS] = {0, .5f, 1, 1.4f, .6f, 0};
static char slab_file[64], cloud_file[64], white_file[64], full_file[64];

static void files_make(void)
{
    enum { N = CELLS * CELLS * CELLS };
    static float cloud[3 * N], white[3 * 8], full[8];
    for (int k = 0; k < N; k++) {
        const int i[3] = {k % CELLS, k / CELLS % CELLS, k / (CELLS * CELLS)};
        const double r2 =
            imp__sqr(i[0] - 2.2) + imp__sqr(i[1] - 2.7) + imp__sqr(i[2] - 2.5);
        for (int c = 0; c < 3; c++) {
            cloud[3 * k + c] =
                (float)((2 + .4 * c) * exp(-.3 * r2) *
                        (.5 + imp__u01(imp__key(5, 1, 2), (uint32_t)(3 * k + c))));
            for (int a = 0; a < 3; a++)
                if (i[a] == 0 || i[a] == CELLS - 1) cloud[3 * k + c] = 0;
        }
    }
    for (int k = 0; k < 24; k++) white[k] = .4f + .5f * (float)(k % 5 == 1);
    for (int k = 0; k < 8; k++) full[k] = 1;
    vol_write(slab_file, 1, 1, LAYERS, 1, layer);
    vol_write(cloud_file, CELLS, CELLS, CELLS, 3, cloud);
    vol_write(white_file, 2, 2, 2, 3, white);
    vol_write(full_file, 2, 2, 2, 1, full);
}

/* ---- Layers ----------------------------------------------------------------------------- */

/* Layers across z, from -.9 to .9, of a width that no pixel sees, in a cube of this place and half height. */
#define LOW  -.9
#define STEP .3
static double density(double z)
{
    const double x = (z - LOW) / STEP - .5;
    const int k = (int)floor(x);
    const double lo = layer[k < 0            ? 0
                            : k > LAYERS - 1 ? LAYERS - 1
                                             : k],
                 hi = layer[k + 1 < 0            ? 0
                            : k + 1 > LAYERS - 1 ? LAYERS - 1
                                                 : k + 1];
    return z < LOW || z > LOW + LAYERS * STEP ? 0 : lo + (x - k) * (hi - lo);
}
/* The optical depth of a column between two heights. */
static double column(double from, double to)
{
    enum { STEPS = 4000 };
    double sum = 0;
    for (int k = 0; k < STEPS; k++) sum += density(from + (to - from) * (k + .5) / STEPS);
    return sum * (to - from) / STEPS;
}

#define LAYERED(ALBEDO, WIDE, MIDDLE, HALF)                                              \
    "<shape type='cube' id='box'><transform name='to_world'><scale x='" WIDE             \
    "' y='" WIDE "' z='" HALF "'/><translate z='" MIDDLE                                 \
    "'/></transform><bsdf type='null'/><medium type='heterogeneous' name='interior' "    \
    "id='air'>" GRID("sigma_t", "layers",                                                \
                     "<scale x='80' y='80' z='1.8'/><translate x='-40' y='-40' "         \
                     "z='-.9'/>") "<float name='albedo' value='" ALBEDO                  \
                                  "'/></medium></shape>"
#define WALL(Z)                                                                          \
    "<shape type='rectangle' id='wall'><transform name='to_world'><scale value='29'/>"   \
    "<translate z='" Z "'/></transform><emitter type='area'><rgb name='radiance' "       \
    "value='3'/></emitter></shape>"
#define TILT .4 /* of the camera, radians, about x */
#define CAMERA(Z, MEDIUM)                                                                \
    "<sensor type='perspective' id='camera'><float name='fov' value='40'/><float "       \
    "name='near_clip' value='1e-6'/><transform name='to_world'><lookat "                 \
    "origin='0,0," Z "' target='0,0.38941834,%.9f' up='0,1,0'/></transform>"             \
    "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' "      \
    "value='8'/><rfilter type='box'/></film>" MEDIUM "</sensor>"
#define SUN                                                                              \
    "<emitter type='directional' id='sun'><vector name='direction' "                     \
    "value='0,0.3,-1'/><rgb name='irradiance' value='5'/></emitter>"
#define SKY        "<emitter type='constant'><rgb name='radiance' value='1,2,3'/></emitter>"
#define SUN_COSINE (1 / sqrt(1.09))

/* The mean over the film of what is seen along a ray with this cosine to the vertical, of a camera that
 * is tilted by an angle. */
typedef double seen_fn(double cosine, const void *payload);
static double film_mean(double tilt, seen_fn *seen, const void *payload)
{
    double sum = 0;
    for (int k = 0; k < FILM; k++) {
        const double half = tan(20 * IMP_PI / 180);
        const double x = half * (2 * (k % SIDE + .5) / SIDE - 1),
                     y = half * (2 * (k / SIDE + .5) / SIDE - 1);
        sum += seen((cos(tilt) - y * sin(tilt)) / sqrt(1 + x * x + y * y), payload);
    }
    return sum / FILM;
}
static double wall_seen(double cosine, const void *payload)
{
    const double *depth = payload;
    return 3 * exp(-*depth / cosine);
}
/* Single scattering of the sun in all directions alike: with m = 1/cosine + 1/cosine of the sun
 * L = albedo E/(4 pi) (1 - exp(-depth m))/(m cosine). */
static double sun_seen(double cosine, const void *payload)
{
    const double *p = payload, m = 1 / cosine + 1 / p[1];
    return .75 * 5 / (4 * IMP_PI) * (1 - exp(-p[0] * m)) / (m * cosine);
}

static void closed_test(int more)
{
    enum { INSIDE, ABOVE, SUNNY, ENDS, CUT };
    char xml[5][4096];
    const int spp = 32 * more;
    const double h = 1e-5, at = .2, target = at - cos(TILT), wall = -.32;
    /* Files and the target's height by their order. */
    snprintf(xml[INSIDE], sizeof xml[0],
             VOLPATH("2") LAYERED("0", "30", "0", "1")
                 CAMERA(".2", "<ref id='air' name='medium'/>") WALL("-.32"),
             slab_file, target);
    snprintf(xml[ABOVE], sizeof xml[0],
             VOLPATH("2") LAYERED("0", "30", "0", "1") CAMERA("3", "") WALL("-.32"),
             slab_file, 3 - cos(TILT));
    snprintf(xml[SUNNY], sizeof xml[0],
             VOLPATH("2") LAYERED("0.75", "30", "0", "1") CAMERA("3", "") SUN, slab_file,
             3 - cos(TILT));
    snprintf(xml[ENDS], sizeof xml[0],
             VOLPATH("2") LAYERED("0", "4.2", "0", ".6") CAMERA("3", "") WALL("-1"),
             slab_file, 3 - cos(TILT));
    snprintf(xml[CUT], sizeof xml[0],
             VOLPATH("2") LAYERED("0", "4.2", "-.25", ".45") CAMERA("3", "") WALL("-1"),
             slab_file, 3 - cos(TILT));

    double depth = column(wall, at), by[2], moved;
    const double *p = &depth;
    for (int k = 0; k < 2; k++) by[k] = film_mean(TILT + (k ? -h : h), wall_seen, p);
    const double by_tilt = (by[0] - by[1]) / (2 * h);
    mean_gradient_test(ctx, "a camera in layers turns", xml[INSIDE], "camera.pose", 3,
                       spp, by_tilt, .02 * fabs(by_tilt));
    for (int k = 0; k < 2; k++) {
        moved = depth + (k ? -h : h);
        by[k] = film_mean(TILT, wall_seen, &moved);
    }
    const double slope = (by[0] - by[1]) / (2 * h); /* by the depth of the column */
    mean_gradient_test(ctx, "it rises", xml[INSIDE], "camera.pose", 2, spp,
                       slope * density(at), .02 * fabs(slope * density(at)));
    mean_gradient_test(ctx, "the wall behind them rises", xml[INSIDE], "wall.pose", 2,
                       spp, -slope * density(wall), .02 * fabs(slope * density(wall)));
    depth = column(wall, 1);
    for (int k = 0; k < 2; k++) by[k] = film_mean(TILT + (k ? -h : h), wall_seen, p);
    const double above = (by[0] - by[1]) / (2 * h);
    mean_gradient_test(ctx, "a camera above layers turns", xml[ABOVE], "camera.pose", 3,
                       spp, above, .02 * fabs(above));

    depth = column(-.6, .6);
    for (int k = 0; k < 2; k++) by[k] = film_mean(TILT + (k ? -h : h), wall_seen, p);
    const double cut = (by[0] - by[1]) / (2 * h);
    mean_gradient_test(ctx, "it turns above layers that end at a border", xml[ENDS],
                       "camera.pose", 3, 8 * spp, cut, .04 * fabs(cut));
    depth = column(-.7, .2);
    for (int k = 0; k < 2; k++) {
        moved = depth + (k ? -h : h);
        by[k] = film_mean(TILT, wall_seen, &moved);
    }
    const double rises = (by[0] - by[1]) / (2 * h) * (density(.2) - density(-.7));
    mean_gradient_test(ctx, "the border rises", xml[CUT], "box.pose", 2, 4 * spp, rises,
                       .04 * fabs(rises));

    double sun[2] = {column(-1, 1), SUN_COSINE};
    for (int k = 0; k < 2; k++) by[k] = film_mean(TILT + (k ? -h : h), sun_seen, sun);
    const double sunny = (by[0] - by[1]) / (2 * h);
    if (more > 1)
        mean_gradient_test(ctx, "above layers in a sun it turns", xml[SUNNY],
                           "camera.pose", 3, 4 * spp, sunny, .04 * fabs(sunny));
    for (int k = 0; k < 2; k++) {
        const double y = .3 + (k ? -h : h);
        sun[1] = 1 / sqrt(1 + y * y);
        by[k] = film_mean(TILT, sun_seen, sun);
    }
    const double turned = (by[0] - by[1]) / (2 * h * SUN_COSINE); /* of a unit vector */
    mean_gradient_test(ctx, "the sun turns", xml[SUNNY], "sun.direction", 1, spp, turned,
                       .02 * fabs(turned));
}

/* ---- In a room ------------------------------------------------------------------------- */

static imp_scene *filled_by(const char *rest, const char *sigma, const char *white,
                            bool fog)
{
    char xml[16384], inside[16384], filled[16384];
    room_write(&(struct room_parts){.rest = rest}, xml, sizeof xml);
    const char *film = strstr(xml, "<film");
    /* The wall stands apart from the floor, which moves by itself. */
    memcpy(strstr(xml, "<translate y='3' z='1.5'/>"), "<translate y='3' z='1.6'/>", 26);
    snprintf(inside, sizeof inside, "%.*s%s%s", (int)(film - xml), xml,
             fog ? "<ref name='medium' id='air'/>" : "", film);
    snprintf(filled, sizeof filled, inside, sigma, white);
    return test_scene_text(ctx, filled, IMP_RGB);
}
#define CLOUD_PLACE                                                                      \
    "<translate x='-.5' y='-.5' z='-.5'/><scale x='2.4' y='2' z='1.6'/><rotate z='1' "   \
    "angle='20'/><translate x='.2' y='-.5' z='1.2'/>"
/* A cloud with a ball around, into which the block reaches. */
#define CLOUD                                                                            \
    "<shape type='sphere' id='around'><point name='center' value='.2,-.5,1.2'/><float "  \
    "name='radius' value='1.15'/><bsdf type='null'/><medium type='heterogeneous' "       \
    "name='interior'>" GRID("sigma_t", "cloud", CLOUD_PLACE)                             \
        GRID("albedo", "white", CLOUD_PLACE) "<rgb name='emission' value='.5,.4,.3'/>"   \
                                             "<phase type='hg'><float name='g' "         \
                                             "value='.4'/></phase></medium></shape>"
/* What fills all of the room, and the camera is in. */
#define AIR_PLACE                                                                        \
    "<translate x='-.5' y='-.5' z='-.5'/><scale x='9' y='13' z='6'/><rotate z='1' "      \
    "angle='10'/><translate x='.1' y='-1.5' z='1.5'/>"
#define AIR                                                                              \
    "<medium type='heterogeneous' id='air'><float name='scale' value='.15'/>" GRID(      \
        "sigma_t", "cloud", AIR_PLACE) GRID("albedo", "white", AIR_PLACE) "</medium>"

static void room_test(int more)
{
    static const struct number cloud[] = {{"block.pose", 1, .02},
                                          {"lamp.pose", 0, .03},
                                          {"camera.pose", 0, .02},
                                          {"camera.pose", 3, .01},
                                          {NULL, 0, 0}},
                               air[] = {{"block.pose", 0, .02},
                                        {"lamp.pose", 2, .03},
                                        {"camera.pose", 1, .02},
                                        {NULL, 0, 0}};
    numbers_compare("a cloud of cells",
                    filled_by(CLOUD VOLPATH("4"), cloud_file, white_file, false),
                    64 * more, 32 * more, .065, cloud);
    numbers_compare("air that varies",
                    filled_by(AIR VOLPATH("3"), cloud_file, white_file, true), 8 * more,
                    8 * more, .05, air);
}

/* The inside of recorded walks, where something has moved by its numbers themselves. */
static void frozen_test(const char *what, imp_scene *scene)
{
    static const char *const name[] = {"block.pose", "lamp.pose", "camera.pose",
                                       "sun.direction"};
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    imp_problem *p;
    o.paths = 60;
    o.only = "frozen";
    for (int k = 0; k < 4; k++) test_must(ctx, imp_scene_add_geometry(scene, name[k]));
    test_must(ctx, imp_problem_create(scene, &p));
    for (int k = 0; k < 4; k++) test_must(ctx, imp_problem_activate(p, name[k]));
    test_check(ctx, p, &o, what);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* Shifts of all that there is, the camera and the grids too, change nothing: the sum of their derivatives
 * is 0, from an axis on. values: of the picture; most: of the standard error. Ends the scene. */
static void shift_test(const char *what, imp_scene *scene, const char *const *names,
                       int axis, const float *values, int spp, int seeds, double most)
{
    struct tap_stat sum[3] = {{0, 0, 0}};
    double g[NUMBERS_MAX];
    size_t first[16];
    imp_problem *p;
    int n = 0;
    for (int k = 0; names[k]; k++)
        test_must(ctx, imp_scene_add_geometry(scene, names[k]));
    test_must(ctx, imp_problem_create(scene, &p));
    for (; names[n]; n++) {
        first[n] = imp_problem_n_variables(p);
        test_must(ctx, imp_problem_activate(p, names[n]));
    }
    for (int s = 0; s < seeds; s++) {
        struct imp_run run = IMP_RUN_INIT;
        run.spp = spp;
        run.seed = 31 + (uint64_t)s;
        test_must(ctx, imp_problem_reverse(p, values, &run, g, NULL));
        for (int a = axis; a < 3; a++) {
            double all = 0;
            for (int k = 0; k < n; k++) all += g[first[k] + (size_t)a];
            tap_add(&sum[a], all);
        }
    }
    for (int a = axis; a < 3; a++) tap_z(&sum[a], 0, most, what);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

static void shifts_test(int more)
{
    static const char *const layers[] = {"camera.pose", "wall.pose", "layers.pose", NULL},
                             *const all[] = {"floor.pose", "wall.pose",     "block.pose",
                                             "lamp.pose",  "camera.pose",   "cloud.pose",
                                             "white.pose", "around.center", NULL};
    static const char above[] =
        VOLPATH("2") LAYERED("0", "30", "0", "1") CAMERA("3", "") WALL("-.32");
    static float mean[64];
    char xml[4096], whole[8192];
    for (int k = 0; k < 64; k++) mean[k] = 1.f / 64;
    snprintf(xml, sizeof xml, above, slab_file, 3 - cos(TILT));
    snprintf(whole, sizeof whole, "<scene version='3.0.0'>%s</scene>", xml);
    shift_test("all of the layers moves", test_scene_text(ctx, whole, IMP_MONO), layers,
               2, mean, 64 * more, 16, .03);
    if (more == 1) return;
    shift_test("all of a room with a cloud moves",
               filled_by(CLOUD VOLPATH("4"), cloud_file, white_file, false), all, 0,
               adjoint, 100 * more, 12, .0015);
}

/* ---- What is refused --------------------------------------------------------------------- */

#define HAZE(SHAPE, PLACE, VOLUME)                                                       \
    "<shape type='" SHAPE "' id='box'><transform name='to_world'><scale value='.5'/>"    \
    "<translate " PLACE "/></transform><bsdf type='null'/><medium "                      \
    "type='heterogeneous' name='interior'>" VOLUME "</medium></shape>" VOLPATH("2")
#define FULL(MORE)                                                                       \
    "<volume type='gridvolume' name='sigma_t'><string name='filename' value='%s'/>" MORE \
    "<transform name='to_world'><translate x='-.5' y='-1.5' "                            \
    "z='1'/></transform></volume>"
#define FALLING                                                                          \
    "<volume type='expvolume' name='sigma_t'><float name='scale_height' value='1'/>"     \
    "<float name='radius' value='1'/><float name='top' value='3'/></volume>"

static void refused(const char *what, const char *rest, const char *name,
                    const char *word)
{
    number_refused(what, filled_by(rest, full_file, "", false), name, word);
}

static void refused_test(void)
{
    refused("a grid that fills the cube around it",
            HAZE("cube", "y='-1' z='1.5'", FULL("")), "block.pose", NULL);
    refused("where the cube moves", HAZE("cube", "y='-1' z='1.5'", FULL("")), "box.pose",
            "at a side of its grid where it is not 0, and what bounds it");
    refused("a grid that ends in the middle of a cube",
            HAZE("cube", "y='-1.2' z='1.5'", FULL("")), "block.pose",
            "at a side of its grid where it is not 0 and nothing else");
    refused("cells that jump",
            HAZE("cube", "y='-1' z='1.5'",
                 FULL("<string name='filter_type' value='nearest'/>")),
            "block.pose", "jump from cell to cell");
    refused("an atmosphere", HAZE("sphere", "y='-1' z='1.5'", FALLING), "block.pose",
            "not as a gridvolume does");
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 8 : 1;
    ctx = test_context(2);
    adjoint_make();
    files_make();
    closed_test(more);
    room_test(more);
    frozen_test("walks through a cloud",
                filled_by(CLOUD SUN SKY VOLPATH("4"), cloud_file, white_file, false));
    frozen_test("walks through air",
                filled_by(AIR SUN SKY VOLPATH("3"), cloud_file, white_file, true));
    shifts_test(more);
    refused_test();
    unlink(slab_file);
    unlink(cloud_file);
    unlink(white_file);
    unlink(full_file);
    imp_context_destroy(ctx);
    return tap_done();
}

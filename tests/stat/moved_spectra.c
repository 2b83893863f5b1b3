/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves where walks carry wavelengths, four or one: imp_problem_reverse against
 * central differences, and errors of a loss told over errors seen, with wavelengths in strata and
 * without. A room with a block of gold, a wall of a spectrum, a lamp and a spot of others. */
#include "moves_kit.h"
#include "moves_numbers.h"

#define DIRECT "<integrator type='direct'/>"
#define PATH   "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
#define GOLD                                                                             \
    "<bsdf type='roughconductor' id='grey'><string name='material' value='Au'/><float "  \
    "name='alpha' value='.5'/></bsdf>"
#define LINES                                                                            \
    "<bsdf type='diffuse' id='grey'><spectrum name='reflectance' value='400:.1, "        \
    "500:.9, 560:.2, 700:.8'/></bsdf>"
#define SPOT                                                                             \
    "<emitter type='spot' id='spot'><spectrum name='intensity' value='400:3, 600:30, "   \
    "700:0'/><float name='cutoff_angle' value='30'/><transform name='to_world'><lookat " \
    "origin='-1.5,-1.5,3.5' target='0,0,.4' up='0,0,1'/></transform></emitter>"
#define SKY                                                                              \
    "<emitter type='sunsky' id='sky'><vector name='sun_direction' value='-.5,-1,.6'/>"   \
    "<float name='sun_aperture' value='20'/><float name='sun_scale' value='.0005'/>"     \
    "</emitter>"

static imp_scene *room(const char *rest, const char *grey, enum imp_color_mode mode)
{
    char xml[16384];
    room_write(&(struct room_parts){.rest = rest, .grey = grey}, xml, sizeof xml);
    return test_scene_text(ctx, xml, mode);
}

/* ---- Losses ------------------------------------------------------------------------------ */

static void loss_test(const char *what, enum imp_points points,
                      enum imp_wavelength_sampling choice, int spp)
{
    enum { SEEDS = 48, N = 18 };
    imp_scene *scene = room(PATH, LINES, IMP_SPECTRAL);
    imp_film *film;
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_target t = IMP_TARGET_INIT;
    struct tap_stat g[N];
    double told[N] = {0}, ratio = 0;
    memset(g, 0, sizeof g);
    for (int k = 0; k < 3; k++)
        test_must(ctx, imp_scene_add_pose(scene, room_objects[k]));
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "*.pose"));
    run.spp = 256;
    run.seed = 77;
    test_must(ctx, imp_render(scene, &run, &film));
    t.width = WIDTH;
    t.height = HEIGHT;
    t.channels = 3;
    t.scale = 1. / (WIDTH * HEIGHT);
    t.pixels = imp_film_mean(film);
    test_must(ctx, imp_problem_add_target(p, &t));
    imp_film_destroy(film);
    const double away[N] = {.1, -.1, .05, .2, -.1, .3,  -.1, .2,  .1,
                            .1, .05, 0,   .1, .2,  -.1, .02, .03, -.02};
    room_poses_set(ctx, scene, away);
    for (int s = 0; s < SEEDS; s++) {
        struct imp_estimate value;
        double v[N], se[N];
        run.spp = spp;
        run.seed = 100 + (uint64_t)s;
        run.points = points;
        run.wavelengths = choice;
        test_must(ctx, imp_problem_objective(p, NULL, &run, &value, v, se));
        for (int k = 0; k < N; k++) {
            tap_add(&g[k], v[k]);
            told[k] += se[k] * se[k] / SEEDS;
        }
    }
    for (int k = 0; k < N; k++) ratio += log(sqrt(told[k] / SEEDS) / tap_se(&g[k])) / N;
    tap_ok(exp(ratio) > 0.85 && exp(ratio) < 1.2,
           "%s: errors told over errors seen, mean of %d numbers # %.3f", what, N,
           exp(ratio));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    static const struct number numbers[] = {{"block.pose", 0, .03},
                                            {"block.pose", 5, .03},
                                            {"lamp.pose", 0, .05},
                                            {"camera.pose", 3, .01},
                                            {NULL, 0, 0}};
    static const struct number spot[] = {{"spot.position", 0, .04},
                                         {"spot.direction", 0, .02},
                                         {"block.pose", 2, .03},
                                         {NULL, 0, 0}};
    /* The horizon lies on the picture's upper border: the camera turns along it. */
    static const struct number sky[] = {
        {"block.pose", 0, .03}, {"camera.pose", 5, .01}, {NULL, 0, 0}};
    const int more = is_long ? 16 : 1;
    ctx = test_context(2);
    adjoint_make();
    numbers_compare("spectra, path", room(PATH, LINES, IMP_SPECTRAL), 32 * more,
                    48 * more, .08, numbers);
    numbers_compare("gold and a spot", room(DIRECT SPOT, GOLD, IMP_SPECTRAL), 32 * more,
                    48 * more, .3, spot);
    numbers_compare("one wavelength, a sky", room(DIRECT SKY, LINES, IMP_SINGLE),
                    32 * more, 48 * more, .1, sky);
    loss_test("l2, points", IMP_POINTS_SCENE, IMP_WAVELENGTHS_STRATIFIED, 16);
    if (is_long) {
        loss_test("l2, sets", IMP_POINTS_INDEPENDENT, IMP_WAVELENGTHS_STRATIFIED, 32);
        loss_test("l2, wavelengths without strata", IMP_POINTS_INDEPENDENT,
                  IMP_WAVELENGTHS_INDEPENDENT, 32);
    }
    imp_context_destroy(ctx);
    return tap_done();
}

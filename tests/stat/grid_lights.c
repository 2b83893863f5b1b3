/* SPDX-License-Identifier: Apache-2.0
 *
 * Grids of illuminances choose among lights by the scene's tree where nobody says how: with the bits
 * of `light_choice` tree, the expectation of weights and far less noise; by weights where lights
 * move; pictures of the same scene stay as they are. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/rooms.h>
#include <math.h>
#include <string.h>

static imp_context *ctx;
enum { N = 20, CAMERA = 2 };

static const char *const room =
    "<shape type='cube'><transform name='to_world'><scale x='5' y='4' "
    "z='1.5'/><translate "
    "z='1.5'/></transform><bsdf type='twosided'><bsdf type='diffuse'><rgb "
    "name='reflectance' value='.5'/></bsdf></bsdf></shape>"
    "<emitter type='point' id='bulb'><point name='position' x='4' y='0' z='2'/><rgb "
    "name='intensity' value='4'/></emitter>";
static const char *const panel =
    "<shape type='rectangle'><transform name='to_world'><scale value='.3'/><rotate x='1' "
    "angle='180'/><translate x='%g' y='%g' z='2.9'/></transform><emitter "
    "type='area'><rgb "
    "name='radiance' value='40'/></emitter></shape>";
static const char *const meter =
    "<shape type='rectangle'><transform name='to_world'><scale x='4.8' y='3.8'/>"
    "<translate z='.75'/></transform><sensor type='irradiancemeter'><boolean "
    "name='virtual' value='true'/><string name='at' value='points'/><string "
    "name='receiver' value='%s'/><film type='hdrfilm'><integer name='width' value='5'/>"
    "<integer name='height' value='4'/></film></sensor></shape>";
static const char *const camera =
    "<sensor type='perspective'><film type='hdrfilm'><integer name='width' value='8'/>"
    "<integer name='height' value='8'/></film></sensor></scene>";

/* A hall of 10 x 8 x 3 with four panels and a bulb, two grids and a camera. */
static imp_scene *hall(const char *choice)
{
    char xml[8192];
    int n = snprintf(xml, sizeof xml,
                     "<scene version='3.0.0'><integrator type='path'><integer "
                     "name='max_depth' value='6'/><string name='light_choice' "
                     "value='%s'/></integrator>%s",
                     choice, room);
    for (int k = 0; k < 4; k++)
        n += snprintf(xml + n, sizeof xml - (size_t)n, panel, k % 2 ? 2.5 : -2.5,
                      k / 2 ? 2. : -2.);
    n += snprintf(xml + n, sizeof xml - (size_t)n, meter, "planar");
    n += snprintf(xml + n, sizeof xml - (size_t)n, meter, "cylindrical");
    snprintf(xml + n, sizeof xml - (size_t)n, "%s", camera);
    return test_scene_text(ctx, xml, IMP_MONO);
}

struct reading {
    double value[N], se[N];
};
static struct reading read_grid(imp_scene *s, int sensor, uint64_t seed)
{
    struct reading out;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate mean;
    run.sensor = sensor;
    run.spp = 1024;
    run.seed = seed;
    test_must(ctx, imp_grid_read(s, &run, out.value, out.se, &mean, NULL));
    return out;
}
static bool same(const struct reading *a, const struct reading *b)
{
    return memcmp(a->value, b->value, sizeof a->value) == 0;
}

static void grids(imp_scene *scene[3])
{
    for (int sensor = 0; sensor < CAMERA; sensor++) {
        double chi2 = 0, sum = 0, square = 0, noise[2] = {0};
        const struct reading nobody = read_grid(scene[0], sensor, 1),
                             tree = read_grid(scene[1], sensor, 1),
                             weights = read_grid(scene[2], sensor, 2);
        for (int i = 0; i < N; i++) {
            const double v = nobody.se[i] * nobody.se[i],
                         w = weights.se[i] * weights.se[i],
                         d = nobody.value[i] - weights.value[i];
            chi2 += d * d / (v + w);
            sum += d;
            square += v + w;
            noise[0] += v;
            noise[1] += w;
        }
        tap_ok(same(&nobody, &tree) && !same(&nobody, &weights),
               "grid %d: lights are chosen by the tree", sensor);
        tap_ok(chi2 < 50 && fabs(sum) < 3.5 * sqrt(square),
               "as by weights: chi2 %.1f of %d, the mean %.2f standard errors away", chi2,
               N, sum / sqrt(square));
        tap_ok(noise[0] < .5 * noise[1], "with %.2f of the variance",
               noise[0] / noise[1]);
    }
}

/* What moves: the tree would have to be made again. */
static void moved(imp_scene *scene[3])
{
    for (int k = 0; k < 3; k += 2)
        test_must(ctx, imp_scene_add_geometry(scene[k], "bulb.position"));
    const struct reading nobody = read_grid(scene[0], 0, 3),
                         weights = read_grid(scene[2], 0, 3);
    tap_ok(same(&nobody, &weights), "where a light moves, by weights");
    const enum imp_status st = imp_scene_add_geometry(scene[1], "bulb.position");
    tap_ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), "tree"), "%s",
           imp_last_error(ctx));
}

static void pictures(imp_scene *scene[3])
{
    imp_film *film[2];
    struct imp_run run = IMP_RUN_INIT;
    run.sensor = CAMERA;
    run.spp = 16;
    for (int k = 0; k < 2; k++) test_must(ctx, imp_render(scene[2 * k], &run, &film[k]));
    tap_ok(memcmp(imp_film_mean(film[0]), imp_film_mean(film[1]), 64 * sizeof(float)) ==
               0,
           "pictures choose by weights");
    for (int k = 0; k < 2; k++) imp_film_destroy(film[k]);
}

int main(void)
{
    static const char *const choice[3] = {"automatic", "tree", "weights"};
    imp_scene *scene[3];
    ctx = test_context(0);
    for (int k = 0; k < 3; k++) scene[k] = hall(choice[k]);
    grids(scene);
    pictures(scene);
    moved(scene);
    for (int k = 0; k < 3; k++) imp_scene_destroy(scene[k]);
    imp_context_destroy(ctx);
    return tap_done();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Luminances of a grid from an observer: a point lamp over a diffuse plane in closed form, rho I h/(pi r^3); a black
 * sphere in the way; where the points are; what is refused. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/rooms.h>
#include <math.h>

static imp_context *ctx;

#define SCENE(film, more)                                                                \
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "          \
    "value='2'/></integrator><shape type='rectangle'><transform name='to_world'><scale " \
    "value='100'/></transform><bsdf type='diffuse'><rgb name='reflectance' "             \
    "value='.3'/></bsdf></shape><emitter type='point'><point name='position' x='2' "     \
    "y='1' z='5'/><rgb name='intensity' value='700'/></emitter>" more                    \
    "<sensor type='radiancemeter' id='seen'><transform name='grid'><scale x='10' "       \
    "y='3'/><translate x='10'/></transform><string name='units' "                        \
    "value='photometric'/>" film "</sensor></scene>"
#define EYE "<point name='origin' x='-60' y='0' z='1.5'/>"
#define FILM(filter)                                                                     \
    "<film type='hdrfilm'><integer name='width' value='5'/><integer name='height' "      \
    "value='3'/>" filter "</film>"
#define SPHERE                                                                           \
    "<shape type='sphere'><point name='center' x='8' y='0' z='.15'/><float "             \
    "name='radius' value='.2'/><bsdf type='diffuse'><rgb name='reflectance' "            \
    "value='0'/></bsdf></shape>"

static void plane(void)
{
    enum { N = 15 };
    static const char *const xml[] = {SCENE(EYE FILM(""), ""),
                                      SCENE(EYE FILM(""), SPHERE)};
    for (int hidden = 0; hidden < 2; hidden++) {
        imp_scene *s = test_scene_text(ctx, xml[hidden], IMP_MONO);
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate mean;
        double value[N], se[N], place[3 * N], normal[3 * N], worst = 0, off = 0;
        int black = 0;
        run.spp = 4;
        test_must(ctx, imp_grid_points(s, 0, place, normal));
        test_must(ctx, imp_grid_read(s, &run, value, se, &mean, NULL));
        for (int i = 0; i < N; i++) {
            const double x = 2 + 4 * (i % 5), y = -2 + 2 * (i / 5);
            off = fmax(off, fabs(place[3 * i] - x) + fabs(place[3 * i + 1] - y) +
                                fabs(place[3 * i + 2]) + fabs(normal[3 * i + 2] - 1));
            const double r = sqrt((x - 2) * (x - 2) + (y - 1) * (y - 1) + 25);
            const double truth = .3 / M_PI * 700 * 5 / (r * r * r);
            if (value[i] == 0) black++;
            else worst = fmax(worst, fabs(value[i] / truth - 1));
        }
        tap_ok(off < 1e-5, "points, %d x %d, and their normal", 5, 3);
        tap_ok(worst < 1e-5 && black == hidden * 3,
               "luminances by a point lamp: within %.1e, %d points hidden", worst, black);
        imp_scene_destroy(s);
    }
}

static void refused(void)
{
    static const struct {
        const char *xml, *says;
    } rows[] = {
        {SCENE(FILM(""), ""), "'origin' is missing"},
        {SCENE(EYE FILM("<rfilter type='gaussian'/>"), ""), "mixes neighbouring points"},
        {SCENE("<point name='origin' x='10' y='0' z='0'/>" FILM(""), ""),
         "the observer is at a point of the grid"},
        {SCENE(EYE "<vector name='direction' x='1' y='0' z='0'/>" FILM(""), ""),
         "direction"}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        imp_scene *s = NULL;
        const enum imp_status st =
            imp_scene_load_string(ctx, rows[k].xml, strlen(rows[k].xml), NULL, NULL, &s);
        tap_ok(st == IMP_E_SCENE && strstr(imp_last_error(ctx), rows[k].says), "%s",
               imp_last_error(ctx));
        imp_scene_destroy(s);
    }
}

int main(void)
{
    ctx = test_context(0);
    plane();
    refused();
    imp_context_destroy(ctx);
    return tap_done();
}

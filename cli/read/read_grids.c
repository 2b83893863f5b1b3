/* SPDX-License-Identifier: Apache-2.0
 *
 * read --grid: the grids of a scene's sensors, and luminaires that light none of them. */
#include "read_grid.h"
#include "room_page.h"
#include "shared/command.h"

#include <math.h>
#include <string.h>

/* Has the sensor a grid? */
static int has_grid(int sensor)
{
    struct imp_sensor_info info = {.size = sizeof info};
    double point[3];
    if (imp_scene_get_sensor(cli.scene, sensor, &info) != IMP_OK) return 0;
    if (strcmp(info.type, "irradiancemeter") != 0 &&
        strcmp(info.type, "radiancemeter") != 0)
        return 0;
    if ((size_t)info.width * (size_t)info.height > 1) return 1;
    return imp_grid_points(cli.scene, sensor, point, NULL) == IMP_OK;
}

int grid_samples_check(struct imp_run run)
{
    if (cli_spp(&run) >= 2) return 0;
    return cli_error(
        EXIT_USAGE,
        "--spp %d: one sample a point has no standard error; grids take 2 or "
        "more",
        cli_spp(&run));
}

/* Why the sensor that --sensor names has no grid. */
static int no_grid(int sensor)
{
    struct imp_scene_info scene = {.size = sizeof scene};
    struct imp_sensor_info info = {.size = sizeof info};
    imp_scene_get_info(cli.scene, &scene);
    if (sensor >= scene.n_sensors)
        return cli_error(
            EXIT_USAGE, "--sensor %d: %s has %d sensor%s, and their numbers begin at 0",
            sensor, cli.scene_path, scene.n_sensors, plural(scene.n_sensors));
    const enum imp_status st = imp_scene_get_sensor(cli.scene, sensor, &info);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    return cli_error(EXIT_USAGE,
                     "--sensor %d: sensor '%s' (%s) has no grid; --grid is of "
                     "irradiancemeters on rectangles and, at points, on disks and flat "
                     "meshes, and of radiancemeters with 'grid'",
                     sensor, info.name, info.type);
}

/* The axis that a level grid lies across; -1: none. */
static int across_of(const struct grid *g)
{
    for (int k = 0; k < 3; k++) {
        double least = INFINITY, most = -INFINITY;
        for (size_t i = 0; i < g->n; i++) {
            least = fmin(least, g->points[3 * i + (size_t)k]);
            most = fmax(most, g->points[3 * i + (size_t)k]);
        }
        if (g->n > 1 && most - least <= 1e-6) return k;
    }
    return -1;
}

/* Are all luminaires in the upper third of [lo, hi] along the axis? */
static int hang(int axis, double lo, double hi)
{
    const int n = imp_scene_n_luminaires(cli.scene);
    int all = n > 0;
    for (int i = 0; i < n && all; i++) {
        struct imp_luminaire_info l = {.size = sizeof l};
        all = imp_scene_get_luminaire(cli.scene, i, &l) == IMP_OK &&
              (!l.is_point || l.position[axis] > hi - (hi - lo) / 3);
    }
    return all;
}

/* Does the grid lie below lamps, as high above the lowest shape as work planes are in feet? What is
 * up in a scene nobody says. */
static void feet_tell(const struct grid *g)
{
    struct imp_scene_info s = {.size = sizeof s};
    const int k = across_of(g);
    if (k < 0) return;
    imp_scene_get_info(cli.scene, &s);
    const double height = s.bounds_max[k] - s.bounds_min[k];
    const double up = g->points[k] - s.bounds_min[k];
    if (height >= 7 && height <= 14 && up >= 2.3 && up <= 2.9 &&
        hang(k, s.bounds_min[k], s.bounds_max[k]))
        cli_say("importon: warning: grid '%s' is %g above the lowest shape, in a room %g "
                "high: is the scene in feet? Luminaires take its units for metres",
                g->name, up, height);
}

static void points_say(const struct grid *g)
{
    if (!isfinite(g->end.relative)) {
        cli_say("%s: no point gets light (%lld samples a point)", g->name,
                (long long)g->end.spp);
        return;
    }
    cli_say("%s: each point within %.3g of itself in 95 of 100 cases%s (%lld samples a "
            "point)",
            g->name, g->end.relative,
            g->end.reached ? "" : ", which is more than --until allows",
            (long long)g->end.spp);
}

/* The grids of the sensors from `first` on that have one. */
int grids_read(struct json *j, struct imp_run run, int first, int end,
               const struct grid_wanted *wanted, double most_z, int *apart, int *unlit,
               int *n_unlit)
{
    int n = 0, rc = 0;
    for (int s = first; s < end; s++) n += has_grid(s);
    if (n == 0 && cli_typed("sensor")) return no_grid(first);
    if (n == 0)
        return cli_error(EXIT_USAGE,
                         "%s: no irradiancemeter on a rectangle is among its sensors, "
                         "nor one at points "
                         "on a disk or a flat mesh, nor a radiancemeter with 'grid', and "
                         "--grid is of those",
                         cli.scene_path);
    if (n > 1 && (wanted->csv || wanted->svg))
        return cli_error(EXIT_USAGE,
                         "%s: it has %d grids, and --csv and --svg write one: choose it "
                         "with --sensor",
                         cli.scene_path, n);
    for (int s = first; s < end && !rc; s++) {
        struct grid g;
        if (!has_grid(s)) continue;
        run.sensor = s;
        if (!(wanted->until > 0)) rc = grid_samples_check(run);
        if (rc) return rc;
        rc = grid_read(run, wanted->until, wanted->ends, &g);
        if (rc) return rc;
        *apart |= wanted->ends && !(fabs(g.z) <= most_z);
        if (g.summary.average.value == 0 && g.summary.average.hi == 0)
            unlit[(*n_unlit)++] = s;
        grid_tell(&g);
        feet_tell(&g);
        if (g.until > 0) points_say(&g);
        if (cli.json) grid_json(j, &g);
        else grid_print(&g);
        if (wanted->csv) rc = grid_csv(wanted->csv, &g);
        if (wanted->svg && !rc) rc = grid_svg(wanted->svg, &g);
        if (wanted->page) room_page_add(wanted->page, &g);
        else grid_free(&g);
    }
    return rc;
}

/* Scenes with luminaires are in metres. Where all three sides are longer than halls are high, or a work
 * plane lies as high in a room as .7 to .9 m are in feet, they hardly are. */
static void units_tell(const struct imp_scene_info *s)
{
    enum { HALL = 50 };
    double size[3];
    for (int k = 0; k < 3; k++) size[k] = s->bounds_max[k] - s->bounds_min[k];
    if (fmin(size[0], fmin(size[1], size[2])) > HALL)
        cli_say(
            "importon: warning: all shapes together are %g x %g x %g, and a luminaire "
            "takes that for metres: are they in centimetres, inches or millimetres?",
            size[0], size[1], size[2]);
}

/* Luminaires outside of the box of all shapes light no room. */
void luminaires_tell(void)
{
    struct imp_scene_info s = {.size = sizeof s};
    const int n = imp_scene_n_luminaires(cli.scene);
    imp_scene_get_info(cli.scene, &s);
    if (n > 0) units_tell(&s);
    for (int i = 0; i < n && s.bounds_min[0] <= s.bounds_max[0]; i++) {
        struct imp_luminaire_info l = {.size = sizeof l};
        int out = 0;
        if (imp_scene_get_luminaire(cli.scene, i, &l) != IMP_OK || !l.is_point) continue;
        for (int k = 0; k < 3; k++)
            out |= l.position[k] < s.bounds_min[k] || l.position[k] > s.bounds_max[k];
        if (out)
            cli_say(
                "importon: warning: luminaire '%s' at (%g, %g, %g) is outside of all "
                "shapes, which lie in (%g, %g, %g) to (%g, %g, %g): are they in other "
                "units, or is it in the wrong place?",
                l.name, l.position[0], l.position[1], l.position[2], s.bounds_min[0],
                s.bounds_min[1], s.bounds_min[2], s.bounds_max[0], s.bounds_max[1],
                s.bounds_max[2]);
    }
}

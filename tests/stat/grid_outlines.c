/* SPDX-License-Identifier: Apache-2.0
 *
 * Grids on an L-shaped mesh and on disks: which points of the raster count, where they are,
 * and what they read below a point lamp, in closed form and from both ends; the mean over
 * an L by quadrature; what has no grid. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/rooms.h>
#include <math.h>
#include <unistd.h>

static imp_context *ctx;
static char folder[] = "/tmp/importon-outline-XXXXXX";

#define HEAD                                                                             \
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "          \
    "value='2'/></integrator><emitter type='point'><point name='position' x='1.2' "      \
    "y='1.1' z='3'/><rgb name='intensity' value='100'/></emitter>"
#define METER                                                                            \
    "<sensor type='irradiancemeter'><boolean name='virtual' value='true'/><string "      \
    "name='units' value='photometric'/>%s</sensor></shape></scene>"
#define POINTS "<string name='at' value='points'/>"
#define FILM(w, h)                                                                       \
    "<film type='hdrfilm'><integer name='width' value='" w "'/><integer name='height' "  \
    "value='" h "'/></film>"

/* Illuminance of level ground at height .75 below the lamp. */
static double lit(double x, double y)
{
    const double dx = x - 1.2, dy = y - 1.1, dz = 3 - .75;
    return 100 * dz / pow(dx * dx + dy * dy + dz * dz, 1.5);
}

/* The L: [0, 6] x [0, 2] and [0, 2] x [2, 5], of triangles that are cut in different ways. */
static const char el[] =
    "v 0 0 .75\nv 6 0 .75\nv 6 2 .75\nv 2 2 .75\nv 2 5 .75\nv 0 5 .75\n"
    "f 1 2 3 4\nf 1 4 5 6\n";
static int in_el(double x, double y)
{
    return x > 0 && y > 0 && ((x < 6 && y < 2) || (x < 2 && y < 5));
}

static void file_write(const char *name, const char *text)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "w");
    if (!f || fputs(text, f) < 0 || fclose(f) != 0) exit(99);
}

static imp_scene *mesh_scene(const char *file, const char *to_world, const char *meter)
{
    char xml[4096];
    snprintf(xml, sizeof xml,
             HEAD "<shape type='obj'><string name='filename' value='%s/%s'/><transform "
                  "name='to_world'>%s</transform>" METER,
             folder, file, to_world, meter);
    return test_scene_text(ctx, xml, IMP_MONO);
}

/* All points of the raster read, from both ends, against the lamp. n: how many there must be. */
static void points_compare(imp_scene *s, int n, const char *name)
{
    enum { MOST = 200 };
    double p[3 * MOST], normal[3 * MOST], value[MOST], se[MOST];
    int32_t cell[2 * MOST];
    struct imp_sensor_info info = {.size = sizeof info};
    int columns, rows, ordered = 1;
    test_must(ctx, imp_scene_get_sensor(s, 0, &info));
    tap_ok(info.width == n && info.height == 1, "%s: %d of the raster's points", name,
           info.width);
    if (info.width > MOST) return;
    test_must(ctx, imp_grid_points(s, 0, p, normal));
    test_must(ctx, imp_grid_cells(s, 0, &columns, &rows, cell));
    for (int i = 1; i < info.width; i++)
        ordered &= cell[2 * i + 1] * columns + cell[2 * i] >
                   cell[2 * i - 1] * columns + cell[2 * i - 2];
    tap_ok(ordered && cell[2 * info.width - 1] < rows && fabs(normal[2] - 1) < 1e-6,
           "%s: cells of %d x %d, row by row", name, columns, rows);
    for (int e = 0; e < 2; e++) {
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate mean;
        double worst = 0, widest = 0, truth = 0;
        run.from = e ? IMP_FROM_LIGHTS : IMP_FROM_SENSOR;
        run.spp = e ? 20000 : 16;
        test_must(ctx, imp_grid_read(s, &run, value, se, &mean, NULL));
        for (int i = 0; i < info.width; i++) {
            const double t = lit(p[3 * i], p[3 * i + 1]);
            truth += t / info.width;
            worst = fmax(worst, fabs(value[i] - t) / (se[i] + 1e-6 * t));
            widest = fmax(widest, se[i] / t);
        }
        const double z = (mean.value - truth) / (mean.se + 1e-6 * truth);
        tap_ok(worst < 4.9 && widest < (e ? .2 : 1e-6) && fabs(z) < 4,
               "%s from the %s: worst %.2f, average z %.2f, widest error %.1e", name,
               e ? "lights" : "sensor", worst, z, widest);
    }
}

static void el_shaped(void)
{
    /* The rectangle around it is 6 x 5: d = 6, p = .2 x 5^log10(6) = .6997: 9 x 7. */
    int n = 0;
    for (int y = 0; y < 7; y++)
        for (int x = 0; x < 9; x++) n += in_el((x + .5) * 6 / 9, (y + .5) * 5 / 7);
    imp_scene *s = mesh_scene("el.obj", "", POINTS);
    double p[3 * 63];
    points_compare(s, n, "an L");
    test_must(ctx, imp_grid_points(s, 0, p, NULL));
    tap_ok(fabs(p[0] - 1. / 3) < 1e-6 && fabs(p[1] - 2.5 / 7) < 1e-6,
           "columns go along x, rows along y");
    imp_scene_destroy(s);

    /* Turned by 30 degrees: its axes are its walls, and a margin is kept from the outline, at the
     * inner corner (2, 2), too. */
    const double c = cos(M_PI / 6), d = sin(M_PI / 6);
    int inside = 0, clear = 1;
    for (int y = 0; y < 9; y++)
        for (int x = 0; x < 11; x++) {
            const double px = .4 + (x + .5) * 5.2 / 11, py = .4 + (y + .5) * 4.2 / 9;
            const double corner = px < 2 && py < 2 ? hypot(2 - px, 2 - py) : 9;
            inside += (py < 1.6 || px < 1.6) && (px < 1.6 || py < 1.6) && corner >= .4;
        }
    s = mesh_scene("el.obj", "<rotate z='1' angle='30'/>",
                   POINTS "<float name='margin' value='.4'/>" FILM("11", "9"));
    double q[3 * 99];
    struct imp_sensor_info info = {.size = sizeof info};
    test_must(ctx, imp_scene_get_sensor(s, 0, &info));
    test_must(ctx, imp_grid_points(s, 0, q, NULL));
    for (int i = 0; i < info.width; i++) {
        const double x = c * q[3 * i] + d * q[3 * i + 1],
                     y = c * q[3 * i + 1] - d * q[3 * i];
        clear &= x > .4 && y > .4 &&
                 ((x < 5.6 && y < 1.6) || (x < 1.6 && y < 4.6) ||
                  (x < 2 && y < 2 && hypot(2 - x, 2 - y) > .4 - 1e-6));
    }
    tap_ok(clear && info.width == inside, "a margin of .4: %d of %d points", info.width,
           inside);
    points_compare(s, inside, "an L, turned, with a margin");
    imp_scene_destroy(s);

    /* The mean over all of it, by the midpoint rule on 600 x 500 cells. */
    double truth = 0, cells = 0;
    for (int y = 0; y < 500; y++)
        for (int x = 0; x < 600; x++) {
            const double px = (x + .5) / 100, py = (y + .5) / 100;
            if (in_el(px, py)) truth += lit(px, py), cells++;
        }
    truth /= cells;
    s = mesh_scene("el.obj", "", FILM("1", "1"));
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate mean;
    double value, se;
    run.spp = 20000;
    test_must(ctx, imp_grid_read(s, &run, &value, &se, &mean, NULL));
    tap_ok(fabs(mean.value - truth) < 4 * mean.se && mean.se < .003 * truth,
           "the mean over an L: %.5g +- %.2g, %.5g by quadrature", mean.value, mean.se,
           truth);
    imp_scene_destroy(s);
}

static void round_table(void)
{
    /* Radius .8: d = 1.6, p = .2 x 5^log10(1.6) = .2777: 6 x 6, less the corners. */
    int n = 0;
    for (int y = 0; y < 6; y++)
        for (int x = 0; x < 6; x++) n += hypot(x - 2.5, y - 2.5) < 3;
    char xml[2048];
    snprintf(xml, sizeof xml,
             HEAD "<shape type='disk'><transform name='to_world'><scale value='.8'/>"
                  "<translate x='1' y='2' z='.75'/></transform>" METER,
             POINTS);
    imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
    points_compare(s, n, "a round table");
    imp_scene_destroy(s);

    /* An ellipse of .8 x .5 that is turned: its raster lies along its axes. */
    snprintf(
        xml, sizeof xml,
        HEAD
        "<shape type='disk'><transform name='to_world'><scale x='.5' y='.8'/>"
        "<rotate z='1' angle='-60'/><translate x='1' y='2' z='.75'/></transform>" METER,
        POINTS FILM("8", "5"));
    s = test_scene_text(ctx, xml, IMP_MONO);
    for (int y = n = 0; y < 5; y++)
        for (int x = 0; x < 8; x++) n += hypot((x - 3.5) / 4, (y - 2) / 2.5) < 1;
    points_compare(s, n, "an oval table");
    imp_scene_destroy(s);
}

static void refused(void)
{
    static const struct {
        const char *file, *meter, *says;
    } rows[] = {{"bent.obj", POINTS, "is not in the plane of the others"},
                {"folded.obj", POINTS, "faces the other way"},
                {"el.obj", "", "cuts cells"},
                {"el.obj", FILM("2", "1"), "cuts cells"},
                {"el.obj", FILM("1", "1") "<float name='margin' value='.1'/>",
                 "a margin goes with"},
                {"el.obj", POINTS "<float name='margin' value='1.5'/>", "none of"},
                {"el.obj",
                 POINTS
                 "<film type='hdrfilm'><integer name='width' value='4'/><integer "
                 "name='height' value='4'/><integer name='crop_width' value='2'/></film>",
                 "a crop window"}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        char xml[2048];
        imp_scene *s = NULL;
        snprintf(xml, sizeof xml,
                 HEAD "<shape type='obj'><string name='filename' value='%s/%s'/>" METER,
                 folder, rows[k].file, rows[k].meter);
        const enum imp_status st =
            imp_scene_load_string(ctx, xml, strlen(xml), "test", NULL, &s);
        tap_ok(st == IMP_E_SCENE && strstr(imp_last_error(ctx), rows[k].says), "%s",
               imp_last_error(ctx));
        imp_scene_destroy(s);
    }
    static const char *const shapes[] = {"sphere", "cube"};
    for (int k = 0; k < 2; k++) {
        char xml[2048];
        imp_scene *s = NULL;
        snprintf(xml, sizeof xml, HEAD "<shape type='%s'>" METER, shapes[k], POINTS);
        tap_ok(imp_scene_load_string(ctx, xml, strlen(xml), "test", NULL, &s) ==
                       IMP_E_SCENE &&
                   strstr(imp_last_error(ctx), "flat"),
               "%s", imp_last_error(ctx));
        imp_scene_destroy(s);
    }
}

int main(void)
{
    ctx = test_context(0);
    if (!mkdtemp(folder)) return 99;
    file_write("el.obj", el);
    file_write("bent.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 .1\nf 1 2 3\nf 1 3 4\n");
    file_write("folded.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 4 3\n");
    el_shaped();
    round_table();
    refused();
    static const char *const files[] = {"el.obj", "bent.obj", "folded.obj"};
    for (int k = 0; k < 3; k++) {
        char path[256];
        snprintf(path, sizeof path, "%s/%s", folder, files[k]);
        unlink(path);
    }
    rmdir(folder);
    imp_context_destroy(ctx);
    return tap_done();
}

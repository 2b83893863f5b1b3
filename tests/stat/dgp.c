/* SPDX-License-Identifier: Apache-2.0
 *
 * Daylight glare probability: the formula by hand, the cells of a view, and of scenes in closed form:
 * a disk on the line of sight and at other places below a uniform sky, a uniform sky alone, noisy
 * walls that are all of the view; the coverage of its intervals, and what is refused. */
#include "inverse/rooms/dgp.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/rooms.h>
#include <math.h>

#define DEGREE (M_PI / 180)
enum { SEEDS = 30 };
static imp_context *ctx;

static void formulas(void)
{
    double x;
    /* 1000^1.87 = 407380.28; 2e4^2 .01/2^2 = 1e6: .0587 + .0918 log10(3.454709) + .16 */
    const struct imp_glare_source s = {2e4, .01, 2};
    test_must(ctx, imp_dgp(ctx, 1000, 1, &s, &x));
    tap_near(x, 0.26812617, 1e-8, 0, "one source");
    test_must(ctx, imp_dgp(ctx, 0, 0, NULL, &x));
    tap_near(x, .16, 1e-15, 0, "in the dark");
    tap_ok(imp_dgp(ctx, 0, 1, &s, &x) == IMP_E_ARG &&
               imp_dgp(ctx, -1, 0, NULL, &x) == IMP_E_ARG,
           "a source without light");
    tap_ok(fabs(imp_iwata_position(atan(.5) / DEGREE) - 1.4) < 1e-12 &&
               fabs(imp_iwata_position(45) - 2.2) < 1e-12 &&
               imp_iwata_position(90) == 4.6 && isnan(imp_iwata_position(91)),
           "positions below the line of sight: 1.4, 2.2, 4.6");
}

static void view(void)
{
    struct imp__view v;
    double cosine = 0, worst = 0;
    test_must(ctx, imp__view_make(ctx, 16, &v));
    bool same = true;
    for (int c = 0; c < 256; c++) {
        double mean = 0;
        same &= imp__view_cell(&v, imp__view_middle(&v, c)) == c;
        cosine += v.cosine[c] / 256;
        /* z = 1 - max(a, b)^2 over the square of the cell. */
        for (int k = 0; k < 64 * 64; k++) {
            const double a = (c % 16 + (k % 64 + .5) / 64) / 8 - 1;
            const double b = (c / 16 + (k / 64 + .5) / 64) / 8 - 1;
            mean += (1 - pow(fmax(fabs(a), fabs(b)), 2)) / (64 * 64);
        }
        worst = fmax(worst, fabs(mean - v.cosine[c]));
    }
    tap_ok(
        same && fabs(cosine - .5) < 1e-12 && worst < 1e-4,
        "cells hold their middles; mean cosines within %.1e of a sum, all together %.12f",
        worst, cosine);
    /* By hand: 30 degrees up: a = 0; to the side: a = 90; below: Iwata. */
    const imp_v3 up = {0, .5, sqrt(.75)}, side = {-.5, 0, sqrt(.75)},
                 down = {.3, -.4, sqrt(.75)};
    tap_ok(fabs(imp__view_position(up) - imp__levin_position(0, 30)) < 1e-9 &&
               fabs(imp__view_position(side) - imp__levin_position(90, 30)) < 1e-9 &&
               fabs(imp__view_position(down) - (1 + .8 * tan(30 * DEGREE))) < 1e-9,
           "positions above, beside and below");
    imp__view_free(ctx, &v);
}

/* ---- Scenes --------------------------------------------------------------------------- */

/* An observer at (0, 0, 1.2) who looks along y. */
#define EYE(more)                                                                        \
    "<scene version='3.0.0'><integrator type='path'/><shape type='rectangle'>"           \
    "<transform name='to_world'><translate z='1.2'/></transform><sensor "                \
    "type='irradiancemeter' id='eye'><boolean name='virtual' value='true'/>" more        \
    "<string name='units' value='photometric'/><film type='hdrfilm'><integer "           \
    "name='width' value='1'/><integer name='height' value='1'/></film></sensor></shape>"
#define POINTS "<string name='at' value='points'/>"
#define SIGHT  "<vector name='facing' x='0' y='1' z='0'/>"
#define SKY    "<emitter type='constant'><rgb name='radiance' value='%g'/></emitter>"
/* A disk that glows towards the eye, at distance 1 from it. */
#define DISK                                                                             \
    "<shape type='disk'><transform name='to_world'><scale value='%.17g'/><lookat "       \
    "origin='%.17g,%.17g,%.17g' target='0,0,1.2' up='0.1,0.2,1'/></transform><bsdf "     \
    "type='diffuse'><rgb name='reflectance' value='0'/></bsdf><emitter "                 \
    "type='area'><rgb "                                                                  \
    "name='radiance' value='%g'/></emitter></shape>"

struct disk {
    const char *what;
    double x, z; /* from the eye at y = 1, before it is brought to distance 1 */
    double half; /* its half angle */
    double luminance;
};

static imp_scene *disk_scene(const struct disk *d, double sky)
{
    char xml[4096];
    const double r = sqrt(1 + d->x * d->x + d->z * d->z);
    snprintf(xml, sizeof xml, EYE(POINTS SIGHT) SKY DISK "</scene>", sky, tan(d->half),
             d->x / r, 1 / r, 1.2 + d->z / r, d->luminance);
    return test_scene_text(ctx, xml, IMP_MONO);
}

/* By quadrature over the disk, with the position index written out here. */
static double disk_truth(const struct disk *d, double sky, double *lx)
{
    enum { N = 400 };
    const double r = sqrt(1 + d->x * d->x + d->z * d->z);
    const double c[3] = {d->x / r, 1 / r, d->z / r};
    const double across = hypot(c[0], c[1]);
    const double s[3] = {c[1] / across, -c[0] / across, 0};
    const double t[3] = {s[1] * c[2], -s[0] * c[2], s[0] * c[1] - s[1] * c[0]};
    double sum = 0, seen = 0;
    const double size = 2 * M_PI * (1 - cos(d->half)) / (N * N);
    for (int i = 0; i < N; i++)
        for (int k = 0; k < N; k++) {
            const double z = 1 - (1 - cos(d->half)) * (i + .5) / N, w = sqrt(1 - z * z);
            const double phi = 2 * M_PI * (k + .5) / N;
            double v[3];
            for (int q = 0; q < 3; q++)
                v[q] = z * c[q] + w * (cos(phi) * s[q] + sin(phi) * t[q]);
            const double b = acos(v[1]) / DEGREE, side = hypot(v[0], v[2]);
            const double a = acos(fmin(fabs(v[2]) / side, 1)) / DEGREE;
            double p = exp((35.2 - .31889 * a - 1.22 * exp(-2 * a / 9)) * b / 1000 +
                           (21 + .26667 * a - .002963 * a * a) * b * b / 1e5);
            if (v[2] < 0) p = 1 + (side / v[1] > .6 ? 1.2 : .8) * side / v[1];
            sum += d->luminance * d->luminance * size / (p * p);
            seen += size * v[1];
        }
    *lx = M_PI * sky + (d->luminance - sky) * seen;
    return 5.87e-5 * *lx + .0918 * log10(1 + sum / pow(*lx, 1.87)) + .16;
}

static void dgp_of(imp_scene *s, int cells, int spp, uint64_t seed, double threshold,
                   double *dgp, double *se, double *lx)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_dgp_options o = IMP_DGP_OPTIONS_INIT;
    o.size = sizeof o;
    o.cells = cells;
    o.threshold = threshold;
    run.seed = seed;
    run.spp = spp;
    test_must(ctx, imp_grid_dgp(s, &run, &o, dgp, se, lx));
}

/* Of Student's distribution with 15 degrees of freedom 6.5 is what 4.5 is of the normal. */
static void disks(void)
{
    /* On the line of sight the disk is 8 x 8 cells of 64 x 64: ends nowhere inside of one. */
    static const struct disk rows[] = {{"on the line of sight", 0, 0, 0, 8000},
                                       {"20 degrees up", 0, .36397, .15, 12000},
                                       {"30 degrees to the right", .57735, .05, .2, 9000},
                                       {"up and to the left", -.5, .5, .2, 9000},
                                       {"below", .2, -.5, .15, 9000}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        struct disk d = rows[k];
        double dgp, se, lx, E;
        if (d.half == 0) d.half = acos(1 - 1. / 64);
        const double truth = disk_truth(&d, 300, &E);
        imp_scene *s = disk_scene(&d, 300);
        dgp_of(s, 64, 0, 1, 0, &dgp, &se, &lx);
        /* Of cells that the disk's edge crosses; without the coarse ones it is .003. */
        const double slack = k ? .001 : 0;
        tap_ok(fabs(dgp - truth) < 6.5 * se + slack && se > 0 && se < 1e-3 &&
                   fabs(lx / E - 1) < .01,
               "%s: %.5f +- %.5f of %.5f, %.0f lx of %.0f", d.what, dgp, se, truth, lx,
               E);
        imp_scene_destroy(s);
    }
}

/* A sun's disc of .0047 rad 25 degrees up and 20 to the right, much smaller than a cell; by a pane
 * across the line of sight a part T of its light is left. */
static void sun(void)
{
    const double el = 25 * DEGREE, az = 20 * DEGREE, size = 2 * M_PI * (1 - cos(.004675));
    const double w[3] = {cos(el) * sin(az), cos(el) * cos(az), sin(el)};
    const double b = acos(w[1]) / DEGREE, a = acos(w[2] / hypot(w[0], w[2])) / DEGREE;
    const double p = imp__levin_position(a, b), L = 2e7;
    const double lx = 300 * M_PI + L * size * w[1];
    const double truth =
        5.87e-5 * lx + .0918 * log10(1 + L * L * size / (p * p) / pow(lx, 1.87)) + .16;
    char xml[2048];
    snprintf(xml, sizeof xml,
             EYE(POINTS SIGHT) SKY
             "<emitter type='sun'><rgb name='radiance' value='%.17g'/>"
             "<vector name='direction' x='%.17g' y='%.17g' "
             "z='%.17g'/></emitter></scene>",
             300., L, -w[0], -w[1], -w[2]);
    imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
    for (int cells = 16; cells <= 64; cells *= 4) {
        double dgp, se, E;
        dgp_of(s, cells, 0, 1, 0, &dgp, &se, &E);
        tap_ok(fabs(dgp - truth) < 6.5 * se && se > 0 && se < 5e-3 &&
                   fabs(E / lx - 1) < .02,
               "the sun's disc, %d x %d cells: %.5f +- %.5f of %.5f, %.0f lx of %.0f",
               cells, cells, dgp, se, truth, E, lx);
    }
    imp_scene_destroy(s);
}

static void without_disk(void)
{
    char xml[2048];
    double dgp, se, lx, again, again_se, again_lx;
    snprintf(xml, sizeof xml, EYE(POINTS SIGHT) SKY "</scene>", 300.);
    imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
    dgp_of(s, 32, 0, 1, 0, &dgp, &se, &lx);
    tap_ok(fabs(dgp - 5.87e-5 * lx - .16) < 1e-12 && fabs(lx / (300 * M_PI) - 1) < .01 &&
               fabs(dgp - 5.87e-5 * 300 * M_PI - .16) < 6.5 * se + 1e-12 && se < 1e-3,
           "a uniform sky: %.5f +- %.5f, %.1f lx", dgp, se, lx);
    imp_scene_destroy(s);
    imp_context *other = test_context(3);
    s = test_scene_text(other, xml, IMP_MONO);
    dgp_of(s, 32, 0, 1, 0, &again, &again_se, &again_lx);
    tap_ok(again == dgp && again_se == se && again_lx == lx,
           "the same bits by 3 threads");
    imp_scene_destroy(s);
    imp_context_destroy(other);
}

/* In a closed sphere that glows with 200 and reflects half, all is 400, by noisy walks. */
static void furnace(void)
{
    enum { N = 1000 };
    double dgp[2], se[2], lx, sum = 0;
    for (int i = 0; i < N; i++)
        for (int k = 0; k < N; k++) {
            const double z = (i + .5) / N, r = sqrt(1 - z * z);
            const double phi = 2 * M_PI * (k + .5) / N;
            const double p = imp__view_position(imp__v3(r * cos(phi), r * sin(phi), z));
            sum += 400. * 400 * 2 * M_PI / (N * N) / (p * p);
        }
    const double E = 400 * M_PI;
    const double truth = 5.87e-5 * E + .0918 * log10(1 + sum / pow(E, 1.87)) + .16;
    imp_scene *s = test_scene_text(
        ctx,
        EYE(POINTS SIGHT) "<shape type='sphere'><boolean name='flip_normals' "
                          "value='true'/><transform name='to_world'><scale value='9'/>"
                          "</transform><bsdf type='diffuse'><rgb name='reflectance' "
                          "value='.5'/></bsdf><emitter type='area'><rgb name='radiance' "
                          "value='200'/></emitter></shape></scene>",
        IMP_MONO);
    for (int k = 0; k < 2; k++)
        dgp_of(s, 32, 65536, 3, k ? 1e9 : .1, &dgp[k], &se[k], &lx);
    tap_ok(fabs(dgp[0] - truth) < 6.5 * se[0] && se[0] < 1e-3,
           "noisy walls, all of them a source: %.5f +- %.5f of %.5f", dgp[0], se[0],
           truth);
    tap_ok(fabs(dgp[1] - 5.87e-5 * E - .16) < 6.5 * se[1] && se[1] < 1e-3,
           "none of them: %.5f +- %.5f", dgp[1], se[1]);
    imp_scene_destroy(s);
}

static void coverage(void)
{
    const struct disk d = {"", 0, 0, acos(1 - 1. / 64), 8000};
    double E, off = 0, variance = 0, squares = 0;
    int held = 0;
    const double truth = disk_truth(&d, 300, &E);
    imp_scene *s = disk_scene(&d, 300);
    for (int k = 0; k < SEEDS; k++) {
        double dgp, se, lx;
        dgp_of(s, 32, 0, 100 + (uint64_t)k, 0, &dgp, &se, &lx);
        held += fabs(dgp - truth) < 2.131 * se; /* Student, 15 */
        off += dgp - truth;
        variance += se * se;
        squares += pow((dgp - truth) / se, 2) / SEEDS;
    }
    /* 95 % of 30 are 28.5; 24 or fewer have a chance of .003. */
    tap_ok(held > 24 && fabs(off) < 4 * sqrt(variance) && squares > .4 && squares < 2.3,
           "%d of %d intervals hold; mean %.2f standard errors away, mean square %.2f",
           held, SEEDS, off / sqrt(variance), squares);
    imp_scene_destroy(s);
}

static void refused(void)
{
    double x;
    static const struct {
        const char *xml, *says;
    } rows[] = {{EYE(POINTS) "</scene>", "no line of sight"},
                {EYE(SIGHT) "</scene>", "an observer is at a point"}};
    for (size_t k = 0; k < 2; k++) {
        imp_scene *s = test_scene_text(ctx, rows[k].xml, IMP_MONO);
        tap_ok(imp_grid_dgp(s, NULL, NULL, &x, NULL, NULL) == IMP_E_ARG &&
                   strstr(imp_last_error(ctx), rows[k].says),
               "%s", imp_last_error(ctx));
        imp_scene_destroy(s);
    }
    static const char plain[] =
        "<scene version='3.0.0'><integrator type='path'/><shape type='rectangle'><sensor "
        "type='irradiancemeter'><boolean name='virtual' value='true'/>" POINTS SIGHT
        "</sensor></shape></scene>";
    imp_scene *s = test_scene_text(ctx, plain, IMP_SPECTRAL);
    tap_ok(imp_grid_dgp(s, NULL, NULL, &x, NULL, NULL) == IMP_E_UNSUPPORTED, "%s",
           imp_last_error(ctx));
    imp_scene_destroy(s);
    s = test_scene_text(ctx, EYE(POINTS SIGHT) "</scene>", IMP_MONO);
    for (int k = 0; k < 3; k++) {
        struct imp_dgp_options o = {sizeof o, k == 0 ? -1 : 0,
                                    k == 1   ? 10
                                    : k == 2 ? 600
                                             : 0};
        tap_ok(imp_grid_dgp(s, NULL, &o, &x, NULL, NULL) == IMP_E_ARG, "%s",
               imp_last_error(ctx));
    }
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(0);
    formulas();
    view();
    disks();
    sun();
    without_disk();
    furnace();
    coverage();
    refused();
    imp_context_destroy(ctx);
    return tap_done();
}

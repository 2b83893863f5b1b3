/* SPDX-License-Identifier: Apache-2.0
 *
 * Points of a grid that share what their walks meet, against the same walks that do not
 * (imp_render): in a room with a screen between the points, a mirror, a texture, a sheet with two
 * faces, a ball that answers on its outside alone and a lamp that reflects. Values without bias,
 * errors as seen, the mean with its error and a smaller variance; the same bits on any threads. Planar
 * points near the walls and the screen have more walks, those of a small grid have not. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/rooms.h>
#include <math.h>
#include <string.h>

enum { COLUMNS = 7, ROWS = 5, N = COLUMNS * ROWS, RUNS = 96 };

static const char *const room =
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='6'/>"
    "</integrator>"
    "<shape type='cube'><transform name='to_world'><scale x='3' y='2' "
    "z='1.4'/><translate "
    "z='1.4'/></transform><bsdf type='twosided'><bsdf type='diffuse'><texture "
    "type='checkerboard' name='reflectance'><rgb name='color0' value='.8'/><rgb "
    "name='color1' value='.3'/></texture></bsdf></bsdf></shape>"
    /* A screen of two faces between the columns of points. */
    "<shape type='rectangle'><transform name='to_world'><scale x='.6' y='1.2'/><rotate "
    "y='1' "
    "angle='90'/><translate x='.4' z='1'/></transform><bsdf type='twosided'><bsdf "
    "type='diffuse'><rgb name='reflectance' value='.9'/></bsdf><bsdf type='diffuse'><rgb "
    "name='reflectance' value='.1'/></bsdf></bsdf></shape>"
    "<shape type='rectangle'><transform name='to_world'><scale x='.8' y='1'/><rotate "
    "y='1' "
    "angle='90'/><translate x='-2.9' z='1.5'/></transform><bsdf "
    "type='conductor'/></shape>"
    "<shape type='sphere'><point name='center' x='-1.2' y='.7' z='1.6'/><float "
    "name='radius' "
    "value='.4'/><bsdf type='diffuse'><rgb name='reflectance' value='.7'/></bsdf></shape>"
    "<shape type='rectangle'><transform name='to_world'><scale value='.4'/><rotate x='1' "
    "angle='180'/><translate x='1.5' y='.5' z='2.6'/></transform><bsdf "
    "type='diffuse'><rgb "
    "name='reflectance' value='.5'/></bsdf><emitter type='area'><rgb name='radiance' "
    "value='9'/></emitter></shape>"
    "%s"
    "<shape type='rectangle'><transform name='to_world'>%s<translate "
    "z='.8'/></transform><sensor type='irradiancemeter'><boolean name='virtual' "
    "value='true'/><string name='at' value='%s'/><string name='receiver' "
    "value='%s'/>%s<film "
    "type='hdrfilm'><integer name='width' value='7'/><integer name='height' value='5'/>"
    "</film></sensor></shape></scene>";

static const char lamp[] =
    "<emitter type='point'><point name='position' x='-2' y='-1' z='2'/><rgb "
    "name='intensity' value='3'/></emitter>";

struct reading {
    double value[N], se[N];
    struct imp_estimate mean;
};

static struct imp_run run_of(uint64_t seed)
{
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 64;
    run.seed = seed;
    return run;
}
static void shared(imp_context *ctx, imp_scene *s, uint64_t seed, struct reading *out)
{
    const struct imp_run run = run_of(seed);
    test_must(ctx, imp_grid_read(s, &run, out->value, out->se, &out->mean, NULL));
}
static void alone(imp_context *ctx, imp_scene *s, uint64_t seed, struct reading *out)
{
    const struct imp_run run = run_of(seed);
    imp_film *film;
    double square = 0;
    test_must(ctx, imp_render(s, &run, &film));
    struct imp_film_info info = {.size = sizeof info};
    test_must(ctx, imp_film_get_info(film, &info));
    const int channels = info.channels;
    out->mean = (struct imp_estimate){0};
    for (int i = 0; i < N; i++) {
        out->value[i] = (double)imp_film_mean(film)[i * channels];
        out->se[i] = (double)imp_film_se(film)[i * channels];
        out->mean.value += out->value[i] / N;
        square += out->se[i] * out->se[i];
    }
    out->mean.se = sqrt(square) / N;
    imp_film_destroy(film);
}

struct sums {
    double mean[N], square[N], stated;
    double average, average_square, average_stated;
};
static void add(struct sums *s, const struct reading *r)
{
    for (int i = 0; i < N; i++) {
        s->mean[i] += r->value[i] / RUNS;
        s->square[i] += r->value[i] * r->value[i] / RUNS;
        s->stated += r->se[i] * r->se[i] / RUNS;
    }
    s->average += r->mean.value / RUNS;
    s->average_square += r->mean.value * r->mean.value / RUNS;
    s->average_stated += r->mean.se * r->mean.se / RUNS;
}
static double variance(const struct sums *s, int i)
{
    return fmax(s->square[i] - s->mean[i] * s->mean[i], 0) * RUNS / (RUNS - 1);
}

static double average_variance(const struct sums *s)
{
    return (s->average_square - s->average * s->average) * RUNS / (RUNS - 1);
}

static void compare(imp_context *ctx, const char *what, imp_scene *scene)
{
    static struct reading a, b;
    struct sums one = {0}, other = {0};
    double chi2 = 0, seen = 0, before = 0;
    for (int k = 0; k < RUNS; k++) {
        shared(ctx, scene, 1 + (uint64_t)k, &a);
        alone(ctx, scene, 1 + (uint64_t)k, &b);
        add(&one, &a);
        add(&other, &b);
    }
    struct sums fresh = {0};
    for (int k = 0; k < RUNS; k++) {
        alone(ctx, scene, 1000 + (uint64_t)k, &b);
        add(&fresh, &b);
    }
    double off = 0;
    for (int i = 0; i < N; i++) {
        const double v = variance(&one, i), w = variance(&fresh, i),
                     z = (one.mean[i] - fresh.mean[i]) / sqrt((v + w) / RUNS);
        chi2 += z * z;
        off = fmax(off, fabs(z));
        seen += v;
        before += variance(&other, i);
    }
    tap_ok(off < 3.9 && chi2 < N + 3.5 * sqrt(2. * N * 1.1),
           "%s: means of %d runs as of points alone: z %.1f at most, chi2 %.0f of %d",
           what, RUNS, off, chi2, N);
    tap_ok(fabs(sqrt(one.stated / seen) - 1) < .12, "errors are %.2f times those seen",
           sqrt(one.stated / seen));
    tap_ok(seen < .75 * before, "with %.2f of the variance", seen / before);
    const double v = average_variance(&one), w = average_variance(&fresh),
                 z = (one.average - fresh.average) / sqrt((v + w) / RUNS),
                 stated = sqrt(one.average_stated / v);
    tap_ok(fabs(z) < 3.5 && fabs(log(stated)) < 3.5 / sqrt(2. * (RUNS - 1)),
           "the mean as of points alone: z %.1f, its error %.2f times what is seen", z,
           stated);
}

/* With one lamp the light samples are those of points alone, too, and so is the mean where points have no
 * walks that give only: what is given adds up to what is there. */
static void one_lamp(imp_context *ctx, imp_scene *scene, const char *what)
{
    static struct reading a, b;
    double sum = 0, error = 0;
    for (uint64_t seed = 1; seed < 7; seed++) {
        shared(ctx, scene, seed, &a);
        alone(ctx, scene, seed, &b);
        sum = fmax(sum, fabs(a.mean.value / b.mean.value - 1));
        error = fmax(error, fabs(a.mean.se / b.mean.se - 1));
    }
    tap_ok(sum < 1e-6 && error < 1e-4,
           "%s, one lamp: the mean is that of points alone, but for %.1g, with its error "
           "(%.1g)",
           what, sum, error);
}

static void threads(imp_context *ctx, imp_scene *scene, const char *xml)
{
    static struct reading a, b;
    imp_context *three = test_context(3);
    imp_scene *again = test_scene_text(three, xml, IMP_RGB);
    shared(ctx, scene, 5, &a);
    shared(three, again, 5, &b);
    tap_ok(!memcmp(a.value, b.value, sizeof a.value) && !memcmp(a.se, b.se, sizeof a.se),
           "the same bits on three threads");
    imp_scene_destroy(again);
    imp_context_destroy(three);
}

int main(void)
{
    static const char *const kind[][4] = {{"planar points", "points", "planar", ""},
                                          {"planar cells, turned", "cells", "planar",
                                           "<vector name='facing' x='1' y='.2' z='.3'/>"},
                                          {"cylindrical", "points", "cylindrical", ""},
                                          {"semicylindrical", "points", "semicylindrical",
                                           "<vector name='facing' x='1' y='0' z='0'/>"}};
    static const char *const all = "<scale x='2.9' y='1.9'/>",
                             *const away =
                                 "<scale value='.5'/><translate x='-1.2' y='-.9'/>";
    imp_context *ctx = test_context(1);
    for (int k = 0; k < 8; k++) {
        const char *const *how = kind[k / 2];
        char xml[8192];
        snprintf(xml, sizeof xml, room, k % 2 ? "" : lamp, k == 1 ? away : all, how[1],
                 how[2], how[3]);
        imp_scene *scene = test_scene_text(ctx, xml, IMP_RGB);
        if (k % 2) one_lamp(ctx, scene, how[0]);
        else compare(ctx, how[0], scene);
        if (k == 0) threads(ctx, scene, xml);
        imp_scene_destroy(scene);
    }
    imp_context_destroy(ctx);
    return tap_done();
}

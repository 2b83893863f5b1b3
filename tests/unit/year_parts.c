/* SPDX-License-Identifier: Apache-2.0
 *
 * What a year of daylight is made of: skies, eight at once, beside the formula in double; the light of
 * hours beside plain sums; suns behind boxes, whose faces hide those of other hours without a ray;
 * any number of points at once, of threads, of blocks that can be had; and a year that is cancelled.
 * The year as a whole: tests/stat/annual.c. */
#include "imp_fail_alloc.h"
#include "imp_tap.h"
#include "imp_year.h"
#include "inverse/rooms/annual.h"
#include "kind/emitter/perezsky.h"

static imp_context *ctx;

/* ---- Skies ----------------------------------------------------------------------------- */

/* The mean of four points of a patch, which begins at `turn` about the zenith. */
static double patch_of(const struct imp__sky_shape *s, double lo, double hi, double turn,
                       double width)
{
    double sum = 0;
    for (int i = 0; i < 4; i++) {
        const double z = lo + (hi - lo) * (i / 2 + .5) / 2,
                     a = turn + width * (i % 2 + .5) / 2, r = sqrt(1 - z * z);
        sum += imp__sky_shape_at(s, s->axis[0] * (r * cos(a)) +
                                        s->axis[1] * (r * sin(a)) + s->axis[2] * z) /
               4;
    }
    return sum;
}

static void skies(void)
{
    static const int around[] = {60, 60, 60, 60, 48, 48, 48, 48, 36, 36, 24, 24, 12, 12};
    const imp_v3 axis[3] = {{0, 1, 0, 0}, {0, 0, 1, 0}, {1, 0, 0, 0}};
    static imp__annual_lanes L[IMP__PATCHES][2], other[IMP__PATCHES][2];
    struct imp__sky_patches p;
    struct imp__sky_shape sky[IMP__AT_ONCE], turned[IMP__AT_ONCE];
    double level[IMP__AT_ONCE], turned_level[IMP__AT_ONCE], worst = 0, ground[8] = {0};
    imp__sky_patches_set(&p, axis);
    for (int t = 0; t < IMP__AT_ONCE; t++) {
        const struct imp_weather_hour *h = &hours[7 * t];
        sky[t] = (struct imp__sky_shape){.axis = {axis[0], axis[1], axis[2]}};
        sky[t].sun =
            axis[0] * h->sun[0] + axis[1] * h->sun[1] + axis[2] * fmax(h->sun[2], .01);
        sky[t].sun = imp__normalize(sky[t].sun);
        imp__perez_shape(&sky[t], &(struct imp__perez_weather){50 + 20 * t, 100 * t,
                                                               IMP__SOLAR_CONSTANT});
        level[t] = t == 3 ? 0 : 1000 + t;
    }
    for (int t = 0; t < IMP__AT_ONCE; t++) {
        turned[t] = sky[(t + 3) % 8];
        turned_level[t] = level[(t + 3) % 8];
    }
    imp__sky_patches_fill(&p, sky, level, L[0]);
    imp__sky_patches_fill(&p, turned, turned_level, other[0]);
    bool same = true, none = true;
    for (int k = 0; k < IMP__PATCHES; k++) {
        none &= L[k][0][3] == 0;
        for (int t = 0; t < 8; t++) same &= other[k][0][t] == L[k][0][(t + 3) % 8];
    }
    tap_ok(same, "a sky has the same bits in any lane");
    tap_ok(none, "an hour without diffuse light has none");
    for (int t = 0; t < 8; t++) {
        double scale = 0;
        for (int row = 0; row < IMP__PATCH_ROWS; row++)
            for (int k = 0; k < around[row]; k++) {
                const double width = 2 * M_PI / around[row], lo = p.sine[row],
                             hi = p.sine[row + 1];
                const double here = patch_of(&sky[t], lo, hi, k * width, width),
                             x = (double)L[p.first[row] + k][0][t];
                ground[t] += x * width / 2 * (hi * hi - lo * lo);
                if (t == 3) continue;
                if (scale == 0) scale = x / here;
                worst = fmax(worst, fabs(x / (here * scale) - 1));
            }
        const double edge = p.sine[IMP__PATCH_ROWS];
        ground[t] += (double)L[IMP__PATCHES - 1][0][t] * M_PI * (1 - edge * edge);
        worst = fmax(worst, level[t] > 0 ? fabs(ground[t] / level[t] - 1) : 0);
    }
    tap_ok(worst < 1e-3, "eight skies by the formula: %.1e", worst);
}

/* ---- The light of hours -------------------------------------------------------------- */

static void sums(void)
{
    enum { N = 75, BLOCKS = 10, CELLS = 3 }; /* eight blocks at once, and two */
    static imp__annual_skies sky[BLOCKS / 2];
    static imp__annual_lanes E[BLOCKS][IMP__GROUPS], S[BLOCKS][IMP__GROUPS];
    static float C[IMP__PATCHES][IMP__GROUPS], I[CELLS][IMP__GROUPS];
    static struct imp__annual_part part[IMP__GROUPS][IMP__PATCHES];
    double sun[N], worst = 0;
    int cell[N];
    const struct imp__annual a = {
        .hours = {.n = N, .blocks = BLOCKS, .sun = sun, .cell = cell}};
    struct imp__annual_at at = {.I = I};
    const struct imp_key key = imp__key(5, 6, 7);
    uint32_t u = 0;
    for (int k = 0; k < N; k++) {
        cell[k] = k % 5 == 4 ? -1 : k % CELLS;
        sun[k] = cell[k] < 0 ? 0 : 1000 * imp__u01(key, u++);
        for (int p = 0; p < IMP__PATCHES; p++)
            sky[k / 16][p][k / 8 % 2][k % 8] = (float)imp__u01(key, u++);
    }
    for (int g = 0; g < IMP__GROUPS; g++) {
        at.part[g] = part[g];
        for (int p = g % 3; p < IMP__PATCHES; p += 3) { /* some have light */
            C[p][g] = (float)imp__u01(key, u++);
            part[g][at.parts[g]++] = (struct imp__annual_part){C[p][g], p};
        }
        for (int c = 0; c < CELLS; c++) I[c][g] = (float)imp__u01(key, u++);
        for (int k = 0; k < N; k++) S[k / 8][g][k % 8] = (float)imp__u01(key, u++);
    }
    memcpy(E, S, sizeof E);
    imp__annual_light_add(&a, &at, sky, 0, BLOCKS, E);
    for (int k = 0; k < N; k++)
        for (int g = 0; g < IMP__GROUPS; g++) {
            double sum = (double)S[k / 8][g][k % 8];
            if (cell[k] >= 0) sum += sun[k] * (double)I[cell[k]][g];
            for (int p = 0; p < IMP__PATCHES; p++)
                sum += (double)C[p][g] * (double)sky[k / 16][p][k / 8 % 2][k % 8];
            worst = fmax(worst, fabs((double)E[k / 8][g][k % 8] / sum - 1));
        }
    tap_ok(worst < 1e-5, "light of hours by plain sums: %.1e", worst);
}

/* ---- Suns behind boxes ------------------------------------------------------------------ */

static const double box[][6] = {{-2, -3, 2, 2, 3, 2.5}, {3, -4, 0, 4, 4, 3}};
/* Does a ray from the origin meet one? */
static bool meets(const double d[3])
{
    for (size_t b = 0; b < sizeof box / sizeof *box; b++) {
        double near = 0, far = INFINITY;
        for (int k = 0; k < 3; k++) {
            const double x = box[b][k] / d[k], y = box[b][3 + k] / d[k];
            near = fmax(near, fmin(x, y));
            far = fmin(far, fmax(x, y));
        }
        if (near < far) return true;
    }
    return false;
}

/* 1: all of the sun's disc is hidden, 0: none of it; -1: a part, or nearly so. */
static int hidden(const double *sun)
{
    const struct imp_frame f = imp__frame_from_normal(imp__v3(sun[0], sun[1], sun[2]));
    int n = 0;
    for (int k = 0; k < 32; k++) {
        const double a = 2 * M_PI * k / 32;
        const imp_v3 w = f.n + (f.s * cos(a) + f.t * sin(a)) * .0055;
        n += meets((double[3]){w[0], w[1], w[2]});
    }
    return n == 32 ? 1 : n == 0 ? 0 : -1;
}

static void boxes(void)
{
    static struct imp_weather_hour suns[HOURS];
    static double x[HOURS];
    static char xml[4096];
    size_t n = (size_t)snprintf(xml, sizeof xml, SKY GRID(FILM(1, 1)));
    for (size_t b = 0; b < sizeof box / sizeof *box; b++) {
        const double *lo = box[b], *hi = box[b] + 3;
        n += (size_t)snprintf(
            xml + n, sizeof xml - n,
            "<shape type='cube'><transform name='to_world'><scale x='%g' y='%g' "
            "z='%g'/><translate x='%g' y='%g' z='%g'/></transform><bsdf type='diffuse'>"
            "<rgb name='reflectance' value='0'/></bsdf></shape>",
            (hi[0] - lo[0]) / 2, (hi[1] - lo[1]) / 2, (hi[2] - lo[2]) / 2,
            (hi[0] + lo[0]) / 2, (hi[1] + lo[1]) / 2, (hi[2] + lo[2]) / 2);
    }
    memcpy(suns, hours, sizeof suns);
    for (int i = 0; i < HOURS; i++) {
        suns[i].diffuse = suns[i].diffuse_illuminance = 0;
        suns[i].direct_illuminance = 50000;
    }
    imp_scene *s = scene_of(ctx, "path", xml);
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 16;
    test_must(ctx, imp_annual_read(s, &run, HOURS, suns, NULL, NULL, NULL, x, NULL));
    imp_scene_destroy(s);
    int wrong = 0, count[2] = {0};
    for (int i = 0; i < HOURS; i++) {
        const int in = suns[i].sun[2] > 0 ? hidden(suns[i].sun) : -1;
        if (in < 0) continue;
        count[in]++;
        wrong += !(fabs(x[i] - (in ? 0 : 50000 * suns[i].sun[2])) <= .01);
    }
    tap_ok(wrong == 0 && count[0] > 40 && count[1] > 40,
           "%d suns that are seen and %d behind boxes: %d are wrong", count[0], count[1],
           wrong);
}

/* ---- Points, threads, memory ------------------------------------------------------------ */

enum { ALL = 17 * 17 };
#define MANY                                                                             \
    "<shape type='rectangle'><transform name='to_world'><scale value='.8'/><translate "  \
    "z='.4'/></transform><sensor type='irradiancemeter'><boolean name='virtual' "        \
    "value='true'/><string name='at' value='points'/>" FILM(                             \
        17, 17) "<string name='units' value='photometric'/></sensor></shape>"
struct answer {
    struct imp_annual_point point[ALL];
    struct imp_annual_summary summary;
    double reading[ALL * HOURS], se[ALL * HOURS];
};

static enum imp_status year_on(imp_context *c, imp_progress_fn progress,
                               struct answer *out)
{
    imp_scene *s = scene_of(c, "path", SKY ROOM MANY);
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 32;
    run.progress = progress;
    out->summary.size = sizeof out->summary;
    const enum imp_status st = imp_annual_read(s, &run, HOURS, hours, NULL, out->point,
                                               &out->summary, out->reading, out->se);
    imp_scene_destroy(s);
    return st;
}

/* More points than have their walks first (256): the last ones come in a second turn. */
static void threads(void)
{
    static struct answer first, other;
    bool same = true;
    test_must(ctx, year_on(ctx, NULL, &first));
    for (int n = 1; n <= 16; n = n == 1 ? 3 : n == 3 ? 16 : 17) {
        imp_context *c = test_context(n);
        memset(&other, 0, sizeof other);
        test_must(c, year_on(c, NULL, &other));
        same &= memcmp(&first, &other, sizeof first) == 0;
        imp_context_destroy(c);
    }
    tap_ok(same, "%d points have the same bits on 1, 3 and 16 threads", ALL);
}

static imp_scene *fragile;
static struct answer kept;
static enum imp_status again(imp_context *c)
{
    struct imp_run run = IMP_RUN_INIT;
    (void)c;
    run.spp = 16;
    kept.summary = (struct imp_annual_summary){.size = sizeof kept.summary};
    return imp_annual_read(fragile, &run, HOURS, hours, NULL, kept.point, &kept.summary,
                           NULL, NULL);
}
static void memory(void)
{
    struct fail_alloc heap = {0};
    imp_context *c = fail_alloc_context(&heap);
    static struct answer whole;
    fragile = scene_of(c, "path", SKY ROOM MANY);
    const int n = fail_alloc_in_turn(&heap, again, c);
    whole = kept;
    test_must(c, again(c));
    tap_ok(n > 10 && memcmp(&whole, &kept, sizeof whole) == 0,
           "%d blocks that could not be had, one by one: no memory, and then a year", n);
    imp_scene_destroy(fragile);
    imp_context_destroy(c);
    tap_ok(heap.live == 0, "and none is left: %ld", heap.live);
}

static int stop(const struct imp_progress *p, void *payload)
{
    (void)p, (void)payload;
    return 1;
}
static void cancel(void)
{
    static struct answer none;
    imp_context *c = test_context(1);
    tap_ok(year_on(c, stop, &none) == IMP_CANCELLED, "a year that is cancelled");
    imp_context_destroy(c);
}

int main(void)
{
    ctx = test_context(0);
    weather_make();
    skies();
    sums();
    boxes();
    threads();
    memory();
    cancel();
    imp_context_destroy(ctx);
    return tap_done();
}

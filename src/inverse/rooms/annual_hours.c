/* SPDX-License-Identifier: Apache-2.0
 *
 * Skies and suns of a year's hours. */
#include "annual.h"
#include "base/arguments.h"
#include "base/pool.h"
#include "kind/emitter/perezsky.h"
#include <math.h>

static enum imp_status hour_check(imp_context *ctx, size_t i,
                                  const struct imp_weather_hour *h)
{
    const double light[] = {h->diffuse, h->direct, h->diffuse_illuminance,
                            h->direct_illuminance};
    const double *s = h->sun, length = sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
    if (!(h->hour >= 0 && h->hour <= 24))
        return imp__error(ctx, IMP_E_ARG, "hour %zu is at %g: not in [0, 24]", i,
                          h->hour);
    for (int k = 0; k < 4; k++)
        if (!(light[k] >= 0 && light[k] <= 1e9))
            return imp__error(ctx, IMP_E_ARG, "hour %zu has light of %g: not in [0, 1e9]",
                              i, light[k]);
    if (!(fabs(length - 1) < 1e-3))
        return imp__error(ctx, IMP_E_ARG,
                          "the sun of hour %zu, (%g, %g, %g), is no unit vector", i, s[0],
                          s[1], s[2]);
    return IMP_OK;
}

enum imp_status imp__annual_hours_check(imp_context *ctx, size_t n,
                                        const struct imp_weather_hour *hour)
{
    for (size_t i = 0; i < n; i++) IMP_CHECKED(hour_check(ctx, i, &hour[i]));
    return IMP_OK;
}

static bool has_sun(const struct imp_weather_hour *h)
{
    return h->direct_illuminance > 0 && h->sun[2] > 0;
}
static bool has_light(const struct imp_weather_hour *h)
{
    return h->diffuse_illuminance > 0 || has_sun(h);
}

static imp_v3 sun_of(const struct imp__sky_patches *p, const struct imp_weather_hour *h)
{
    return imp__normalize(p->axis[0] * h->sun[0] + p->axis[1] * h->sun[1] +
                          p->axis[2] * h->sun[2]);
}

/* ---- Skies -------------------------------------------------------------------------- */

struct job {
    const struct imp__annual *a;
    size_t block; /* the first */
    imp__annual_skies *out;
};

/* Without light: a sky of one radiance, which counts 0 times. */
static double sky_of(const struct imp__annual *a, size_t k, struct imp__sky_shape *out)
{
    const struct imp__sky_patches *p = &a->patches;
    *out = (struct imp__sky_shape){.axis = {p->axis[0], p->axis[1], p->axis[2]}};
    if (k >= a->hours.n) return 0;
    const struct imp_weather_hour *h = &a->hours.given[a->hours.hour[k]];
    if (!(h->diffuse_illuminance > 0)) return 0;
    const double up = h->sun[2];
    out->sun = sun_of(p, h);
    if (up < 0) { /* it has just set, or is about to rise */
        const imp_v3 level = out->sun - p->axis[2] * up;
        out->sun = imp__length(level) > 1e-9 ? imp__normalize(level) : p->axis[0];
    }
    /* Illuminances alone make a sky, too: a diffuse irradiance below 1 W/m^2 is night's end. */
    imp__perez_shape(out, &(struct imp__perez_weather){fmax(h->diffuse, 1), h->direct,
                                                       IMP__SOLAR_CONSTANT});
    return h->diffuse_illuminance;
}

static enum imp_status skies_work(size_t first, size_t end, void *payload)
{
    const struct job *j = payload;
    for (size_t block = first; block < end; block++) {
        struct imp__sky_shape sky[IMP__AT_ONCE];
        double level[IMP__AT_ONCE];
        for (size_t t = 0; t < IMP__AT_ONCE; t++)
            level[t] = sky_of(j->a, (j->block + block) * IMP__AT_ONCE + t, &sky[t]);
        imp__sky_patches_fill(&j->a->patches, sky, level,
                              &j->out[block / 2][0][block % 2]);
    }
    return IMP_OK;
}

enum imp_status imp__annual_skies_make(const struct imp__annual *a, size_t first,
                                       size_t blocks, imp__annual_skies *out)
{
    struct job j = {a, first, out};
    return imp__parallel_ranges(a->scene->ctx, blocks, 8, skies_work, &j);
}

/* ---- The sun's patches ---------------------------------------------------------------- */

static void cells_make(const struct imp__sky_patches *p, struct imp__annual_hours *h,
                       double *light)
{
    bool any[IMP__PATCHES] = {false};
    h->n_cells = 0;
    for (size_t k = 0; k < h->n; k++) {
        h->cell[k] = h->sun[k] > 0 ? imp__sky_patch_of(p, h->to_sun[k]) : -1;
        if (h->cell[k] >= 0) any[h->cell[k]] = true;
        else h->sun[k] = 0;
    }
    for (int i = 0; i < IMP__PATCHES; i++) {
        h->cell_of[i] = -1;
        if (!any[i]) continue;
        h->cell_of[i] = h->n_cells;
        h->patch_of[h->n_cells++] = i;
    }
    for (size_t k = 0; k < h->n; k++) {
        if (h->cell[k] < 0) continue;
        h->cell[k] = h->cell_of[h->cell[k]];
        light[h->cell[k]] += h->sun[k];
        h->n_suns++;
    }
}

static void sun_put(struct imp__annual_sun *t, int at, const struct imp__annual_hours *h,
                    size_t hour)
{
    for (int i = 0; i < 3; i++) t->to[at][i] = (float)h->to_sun[hour][i];
    t->cell[at] = (uint16_t)h->cell[hour];
}

/* A step through n places that comes to each of them, near the golden section of n. */
static size_t step_of(size_t n)
{
    size_t step = imp_max((size_t)(0.6180339887 * (double)n), (size_t)1);
    for (;; step++) {
        size_t a = n, b = step;
        while (b > 0) {
            const size_t left = a % b;
            a = b;
            b = left;
        }
        if (a == 1) return step;
    }
}

/* The chance of a cell goes with the fourth root of its light in the year: counts of hours have least
 * noise where all cells are drawn alike, sums where they are drawn by their light. In it that of
 * an hour goes with the hour's sun. Each entry of the table has room for the chance 1/n: hours with less are
 * filled up by those with more. Entries side by side are of hours far apart. */
static void suns_make(struct imp__annual_hours *h, const double *light, double *chance,
                      size_t *list)
{
    const size_t n = h->n_suns;
    double roots = 0;
    size_t low = 0, high = n; /* list: hours with less from 0 on, with more to n */
    size_t next = 0, step = n > 0 ? step_of(n) : 0;
    for (int c = 0; c < h->n_cells; c++) roots += sqrt(sqrt(light[c]));
    for (int c = 0; c < h->n_cells; c++) h->times[c] = roots / sqrt(sqrt(light[c]));
    for (size_t k = 0; k < h->n; k++) {
        const int c = h->cell[k];
        if (c < 0) continue;
        chance[k] = (double)n * h->sun[k] / (light[c] * h->times[c]);
        if (chance[k] < 1) list[low++] = k;
        else list[--high] = k;
    }
    for (size_t left = n; left > 0; left--, next = (next + step) % n) {
        /* Rounding leaves the last ones a little less or more than 1. */
        const bool fills = low > 0 && high < n;
        const size_t one = low > 0 ? list[--low] : list[high++];
        const size_t other = fills ? list[high] : one;
        struct imp__annual_sun *t = &h->suns[next];
        t->part = fills ? (float)chance[one] : 1;
        sun_put(t, 0, h, one);
        sun_put(t, 1, h, other);
        if (!fills) continue;
        chance[other] -= 1 - chance[one];
        if (chance[other] < 1) list[low++] = other, high++;
    }
}

static enum imp_status suns_draw_by(imp_context *ctx, const struct imp__sky_patches *p,
                                    struct imp__annual_hours *h)
{
    double light[IMP__PATCHES] = {0};
    cells_make(p, h, light);
    h->suns = imp__alloc(ctx, h->n_suns + 1, sizeof *h->suns);
    double *chance = imp__alloc(ctx, h->n, sizeof *chance);
    size_t *list = imp__alloc(ctx, h->n_suns + 1, sizeof *list);
    const bool got = h->suns && chance && list;
    if (got) suns_make(h, light, chance, list);
    imp__release(ctx, chance);
    imp__release(ctx, list);
    return got ? IMP_OK : imp__error(ctx, IMP_E_NOMEM, "no memory for suns of a year");
}

enum imp_status imp__annual_hours_make(const struct imp__annual *a, size_t n,
                                       const struct imp_weather_hour *hour,
                                       struct imp__annual_hours *out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = a->scene->ctx;
    struct imp__annual_hours h = {.given = hour};
    for (size_t i = 0; i < n; i++) h.n += has_light(&hour[i]);
    if (h.n == 0)
        IMP_TRY(imp__error(ctx, IMP_E_ARG, "none of the %zu hours has any daylight", n));
    h.blocks = 2 * ((h.n + 2 * IMP__AT_ONCE - 1) / (2 * IMP__AT_ONCE));
    h.hour = imp__alloc(ctx, h.n, sizeof *h.hour);
    h.sun = imp__alloc(ctx, h.n, sizeof *h.sun);
    h.to_sun = imp__alloc(ctx, h.n, sizeof *h.to_sun);
    h.cell = imp__alloc(ctx, h.n, sizeof *h.cell);
    if (!h.hour || !h.sun || !h.to_sun || !h.cell)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for %zu suns", h.n));
    for (size_t i = 0, k = 0; i < n; i++) {
        if (!has_light(&hour[i])) continue;
        h.hour[k] = i;
        h.to_sun[k] = sun_of(&a->patches, &hour[i]);
        h.sun[k++] = has_sun(&hour[i]) ? hour[i].direct_illuminance : 0;
    }
    IMP_TRY(suns_draw_by(ctx, &a->patches, &h));
    *out = h;
    h = (struct imp__annual_hours){.n = 0};
out:
    imp__annual_hours_free(ctx, &h);
    return st;
}

void imp__annual_hours_free(imp_context *ctx, struct imp__annual_hours *h)
{
    imp__release(ctx, h->hour);
    imp__release(ctx, h->sun);
    imp__release(ctx, h->to_sun);
    imp__release(ctx, h->cell);
    imp__release(ctx, h->suns);
}

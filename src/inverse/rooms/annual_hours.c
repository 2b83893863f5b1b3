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
    const struct imp__sky_patches *patches;
    const struct imp_weather_hour *hour;
    struct imp__annual_hours *out;
};

static void sky_make(const struct job *j, size_t k)
{
    const struct imp_weather_hour *h = &j->hour[j->out->hour[k]];
    const struct imp__sky_patches *p = j->patches;
    double *L = j->out->sky + k * IMP__PATCHES;
    if (!(h->diffuse_illuminance > 0)) {
        for (int i = 0; i < IMP__PATCHES; i++) L[i] = 0;
        return;
    }
    struct imp__sky_shape s = {.axis = {p->axis[0], p->axis[1], p->axis[2]}};
    const double up = h->sun[2];
    s.sun = sun_of(p, h);
    if (up < 0) { /* it has just set, or is about to rise */
        const imp_v3 level = s.sun - p->axis[2] * up;
        s.sun = imp__length(level) > 1e-9 ? imp__normalize(level) : p->axis[0];
    }
    /* Illuminances alone make a sky, too: a diffuse irradiance below 1 W/m^2 is night's end. */
    imp__perez_shape(&s, &(struct imp__perez_weather){fmax(h->diffuse, 1), h->direct,
                                                      IMP__SOLAR_CONSTANT});
    imp__sky_patches_fill(p, &s, h->diffuse_illuminance, L);
}

static enum imp_status skies_make(size_t first, size_t end, void *payload)
{
    for (size_t k = first; k < end; k++) sky_make(payload, k);
    return IMP_OK;
}

/* ---- The sun's patches ---------------------------------------------------------------- */

static void cells_make(const struct imp__sky_patches *p, struct imp__annual_hours *h)
{
    size_t count[IMP__PATCHES] = {0};
    h->n_cells = 0;
    for (size_t k = 0; k < h->n; k++) {
        h->cell[k] = h->sun[k] > 0 ? imp__sky_patch_of(p, h->to_sun[k]) : -1;
        if (h->cell[k] >= 0) count[h->cell[k]]++;
        else h->sun[k] = 0;
    }
    h->first[0] = 0;
    for (int i = 0; i < IMP__PATCHES; i++) {
        h->cell_of[i] = -1;
        if (!count[i]) continue;
        h->cell_of[i] = h->n_cells;
        h->patch_of[h->n_cells] = i;
        h->first[h->n_cells + 1] = h->first[h->n_cells] + count[i];
        h->n_cells++;
    }
    size_t filled[IMP__PATCHES] = {0};
    for (size_t k = 0; k < h->n; k++) {
        if (h->cell[k] < 0) continue;
        const int c = h->cell[k] = h->cell_of[h->cell[k]];
        const size_t at = h->first[c] + filled[c]++;
        h->suns[at] = h->to_sun[k];
        h->below[at] = h->sun[k] + (at > h->first[c] ? h->below[at - 1] : 0);
    }
}

enum imp_status imp__annual_hours_make(const struct imp__annual *a, size_t n,
                                       const struct imp_weather_hour *hour,
                                       struct imp__annual_hours *out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = a->scene->ctx;
    struct imp__annual_hours h = {.n = 0};
    for (size_t i = 0; i < n; i++) h.n += has_light(&hour[i]);
    if (h.n == 0)
        IMP_TRY(imp__error(ctx, IMP_E_ARG, "none of the %zu hours has any daylight", n));
    h.hour = imp__alloc(ctx, h.n, sizeof *h.hour);
    h.sky = imp__alloc(ctx, h.n * IMP__PATCHES, sizeof *h.sky);
    h.sun = imp__alloc(ctx, h.n, sizeof *h.sun);
    h.to_sun = imp__alloc(ctx, h.n, sizeof *h.to_sun);
    h.cell = imp__alloc(ctx, h.n, sizeof *h.cell);
    h.suns = imp__alloc(ctx, h.n, sizeof *h.suns);
    h.below = imp__alloc(ctx, h.n, sizeof *h.below);
    if (!h.hour || !h.sky || !h.sun || !h.to_sun || !h.cell || !h.suns || !h.below)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for %zu skies", h.n));
    for (size_t i = 0, k = 0; i < n; i++) {
        if (!has_light(&hour[i])) continue;
        h.hour[k] = i;
        h.to_sun[k] = sun_of(&a->patches, &hour[i]);
        h.sun[k++] = has_sun(&hour[i]) ? hour[i].direct_illuminance : 0;
    }
    cells_make(&a->patches, &h);
    struct job j = {&a->patches, hour, &h};
    IMP_TRY(imp__parallel_ranges(ctx, h.n, 64, skies_make, &j));
    *out = h;
    h = (struct imp__annual_hours){.n = 0};
out:
    imp__annual_hours_free(ctx, &h);
    return st;
}

void imp__annual_hours_free(imp_context *ctx, struct imp__annual_hours *h)
{
    imp__release(ctx, h->hour);
    imp__release(ctx, h->sky);
    imp__release(ctx, h->sun);
    imp__release(ctx, h->to_sun);
    imp__release(ctx, h->cell);
    imp__release(ctx, h->suns);
    imp__release(ctx, h->below);
}

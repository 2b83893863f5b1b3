/* SPDX-License-Identifier: Apache-2.0
 *
 * Hero wavelength and companions from one uniform number, and the sensor's responses at them. */
#include "wavelength.h"
#include "base/compiler.h"
#include "cie.h"
#include "math/hash.h"
#include "rgb.h"

/* Wavelength at u of the distribution, and its density per nm. */
static double draw(const struct imp_wavelengths *w, double u, double *density)
{
    int lo = 0, hi = w->n_bins; /* cdf[lo] <= u < cdf[hi] */
    while (hi - lo > 1) {
        const int middle = (lo + hi) / 2;
        if (w->cdf[middle] <= u) lo = middle;
        else hi = middle;
    }
    const double p = w->cdf[lo + 1] - w->cdf[lo], bin = (w->hi - w->lo) / w->n_bins;
    *density = p / bin;
    return w->lo + bin * (lo + (u - w->cdf[lo]) / p);
}

void imp__waves_response(const struct imp_waves *waves,
                         const struct imp_spectrum *response, imp_spec *weight)
{
    imp_spec r;
    imp__spectrum_lanes(response, waves->carried.nm, &r);
    *weight = r / waves->density;
    for (int j = waves->carried.n; j < 4; j++) (*weight)[j] = 0;
}

/* Four, uniformly: no branch goes by the draw. */
static void four_even(const struct imp_wavelengths *w, double u, struct imp_waves *out)
{
    const double range = w->hi - w->lo;
    const imp_spec zero = {0}, at = u + (imp_spec){0, .25, .5, .75},
                   over =
                       (imp_spec)((__typeof__(at >= zero))(zero + 1) & (at >= zero + 1)),
                   nm = w->lo + (at - over) * range;
    for (int j = 0; j < 4; j++) out->carried.nm[j] = nm[j];
    out->density = zero + 1 / range * 4;
}

static void some(const struct imp_wavelengths *w, double u, struct imp_waves *out)
{
    const int n = w->lanes;
    const double range = w->hi - w->lo;
    double p = 1 / range;
    out->density = (imp_spec){1, 1, 1, 1};
    for (int j = 0; j < n; j++) {
        double at = u + (double)j / n;
        if (at >= 1) at -= 1;
        out->carried.nm[j] = w->cdf ? draw(w, at, &p) : w->lo + at * range;
        out->density[j] = p * n;
    }
    for (int j = n; j < 4; j++) out->carried.nm[j] = out->carried.nm[0];
}

void imp__waves_make(const struct imp_wavelengths *w, double u, struct imp_waves *out)
{
    const int n = w->lanes;
    out->carried.n = n;
    out->n_channels = imp_min(w->n_channels, IMP_CHANNELS_MAX);
    if (imp_likely(n == 4 && !w->cdf)) four_even(w, u, out);
    else some(w, u, out);
    if (!w->one_grid) {
        for (int c = 0; c < out->n_channels; c++)
            imp__waves_response(out, &w->response[c], &out->channel[c]);
        return;
    }
    const struct imp__even_place at =
        imp__spectrum_place(&w->response[0], out->carried.nm);
    for (int c = 0; c < out->n_channels; c++) {
        out->channel[c] = imp__spectrum_there(&w->response[c], &at) / out->density;
        for (int j = n; j < 4; j++) out->channel[c][j] = 0;
    }
}

bool imp__responses_share_grid(const struct imp_wavelengths *w)
{
    const struct imp_spectrum *first = w->response;
    for (int c = 0; c < imp_min(w->n_channels, IMP_CHANNELS_MAX); c++) {
        const struct imp_spectrum *r = &w->response[c];
        if (!imp__spectrum_is_even(r) || r->lo != first->lo || r->hi != first->hi ||
            r->per_nm != first->per_nm || r->n != first->n)
            return false;
    }
    return w->n_channels > 0;
}

struct imp_spectrum *imp__rgb_responses(struct imp_arena *arena)
{
    double nm[IMP_CIE_N], value[3][IMP_CIE_N];
    struct imp_spectrum *out = imp__arena_take(arena, 3, sizeof *out);
    for (int q = 0; q < IMP_CIE_N; q++) {
        double xyz[3], rgb[3];
        nm[q] = IMP_CIE_FIRST_NM + IMP_CIE_STEP_NM * q;
        for (int c = 0; c < 3; c++) xyz[c] = imp__cie_xyz[c][q] / IMP_CIE_Y_INTEGRAL;
        imp__xyz_to_rgb(xyz, rgb);
        for (int c = 0; c < 3; c++) value[c][q] = rgb[c];
    }
    for (int c = 0; out && c < 3; c++) {
        const struct imp_spectrum *s =
            imp__spectrum_make(arena, IMP_SPECTRUM_POINTS, IMP_CIE_N, nm, value[c]);
        if (!s) return NULL;
        out[c] = *s;
    }
    return out;
}

uint64_t imp__wavelengths_hash(uint64_t h, const struct imp_wavelengths *w)
{
    h = imp__hash(h, &w->lanes, sizeof w->lanes);
    h = imp__hash(h, &w->lo, sizeof w->lo);
    h = imp__hash(h, &w->hi, sizeof w->hi);
    for (int k = 0; w->cdf && k <= w->n_bins; k++) { /* computed: rounded */
        const float f = (float)w->cdf[k];
        h = imp__hash(h, &f, sizeof f);
    }
    for (int c = 0; c < w->n_channels; c++) {
        const struct imp_spectrum *r = &w->response[c];
        for (size_t i = 0; i < r->n; i++) {
            const float f = (float)r->value[i];
            h = imp__hash(h, &f, sizeof f);
        }
        for (double nm = w->lo; r->times && nm <= w->hi; nm += 1) {
            const float f = (float)imp__spectrum_value(r->times, nm);
            h = imp__hash(h, &f, sizeof f);
        }
    }
    return h;
}

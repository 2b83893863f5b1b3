/* SPDX-License-Identifier: Apache-2.0
 *
 * Values, derivatives and bounds of spectra at wavelengths: interpolated samples, Planck's law,
 * Sellmeier's and Cauchy's formulas, lifted colours; their colour under the CIE curves. */
#include "spectrum.h"
#include "base/compiler.h"
#include "cie.h"
#include "rgb.h"
#include <string.h>

/* ---- Forms ----------------------------------------------------------------------- */

/* The sample at or below nm, which lies within the samples, and how far nm is beyond. */
static size_t points_find(const struct imp_spectrum *s, double nm, double *part)
{
    size_t lo = 0, hi = s->n - 1; /* nm[lo] <= nm <= nm[hi] */
    if (imp_likely(s->per_nm > 0)) {
        const double at = (nm - s->nm[0]) * s->per_nm;
        lo = imp_min((size_t)at, s->n - 2);
        *part = at - (double)lo;
        return lo;
    }
    while (hi - lo > 1) {
        const size_t middle = (lo + hi) / 2;
        if (s->nm[middle] <= nm) lo = middle;
        else hi = middle;
    }
    *part = (nm - s->nm[lo]) / (s->nm[hi] - s->nm[lo]);
    return lo;
}

/* Planck's law per wavelength; L = c1 / (l^5 (exp(c2/(l T)) - 1)), with the constants of
 * docs/scene-format.md 2.4. */
static double planck(double nm, double T, double *d_T)
{
    const double c = 2.99792458e8, h = 6.62607004e-34, k = 1.38064852e-23;
    const double l = nm * 1e-9, c1 = 2 * h * c * c, x = h * c / (l * k * T);
    const double e = expm1(x), L = c1 / (l * l * l * l * l * e) * 1e-9;
    *d_T = x > 700 ? 0 : L * (e + 1) / e * x / T;
    return L;
}

static double sellmeier(const double *c, int terms, double nm, double *d)
{
    const double l2 = nm * nm * 1e-6;
    double n2 = 1;
    for (int k = 0; k < terms; k++) n2 += c[k] * l2 / (l2 - c[terms + k]);
    const double n = n2 > 0 ? sqrt(n2) : NAN;
    for (int k = 0; k < terms; k++) {
        const double r = 1 / (l2 - c[terms + k]);
        d[k] = 0.5 * l2 * r / n;
        d[terms + k] = 0.5 * c[k] * l2 * r * r / n;
    }
    return n;
}

static double form_value(const struct imp_spectrum *s, double nm)
{
    double part, d[IMP_SPECTRUM_NUMBERS];
    switch (s->form) {
    case IMP_SPECTRUM_POINTS: {
        const size_t k = points_find(s, nm, &part);
        return s->value[k] + part * (s->value[k + 1] - s->value[k]);
    }
    case IMP_SPECTRUM_NUMBER: return s->value[0];
    case IMP_SPECTRUM_COLOR: return imp__lifted_value(&s->lifted, nm);
    case IMP_SPECTRUM_BLACKBODY: return planck(nm, s->value[0], d);
    case IMP_SPECTRUM_SELLMEIER: return sellmeier(s->value, (int)s->n / 2, nm, d);
    case IMP_SPECTRUM_CAUCHY: {
        const double per = 1e6 / (nm * nm);
        return s->value[0] + per * (s->value[1] + per * s->value[2]);
    }
    }
    return 0;
}

static double form_at(const struct imp_spectrum *s, double nm,
                      struct imp__spectrum_at *out)
{
    double part;
    out->first = 0;
    out->n = (int)s->n;
    switch (s->form) {
    case IMP_SPECTRUM_POINTS:
        out->first = points_find(s, nm, &part);
        out->n = 2;
        out->d[0] = 1 - part;
        out->d[1] = part;
        return s->value[out->first] +
               part * (s->value[out->first + 1] - s->value[out->first]);
    case IMP_SPECTRUM_NUMBER: out->d[0] = 1; return s->value[0];
    case IMP_SPECTRUM_COLOR: return imp__lifted_value_d(&s->lifted, nm, out->d);
    case IMP_SPECTRUM_BLACKBODY: return planck(nm, s->value[0], out->d);
    case IMP_SPECTRUM_SELLMEIER: return sellmeier(s->value, (int)s->n / 2, nm, out->d);
    case IMP_SPECTRUM_CAUCHY:
        out->d[0] = 1;
        out->d[1] = 1e6 / (nm * nm);
        out->d[2] = out->d[1] * out->d[1];
        return form_value(s, nm);
    }
    return 0;
}

/* ---- Values ---------------------------------------------------------------------- */

static double factor(const struct imp_spectrum *s, double nm)
{
    double f = 1;
    if (s->times) f *= imp__spectrum_value(s->times, nm);
    if (s->over) f /= imp__spectrum_value(s->over, nm);
    return f;
}

double imp__spectrum_value(const struct imp_spectrum *s, double nm)
{
    if (!(nm >= s->lo && nm <= s->hi)) return 0;
    const double v = form_value(s, nm);
    return imp_likely(!s->times && !s->over) ? v : v * factor(s, nm);
}

void imp__spectrum_lanes_any(const struct imp_spectrum *s, const double nm[4],
                             imp_spec *value)
{
    const bool alone = !s->times && !s->over;
    if (s->form == IMP_SPECTRUM_NUMBER && alone) {
        for (int j = 0; j < 4; j++) (*value)[j] = s->value[0];
    } else if (s->form == IMP_SPECTRUM_COLOR && alone) {
        imp__lifted_lanes(&s->lifted, nm, value);
    } else {
        for (int j = 0; j < 4; j++)
            (*value)[j] =
                j > 0 && nm[j] == nm[0] ? (*value)[0] : imp__spectrum_value(s, nm[j]);
        return;
    }
    for (int j = 0; j < 4; j++)
        if (!(nm[j] >= s->lo && nm[j] <= s->hi)) (*value)[j] = 0;
}

void imp__spectrum_at(const struct imp_spectrum *s, double nm,
                      struct imp__spectrum_at *out)
{
    if (!(nm >= s->lo && nm <= s->hi)) {
        out->value = 0;
        out->n = 0;
        return;
    }
    out->value = form_at(s, nm, out);
    if (imp_likely(!s->times && !s->over)) return;
    const double f = factor(s, nm);
    out->value *= f;
    for (int k = 0; k < out->n; k++) out->d[k] *= f;
}

/* Formulas have no simple bound: they are smooth, and sampled every nm. */
static double formula_most(const struct imp_spectrum *s)
{
    const double lo = imp_max(s->lo, IMP_CIE_FIRST_NM - 100),
                 hi = imp_min(s->hi, IMP_CIE_LAST_NM + 300);
    double most = 0;
    for (double nm = lo; nm <= hi; nm += 1) most = fmax(most, form_value(s, nm));
    return fmax(most, form_value(s, hi)) * 1.001;
}

double imp__spectrum_most(const struct imp_spectrum *s)
{
    double most = 0;
    switch (s->form) {
    case IMP_SPECTRUM_POINTS:
        for (size_t k = 0; k < s->n; k++) most = fmax(most, s->value[k]);
        break;
    case IMP_SPECTRUM_NUMBER: most = fmax(s->value[0], 0); break;
    case IMP_SPECTRUM_COLOR: most = imp__lifted_most(&s->lifted); break;
    case IMP_SPECTRUM_BLACKBODY:
    case IMP_SPECTRUM_SELLMEIER:
    case IMP_SPECTRUM_CAUCHY: most = formula_most(s); break;
    }
    if (s->times) most *= imp__spectrum_most(s->times);
    if (s->over) { /* of numbers and indices */
        double least = INFINITY;
        for (double nm = IMP_CIE_FIRST_NM; nm <= IMP_CIE_LAST_NM; nm += 1)
            least = fmin(least, imp__spectrum_value(s->over, nm));
        most /= least;
    }
    return most;
}

void imp__spectrum_update(struct imp_spectrum *s)
{
    if (s->form != IMP_SPECTRUM_COLOR) return;
    if (s->linear) imp__lift_linear(s->value, !s->emission && !s->extinction, &s->lifted);
    else if (s->extinction) imp__lift_extinction(s->value, &s->lifted);
    else if (s->emission) imp__lift_unbounded(s->value, &s->lifted);
    else imp__lift_reflectance(s->value, &s->lifted);
}

/* ---- Daylight -------------------------------------------------------------------- */

static const double daylight_first = IMP_CIE_FIRST_NM; /* where the step is known */
static const double daylight_scale = IMP_CIE_D65_SCALE;
static const struct imp_spectrum daylight_unit = {
    .form = IMP_SPECTRUM_NUMBER, .n = 1, .value = &daylight_scale, .hi = INFINITY};
const struct imp_spectrum imp__daylight = {.form = IMP_SPECTRUM_POINTS,
                                           .n = IMP_CIE_N,
                                           .value = imp__cie_d65,
                                           .nm = &daylight_first,
                                           .per_nm = 1 / IMP_CIE_STEP_NM,
                                           .lo = IMP_CIE_FIRST_NM,
                                           .hi = IMP_CIE_LAST_NM,
                                           .over = &daylight_unit};

/* A power of two: nothing is rounded. */
static const double wavelength_ends[2] = {0, 131072};
const struct imp_spectrum imp__wavelength = {.form = IMP_SPECTRUM_POINTS,
                                             .n = 2,
                                             .value = wavelength_ends,
                                             .nm = wavelength_ends,
                                             .per_nm = 1. / 131072,
                                             .hi = 131072};

/* ---- Colour ---------------------------------------------------------------------- */

void imp__spectrum_color(const struct imp_spectrum *s, bool daylight, double rgb[3])
{
    enum { POINTS = 1000 }; /* those of imp__spectrum_to_rgb */
    double nm[POINTS], value[POINTS];
    if (s->form == IMP_SPECTRUM_POINTS && !s->times && !s->over) {
        imp__spectrum_to_rgb(s->n, s->nm, s->value, daylight, rgb);
        return;
    }
    for (int i = 0; i < POINTS; i++) {
        nm[i] =
            IMP_CIE_FIRST_NM + (IMP_CIE_LAST_NM - IMP_CIE_FIRST_NM) * i / (POINTS - 1);
        value[i] = imp__spectrum_value(s, nm[i]);
    }
    imp__spectrum_to_rgb(POINTS, nm, value, daylight, rgb);
}

bool imp__spectrum_color_prepare(struct imp_arena *arena, bool daylight,
                                 struct imp_spectrum *s)
{
    enum { POINTS = 1000 };
    const double range = IMP_CIE_LAST_NM - IMP_CIE_FIRST_NM;
    if (s->color_d) return true;
    double *d = imp__arena_array(arena, s->n * 3, sizeof *d);
    if (!d) return false;
    for (int i = 0; i < POINTS && s->form != IMP_SPECTRUM_COLOR; i++) {
        const double nm = IMP_CIE_FIRST_NM + range * i / (POINTS - 1);
        const double light =
            daylight ? imp__cie_lookup(imp__cie_d65, nm) / IMP_CIE_D65_SCALE : 1;
        struct imp__spectrum_at at;
        double xyz[3], rgb[3];
        imp__spectrum_at(s, nm, &at);
        for (int c = 0; c < 3; c++)
            xyz[c] = light * imp__cie_lookup(imp__cie_xyz[c], nm) * range / POINTS /
                     IMP_CIE_Y_INTEGRAL;
        imp__xyz_to_rgb(xyz, rgb);
        for (int k = 0; k < at.n; k++)
            for (size_t c = 0; c < 3; c++)
                d[3 * (at.first + (size_t)k) + c] += at.d[k] * rgb[c];
    }
    for (size_t k = 0; k < s->n && s->form == IMP_SPECTRUM_COLOR; k++) d[4 * k] = 1;
    s->color_d = d;
    return true;
}

/* ---- Making ---------------------------------------------------------------------- */

/* 1/step of equidistant wavelengths, or 0. */
static double per_step(size_t n, const double *nm)
{
    const double step = (nm[n - 1] - nm[0]) / (double)(n - 1);
    for (size_t i = 1; i < n; i++)
        if (fabs(nm[i] - (nm[0] + step * (double)i)) > 1e-12 * nm[n - 1]) return 0;
    return 1 / step;
}

struct imp_spectrum *imp__spectrum_make(struct imp_arena *arena,
                                        enum imp__spectrum_form form, size_t n,
                                        const double *nm, const double *value)
{
    struct imp_spectrum *s = imp__arena_take(arena, 1, sizeof *s);
    double *numbers = imp__arena_take(arena, nm ? 2 * n : n, sizeof *numbers);
    if (!s || !numbers) return NULL;
    memcpy(numbers, value, n * sizeof *value);
    if (nm) memcpy(numbers + n, nm, n * sizeof *nm);
    *s = (struct imp_spectrum){.form = form, .n = n, .value = numbers, .own = numbers};
    s->lo = nm ? nm[0] : 0;
    s->hi = nm ? nm[n - 1] : INFINITY;
    if (!nm) return s;
    s->nm = numbers + n;
    s->per_nm = per_step(n, nm);
    return s;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * A film of wavelength bins of equal width: its channels are means of spectral radiance,
 *
 *     L_k = 1/w int over bin k of L dl,      w = (to - from)/n,
 *
 * with names of the OpenEXR layout for spectral images (format/exr_spectral.h): S0 and the
 * wavelength in the middle. */
#include "base/number.h"
#include "color/color_set.h"
#include "color/spectrum.h"
#include "sensor_film.h"
#include <stdio.h>
#include <string.h>

/* "from, to, n" */
static bool bins_read(const char *text, double *from, double *to, int64_t *n)
{
    const char *s = text, *end = text + strlen(text);
    double *const range[2] = {from, to};
    for (int i = 0; i < 2; i++) {
        s += strspn(s, " ");
        if (!imp__number(&s, end, range[i])) return false;
        s += strspn(s, " ");
        if (*s++ != ',') return false;
    }
    s += strspn(s, " ");
    if (!imp__integer(&s, end, n)) return false;
    return s[strspn(s, " ")] == 0;
}

enum imp_status imp__film_bins_build(const struct imp_build *b, const char *text,
                                     struct imp_film_desc *f)
{
    double from, to;
    int64_t n;
    if (!bins_read(text, &from, &to, &n) || !(from > 0) || !(to > from) || !(to <= 1e5) ||
        n < 1 || n > IMP_RESPONSES_MAX)
        return imp_build_error(b, "bins", IMP_E_SCENE,
                               "bins '%s' are no wavelengths from, to in nm and number "
                               "of bins (1 to %d), as in '400, 700, 30'",
                               text, IMP_RESPONSES_MAX);
    if (to < IMP_LIGHT_FIRST_NM)
        return imp_build_error(b, "bins", IMP_E_SCENE,
                               "bins are in nm: %g to %g nm is no light (micrometres?)",
                               from, to);
    const double w = (to - from) / (double)n;
    struct imp_spectrum *curve = imp__arena_array(b->arena, (size_t)n, sizeof *curve);
    const char **names = imp__arena_array(b->arena, (size_t)n, sizeof *names);
    bool room = curve && names;
    for (int k = 0; room && k < n; k++) {
        /* Linear in between and 0 outside: two equal points are a box. */
        const double ends[2] = {from + k * w, from + (k + 1) * w};
        const double value[2] = {1 / w, 1 / w};
        const struct imp_spectrum *box =
            imp__spectrum_make(b->arena, IMP_SPECTRUM_POINTS, 2, ends, value);
        char name[40];
        snprintf(name, sizeof name, "S0.%.9gnm", from + (k + 0.5) * w);
        names[k] = imp__arena_strdup(b->arena, name);
        room = box && names[k];
        if (room) curve[k] = *box;
    }
    if (!room) return imp__error(b->ctx, IMP_E_NOMEM, "out of memory");
    f->n_responses = (int)n;
    f->response = curve;
    f->response_name = names;
    return IMP_OK;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * EULUMDAT: one value a line, in a fixed order; decimal commas occur.
 *
 *    1  company                          13-15  length, width, height of the luminaire, mm
 *    2  type (1 to 3)                    16-21  the same of the luminous opening; its height
 *    3  symmetry: 0 none, 1 about the           at C0, C90, C180, C270
 *       axis, 2 about C0-C180, 3 about   22     downward flux, %
 *       C90-C270, 4 both                 23     light output ratio, %
 *    4  Mc, C-planes of the circle       24     factor of the intensities
 *    5  Dc, degrees between them         25     tilt during the measurement
 *    6  Ng, angles of each               26     n, sets of lamps; of each a to f: lamps, type,
 *    7  Dg, degrees between them                flux (lm), colour, rendering, watts
 *    8-12 texts                          then   ten direct ratios, Mc angles C, Ng angles
 *                                               gamma, intensities in cd/klm by planes
 *
 * The file has the planes that its symmetry leaves: Mc; 1; Mc/2 + 1 from C0; Mc/2 + 1 from
 * C270 over C0 to C90; Mc/4 + 1. Gamma is the vertical angle from nadir of LM-63's type C.
 * A negative number of lamps is absolute photometry: the flux is the luminaire's. */
#include "ldt_file.h"
#include "base/number.h"
#include "ies_file.h"
#include "kind/emitter/ies.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define NUMBER_MAX 1e12
#define SETS_MAX   20

struct lines {
    imp_context *ctx;
    const char *name, *at, *end;
    int line;
};

static enum imp_status IMP_PRINTF(2, 3)
    fail(const struct lines *r, const char *format, ...)
{
    char text[256];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return imp__error(r->ctx, IMP_E_SCENE, "%s:%d: %s", r->name, r->line, text);
}

/* The next line; false at the end of the file. */
static bool next(struct lines *r, const char **line, size_t *n)
{
    if (r->at == r->end || *r->at == '\x1a') return false;
    const char *p = r->at;
    while (p < r->end && *p != '\n' && *p != '\r') p++;
    *line = r->at;
    *n = (size_t)(p - r->at);
    if (p < r->end) p += p + 1 < r->end && p[0] == '\r' && p[1] == '\n' ? 2 : 1;
    r->at = p;
    r->line++;
    return true;
}

static enum imp_status pass(struct lines *r, const char *what)
{
    const char *line;
    size_t n;
    return next(r, &line, &n) ? IMP_OK : fail(r, "the file ends before %s", what);
}

/* A number alone on its line. */
static enum imp_status number(struct lines *r, const char *what, double lo, double hi,
                              double *out)
{
    const char *line;
    char text[64];
    size_t n;
    if (!next(r, &line, &n)) return fail(r, "the file ends before %s", what);
    while (n > 0 && (line[n - 1] == ' ' || line[n - 1] == '\t')) n--;
    while (n > 0 && (*line == ' ' || *line == '\t')) line++, n--;
    if (n == 0 || n >= sizeof text) return fail(r, "%s: not a number", what);
    for (size_t k = 0; k < n; k++) text[k] = line[k] == ',' ? '.' : line[k];
    const char *at = text;
    double x;
    if (!imp__number(&at, text + n, &x) || at != text + n)
        return fail(r, "%s: not a number", what);
    if (!(x >= lo && x <= hi))
        return fail(r, "%s is %g, not in [%g, %g]", what, x, lo, hi);
    *out = x;
    return IMP_OK;
}
static enum imp_status whole(struct lines *r, const char *what, int lo, int hi, int *out)
{
    double x = 0;
    const enum imp_status st = number(r, what, lo, hi, &x);
    if (st != IMP_OK) return st;
    if (x != floor(x)) return fail(r, "%s is %g, not whole", what, x);
    *out = (int)x;
    return IMP_OK;
}

/* ---- The head ---------------------------------------------------------------------- */

struct head {
    int symmetry, planes, angles;
    double output_ratio, factor, flux; /* %; of the intensities; lm */
    bool absolute;
};

static enum imp_status opening(struct lines *r, struct imp_ies_data *d)
{
    enum imp_status st = IMP_OK;
    double side[2], height[4];
    static const char *const luminaire[] = {"the length", "the width", "the height"};
    static const char *const heights[] = {
        "the height of the opening at C0", "the height of the opening at C90",
        "the height of the opening at C180", "the height of the opening at C270"};
    double passed;
    for (int k = 0; k < 3; k++) IMP_TRY(number(r, luminaire[k], 0, NUMBER_MAX, &passed));
    IMP_TRY(number(r, "the length of the opening", 0, NUMBER_MAX, &side[0]));
    IMP_TRY(number(r, "the width of the opening", 0, NUMBER_MAX, &side[1]));
    for (int k = 0; k < 4; k++) IMP_TRY(number(r, heights[k], 0, NUMBER_MAX, &height[k]));
    /* The length lies along C90, across the plane C0. Width 0: a round opening, which becomes the
     * square of its area. */
    const double round = side[1] > 0 ? 1 : sqrt(atan(1));
    d->size[0] = (side[1] > 0 ? side[1] : side[0]) / 1000 * round;
    d->size[1] = side[0] / 1000 * round;
    d->size[2] = fmax(fmax(height[0], height[1]), fmax(height[2], height[3])) / 1000;
out:
    return st;
}

static enum imp_status lamps(struct lines *r, struct head *h, struct imp_ies_data *d)
{
    enum imp_status st = IMP_OK;
    int sets = 0;
    IMP_TRY(whole(r, "the number of sets of lamps", 1, SETS_MAX, &sets));
    for (int k = 0; k < sets; k++) {
        double count = 0, flux = 0, watts = 0;
        IMP_TRY(number(r, "the number of lamps", -NUMBER_MAX, NUMBER_MAX, &count));
        IMP_TRY(pass(r, "the type of lamps"));
        IMP_TRY(number(r, "the flux of the lamps", 0, NUMBER_MAX, &flux));
        IMP_TRY(pass(r, "the colour of the lamps"));
        IMP_TRY(pass(r, "the colour rendering"));
        IMP_TRY(number(r, "watts", 0, NUMBER_MAX, &watts));
        if (k > 0) continue;
        h->absolute = count < 0;
        h->flux = flux;
        d->watts = watts;
    }
out:
    return st;
}

static enum imp_status head_read(struct lines *r, struct head *h, struct imp_ies_data *d)
{
    enum imp_status st = IMP_OK;
    int type;
    double passed;
    IMP_TRY(pass(r, "the company"));
    IMP_TRY(whole(r, "the type", 0, 3, &type));
    IMP_TRY(whole(r, "the symmetry", 0, 4, &h->symmetry));
    IMP_TRY(whole(r, "the number of C-planes", 1, IMP_IES_ANGLES_MAX, &h->planes));
    IMP_TRY(number(r, "the angle between C-planes", 0, 360, &passed));
    IMP_TRY(whole(r, "the number of angles", 2, IMP_IES_ANGLES_MAX, &h->angles));
    IMP_TRY(number(r, "the angle between angles", 0, 180, &passed));
    for (int k = 0; k < 5; k++) IMP_TRY(pass(r, "the names"));
    IMP_TRY(opening(r, d));
    IMP_TRY(number(r, "the downward flux", 0, 100.5, &passed));
    IMP_TRY(number(r, "the light output ratio", 0, NUMBER_MAX, &h->output_ratio));
    IMP_TRY(number(r, "the factor of the intensities", 0, NUMBER_MAX, &h->factor));
    IMP_TRY(number(r, "the tilt", -360, 360, &passed));
    IMP_TRY(lamps(r, h, d));
    for (int k = 0; k < 10; k++)
        IMP_TRY(number(r, "a direct ratio", -NUMBER_MAX, NUMBER_MAX, &passed));
    if ((h->symmetry >= 2 && h->planes % 2) || (h->symmetry >= 3 && h->planes % 4))
        IMP_TRY(fail(r, "%d C-planes cannot have symmetry %d", h->planes, h->symmetry));
out:
    return st;
}

/* ---- The table --------------------------------------------------------------------- */

static enum imp_status ascending(struct lines *r, const char *what, int n, double hi,
                                 double *out)
{
    for (int k = 0; k < n; k++) {
        const enum imp_status st = number(r, what, 0, hi, &out[k]);
        if (st != IMP_OK) return st;
        if (k > 0 && !(out[k] > out[k - 1]))
            return fail(r, "%s %g does not come after %g", what, out[k], out[k - 1]);
    }
    return IMP_OK;
}

/* Planes that the file has, the first of them, and those of our table. */
struct span {
    int first, n; /* of the file's, by their number in the circle */
    int made;     /* horizontal angles of the table */
};

static struct span span_of(const struct head *h)
{
    switch (h->symmetry) {
    case 1: return (struct span){0, 1, 1};
    case 2: return (struct span){0, h->planes / 2 + 1, h->planes / 2 + 1};
    case 3: return (struct span){3 * h->planes / 4, h->planes / 2 + 1, h->planes / 2 + 1};
    case 4: return (struct span){0, h->planes / 4 + 1, h->planes / 4 + 1};
    default: return (struct span){0, h->planes, h->planes == 1 ? 1 : h->planes + 1};
    }
}

/* The planes' angles as LM-63 has them: the circle is closed by 360, and symmetry about C90-C270
 * takes 180 - C, of C from 90 down to -90, in place of C. */
static enum imp_status turns(struct lines *r, const struct head *h, const struct span *s,
                             const double *c, double *out)
{
    static const double last[] = {360, 0, 180, 270, 90};
    const bool about_90 = h->symmetry == 3;
    for (int k = 0; k < s->made; k++) {
        const int from = about_90 ? s->n - 1 - k : k, plane = s->first + from;
        const double at = plane == h->planes ? c[0] + 360 : c[plane % h->planes];
        out[k] = !about_90            ? at
                 : plane >= h->planes ? 180 - c[plane - h->planes]
                                      : 540 - c[plane];
    }
    const double begin = about_90 ? 90 : 0, end = s->made == 1 ? 0 : last[h->symmetry];
    if (fabs(out[0] - begin) > 1e-6 || fabs(out[s->made - 1] - end) > 1e-6)
        return fail(r,
                    "the C-planes of symmetry %d go from %g to %g, in place of %g to %g",
                    h->symmetry, out[0], out[s->made - 1], begin, end);
    for (int k = 1; k < s->made; k++)
        if (!(out[k] > out[k - 1])) return fail(r, "the C-planes do not ascend");
    out[0] = begin;
    out[s->made - 1] = end;
    return IMP_OK;
}

static void contradictions_tell(const struct lines *r, const struct head *h,
                                const struct imp_ies_data *d)
{
    const double table = imp__ies_flux(&(struct imp__ies){.data = d, .factor = 1});
    const double says = h->flux * h->output_ratio / 100;
    if (h->flux > 0 && h->output_ratio > 0 && fabs(table - says) > IMP_IES_OFF_MAX * says)
        imp__warn(
            r->ctx,
            "%s: its intensities are %.4g lm, and its lamps of %.4g lm with a light "
            "output ratio of %.4g %% would give %.4g lm; the intensities count",
            r->name, table, h->flux, h->output_ratio, says);
}

static enum imp_status parse(struct lines *r, struct imp_arena *keep,
                             struct imp_ies_data *d)
{
    enum imp_status st = IMP_OK;
    struct head h = {0};
    IMP_TRY(head_read(r, &h, d));
    const struct span s = span_of(&h);
    const size_t n_c = (size_t)h.planes, n_v = (size_t)h.angles, n_h = (size_t)s.made;
    /* A number takes a digit and a line's end: no memory for what cannot be in the file. */
    if (n_c + n_v + (size_t)s.n * n_v > (size_t)(r->end - r->at) / 2 + 1)
        IMP_TRY(fail(r, "%d x %d intensities, but the file has %zu bytes more", s.n,
                     h.angles, (size_t)(r->end - r->at)));
    double *c = imp__arena_take(keep, n_c, sizeof *c);
    double *v = imp__arena_take(keep, n_v, sizeof *v);
    double *t = imp__arena_take(keep, n_h, sizeof *t);
    double *cd = imp__arena_take(keep, n_v * n_h, sizeof *cd);
    if (!c || !v || !t || !cd)
        IMP_TRY(imp__error(r->ctx, IMP_E_NOMEM, "%s: out of memory", r->name));
    IMP_TRY(ascending(r, "a C-plane", h.planes, 360, c));
    IMP_TRY(ascending(r, "an angle", h.angles, 180, v));
    IMP_TRY(turns(r, &h, &s, c, t));
    const double klm = h.flux / 1000 * h.factor;
    for (int k = 0; k < s.n; k++) {
        const int to = h.symmetry == 3 ? s.n - 1 - k : k;
        for (size_t i = 0; i < n_v; i++) {
            double *x = cd + (size_t)to * n_v + i;
            IMP_TRY(number(r, "an intensity", 0, NUMBER_MAX, x));
            *x *= klm;
        }
    }
    if (s.made > s.n) memcpy(cd + (size_t)s.n * n_v, cd, n_v * sizeof *cd);
    d->n_vertical = h.angles;
    d->n_horizontal = s.made;
    d->vertical = v;
    d->horizontal = t;
    d->candela = cd;
    d->type = IMP_PHOTOMETRY_C;
    d->lamp_flux = h.absolute ? 0 : h.flux;
    if (h.flux == 0)
        imp__warn(r->ctx, "%s: its lamps have a flux of 0 lm: it is dark", r->name);
    contradictions_tell(r, &h, d);
out:
    return st;
}

enum imp_status imp__ldt_parse(imp_context *ctx, struct imp_arena *keep, const char *name,
                               const struct imp_bytes *text, struct imp_ies_data *out)
{
    const char *at = (const char *)text->data;
    struct lines r = {.ctx = ctx, .name = name, .at = at, .end = at + text->size};
    struct imp_ies_data d = {0};
    const enum imp_status st = parse(&r, keep, &d);
    if (st == IMP_OK) *out = d;
    return st;
}

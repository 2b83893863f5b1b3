/* SPDX-License-Identifier: Apache-2.0
 *
 * LM-63: label lines, TILT=, then numbers in a fixed order, separated by blanks, commas
 * or line ends:
 *
 *   [lamp-to-luminaire geometry, n, n angles, n multipliers]           if TILT=INCLUDE
 *   lamps, lumens per lamp, candela multiplier, vertical angles, horizontal angles,
 *   photometric type, units, width, length, height
 *   ballast factor, ballast-lamp photometric factor (to 1995; later without meaning),
 *   input watts
 *   vertical angles, horizontal angles, candela: all of one horizontal angle together
 *
 * Types A and B have vertical angles from -90 or 0 to 90, horizontal ones from -90 or 0 to
 * 90. A number of lamps times lumens below 0 is absolute photometry: no lamp is named.
 *
 * TILT=FILE has the numbers of TILT=INCLUDE in a file of their own.
 *
 * Intensity is candela x multiplier x ballast factor (x ballast-lamp factor), as it was measured;
 * what tilted lamps keep of it is for the emitter, whose tilt it is. */
#include "ies_file.h"
#include "base/number.h"
#include "kind/emitter/ies.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define NUMBER_MAX 1e12 /* of any number in a file */
#define TILT_MOST  100  /* of a lamp's flux, tilted over measured */
#define TILTS_MAX  10000
#define FOOT       0.3048 /* m */

struct reader {
    imp_context *ctx;
    const char *name, *at, *end;
    int line;
};

static enum imp_status IMP_PRINTF(3, 4)
    fail(const struct reader *r, enum imp_status status, const char *format, ...)
{
    char text[256];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return imp__error(r->ctx, status, "%s:%d: %s", r->name, r->line, text);
}

/* ---- Lines --------------------------------------------------------------------- */

/* The next line without its end; false at the end of the file. */
static bool next_line(struct reader *r, const char **line, size_t *n)
{
    if (r->at == r->end) return false;
    const char *p = r->at;
    while (p < r->end && *p != '\n' && *p != '\r') p++;
    *line = r->at;
    *n = (size_t)(p - r->at);
    if (p < r->end) p += p + 1 < r->end && p[0] == '\r' && p[1] == '\n' ? 2 : 1;
    r->at = p;
    r->line++;
    while (*n > 0 && ((*line)[*n - 1] == ' ' || (*line)[*n - 1] == '\t')) --*n;
    while (*n > 0 && (**line == ' ' || **line == '\t')) ++*line, --*n;
    return true;
}

static bool begins(const char *line, size_t n, const char *with)
{
    return n >= strlen(with) && memcmp(line, with, strlen(with)) == 0;
}

/* A copy of what stands behind TILT=. */
static enum imp_status tilt_named(struct reader *r, struct imp_arena *keep,
                                  const char *name, size_t n, struct imp_ies_data *d)
{
    if (n == 0)
        return fail(r, IMP_E_SCENE, "TILT= names nothing: NONE, INCLUDE or a file");
    char *text = imp__arena_take(keep, n + 1, 1);
    if (!text) return imp__error(r->ctx, IMP_E_NOMEM, "%s: out of memory", r->name);
    memcpy(text, name, n);
    text[n] = 0;
    d->tilt_file = text;
    return IMP_OK;
}

/* Up to TILT=. *factor: does the ballast-lamp photometric factor count? *tilt: do its numbers follow? */
static enum imp_status labels(struct reader *r, struct imp_arena *keep, bool *factor,
                              bool *tilt, struct imp_ies_data *d)
{
    static const struct {
        const char *name;
        bool factor;
    } versions[] = {{"IESNA86", true},           {"IESNA91", true},
                    {"IESNA:LM-63-1986", true},  {"IESNA:LM-63-1991", true},
                    {"IESNA:LM-63-1995", true},  {"IESNA:LM-63-2002", false},
                    {"IESNA:LM-63-2019", false}, {"IES:LM-63-2019", false}};
    const char *line;
    size_t n;
    *factor = true; /* files of 1986 have no signature */
    if (r->end - r->at >= 3 && memcmp(r->at, "\xef\xbb\xbf", 3) == 0) r->at += 3;
    while (next_line(r, &line, &n)) {
        if (r->line == 1 && (begins(line, n, "IESNA") || begins(line, n, "IES:"))) {
            size_t k = 0;
            while (k < imp_count(versions) && (strlen(versions[k].name) != n ||
                                               memcmp(line, versions[k].name, n) != 0))
                k++;
            if (k == imp_count(versions))
                return fail(r, IMP_E_SCENE, "the format '%.*s' is not known",
                            (int)imp_min(n, (size_t)40), line);
            *factor = versions[k].factor;
        }
        if (!begins(line, n, "TILT=")) continue;
        line += 5, n -= 5;
        while (n > 0 && (*line == ' ' || *line == '\t')) line++, n--;
        *tilt = n == 7 && memcmp(line, "INCLUDE", 7) == 0;
        if (*tilt || (n == 4 && memcmp(line, "NONE", 4) == 0)) return IMP_OK;
        return tilt_named(r, keep, line, n, d);
    }
    return fail(r, IMP_E_SCENE, "the file ends without a line that begins with TILT=");
}

/* ---- Numbers ------------------------------------------------------------------- */

static bool is_gap(char c)
{
    return c == ' ' || c == '\t' || c == ',' || c == '\r' || c == '\n' || c == '\f';
}
/* r->line stays that of the last number, for messages, until there is another. */
static void gap(struct reader *r, int *line)
{
    for (; r->at < r->end && is_gap(*r->at); r->at++) {
        const bool end = *r->at == '\n' ||
                         (*r->at == '\r' && !(r->at + 1 < r->end && r->at[1] == '\n'));
        *line += end;
    }
}

static enum imp_status number(struct reader *r, const char *what, double lo, double hi,
                              double *out)
{
    int line = r->line;
    gap(r, &line);
    if (r->at == r->end || *r->at == '\x1a')
        return fail(r, IMP_E_SCENE, "the file ends before %s", what);
    r->line = line;
    double x;
    if (!imp__number(&r->at, r->end, &x) || (r->at < r->end && !is_gap(*r->at)))
        return fail(r, IMP_E_SCENE, "%s: not a number", what);
    if (!(x >= lo && x <= hi))
        return fail(r, IMP_E_SCENE, "%s is %g, not in [%g, %g]", what, x, lo, hi);
    *out = x;
    return IMP_OK;
}
static enum imp_status whole(struct reader *r, const char *what, int lo, int hi, int *out)
{
    double x = 0;
    const enum imp_status st = number(r, what, lo, hi, &x);
    if (st != IMP_OK) return st;
    if (x != floor(x)) return fail(r, IMP_E_SCENE, "%s is %g, not whole", what, x);
    *out = (int)x;
    return IMP_OK;
}
static enum imp_status angles(struct reader *r, const char *what, double lo, double hi,
                              int n, double *out)
{
    for (int k = 0; k < n; k++) {
        const enum imp_status st = number(r, what, lo, hi, &out[k]);
        if (st != IMP_OK) return st;
        if (k > 0 && !(out[k] > out[k - 1]))
            return fail(r, IMP_E_SCENE, "%s %g does not come after %g", what, out[k],
                        out[k - 1]);
    }
    return IMP_OK;
}

/* The lamp-to-luminaire geometry says how lamps lie in the luminaire; the multipliers are those of the
 * luminaire's tilt with any of them. */
static enum imp_status tilts(struct reader *r, struct imp_arena *keep,
                             struct imp_ies_data *d)
{
    enum imp_status st = IMP_OK;
    int geometry, n = 0;
    IMP_TRY(whole(r, "the lamp-to-luminaire geometry", 1, 3, &geometry));
    IMP_TRY(whole(r, "the number of tilt angles", 1, TILTS_MAX, &n));
    double *tilt = imp__arena_take(keep, (size_t)n, sizeof *tilt);
    double *factor = imp__arena_take(keep, (size_t)n, sizeof *factor);
    if (!tilt || !factor)
        IMP_TRY(imp__error(r->ctx, IMP_E_NOMEM, "%s: out of memory", r->name));
    IMP_TRY(angles(r, "a tilt angle", 0, 180, n, tilt));
    for (int k = 0; k < n; k++)
        IMP_TRY(number(r, "a tilt multiplier", 0, TILT_MOST, &factor[k]));
    d->n_tilts = n;
    d->tilt = tilt;
    d->tilt_factor = factor;
    d->tilt_file = NULL;
out:
    return st;
}

/* Nothing but gaps and an end of file of another age is left. */
static bool at_end(struct reader *r, int *line)
{
    *line = r->line;
    while (gap(r, line), r->at < r->end && *r->at == '\x1a') r->at++;
    return r->at == r->end;
}

/* ---- The file ------------------------------------------------------------------ */

/* The spans that LM-63 has, each with its symmetry. */
static bool span_is_known(enum imp_photometry type, int n, const double *h)
{
    const double last = h[n - 1];
    if (n == 1) return h[0] == 0;
    if (type != IMP_PHOTOMETRY_C) return (h[0] == 0 || h[0] == -90) && last == 90;
    return (h[0] == 0 && (last == 90 || last == 180 || last == 360)) ||
           (h[0] == 90 && last == 270);
}

static bool ascends(int n, const double *x, double lo, double hi)
{
    for (int k = 0; k < n; k++)
        if (!(x[k] >= lo && x[k] <= hi) || (k > 0 && !(x[k] > x[k - 1]))) return false;
    return true;
}
bool imp__ies_is_valid(const struct imp_ies_data *d)
{
    const bool c = d->type == IMP_PHOTOMETRY_C;
    return ascends(d->n_vertical, d->vertical, c ? 0 : -90, c ? 180 : 90) &&
           ascends(d->n_horizontal, d->horizontal, c ? 0 : -90, c ? 360 : 90) &&
           span_is_known(d->type, d->n_horizontal, d->horizontal);
}

#define OPENING_MAX 20 /* m: what is sold is shorter */
static enum imp_status parse(struct reader *r, struct imp_arena *keep,
                             struct imp_ies_data *d)
{
    enum imp_status st = IMP_OK;
    bool has_factor, tilt;
    double multiplier = 0, ballast = 0, lamp = 0, lamps = 0, lumens = 0, size[3];
    int type = 0, units = 1;
    IMP_TRY(labels(r, keep, &has_factor, &tilt, d));
    r->line++; /* the one that begins after TILT= */
    if (tilt) IMP_TRY(tilts(r, keep, d));
    IMP_TRY(number(r, "the number of lamps", -NUMBER_MAX, NUMBER_MAX, &lamps));
    IMP_TRY(number(r, "lumens per lamp", -NUMBER_MAX, NUMBER_MAX, &lumens));
    IMP_TRY(number(r, "the candela multiplier", 0, NUMBER_MAX, &multiplier));
    IMP_TRY(
        whole(r, "the number of vertical angles", 2, IMP_IES_ANGLES_MAX, &d->n_vertical));
    IMP_TRY(whole(r, "the number of horizontal angles", 1, IMP_IES_ANGLES_MAX,
                  &d->n_horizontal));
    IMP_TRY(whole(r, "the photometric type", 1, 3, &type));
    d->type = (enum imp_photometry)(type - 1);
    IMP_TRY(whole(r, "the units type", 1, 2, &units));
    static const char *const sides[] = {"the width", "the length", "the height"};
    for (int k = 0; k < 3; k++)
        IMP_TRY(number(r, sides[k], -NUMBER_MAX, NUMBER_MAX, &size[k]));
    IMP_TRY(number(r, "the ballast factor", 0, NUMBER_MAX, &ballast));
    IMP_TRY(number(r, "the ballast-lamp photometric factor", 0, NUMBER_MAX, &lamp));
    IMP_TRY(number(r, "input watts", -NUMBER_MAX, NUMBER_MAX, &d->watts));
    d->watts = fmax(d->watts, 0);
    d->lamp_flux = fmax(lamps * lumens, 0) * ballast;
    /* Negative sizes are diameters of round openings, which become squares of their area. The
     * length lies along C0. */
    const double metre = units == 1 ? FOOT : 1;
    const double round = size[0] < 0 && size[1] < 0 ? sqrt(atan(1)) : 1;
    d->size[0] = fabs(size[1]) * metre * round;
    d->size[1] = fabs(size[0]) * metre * round;
    d->size[2] = fabs(size[2]) * metre;
    d->length_c0 = true;
    const double factor = multiplier * ballast * (has_factor ? lamp : 1);

    /* A number takes a digit and a gap: no memory for what cannot be in the file. */
    const size_t n_v = (size_t)d->n_vertical, n_h = (size_t)d->n_horizontal;
    if (n_v * n_h + n_v + n_h > (size_t)(r->end - r->at) / 2 + 1)
        IMP_TRY(fail(r, IMP_E_SCENE, "%d x %d angles, but the file has %zu bytes more",
                     d->n_vertical, d->n_horizontal, (size_t)(r->end - r->at)));
    double *v = imp__arena_take(keep, n_v, sizeof *v);
    double *h = imp__arena_take(keep, n_h, sizeof *h);
    double *cd = imp__arena_take(keep, n_v * n_h, sizeof *cd);
    if (!v || !h || !cd)
        IMP_TRY(imp__error(r->ctx, IMP_E_NOMEM, "%s: out of memory", r->name));
    const bool c = d->type == IMP_PHOTOMETRY_C;
    IMP_TRY(angles(r, "a vertical angle", c ? 0 : -90, c ? 180 : 90, d->n_vertical, v));
    IMP_TRY(
        angles(r, "a horizontal angle", c ? 0 : -90, c ? 360 : 90, d->n_horizontal, h));
    if (!c && !span_is_known(d->type, d->n_horizontal, h))
        IMP_TRY(
            fail(r, IMP_E_SCENE,
                 "horizontal angles go from %g to %g: with type %c they may be 0, or go "
                 "from -90 or 0 to 90",
                 h[0], h[d->n_horizontal - 1], type == 2 ? 'B' : 'A'));
    if (!span_is_known(d->type, d->n_horizontal, h))
        IMP_TRY(fail(r, IMP_E_SCENE,
                     "horizontal angles go from %g to %g: they may be 0, or go from 0 to "
                     "90, 180 or 360, or from 90 to 270",
                     h[0], h[d->n_horizontal - 1]));
    for (size_t k = 0; k < n_v * n_h; k++) {
        int line = r->line;
        gap(r, &line);
        if (r->at == r->end || *r->at == '\x1a')
            IMP_TRY(fail(r, IMP_E_SCENE, "the file ends after %zu of %zu candela values",
                         k, n_v * n_h));
        r->line = line;
        IMP_TRY(number(r, "a candela value", 0, NUMBER_MAX, &cd[k]));
        cd[k] *= factor;
    }
    int line;
    if (!at_end(r, &line)) {
        r->line = line;
        IMP_TRY(fail(r, IMP_E_SCENE, "there is more than %d x %d candela values",
                     d->n_vertical, d->n_horizontal));
    }
    d->vertical = v;
    d->horizontal = h;
    d->candela = cd;
    const double table = imp__ies_flux(&(struct imp__ies){.data = d, .factor = 1});
    if (d->lamp_flux > 0 && table > (1 + IMP_IES_OFF_MAX) * d->lamp_flux)
        imp__warn(
            r->ctx,
            "%s: its intensities are %.4g lm, and its lamps give %.4g lm alone; the "
            "intensities count",
            r->name, table, d->lamp_flux);
    const double longest = fmax(fmax(d->size[0], d->size[1]), d->size[2]);
    if (longest > OPENING_MAX)
        imp__warn(r->ctx,
                  "%s: its luminous opening is %.4g m long: LM-63 has %s here, not "
                  "millimetres",
                  r->name, longest, units == 1 ? "feet" : "metres");
out:
    return st;
}

enum imp_status imp__ies_parse(imp_context *ctx, struct imp_arena *keep, const char *name,
                               const struct imp_bytes *text, struct imp_ies_data *out)
{
    const char *at = (const char *)text->data;
    struct reader r = {.ctx = ctx, .name = name, .at = at, .end = at + text->size};
    struct imp_ies_data d = {0};
    const enum imp_status st = parse(&r, keep, &d);
    if (st == IMP_OK) *out = d;
    return st;
}

enum imp_status imp__ies_tilt_parse(imp_context *ctx, struct imp_arena *keep,
                                    const char *name, const struct imp_bytes *text,
                                    struct imp_ies_data *data)
{
    const char *at = (const char *)text->data;
    struct reader r = {
        .ctx = ctx, .name = name, .at = at, .end = at + text->size, .line = 1};
    struct imp_ies_data d = *data;
    enum imp_status st = tilts(&r, keep, &d);
    int line;
    if (st == IMP_OK && !at_end(&r, &line)) {
        r.line = line;
        st = fail(&r, IMP_E_SCENE, "there is more than %d tilt multipliers", d.n_tilts);
    }
    if (st == IMP_OK) *data = d;
    return st;
}

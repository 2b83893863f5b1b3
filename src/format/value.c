/* SPDX-License-Identifier: Apache-2.0
 *
 * Parsers of numbers, booleans, lists, triples and spectra. */
#include "value.h"
#include "base/file.h"
#include "base/number.h"
#include <math.h>
#include <string.h>
#include <strings.h>

#define BLANKS        " \t\r\n"
#define SPD_BYTES_MAX ((size_t)64 << 20)

bool imp__value_float(const char *text, double *out)
{
    const char *s = text + strspn(text, BLANKS), *end = s + strlen(s);
    double v;
    if (!imp__number(&s, end, &v) || s[strspn(s, BLANKS)] || !isfinite(v)) return false;
    *out = v;
    return true;
}

bool imp__value_integer(const char *text, int64_t *out)
{
    const char *s = text + strspn(text, BLANKS), *end = s + strlen(s);
    int64_t v;
    if (!imp__integer(&s, end, &v) || s[strspn(s, BLANKS)]) return false;
    *out = v;
    return true;
}

bool imp__value_bool(const char *text, bool *out)
{
    if (strcasecmp(text, "true") != 0 && strcasecmp(text, "false") != 0) return false;
    *out = strcasecmp(text, "true") == 0;
    return true;
}

int imp__value_list(const char *text, int max, double *out)
{
    int n = 0;
    for (const char *s = text; *(s += strspn(s, "," BLANKS));) {
        const char *end = s + strcspn(s, "," BLANKS);
        if (n == max) return max + 1;
        if (!imp__number(&s, end, &out[n]) || s != end || !isfinite(out[n])) return -1;
        n++;
    }
    return n;
}

bool imp__value_triple(const char *text, double out[3])
{
    double v[3];
    const int n = imp__value_list(text, 3, v);
    if (n != 1 && n != 3) return false;
    for (int i = 0; i < 3; i++) out[i] = v[n == 3 ? i : 0];
    return true;
}

/* Pairs (wavelength, value) as they come; turned into two halves at the end. */
struct pairs {
    double (*at)[2];
    size_t n, capacity;
};

static enum imp_status pairs_add(imp_context *ctx, struct pairs *p, double l, double v)
{
    double(*grown)[2] = imp__grow(ctx, p->at, &p->capacity, p->n + 1, sizeof *grown);
    if (!grown) return imp__error(ctx, IMP_E_NOMEM, "out of memory");
    p->at = grown;
    p->at[p->n][0] = l;
    p->at[p->n++][1] = v;
    return IMP_OK;
}

static enum imp_status pairs_finish(imp_context *ctx, const struct pairs *p,
                                    struct imp_samples *out)
{
    struct imp_samples s = {p->n, imp__alloc(ctx, p->n, 2 * sizeof(double))};
    if (!s.list) return imp__error(ctx, IMP_E_NOMEM, "out of memory");
    for (size_t i = 0; i < p->n; i++) {
        s.list[i] = p->at[i][0];
        s.list[s.n + i] = p->at[i][1];
    }
    const enum imp_status st = imp__samples_check(ctx, &s);
    if (st != IMP_OK) imp__release(ctx, s.list);
    else *out = s;
    return st;
}

enum imp_status imp__samples_check(imp_context *ctx, const struct imp_samples *s)
{
    if (s->n < 2)
        return imp__error(ctx, IMP_E_SCENE, "a spectrum needs at least two wavelengths");
    for (size_t i = 0; i < s->n; i++) {
        if (!isfinite(s->list[i]) || !isfinite(s->list[s->n + i]))
            return imp__error(ctx, IMP_E_SCENE,
                              "sample %zu of the spectrum is not finite", i);
        if (i && !(s->list[i] > s->list[i - 1]))
            return imp__error(ctx, IMP_E_SCENE,
                              "wavelengths must increase: %g nm does not follow %g nm",
                              s->list[i], s->list[i - 1]);
    }
    return IMP_OK;
}

enum imp_status imp__samples_parse(imp_context *ctx, const char *text,
                                   struct imp_samples *out)
{
    enum imp_status st = IMP_OK;
    struct pairs p = {0};
    for (const char *s = text; *(s += strspn(s, "," BLANKS));) {
        const char *start = s, *end = s + strcspn(s, "," BLANKS);
        double l, v;
        if (!imp__number(&s, end, &l) || s == end || *s != ':' ||
            (s++, !imp__number(&s, end, &v)) || s != end)
            IMP_TRY(imp__error(ctx, IMP_E_SCENE, "'%.*s' is not 'wavelength:value'",
                               (int)imp_min(end - start, 80), start));
        IMP_TRY(pairs_add(ctx, &p, l, v));
    }
    IMP_TRY(pairs_finish(ctx, &p, out));
out:
    imp__release(ctx, p.at);
    return st;
}

enum imp_status imp__samples_read(imp_context *ctx, const char *path,
                                  struct imp_samples *out)
{
    enum imp_status st = IMP_OK;
    struct pairs p = {0};
    struct imp_bytes file = {0};
    IMP_TRY(imp__file_read(ctx, path, SPD_BYTES_MAX, &file));
    const char *s = (const char *)file.data, *end = s + file.size;
    for (int line = 1; s < end; line++) {
        const char *stop = memchr(s, '\n', (size_t)(end - s));
        if (!stop) stop = end;
        while (s < stop && strchr(BLANKS, *s)) s++;
        if (s < stop && *s != '#') {
            double v[2];
            for (int i = 0; i < 2; i++) {
                while (s < stop && strchr(BLANKS, *s)) s++;
                if (!imp__number(&s, stop, &v[i]) || (s < stop && !strchr(BLANKS, *s)))
                    IMP_TRY(imp__error(ctx, IMP_E_SCENE,
                                       "%s:%d: a line must be 'wavelength value'", path,
                                       line));
            }
            while (s < stop && strchr(BLANKS, *s)) s++;
            if (s < stop && *s != '#')
                IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s:%d: more than two numbers", path,
                                   line));
            IMP_TRY(pairs_add(ctx, &p, v[0], v[1]));
        }
        s = stop + 1;
    }
    st = pairs_finish(ctx, &p, out);
    if (st == IMP_E_SCENE) imp__error_prefix(ctx, st, "%s", path);
out:
    imp__release(ctx, p.at);
    imp__bytes_free(ctx, &file);
    return st;
}

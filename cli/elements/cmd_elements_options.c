/* SPDX-License-Identifier: Apache-2.0
 *
 * Options of importon elements that hold several numbers: overrides and measurements. */
#include "cmd_elements.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* "a,b,..": at least `least`, at most `most` numbers, up to the end of the text or a `=`.
 * How many, or -1. */
static int numbers(const char *text, double *out, int least, int most)
{
    int n = 0;
    while (n < most) {
        char *end;
        out[n] = strtod(text, &end);
        if (end == text) return -1;
        n++;
        if (*end == 0 || *end == '=') return n >= least ? n : -1;
        if (*end != ',') return -1;
        text = end + 1;
    }
    return -1;
}

/* "NAME=numbers": a copy of the name, and the numbers. */
static char *named(const char *text, double *out, int least, int most, int *n)
{
    const char *equals = strrchr(text, '=');
    if (!equals || equals == text) return NULL;
    *n = numbers(equals + 1, out, least, most);
    if (*n < 0) return NULL;
    const size_t length = (size_t)(equals - text);
    char *name = cli_alloc(length + 1, 1);
    memcpy(name, text, length);
    return name;
}

int elements_phong(const struct arg_list *list, struct imp_elements_phong **out)
{
    *out = cli_alloc(list->n + 1, sizeof **out);
    for (size_t i = 0; i < list->n; i++) {
        struct imp_elements_phong *p = &(*out)[i];
        p->size = sizeof *p;
        double v[7];
        int n = 0;
        p->shape = named(list->item[i], v, 3, 7, &n);
        if (!p->shape || (n != 3 && n != 7))
            return cli_error(EXIT_USAGE,
                             "--phong '%s': SHAPE=KD,KS,N or "
                             "SHAPE=R,G,B,R,G,B,N",
                             list->item[i]);
        for (int c = 0; c < 3; c++) {
            p->kd[c] = n == 3 ? v[0] : v[c];
            p->ks[c] = n == 3 ? v[1] : v[3 + c];
        }
        p->exponent = v[n - 1];
    }
    return 0;
}

int elements_beams(const struct arg_list *list, struct imp_elements_beam **out)
{
    *out = cli_alloc(list->n + 1, sizeof **out);
    for (size_t i = 0; i < list->n; i++) {
        struct imp_elements_beam *b = &(*out)[i];
        b->size = sizeof *b;
        double v[4] = {0};
        int n = 0;
        b->shape = named(list->item[i], v, 1, 4, &n);
        if (!b->shape || (n != 1 && n != 4))
            return cli_error(EXIT_USAGE, "--beam '%s': SHAPE=N or SHAPE=N,X,Y,Z",
                             list->item[i]);
        b->exponent = v[0];
        memcpy(b->axis, v + 1, sizeof b->axis);
    }
    return 0;
}

int elements_bounds(const struct arg_list *list, struct imp_elements_bounds **out)
{
    *out = cli_alloc(list->n + 1, sizeof **out);
    for (size_t i = 0; i < list->n; i++) {
        double v[2];
        int n = 0;
        (*out)[i].size = sizeof **out;
        (*out)[i].glob = named(list->item[i], v, 2, 2, &n);
        if (!(*out)[i].glob)
            return cli_error(EXIT_USAGE, "--bounds '%s': GLOB=LO,HI", list->item[i]);
        (*out)[i].lo = v[0];
        (*out)[i].hi = v[1];
    }
    return 0;
}

/* "what", "weight:what", "what=target" or both; target NAN: none is given. Returns where
 * `what` begins. */
static const char *parts_of(const char *text, double *weight, double *target)
{
    const char *colon = strchr(text, ':'), *equals = strrchr(text, '=');
    char *end;
    *weight = 1;
    *target = NAN;
    if (equals) {
        *target = strtod(equals + 1, &end);
        if (end == equals + 1 || *end) *target = INFINITY;
    }
    if (!colon) return text;
    const double w = strtod(text, &end);
    if (end != colon) return text;
    *weight = w;
    return colon + 1;
}

static int source_parse(const char *option, const char *text, int n_numbers,
                        const char *form, struct imp_elements_source *s, double *v,
                        double *target)
{
    const char *what = parts_of(text, &s->weight, target);
    if (s->weight == 0 || !isfinite(s->weight))
        return cli_error(EXIT_USAGE, "--%s '%s': a weight is a number, and not 0", option,
                         text);
    if (isinf(*target) || (n_numbers && numbers(what, v, n_numbers, n_numbers) < 0))
        return cli_error(EXIT_USAGE, "--%s '%s': [WEIGHT:]%s[=TARGET]", option, text,
                         form);
    if (!n_numbers) {
        const char *equals = strrchr(what, '=');
        const size_t n = equals ? (size_t)(equals - what) : strlen(what);
        char *name = cli_alloc(n + 1, 1);
        memcpy(name, what, n);
        s->shape = name;
    }
    return 0;
}

int elements_sources(const struct elements_sources *s, int sensor,
                     struct imp_elements_source **out, double **targets, size_t *n_out)
{
    static const struct imp_elements_source initial = IMP_ELEMENTS_SOURCE_INIT;
    const size_t n = s->regions.n + s->planes.n + s->shapes.n;
    *out = cli_alloc(n + 1, sizeof **out);
    *targets = cli_alloc(n + 1, sizeof **targets);
    *n_out = n;
    for (size_t i = 0; i < n; i++) {
        struct imp_elements_source *p = &(*out)[i];
        double v[9], *target = &(*targets)[i];
        size_t k = i;
        int rc;
        *p = initial;
        if (k < s->regions.n) {
            rc = source_parse("region", s->regions.item[k], 4, "X0,Y0,X1,Y1", p, v,
                              target);
            p->kind = IMP_ELEMENTS_CAMERA;
            p->sensor = sensor;
            for (int a = 0; a < 4 && !rc; a++)
                p->region[a] = v[a] >= 0 && v[a] < 1e9 ? (int)v[a] : -1;
        } else if ((k -= s->regions.n) < s->planes.n) {
            rc = source_parse("plane", s->planes.item[k], 9,
                              "a corner and two edges, nine numbers", p, v, target);
            p->kind = IMP_ELEMENTS_PLANE;
            for (int a = 0; a < 3 && !rc; a++) {
                p->origin[a] = v[a];
                p->edge_u[a] = v[3 + a];
                p->edge_v[a] = v[6 + a];
            }
        } else {
            k -= s->planes.n;
            rc = source_parse("lux", s->shapes.item[k], 0, "SHAPE", p, v, target);
            p->kind = IMP_ELEMENTS_SHAPE;
        }
        if (rc) return rc;
    }
    return 0;
}

const char *elements_source_name(const struct elements_sources *s, size_t i)
{
    if (i < s->regions.n) return s->regions.item[i];
    i -= s->regions.n;
    return i < s->planes.n ? s->planes.item[i] : s->shapes.item[i - s->planes.n];
}

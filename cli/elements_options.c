/* SPDX-License-Identifier: Apache-2.0
 *
 * Options of importon elements that hold several numbers: overrides and measurements. */
#include "elements.h"

#include <stdlib.h>
#include <string.h>

/* "a,b,..": at least `least`, at most `most` numbers. How many, or -1. */
static int numbers(const char *text, double *out, int least, int most)
{
    int n = 0;
    while (n < most) {
        char *end;
        out[n] = strtod(text, &end);
        if (end == text) return -1;
        n++;
        if (*end == 0) return n >= least ? n : -1;
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

/* "numbers" or "weight:numbers". */
static const char *weight_of(const char *text, double *weight)
{
    const char *colon = strchr(text, ':');
    *weight = 1;
    if (!colon) return text;
    char *end;
    *weight = strtod(text, &end);
    return end == colon ? colon + 1 : text;
}

int elements_sources(const struct elements_sources *s, int sensor,
                     struct imp_elements_source **out, size_t *n_out)
{
    const size_t n = s->regions.n + s->planes.n + s->shapes.n;
    *out = cli_alloc(n + 1, sizeof **out);
    *n_out = n;
    size_t at = 0;
    for (size_t i = 0; i < n; i++) {
        static const struct imp_elements_source initial = IMP_ELEMENTS_SOURCE_INIT;
        (*out)[i] = initial;
    }
    for (size_t i = 0; i < s->regions.n; i++, at++) {
        struct imp_elements_source *p = &(*out)[at];
        double v[4];
        if (numbers(weight_of(s->regions.item[i], &p->weight), v, 4, 4) != 4)
            return cli_error(EXIT_USAGE, "--region '%s': [WEIGHT:]X0,Y0,X1,Y1",
                             s->regions.item[i]);
        p->kind = IMP_ELEMENTS_CAMERA;
        p->sensor = sensor;
        for (int k = 0; k < 4; k++)
            p->region[k] = v[k] >= 0 && v[k] < 1e9 ? (int)v[k] : -1;
    }
    for (size_t i = 0; i < s->planes.n; i++, at++) {
        struct imp_elements_source *p = &(*out)[at];
        double v[9];
        if (numbers(weight_of(s->planes.item[i], &p->weight), v, 9, 9) != 9)
            return cli_error(EXIT_USAGE,
                             "--plane '%s': [WEIGHT:] a corner and two edges, nine "
                             "numbers",
                             s->planes.item[i]);
        p->kind = IMP_ELEMENTS_PLANE;
        memcpy(p->origin, v, sizeof p->origin);
        memcpy(p->edge_u, v + 3, sizeof p->edge_u);
        memcpy(p->edge_v, v + 6, sizeof p->edge_v);
    }
    for (size_t i = 0; i < s->shapes.n; i++, at++) {
        struct imp_elements_source *p = &(*out)[at];
        p->kind = IMP_ELEMENTS_SHAPE;
        p->shape = weight_of(s->shapes.item[i], &p->weight);
    }
    return 0;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Influences of the samples of one pixel: their squares by sets of samples, and their cross
 * terms with the pixels around. */
#include "influence_pixel.h"
#include "film/film_sums.h"
#include "moved_pictures.h"
#include <math.h>
#include <string.h>

size_t imp__influence_side(const struct imp__influence_pass *p)
{
    /* One more than the filter reaches: a position may be rounded up to a pixel's end. */
    return (size_t)(p->tiles.side + 2 * p->border + 1);
}
size_t imp__influence_size(const struct imp__influence_pass *p)
{
    const size_t side = p->positions || !p->f->W ? 0 : imp__influence_side(p);
    return p->n * (1 + side * side);
}

bool imp__influence_pixel_create(const struct imp__influence_pass *p,
                                 struct imp_arena *arena, struct imp__influence_pixel *s)
{
    const struct imp__functional *f = p->f;
    const size_t C = (size_t)f->channels, K = f->derivatives ? f->tracer.active->n : 0;
    s->side = (size_t)(2 * p->border + 2);
    const size_t area = s->side * s->side;
    s->lane = imp__arena_take(arena, (K + 1) * C, sizeof(double));
    s->S = imp__arena_take(arena, p->n * C, sizeof(double));
    s->value = imp__arena_take(arena, p->n, sizeof(double));
    s->a = imp__arena_take(arena, p->n, sizeof(double));
    s->sum = imp__arena_take(arena, p->n, sizeof(double));
    s->square = imp__arena_take(arena, p->n, sizeof(double));
    s->u = imp__arena_take(arena, area, sizeof(double));
    s->sum_u = imp__arena_take(arena, area, sizeof(double));
    s->cross = imp__arena_take(arena, area * p->n, sizeof(double));
    return s->lane && s->S && s->value && s->a && s->sum && s->square && s->u &&
           s->sum_u && s->cross;
}

/* S [n][channels]: the sample's radiance, and the sums of its derivatives in groups; 0 if
 * its walk is dropped, which the picture has counted. */
static bool sample_walk(const struct imp__functional *f, struct imp__influence_pixel *t,
                        struct imp_sample *s, size_t n)
{
    const size_t C = (size_t)f->channels, K = f->derivatives ? f->tracer.active->n : 0;
    bool finite = true;
    s->value = t->lane;
    if (f->derivatives) {
        imp__moved_sample(f->moved, &f->tracer, s);
    } else {
        struct imp_walk walk;
        imp__sample_walk(s, &f->tracer, &walk);
        for (size_t c = 0; c < C; c++) t->lane[c] = walk.L[c];
    }
    if (s->dropped == IMP_DROP_MEMORY) return false;
    finite &= imp__fits_float(t->lane, (int)C); /* as pictures take them */
    for (size_t k = C; k < (K + 1) * C; k++) finite &= isfinite(t->lane[k]);
    memset(t->S, 0, n * C * sizeof *t->S);
    if (s->dropped != IMP_DROP_NONE || !finite) return true;
    memcpy(t->S, t->lane, C * sizeof *t->S);
    for (size_t k = 0; k < K; k++)
        for (size_t c = 0; c < C; c++)
            t->S[(size_t)(1 + f->group[k]) * C + c] += t->lane[(k + 1) * C + c];
    return true;
}

void imp__influence_pixel_value(const struct imp__influence_pass *p,
                                struct imp__influence_pixel *t, size_t pixel)
{
    const struct imp__functional *f = p->f;
    const size_t C = (size_t)f->channels, stride = (size_t)f->picture->channels;
    const float *s = f->adjoint + pixel * C;
    memset(t->value, 0, p->n * sizeof *t->value);
    for (size_t c = 0; c < C; c++)
        t->value[0] += (double)s[c] * f->picture->mean[pixel * stride + c];
    for (size_t k = 0; f->derivatives && k < f->tracer.active->n; k++)
        for (size_t c = 0; c < C; c++)
            t->value[1 + f->group[k]] += (double)s[c] * f->films[k]->mean[pixel * C + c];
}
static void sample_value(const struct imp__influence_pass *p,
                         struct imp__influence_pixel *t, size_t pixel)
{
    const size_t C = (size_t)p->f->channels;
    const float *s = p->f->adjoint + pixel * C;
    for (size_t g = 0; g < p->n; g++) {
        t->value[g] = 0;
        for (size_t c = 0; c < C; c++) t->value[g] += s[c] * t->S[g * C + c];
    }
}

static void sample_taps(const struct imp__functional *f, const struct imp_sample *s,
                        struct imp__influence_pixel *t)
{
    const struct imp_film_desc *film = f->film;
    if (!f->W) {
        t->across = (struct imp_taps){.first = s->x, .n = 1, .w = {1}};
        t->down = (struct imp_taps){.first = s->y, .n = 1, .w = {1}};
        return;
    }
    const int b = imp__film_border(film);
    imp__film_taps(&film->filter, s->px - film->crop_x, imp_max(s->x - b, 0),
                   imp_min(s->x + b + 1, film->crop_w - 1), &t->across);
    imp__film_taps(&film->filter, s->py - film->crop_y, imp_max(s->y - b, 0),
                   imp_min(s->y + b + 1, film->crop_h - 1), &t->down);
}

bool imp__influence_pixel_add(const struct imp__influence_pass *p,
                              struct imp__influence_pixel *t, struct imp_sample *s)
{
    const struct imp__functional *f = p->f;
    if (p->positions)
        imp__walk_position(&f->tracer, s->x, s->y, s->index, &s->px, &s->py);
    else if (!sample_walk(f, t, s, p->n)) return false;
    sample_taps(f, s, t);
    for (int j = 0; j < t->down.n; j++)
        for (int i = 0; i < t->across.n; i++) {
            const int x = t->across.first + i, y = t->down.first + j;
            const size_t pixel = (size_t)y * (size_t)f->film->crop_w + (size_t)x;
            const double W = f->W ? f->W[pixel] : f->spp;
            if (W == 0) continue;
            const double u = t->down.w[j] * t->across.w[i] / W;
            t->u[(size_t)(y - s->y + p->border) * t->side +
                 (size_t)(x - s->x + p->border)] += u;
            if (p->positions) imp__influence_pixel_value(p, t, pixel);
            else sample_value(p, t, pixel);
            for (size_t g = 0; g < p->n; g++) t->a[g] += u * t->value[g];
        }
    return true;
}

void imp__influence_pixel_set_end(const struct imp__influence_pass *p,
                                  struct imp__influence_pixel *t, bool cross)
{
    for (size_t g = 0; g < p->n; g++) {
        t->sum[g] += t->a[g];
        t->square[g] += t->a[g] * t->a[g];
    }
    for (size_t k = 0; cross && k < t->side * t->side; k++) {
        if (t->u[k] == 0) continue;
        t->sum_u[k] += t->u[k];
        for (size_t g = 0; g < p->n; g++) t->cross[k * p->n + g] += t->u[k] * t->a[g];
        t->u[k] = 0;
    }
    memset(t->a, 0, p->n * sizeof *t->a);
}

void imp__influence_pixel_end(const struct imp__influence_pass *p,
                              const struct imp_tile *tile, int x, int y, int64_t m,
                              struct imp__influence_pixel *t, double *result, bool cross)
{
    const double factor = m > 1 ? (double)m / (double)(m - 1) : INFINITY;
    const double each = 1. / (double)m;
    for (size_t g = 0; g < p->n; g++)
        result[g] += factor * fmax(t->square[g] - t->sum[g] * t->sum[g] * each, 0);
    for (size_t k = 0; cross && m > 1 && k < t->side * t->side; k++) {
        const size_t row = (size_t)(y - tile->y0) + k / t->side,
                     column = (size_t)(x - tile->x0) + k % t->side;
        double *to = result + p->n * (1 + row * imp__influence_side(p) + column);
        for (size_t g = 0; g < p->n; g++)
            to[g] += factor * (t->cross[k * p->n + g] - t->sum_u[k] * t->sum[g] * each);
    }
}

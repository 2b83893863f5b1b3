/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums of pictures, added tile by tile, and the means and errors that follow. */
#include "film_sums.h"
#include <string.h>

static size_t pixels_of(const struct imp_film_sums *s)
{
    return (size_t)s->width * (size_t)s->height;
}
static size_t row_doubles(const struct imp_film_sums *s)
{
    return (size_t)s->across * imp__film_sums_pixels(s);
}
static size_t tiles_of(const struct imp_film_sums *s)
{
    return (size_t)s->across * (size_t)s->down;
}

double imp__film_sums_bytes(const struct imp_film_sums *s)
{
    const double pixels = (double)pixels_of(s), n = s->n;
    const double counts = (double)s->across * s->down * sizeof *s->count;
    /* box: means and errors take the place of sums; wide: they lie beside these */
    if (s->border == 0) return pixels * n * 2 * sizeof(double) + counts;
    return (double)s->down * (double)row_doubles(s) * sizeof(double) +
           pixels * n * 2 * sizeof(float) + counts;
}

enum imp_status imp__film_sums_create(struct imp_film_sums *s)
{
    const size_t films = (size_t)s->n_films, pixels = pixels_of(s);
    const size_t C = (size_t)(s->n / s->n_films);
    s->count = imp__alloc(s->ctx, tiles_of(s), sizeof *s->count);
    bool fine = s->count;
    if (s->border == 0) {
        s->sum = imp__alloc(s->ctx, films, sizeof *s->sum);
        s->square = imp__alloc(s->ctx, films, sizeof *s->square);
        fine = fine && s->sum && s->square;
        for (size_t f = 0; fine && f < films; f++) {
            s->sum[f] = imp__alloc_raw(s->ctx, pixels, C * sizeof(double));
            s->square[f] = imp__alloc_raw(s->ctx, pixels, C * sizeof(double));
            fine = s->sum[f] && s->square[f];
        }
    } else {
        s->rows = imp__alloc(s->ctx, (size_t)s->down, sizeof *s->rows);
        fine = fine && s->rows;
        for (int j = 0; fine && j < s->down; j++) {
            s->rows[j] = imp__alloc_raw(s->ctx, row_doubles(s), sizeof(double));
            fine = s->rows[j];
        }
    }
    return fine ? IMP_OK
                : imp__error(s->ctx, IMP_E_NOMEM,
                             "no memory for a picture of %d x %d with %d channels, which "
                             "takes %.3g GB",
                             s->width, s->height, s->n, imp__film_sums_bytes(s) * 1e-9);
}

static void array_free(imp_context *ctx, double ***array, int n)
{
    for (int k = 0; *array && k < n; k++) imp__release(ctx, (*array)[k]);
    imp__release(ctx, *array);
    *array = NULL;
}

void imp__film_sums_destroy(struct imp_film_sums *s)
{
    array_free(s->ctx, &s->sum, s->n_films);
    array_free(s->ctx, &s->square, s->n_films);
    array_free(s->ctx, &s->rows, s->down);
    imp__release(s->ctx, s->count);
    s->count = NULL;
}

/* ---- Sums of a tile ------------------------------------------------------------- */

static void box_add(struct imp_film_sums *s, size_t tile, const double *in, bool first)
{
    const int x0 = (int)(tile % (size_t)s->across) * s->side;
    const int y0 = (int)(tile / (size_t)s->across) * s->side;
    const int x1 = imp_min(x0 + s->side, s->width), y1 = imp_min(y0 + s->side, s->height);
    const int C = s->n / s->n_films;
    for (int y = y0; y < y1; y++) {
        const double *from = in + (size_t)(y - y0) * (size_t)s->side * 2 * (size_t)s->n;
        const size_t at = ((size_t)y * (size_t)s->width + (size_t)x0) * (size_t)C;
        for (int x = 0; x < x1 - x0; x++)
            for (int f = 0; f < s->n_films; f++) {
                double *sum = s->sum[f] + at + (size_t)(x * C);
                double *square = s->square[f] + at + (size_t)(x * C);
                for (int c = 0; c < C; c++, from += 2) {
                    sum[c] = first ? from[0] : sum[c] + from[0];
                    square[c] = first ? from[1] : square[c] + from[1];
                }
            }
    }
}

void imp__film_sums_add(struct imp_film_sums *s, size_t tile, const double *in, int count)
{
    const bool first = s->count[tile] == 0;
    const size_t n = imp__film_sums_pixels(s);
    s->count[tile] += count;
    if (s->border == 0) {
        box_add(s, tile, in, first);
        return;
    }
    double *to = s->rows[tile / (size_t)s->across] + tile % (size_t)s->across * n;
    if (first) memcpy(to, in, n * sizeof *to);
    else
        for (size_t k = 0; k < n; k++) to[k] += in[k];
}

/* ---- Means and errors ------------------------------------------------------------ */

struct finish {
    struct imp_film_sums *s;
    bool strata, errors; /* box: errors, or means */
    bool keep;           /* the sums stay, and films have their room */
    double *weights;
    imp_film **films;
    int film; /* box: which */
    float *
        floats; /* box: its errors, or means; where the sums go, in the memory of one of them */
    int row0;  /* first row of the loop */
    double *t; /* wide: [threads][sums] of a pixel */
};

/* With W = sum w, W2 = sum w^2: n_eff - 1 degrees of freedom, n_eff = W^2/W2; strata have
 * taken theirs into account. */
static double freedom_of(bool strata, double W, double W2)
{
    const double n_eff = W2 > 0 ? W * W / W2 : 0;
    return strata ? 1 : n_eff > 1 ? n_eff / (n_eff - 1) : INFINITY;
}
static float error_of(double freedom, double W, double spread)
{
    return isfinite(freedom) && W != 0
               ? (float)(sqrt(fmax(0, spread) * freedom) / fabs(W))
               : INFINITY;
}

float imp__box_mean(double sum, double W) { return (float)(W != 0 ? sum / W : 0); }

float imp__box_error(double sum, double square, double W, double q)
{
    const double all = W != 0 ? sum : 0, mean = W != 0 ? sum / W : 0;
    const double spread =
        (W != 0 ? square : 0) - 2 * (q * mean) * all + q * mean * mean * W;
    return error_of(freedom_of(false, W, W * q), W, spread);
}

static enum imp_status not_finite(const imp_film *film, size_t pixel, int channel)
{
    return imp__error(film->ctx, IMP_E_NUMERIC,
                      "pixel %zu,%zu of the picture is not finite in channel %s",
                      pixel % (size_t)film->width, pixel / (size_t)film->width,
                      film->names[channel]);
}

static enum imp_status box_row(size_t item, int worker, int slot, void *payload)
{
    const struct finish *f = payload;
    const struct imp_film_sums *s = f->s;
    imp_film *film = f->films[f->film];
    const size_t C = (size_t)film->channels, y = (size_t)f->row0 + item;
    const int32_t *count = s->count + y / (size_t)s->side * (size_t)s->across;
    (void)worker, (void)slot;
    for (size_t x = 0; x < (size_t)s->width; x++) {
        const size_t pixel = y * (size_t)s->width + x;
        const double W = count[x / (size_t)s->side], q = s->set;
        if (f->weights) f->weights[pixel] = W;
        for (size_t k = pixel * C; k < (pixel + 1) * C; k++) {
            if (f->errors) {
                f->floats[k] =
                    imp__box_error(s->sum[f->film][k], s->square[f->film][k], W, q);
            } else {
                f->floats[k] = imp__box_mean(s->sum[f->film][k], W);
                if (!isfinite(f->floats[k]))
                    return not_finite(film, pixel, (int)(k - pixel * C));
            }
        }
    }
    return IMP_OK;
}

/* Rows one by one put floats where doubles were that are read by then: row y ends before row (y + 1)/2 of
 * these. So those of [a, 2 a) can be made together when those before are there. */
static enum imp_status box_rows(struct finish *f)
{
    const struct imp_film_sums *s = f->s;
    enum imp_status st = IMP_OK;
    int rows;
    for (f->row0 = 0; f->row0 < s->height && st == IMP_OK; f->row0 += rows) {
        rows = f->keep ? s->height : imp_min(imp_max(f->row0, 1), s->height - f->row0);
        const struct imp_loop loop = {
            .n_items = (size_t)rows, .work = box_row, .payload = f};
        st = imp__parallel(s->ctx, &loop, NULL);
    }
    return st;
}

/* Sums become floats in their own memory, whose second half is given back. */
static void floats_become(const imp_film *film, double **sums, float **floats)
{
    *floats = imp__shrunk(film->ctx, *sums, imp__film_values(film) * sizeof **floats);
    *sums = NULL;
}

/* Films one by one, errors first, which are made of both sums. */
static enum imp_status box_finish(struct finish *f)
{
    struct imp_film_sums *s = f->s;
    enum imp_status st = IMP_OK;
    for (f->film = 0; f->film < s->n_films; f->film++) {
        imp_film *film = f->films[f->film];
        double **sum = &s->sum[f->film], **square = &s->square[f->film];
        f->errors = true;
        f->floats = f->keep ? film->se : (float *)*square;
        IMP_TRY(box_rows(f));
        if (!f->keep) floats_become(film, square, &film->se);
        f->errors = false;
        f->floats = f->keep ? film->mean : (float *)*sum;
        IMP_TRY(box_rows(f));
        if (!f->keep) floats_become(film, sum, &film->mean);
    }
out:
    return st;
}

/* t [sums] of a pixel: the tiles that reach it, in their order. */
static void wide_gather(const struct imp_film_sums *s, int x, int y, double *t)
{
    const int b = s->border, stride = s->side + 2 * b, n = IMP_WIDE_SUMS(s->n);
    const int i0 = imp_max(x + s->margin - b, 0) / s->side;
    const int j0 = imp_max(y + s->margin - b, 0) / s->side;
    const int i1 = imp_min((x + s->margin + b) / s->side, s->across - 1);
    const int j1 = imp_min((y + s->margin + b) / s->side, s->down - 1);
    memset(t, 0, (size_t)n * sizeof *t);
    for (int j = j0; j <= j1; j++)
        for (int i = i0; i <= i1; i++) {
            if (s->count[(size_t)j * (size_t)s->across + (size_t)i] == 0) continue;
            const int u = x - (i * s->side - s->margin) + b;
            const int v = y - (j * s->side - s->margin) + b;
            const double *from = s->rows[j] + (size_t)i * imp__film_sums_pixels(s) +
                                 (size_t)(v * stride + u) * (size_t)n;
            for (int k = 0; k < n; k++) t[k] += from[k];
        }
}

static enum imp_status wide_row(size_t item, int worker, int slot, void *payload)
{
    const struct finish *f = payload;
    const struct imp_film_sums *s = f->s;
    const int y = f->row0 + (int)item, C = s->n / s->n_films;
    double *t = f->t + (size_t)worker * (size_t)IMP_WIDE_SUMS(s->n);
    (void)slot;
    for (int x = 0; x < s->width; x++) {
        const size_t pixel = (size_t)y * (size_t)s->width + (size_t)x;
        wide_gather(s, x, y, t);
        const double W = t[0], freedom = freedom_of(f->strata, W, t[1]);
        if (f->weights) f->weights[pixel] = W;
        for (int c = 0; c < s->n; c++) {
            const double *v = t + 2 + 3 * c;
            const double mean = W != 0 ? v[0] / W : 0;
            const double spread = v[2] - 2 * mean * v[1] + mean * mean * t[1];
            imp_film *film = f->films[c / C];
            const size_t k = pixel * (size_t)C + (size_t)(c % C);
            film->mean[k] = (float)mean;
            film->se[k] = error_of(freedom, W, spread);
            if (!isfinite(film->mean[k])) return not_finite(film, pixel, c % C);
        }
    }
    return IMP_OK;
}

/* Row of tiles by row of tiles, which are freed when no pixel needs them any more. */
static enum imp_status wide_finish(struct finish *f)
{
    struct imp_film_sums *s = f->s;
    enum imp_status st = IMP_OK;
    int freed = 0;
    f->t = imp__alloc(s->ctx, (size_t)s->ctx->threads,
                      (size_t)IMP_WIDE_SUMS(s->n) * sizeof *f->t);
    if (!f->t) IMP_TRY(imp__error(s->ctx, IMP_E_NOMEM, "no memory for a pixel's sums"));
    for (int k = 0; k < s->n_films && !f->keep; k++) {
        IMP_TRY(imp__film_room(f->films[k], &f->films[k]->mean));
        IMP_TRY(imp__film_room(f->films[k], &f->films[k]->se));
    }
    for (f->row0 = 0; f->row0 < s->height; f->row0 += s->side) {
        const int row1 = imp_min(f->row0 + s->side, s->height);
        const struct imp_loop loop = {
            .n_items = (size_t)(row1 - f->row0), .work = wide_row, .payload = f};
        IMP_TRY(imp__parallel(s->ctx, &loop, NULL));
        /* Tiles of row j reach rows before (j + 1) side - margin + border. */
        for (; !f->keep && freed < s->down &&
               (freed + 1) * s->side - s->margin + s->border <= row1;
             freed++) {
            imp__release(s->ctx, s->rows[freed]);
            s->rows[freed] = NULL;
        }
    }
out:
    imp__release(s->ctx, f->t);
    return st;
}

enum imp_status imp__film_sums_finish(struct imp_film_sums *s, bool strata,
                                      double *weights, imp_film **films)
{
    struct finish f = {.s = s, .strata = strata, .weights = weights, .films = films};
    return s->border == 0 ? box_finish(&f) : wide_finish(&f);
}

enum imp_status imp__film_sums_look(struct imp_film_sums *s, bool strata,
                                    imp_film **films)
{
    struct finish f = {.s = s, .strata = strata, .films = films, .keep = true};
    return s->border == 0 ? box_finish(&f) : wide_finish(&f);
}

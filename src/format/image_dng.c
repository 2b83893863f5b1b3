/* SPDX-License-Identifier: Apache-2.0
 *
 * DNG, reading only, by LibRaw: what the sensor counted, black taken off and white at 1, without white
 * balance, colour matrix or curve. Nothing is interpolated: 2 x 2 pixels behind a mosaic of red, green
 * and blue are one pixel here, its green the mean of two. A value that has one at the level of white is 1,
 * and others are below. Errors end in our messages; LibRaw's memory takes no hooks, but is bounded. */
#include "base/arguments.h"
#include "image.h"
#include <libraw/libraw.h>
#include <string.h>

#define PIXELS_EVERY                                                                     \
    16. /* a byte of a file may hold: lossless JPEG of flat pictures, a bit for each */

struct dng_job {
    imp_context *ctx;
    const char *name;
    size_t bytes;
    libraw_data_t *raw;
    imp_film *film;
    bool mosaic;
    int colour[2][2]; /* of a mosaic: 0, 1, 2 */
};

static enum imp_status refused(const struct dng_job *j, const char *what)
{
    return imp__error(j->ctx, IMP_E_UNSUPPORTED,
                      "%s: DNG files %s are not read: mosaics of 2 x 2 pixels of red, "
                      "green and blue are, grey, and linear RGB",
                      j->name, what);
}

static enum imp_status damaged(const struct dng_job *j, int code)
{
    return imp__error(j->ctx, IMP_E_SCENE, "%s: %s", j->name,
                      code ? libraw_strerror(code) : "damaged DNG file");
}

/* The mosaic's colours, which LibRaw has for 8 x 2 pixels, the second green as 3. */
static enum imp_status mosaic_read(struct dng_job *j)
{
    const libraw_iparams_t *p = &j->raw->idata;
    int greens = 0, seen = 0;
    if (p->colors != 3 || p->filters < 1000 || strncmp(p->cdesc, "RGBG", 4) != 0)
        return refused(j, "with another mosaic");
    for (int y = 0; y < 16; y++)
        for (int x = 0; x < 2; x++) {
            const int at = libraw_COLOR(j->raw, y, x), colour = at == 3 ? 1 : at;
            if (colour < 0 || colour > 2) return refused(j, "with another mosaic");
            if (y < 2) j->colour[y][x] = colour;
            if (y < 2) greens += colour == 1;
            if (y < 2) seen |= 1 << colour;
            if (j->colour[y % 2][x] != colour) return refused(j, "with another mosaic");
        }
    return greens == 2 && seen == 7 ? IMP_OK : refused(j, "with another mosaic");
}

static enum imp_status film_make(struct dng_job *j)
{
    const libraw_iparams_t *p = &j->raw->idata;
    const libraw_image_sizes_t *s = &j->raw->sizes;
    const char *names = p->colors == 1 ? "Y" : "R,G,B";
    if (!p->dng_version) return damaged(j, 0);
    j->mosaic = p->filters != 0;
    if (j->mosaic) IMP_CHECKED(mosaic_read(j));
    else if (p->colors != 1 && p->colors != 3) return refused(j, "of other colours");
    const unsigned part = j->mosaic ? 2 : 1;
    IMP_CHECKED(imp__image_film(j->ctx, j->name, s->raw_width, s->raw_height, names,
                                j->bytes, PIXELS_EVERY, &j->film));
    imp_film_destroy(j->film); /* that size was of all that is unpacked */
    j->film = NULL;
    return imp__image_film(j->ctx, j->name, s->width / part, s->height / part, names,
                           j->bytes, PIXELS_EVERY, &j->film);
}

/* Black of a pixel of the picture: of all, of its colour, and of a pattern. */
static double black_of(const libraw_colordata_t *c, int colour, unsigned y, unsigned x)
{
    double black = (double)c->black + (double)c->cblack[colour];
    const unsigned rows = c->cblack[4], columns = c->cblack[5];
    if (rows > 0 && columns > 0 && rows <= LIBRAW_CBLACK_SIZE &&
        columns <= LIBRAW_CBLACK_SIZE && rows * columns + 6 <= LIBRAW_CBLACK_SIZE)
        black += (double)c->cblack[6 + y % rows * columns + x % columns];
    return black;
}

/* Values of one colour of a pixel. */
struct sum {
    double value;
    int n;
    bool white;
};

static bool sum_add(const struct dng_job *j, struct sum *s, double code, int colour,
                    unsigned y, unsigned x)
{
    const libraw_colordata_t *c = &j->raw->color;
    const double black = black_of(c, colour, y, x), white = (double)c->maximum;
    if (!(white > black)) return false;
    s->value += (code - black) / (white - black);
    s->white |= code >= white;
    s->n++;
    return true;
}

static float sum_value(const struct sum *s)
{
    return s->white ? 1 : (float)(s->n > 0 ? s->value / s->n : 0);
}

static enum imp_status pixels_read(struct dng_job *j)
{
    const libraw_rawdata_t *r = &j->raw->rawdata;
    const libraw_image_sizes_t *s = &j->raw->sizes;
    const unsigned part = j->mosaic ? 2 : 1, C = (unsigned)j->film->channels;
    const unsigned planes = r->raw_image ? 1 : r->color3_image ? 3 : 4;
    const unsigned short *from = r->raw_image      ? r->raw_image
                                 : r->color3_image ? *r->color3_image
                                 : r->color4_image ? *r->color4_image
                                                   : NULL;
    if (!from) return refused(j, "of other numbers");
    if ((planes == 1) != (j->mosaic || C == 1)) return refused(j, "of other layouts");
    const size_t pitch = s->raw_pitch / sizeof *from;
    if (pitch < (size_t)planes * s->raw_width ||
        s->top_margin + s->height > s->raw_height ||
        s->left_margin + s->width > s->raw_width)
        return damaged(j, 0);
    for (unsigned y = 0; y < (unsigned)j->film->height; y++)
        for (unsigned x = 0; x < (unsigned)j->film->width; x++) {
            struct sum sum[3] = {{0}};
            bool fine = true;
            for (unsigned k = 0; k < (j->mosaic ? 4 : C); k++) {
                const unsigned row = part * y + (j->mosaic ? k / 2 : 0),
                               column = part * x + (j->mosaic ? k % 2 : 0),
                               plane = j->mosaic ? 0 : k;
                const int at = j->mosaic ? j->colour[row % 2][column % 2] : (int)k;
                const int black =
                    j->mosaic ? libraw_COLOR(j->raw, (int)row, (int)column) : (int)k;
                fine &= sum_add(j, &sum[at],
                                from[(row + s->top_margin) * pitch +
                                     planes * (column + s->left_margin) + plane],
                                black, row, column);
            }
            if (!fine) return damaged(j, 0);
            for (unsigned c = 0; c < C; c++)
                j->film->mean[((size_t)y * (size_t)j->film->width + x) * C + c] =
                    sum_value(&sum[c]);
        }
    return IMP_OK;
}

static enum imp_status decode(struct dng_job *j, const struct imp_bytes *file)
{
    int code = libraw_open_buffer(j->raw, file->data, file->size);
    if (code) return damaged(j, code);
    IMP_CHECKED(film_make(j));
    code = libraw_unpack(j->raw);
    return code ? damaged(j, code) : pixels_read(j);
}

enum imp_status imp__dng_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out)
{
    struct dng_job j = {.ctx = ctx, .name = name, .bytes = file->size};
    j.raw = libraw_init(0);
    if (!j.raw) return imp__error(ctx, IMP_E_NOMEM, "%s: no memory", name);
    libraw_set_dataerror_handler(j.raw, NULL, NULL);
    libraw_set_memerror_handler(j.raw, NULL, NULL);
    const enum imp_status st = decode(&j, file);
    libraw_close(j.raw);
    if (st == IMP_OK) {
        *out = j.film;
        j.film = NULL;
    }
    imp_film_destroy(j.film);
    return st;
}

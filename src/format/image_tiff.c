/* SPDX-License-Identifier: Apache-2.0
 *
 * TIFF, reading only, by libtiff: grey and colour of 8 or 16 bits, which are sRGB as in PNG, or
 * of 32-bit floats, which are linear, in strips of any compression that libtiff has. The first picture of
 * a file counts. Errors end in our messages, not on the error stream; libtiff's memory takes no hooks,
 * but single blocks are bounded. */
#include "base/arguments.h"
#include "image.h"
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <tiffio.h>

#define BLOCK_MAX ((tmsize_t)1 << 30) /* bytes of one block of libtiff's memory */
#define PIXELS_EVERY                                                                     \
    (4 * 1032.0) /* a byte of a file may hold: Deflate's 1032:1 and more */

struct tiff_job {
    imp_context *ctx;
    const char *name;
    const struct imp_bytes *from;
    toff_t at;
    TIFF *tiff;
    unsigned char *row;
    imp_film *film;
    char message[160]; /* libtiff's first */
};

/* ---- What libtiff calls ---------------------------------------------------------------- */

static int on_error(TIFF *tiff, void *job, const char *part, const char *format,
                    va_list args)
{
    struct tiff_job *j = job;
    (void)tiff, (void)part;
    if (!j->message[0]) vsnprintf(j->message, sizeof j->message, format, args);
    return 1; /* no other handler */
}
static int on_warning(TIFF *tiff, void *job, const char *part, const char *format,
                      va_list args)
{
    (void)tiff, (void)job, (void)part, (void)format, (void)args;
    return 1;
}
static tmsize_t on_read(thandle_t handle, void *to, tmsize_t n)
{
    struct tiff_job *j = handle;
    const toff_t left = j->at < j->from->size ? j->from->size - j->at : 0;
    const tmsize_t part = (toff_t)n < left ? n : (tmsize_t)left;
    if (part <= 0) return 0;
    memcpy(to, j->from->data + j->at, (size_t)part);
    j->at += (toff_t)part;
    return part;
}
static tmsize_t on_write(thandle_t handle, void *from, tmsize_t n)
{
    (void)handle, (void)from, (void)n;
    return 0;
}
static toff_t on_seek(thandle_t handle, toff_t to, int whence)
{
    struct tiff_job *j = handle;
    j->at = whence == SEEK_SET   ? to
            : whence == SEEK_CUR ? j->at + to
                                 : (toff_t)j->from->size + to;
    return j->at;
}
static int on_close(thandle_t handle)
{
    (void)handle;
    return 0;
}
static toff_t on_size(thandle_t handle)
{
    return (toff_t)((struct tiff_job *)handle)->from->size;
}

static enum imp_status damaged(const struct tiff_job *j)
{
    return imp__error(j->ctx, IMP_E_SCENE, "%s: %s", j->name,
                      j->message[0] ? j->message : "damaged TIFF file");
}

/* ---- The picture ----------------------------------------------------------------------- */

struct layout {
    uint32_t width, height;
    uint16_t bits, samples, format, photometric, planar;
};

static enum imp_status refused(const struct tiff_job *j, const char *what)
{
    return imp__error(
        j->ctx, IMP_E_UNSUPPORTED,
        "%s: TIFF files %s are not read: save it as grey or RGB, of 8 or 16 "
        "bits or 32-bit floats, in strips",
        j->name, what);
}

static enum imp_status layout_read(struct tiff_job *j, struct layout *l)
{
    TIFF *t = j->tiff;
    if (!TIFFGetField(t, TIFFTAG_IMAGEWIDTH, &l->width) ||
        !TIFFGetField(t, TIFFTAG_IMAGELENGTH, &l->height) ||
        !TIFFGetField(t, TIFFTAG_PHOTOMETRIC, &l->photometric))
        return damaged(j);
    TIFFGetFieldDefaulted(t, TIFFTAG_BITSPERSAMPLE, &l->bits);
    TIFFGetFieldDefaulted(t, TIFFTAG_SAMPLESPERPIXEL, &l->samples);
    TIFFGetFieldDefaulted(t, TIFFTAG_SAMPLEFORMAT, &l->format);
    TIFFGetFieldDefaulted(t, TIFFTAG_PLANARCONFIG, &l->planar);
    const bool grey = l->photometric == PHOTOMETRIC_MINISBLACK ||
                      l->photometric == PHOTOMETRIC_MINISWHITE,
               colour = l->photometric == PHOTOMETRIC_RGB;
    if (TIFFIsTiled(t)) return refused(j, "in tiles");
    if (l->photometric == PHOTOMETRIC_PALETTE) return refused(j, "with a palette");
    if (!grey && !colour) return refused(j, "of other colours than grey or RGB");
    if (l->samples < (colour ? 3 : 1) || l->samples > (colour ? 4 : 2))
        return refused(j, "with more channels than colours and alpha");
    const bool integer =
                   l->format == SAMPLEFORMAT_UINT && (l->bits == 8 || l->bits == 16),
               real = l->format == SAMPLEFORMAT_IEEEFP && l->bits == 32;
    if (!integer && !real) return refused(j, "of other numbers");
    return IMP_OK;
}

/* One value of a row in the machine's byte order. */
static float value_of(const unsigned char *row, size_t i, const struct layout *l)
{
    float real;
    uint16_t deep;
    switch (l->bits) {
    case 8: return (float)(row[i] / 255.0);
    case 16: memcpy(&deep, row + 2 * i, 2); return (float)(deep / 65535.0);
    default: memcpy(&real, row + 4 * i, 4); return real;
    }
}

static enum imp_status rows_read(struct tiff_job *j, const struct layout *l)
{
    const size_t C = l->samples, W = l->width;
    const bool planes = l->planar == PLANARCONFIG_SEPARATE && C > 1,
               turned = l->photometric == PHOTOMETRIC_MINISWHITE;
    const size_t per_row = planes ? W : W * C, bytes = per_row * (l->bits / 8u);
    if ((size_t)TIFFScanlineSize64(j->tiff) != bytes) return damaged(j);
    j->row = imp__alloc(j->ctx, bytes, 1);
    if (!j->row)
        return imp__error(j->ctx, IMP_E_NOMEM, "%s: no memory for the picture", j->name);
    for (size_t plane = 0; plane < (planes ? C : 1); plane++)
        for (uint32_t y = 0; y < l->height; y++) {
            if (TIFFReadScanline(j->tiff, j->row, y, (uint16_t)plane) != 1)
                return damaged(j);
            float *to = j->film->mean + (size_t)y * W * C;
            for (size_t i = 0; i < per_row; i++) {
                const size_t at = planes ? i * C + plane : i;
                const float v = value_of(j->row, i, l);
                to[at] = turned && at % C == 0 ? 1 - v : v;
            }
        }
    return IMP_OK;
}

static enum imp_status decode(struct tiff_job *j, struct layout *l)
{
    static const char *const names[] = {"Y", "Y,A", "R,G,B", "R,G,B,A"};
    IMP_CHECKED(layout_read(j, l));
    IMP_CHECKED(imp__image_film(j->ctx, j->name, l->width, l->height,
                                names[l->samples - 1], j->from->size, PIXELS_EVERY,
                                &j->film));
    return rows_read(j, l);
}

enum imp_status imp__tiff_parse(imp_context *ctx, const char *name,
                                const struct imp_bytes *file, imp_film **out, bool *srgb)
{
    struct tiff_job j = {.ctx = ctx, .name = name, .from = file};
    struct layout l = {0};
    TIFFOpenOptions *options = TIFFOpenOptionsAlloc();
    if (!options) return imp__error(ctx, IMP_E_NOMEM, "%s: no memory", name);
    TIFFOpenOptionsSetMaxSingleMemAlloc(options, BLOCK_MAX);
    TIFFOpenOptionsSetErrorHandlerExtR(options, on_error, &j);
    TIFFOpenOptionsSetWarningHandlerExtR(options, on_warning, &j);
    /* m: no mapping, so that nothing writes into the file's bytes */
    j.tiff = TIFFClientOpenExt(name, "rm", &j, on_read, on_write, on_seek, on_close,
                               on_size, NULL, NULL, options);
    TIFFOpenOptionsFree(options);
    const enum imp_status st = j.tiff ? decode(&j, &l) : damaged(&j);
    if (j.tiff) TIFFClose(j.tiff);
    if (st == IMP_OK) {
        *out = j.film;
        *srgb = l.format == SAMPLEFORMAT_UINT;
        j.film = NULL;
    }
    imp__release(ctx, j.row);
    imp_film_destroy(j.film);
    return st;
}

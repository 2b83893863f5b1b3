/* SPDX-License-Identifier: Apache-2.0
 *
 * PNG. Errors of libpng jump back to one setjmp in each direction; all state lives in the
 * job, outside the frame that is jumped over. */
#include "image.h"
#include <png.h>
#include <stdio.h>
#include <string.h>

struct png_job {
    imp_context *ctx;
    const char *name;
    const struct imp_bytes *from;
    size_t at;
    struct imp_bytes *to;
    png_structp png;
    png_infop info;
    unsigned char *pixels;
    png_bytep *rows;
    imp_film *film;
    enum imp_status st;
    bool no_memory;
    char message[160];
};

static void on_error(png_structp png, png_const_charp message)
{
    struct png_job *j = png_get_error_ptr(png);
    snprintf(j->message, sizeof j->message, "%s", message);
    png_longjmp(png, 1);
}
static void on_warning(png_structp png, png_const_charp message)
{
    (void)png, (void)message;
}

static png_voidp on_allocate(png_structp png, png_alloc_size_t bytes)
{
    struct png_job *j = png_get_mem_ptr(png);
    void *p = imp__alloc(j->ctx, bytes, 1);
    j->no_memory |= !p;
    return p;
}
static void on_free(png_structp png, png_voidp memory)
{
    struct png_job *j = png_get_mem_ptr(png);
    imp__release(j->ctx, memory);
}

static void on_read(png_structp png, png_bytep to, png_size_t n)
{
    struct png_job *j = png_get_io_ptr(png);
    if (n > j->from->size - j->at) png_error(png, "cut off");
    memcpy(to, j->from->data + j->at, n);
    j->at += n;
}
static void on_write(png_structp png, png_bytep from, png_size_t n)
{
    struct png_job *j = png_get_io_ptr(png);
    if (imp__bytes_add(j->ctx, j->to, from, n)) return;
    j->no_memory = true;
    png_error(png, "out of memory");
}
static void on_flush(png_structp png) { (void)png; }

static enum imp_status job_error(const struct png_job *j)
{
    if (j->st != IMP_OK) return j->st;
    if (j->no_memory)
        return imp__error(j->ctx, IMP_E_NOMEM, "%s: no memory for the picture", j->name);
    return imp__error(j->ctx, IMP_E_SCENE, "%s: %s", j->name, j->message);
}

static void job_close(struct png_job *j)
{
    imp__release(j->ctx, j->pixels);
    imp__release(j->ctx, j->rows);
    imp_film_destroy(j->film);
}

/* Everything that may jump; false: it did, or j->st is the reason. */
static bool decode(struct png_job *j)
{
    static const char *const names[] = {"Y", "Y,A", "R,G,B", "R,G,B,A"};
    if (setjmp(png_jmpbuf(j->png))) return false;
    png_set_user_limits(j->png, IMP_FILM_SIDE_MAX, IMP_FILM_SIDE_MAX);
    png_set_read_fn(j->png, j, on_read);
    png_read_info(j->png, j->info);
    const uint64_t width = png_get_image_width(j->png, j->info),
                   height = png_get_image_height(j->png, j->info);
    png_set_expand(j->png); /* palettes, packed greys and transparent colours */
    const bool deep = png_get_bit_depth(j->png, j->info) == 16;
    png_set_interlace_handling(j->png);
    png_read_update_info(j->png, j->info);
    const size_t channels = png_get_channels(j->png, j->info),
                 row = png_get_rowbytes(j->png, j->info);
    if (channels < 1 || channels > 4) png_error(j->png, "unknown number of channels");

    /* Deflate packs at most 1032:1, and a pixel takes a bit at least. */
    j->st = imp__image_film(j->ctx, j->name, width, height, names[channels - 1],
                            j->from->size, 8 * 1032.0, &j->film);
    if (j->st != IMP_OK) return false;
    j->pixels = imp__alloc(j->ctx, height, row);
    j->rows = imp__alloc(j->ctx, height, sizeof *j->rows);
    if (!j->pixels || !j->rows) {
        j->no_memory = true;
        return false;
    }
    for (size_t y = 0; y < height; y++) j->rows[y] = j->pixels + y * row;
    png_read_image(j->png, j->rows);
    png_read_end(j->png, NULL);

    for (size_t y = 0; y < height; y++) {
        float *to = j->film->mean + y * width * channels;
        const unsigned char *from = j->rows[y];
        for (size_t i = 0; i < width * channels; i++)
            to[i] = deep ? (float)((from[2 * i] << 8 | from[2 * i + 1]) / 65535.0)
                         : (float)(from[i] / 255.0);
    }
    return true;
}

enum imp_status imp__png_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out)
{
    struct png_job j = {.ctx = ctx, .name = name, .from = file};
    j.png = png_create_read_struct_2(PNG_LIBPNG_VER_STRING, &j, on_error, on_warning, &j,
                                     on_allocate, on_free);
    j.info = j.png ? png_create_info_struct(j.png) : NULL;
    enum imp_status st = IMP_OK;
    if (!j.info) st = imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", name);
    else if (decode(&j)) {
        *out = j.film;
        j.film = NULL;
    } else st = job_error(&j);
    png_destroy_read_struct(&j.png, &j.info, NULL);
    job_close(&j);
    return st;
}

static bool encode(struct png_job *j, int width, int height, int channels,
                   const unsigned char *pixels)
{
    if (setjmp(png_jmpbuf(j->png))) return false;
    png_set_write_fn(j->png, j, on_write, on_flush);
    png_set_user_limits(j->png, IMP_FILM_SIDE_MAX, IMP_FILM_SIDE_MAX);
    png_set_IHDR(j->png, j->info, (png_uint_32)width, (png_uint_32)height, 8,
                 channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(j->png, j->info, PNG_sRGB_INTENT_RELATIVE);
    char key[] = "Software", value[] = "importon " IMP_VERSION_STRING;
    png_set_text(j->png, j->info,
                 &(png_text){.compression = PNG_TEXT_COMPRESSION_NONE,
                             .key = key,
                             .text = value,
                             .text_length = strlen(value)},
                 1);
    png_write_info(j->png, j->info);
    for (int y = 0; y < height; y++)
        png_write_row(j->png, pixels + (size_t)y * (size_t)width * (size_t)channels);
    png_write_end(j->png, NULL);
    return true;
}

enum imp_status imp__png_encode(imp_context *ctx, int width, int height, int channels,
                                const unsigned char *pixels, struct imp_bytes *out)
{
    struct imp_bytes bytes = {0};
    struct png_job j = {.ctx = ctx, .name = "PNG", .to = &bytes};
    j.png = png_create_write_struct_2(PNG_LIBPNG_VER_STRING, &j, on_error, on_warning, &j,
                                      on_allocate, on_free);
    j.info = j.png ? png_create_info_struct(j.png) : NULL;
    enum imp_status st = IMP_OK;
    if (!j.info) st = imp__error(ctx, IMP_E_NOMEM, "PNG: out of memory");
    else if (!encode(&j, width, height, channels, pixels)) st = job_error(&j);
    png_destroy_write_struct(&j.png, &j.info);
    if (st == IMP_OK) *out = bytes;
    else imp__bytes_free(ctx, &bytes);
    return st;
}

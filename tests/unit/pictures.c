/* SPDX-License-Identifier: Apache-2.0
 *
 * Picture files: what is written comes back, foreign variants are read, and files that are
 * cut off, absurd or not pictures give an error that names them. */
#include "imp_tap.h"
#include <openexr.h>
#include <stddef.h>
#include <jpeglib.h>
#include <png.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#include "format/image.h"
#include "imp_fail_alloc.h"

static imp_context *ctx;
static char folder[] = "/tmp/importon-pictures-XXXXXX";

static const char *in_folder(const char *name)
{
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

/* A picture whose every number is different, some beyond [0,1] and negative. */
static imp_film *sample(int width, int height, const char *names, bool with_se)
{
    imp_film *f = NULL;
    if (imp__film_create(ctx, width, height, names, with_se, &f) != IMP_OK) exit(1);
    for (size_t i = 0; i < imp__film_values(f); i++) {
        f->mean[i] = (float)sin((double)i) * 3;
        if (f->se) f->se[i] = (float)i * 0.01f;
    }
    return f;
}

static double difference(const float *a, const float *b, size_t n)
{
    double worst = 0;
    for (size_t i = 0; i < n; i++) {
        const double d = fabs((double)a[i] - (double)b[i]);
        worst = d >= worst || isnan(d) ? d : worst;
    }
    return worst;
}

/* ---- Round trips -------------------------------------------------------------------- */

static void check_exr(void)
{
    static const struct { const char *names, *back; int w, h, half; } cases[] = {
        {"R,G,B", "R,G,B", 37, 23, 0}, {"R,G,B", "R,G,B", 37, 23, 1}, {"Y", "Y", 5, 40, 0},
        {"R,G,B,A", "R,G,B,A", 8, 8, 0}, {"X,Y,Z", "X,Y,Z", 3, 2, 0}, {"Y", "Y", 1, 1, 1},
        {"R,G,B,albedo.R,albedo.G,albedo.B,depth,nn.X,nn.Y,nn.Z",
         "R,G,B,depth,albedo.R,albedo.G,albedo.B,nn.X,nn.Y,nn.Z", 19, 33, 0}};
    for (size_t i = 0; i < imp_count(cases); i++) {
        imp_film *f = sample(cases[i].w, cases[i].h, cases[i].names, true), *g = NULL;
        struct imp_write_options o = IMP_WRITE_OPTIONS_INIT;
        o.half = cases[i].half;
        o.standard_error = 1;
        f->spp = 12345678901;
        f->dropped = 3;
        enum imp_status st = imp_film_set_text(f, "command", "importon render a.xml");
        if (st == IMP_OK) st = imp_film_set_text(f, "a key that is longer than 31 characters", "\xc3\xa9");
        if (st == IMP_OK) st = imp_film_write(f, in_folder("a.exr"), &o);
        if (st == IMP_OK) st = imp_film_read(ctx, in_folder("a.exr"), &g);
        tap_ok(st == IMP_OK, "EXR %s %d x %d%s # %s", cases[i].names, cases[i].w, cases[i].h,
               cases[i].half ? " half" : "", st ? imp_last_error(ctx) : "");
        if (st == IMP_OK) {
            char names[256] = "";
            double worst = 0, worst_se = g->se ? 0 : 1;
            for (int c = 0; c < g->channels; c++) {
                sprintf(names + strlen(names), "%s%s", c ? "," : "", g->names[c]);
                const int k = imp__film_find(f, g->names[c]);
                for (size_t p = 0; k >= 0 && p < (size_t)(g->width * g->height); p++) {
                    const size_t a = p * (size_t)f->channels + (size_t)k,
                                 b = p * (size_t)g->channels + (size_t)c;
                    worst = fmax(worst, fabs((double)f->mean[a] - (double)g->mean[b]));
                    if (g->se) worst_se = fmax(worst_se, fabs((double)f->se[a] - (double)g->se[b]));
                }
            }
            tap_ok(strcmp(names, cases[i].back) == 0, "its channels # %s", names);
            tap_ok(worst <= (o.half ? 3 * 0x1p-11 : 0) && worst_se <= (o.half ? 0.05 : 0),
                   "its numbers # error %.2e, of se %.2e", worst, worst_se);
            tap_ok(g->spp == f->spp && g->dropped == 3, "spp and dropped walks");
            tap_ok(g->n_texts == 2 && strcmp(g->texts[0].value, "importon render a.xml") == 0 &&
                       strcmp(g->texts[1].value, "\xc3\xa9") == 0, "its texts");
        }
        imp_film_destroy(f);
        imp_film_destroy(g);
    }
    imp_film *f = sample(2, 1, "Y", false), *g = NULL;
    struct imp_write_options o = IMP_WRITE_OPTIONS_INIT;
    o.half = 1;
    f->mean[0] = 1e9f;
    f->mean[1] = -INFINITY;
    if (imp_film_write(f, in_folder("h.exr"), &o) == IMP_OK &&
        imp_film_read(ctx, in_folder("h.exr"), &g) == IMP_OK)
        tap_ok(g->mean[0] == 65504 && g->mean[1] == -INFINITY, "half saturates # %g", g->mean[0]);
    imp_film_destroy(f);
    imp_film_destroy(g);
}

static void check_raw(void)
{
    for (int i = 0; i < 4; i++) {
        const char *path = in_folder(i < 2 ? "a.pfm" : "a.npy");
        imp_film *f = sample(7, 5, i % 2 ? "Y" : "R,G,B", false), *g = NULL;
        enum imp_status st = imp_film_write(f, path, NULL);
        if (st == IMP_OK) st = imp_film_read(ctx, path, &g);
        tap_ok(st == IMP_OK && g->channels == f->channels && g->width == 7 && g->height == 5 &&
                   difference(f->mean, g->mean, imp__film_values(f)) == 0,
               "%s of %s # %s", i < 2 ? "PFM" : "NPY", i % 2 ? "Y" : "R,G,B",
               st ? imp_last_error(ctx) : "");
        imp_film_destroy(f);
        imp_film_destroy(g);
    }
    static const unsigned char big[] = "PF\n1 2\n1.0\n"
        "\x3f\x80\0\0\x40\0\0\0\x40\x40\0\0\xbf\x80\0\0\xc0\0\0\0\xc0\x40\0\0";
    struct imp_bytes b = {(unsigned char *)big, sizeof big - 1, 0};
    imp_film *g = NULL;
    bool srgb;
    tap_ok(imp__image_parse(ctx, "b.pfm", &b, &g, &srgb) == IMP_OK && g->mean[0] == -1 &&
               g->mean[3] == 1 && g->mean[5] == 3, "big-endian PFM, rows from the bottom");
    imp_film_destroy(g);
    static const char npy[] = "\x93NUMPY\x01\x00\x40\x00{'descr': '<f8', 'fortran_order': False, "
                              "'shape': (1, 2), }    \n\0\0\0\0\0\0\xf0\x3f\0\0\0\0\0\0\0\x40";
    b = (struct imp_bytes){(unsigned char *)npy, sizeof npy - 1, 0};
    g = NULL;
    const enum imp_status st = imp__image_parse(ctx, "b.npy", &b, &g, &srgb);
    tap_ok(st == IMP_OK && g->width == 2 && g->mean[0] == 1 && g->mean[1] == 2,
           "NPY of doubles # %s", st ? imp_last_error(ctx) : "");
    imp_film_destroy(g);
}

static void check_hdr(void)
{
    for (int i = 0; i < 2; i++) {
        imp_film *f = sample(11, 4, i ? "Y" : "R,G,B", false), *g = NULL;
        for (size_t k = 0; k < imp__film_values(f); k++)
            f->mean[k] = (float)exp(3 * (double)f->mean[k]);
        f->mean[0] = 0;
        enum imp_status st = imp_film_write(f, in_folder("a.hdr"), NULL);
        if (st == IMP_OK) st = imp_film_read(ctx, in_folder("a.hdr"), &g);
        double worst = g ? 0 : 1; /* half a step of eight bits of the brightest component */
        for (int p = 0; g && p < 44; p++) {
            double most = 0, error = 0;
            for (int c = 0; c < 3; c++) {
                const double want = (double)f->mean[p * f->channels + (i ? 0 : c)];
                most = fmax(most, want);
                error = fmax(error, fabs((double)g->mean[3 * p + c] - want));
            }
            worst = fmax(worst, most > 0 ? error / most : error);
        }
        tap_ok(worst <= 1.001 / 256, "HDR of %s # relative error %.2e %s", i ? "Y" : "R,G,B", worst,
               st ? imp_last_error(ctx) : "");
        imp_film_destroy(f);
        imp_film_destroy(g);
    }
    static const unsigned char runs[] = "#?RADIANCE\nEXPOSURE=1\nFORMAT=32-bit_rle_rgbe\n\n"
        "-Y 1 +X 8\n\x02\x02\x00\x08\x88\x80\x88\x40\x02\x00\x01\x86\x20\x88\x81";
    struct imp_bytes b = {(unsigned char *)runs, sizeof runs - 1, 0};
    imp_film *g = NULL;
    bool srgb = true;
    const enum imp_status st = imp__image_parse(ctx, "r.hdr", &b, &g, &srgb);
    tap_ok(st == IMP_OK && !srgb && g->mean[21] == 128.5f / 128 && g->mean[22] == 64.5f / 128 &&
               g->mean[2] == 0.5f / 128 && g->mean[5] == 1.5f / 128 && g->mean[23] == 32.5f / 128,
           "HDR of runs and literals # %s", st ? imp_last_error(ctx) : "");
    imp_film_destroy(g);
}

static void check_png(void)
{
    imp_film *f = sample(16, 16, "R,G,B", false), *g = NULL;
    for (size_t i = 0; i < 256; i++)
        for (size_t c = 0; c < 3; c++)
            f->mean[3 * i + c] = (float)((double)(i + c) / 300);
    enum imp_status st = imp_film_write(f, in_folder("a.png"), NULL);
    if (st == IMP_OK) st = imp_film_read(ctx, in_folder("a.png"), &g);
    tap_ok(st == IMP_OK, "PNG # %s", st ? imp_last_error(ctx) : "");
    /* Half a code value at the steep end of the curve: 0.5/255 * dL/dc(1) = 0.5/255 * 2.27. */
    if (g) tap_near(difference(f->mean, g->mean, 768), 0, 0, 0.5 / 255 * 2.28, "sRGB there and back");
    imp_film_destroy(g);

    struct imp_write_options o = IMP_WRITE_OPTIONS_INIT;
    o.exposure = 1;
    g = NULL;
    if (imp_film_write(f, in_folder("a.png"), &o) == IMP_OK &&
        imp_film_read(ctx, in_folder("a.png"), &g) == IMP_OK)
        tap_ok(fabs(g->mean[3 * 60] - 0.4f) < 0.01 && g->mean[3 * 200] == 1, "one stop brighter, clipped");
    imp_film_destroy(g);
    imp_film_destroy(f);

    f = sample(3, 1, "Y", false);
    f->mean[0] = -2, f->mean[1] = 0, f->mean[2] = 2;
    o = (struct imp_write_options)IMP_WRITE_OPTIONS_INIT;
    o.diverging = 1;
    g = NULL;
    if (imp_film_write(f, in_folder("d.png"), &o) == IMP_OK &&
        imp_film_read(ctx, in_folder("d.png"), &g) == IMP_OK)
        tap_ok(g->channels == 3 && g->mean[2] > g->mean[0] && g->mean[3] == 1 && g->mean[4] == 1 &&
                   g->mean[6] > g->mean[8], "blue, white, red");
    imp_film_destroy(g);
    imp_film_destroy(f);
    f = sample(2, 2, "Y", false);
    tap_ok(imp_film_write(f, in_folder("a.tiff"), NULL) == IMP_E_ARG, "unknown extensions are refused");
    imp_film_destroy(f);
}

/* ---- Foreign variants ----------------------------------------------------------------- */

/* PNG of every kind: grey, palette, alpha, 1 to 16 bits, interlaced or not; 8 x 4 pixels,
 * pixel (x, y) has the code (x + 8 y) * maximum / 31 (palettes: index mod colours). */
static struct imp_bytes png_make(int type, int depth, int interlaced)
{
    struct imp_bytes b = {0};
    FILE *file = fopen(in_folder("v.png"), "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, file);
    png_set_IHDR(png, info, 8, 4, depth, type, interlaced ? PNG_INTERLACE_ADAM7 : 0, 0, 0);
    png_color colors[2] = {{0, 0, 0}, {255, 0, 51}};
    if (type == PNG_COLOR_TYPE_PALETTE) png_set_PLTE(png, info, colors, 2);
    png_write_info(png, info);
    const int channels = type == PNG_COLOR_TYPE_RGB ? 3 : type == PNG_COLOR_TYPE_RGB_ALPHA ? 4
                         : type == PNG_COLOR_TYPE_GRAY_ALPHA ? 2 : 1;
    unsigned char rows[4][64] = {{0}};
    png_bytep pointers[4];
    const int maximum = (1 << depth) - 1;
    for (int y = 0; y < 4; y++) {
        pointers[y] = rows[y];
        for (int x = 0; x < 8; x++)
            for (int c = 0; c < channels; c++) {
                const int code = type == PNG_COLOR_TYPE_PALETTE ? x % 2 : (x + 8 * y) * maximum / 31;
                const int at = (x * channels + c) * depth;
                if (depth == 16) rows[y][at / 8] = (unsigned char)(code >> 8), rows[y][at / 8 + 1] = (unsigned char)code;
                else rows[y][at / 8] |= (unsigned char)(code << (8 - depth - at % 8));
            }
    }
    png_write_image(png, pointers);
    png_write_end(png, NULL);
    png_destroy_write_struct(&png, &info);
    fclose(file);
    if (imp__file_read(ctx, in_folder("v.png"), 1 << 20, &b) != IMP_OK) exit(1);
    return b;
}

static void check_png_variants(void)
{
    static const int kinds[][2] = {{PNG_COLOR_TYPE_GRAY, 1}, {PNG_COLOR_TYPE_GRAY, 4},
        {PNG_COLOR_TYPE_GRAY, 8}, {PNG_COLOR_TYPE_GRAY, 16}, {PNG_COLOR_TYPE_RGB, 8},
        {PNG_COLOR_TYPE_RGB, 16}, {PNG_COLOR_TYPE_RGB_ALPHA, 8}, {PNG_COLOR_TYPE_GRAY_ALPHA, 16},
        {PNG_COLOR_TYPE_PALETTE, 1}, {PNG_COLOR_TYPE_PALETTE, 8}};
    for (size_t i = 0; i < 2 * imp_count(kinds); i++) {
        const int type = kinds[i / 2][0], depth = kinds[i / 2][1];
        struct imp_bytes b = png_make(type, depth, i % 2);
        imp_film *g = NULL;
        bool srgb = false;
        const enum imp_status st = imp__image_parse(ctx, "v.png", &b, &g, &srgb);
        double worst = g ? 0 : 1;
        const double maximum = (1 << depth) - 1;
        for (int k = 0; g && k < 32; k++)
            for (int c = 0; c < g->channels; c++) {
                static const double colors[2][3] = {{0, 0, 0}, {1, 0, 0.2}};
                const double want = type == PNG_COLOR_TYPE_PALETTE ? colors[k % 2][c]
                                    : floor(k * maximum / 31) / maximum;
                worst = fmax(worst, fabs((double)g->mean[k * g->channels + c] - want));
            }
        tap_ok(st == IMP_OK && srgb && worst < 1e-6, "PNG type %d, %d bits%s # error %.1e %s", type,
               depth, i % 2 ? ", interlaced" : "", worst, st ? imp_last_error(ctx) : "");
        imp_film_destroy(g);
        imp__bytes_free(ctx, &b);
    }
}

static struct imp_bytes jpeg_make(int channels, int progressive)
{
    struct jpeg_compress_struct jpeg;
    struct jpeg_error_mgr errors;
    unsigned char *memory = NULL, row[3 * 20];
    unsigned long size = 0;
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    jpeg_mem_dest(&jpeg, &memory, &size);
    jpeg.image_width = 20;
    jpeg.image_height = 12;
    jpeg.input_components = channels;
    jpeg.in_color_space = channels == 3 ? JCS_RGB : JCS_GRAYSCALE;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, 98, TRUE);
    if (progressive) jpeg_simple_progression(&jpeg);
    jpeg_start_compress(&jpeg, TRUE);
    for (int y = 0; y < 12; y++) {
        for (int x = 0; x < 20; x++)
            for (int c = 0; c < channels; c++)
                row[x * channels + c] = (unsigned char)(40 + 8 * x + 3 * c * (channels > 1));
        JSAMPROW rows[1] = {row};
        jpeg_write_scanlines(&jpeg, rows, 1);
    }
    jpeg_finish_compress(&jpeg);
    struct imp_bytes b = {0};
    imp__bytes_add(ctx, &b, memory, size);
    jpeg_destroy_compress(&jpeg);
    free(memory);
    return b;
}

static void check_jpeg(void)
{
    for (int i = 0; i < 4; i++) {
        struct imp_bytes b = jpeg_make(i % 2 ? 3 : 1, i / 2);
        imp_film *g = NULL;
        bool srgb = false;
        const enum imp_status st = imp__image_parse(ctx, "v.jpg", &b, &g, &srgb);
        double worst = 1;
        if (st == IMP_OK) {
            worst = 0;
            for (int x = 0; x < 20; x++)
                for (int c = 0; c < g->channels; c++)
                    worst = fmax(worst, fabs((double)g->mean[x * g->channels + c] -
                                             (40 + 8 * x + 3 * c) / 255.0));
        }
        tap_ok(st == IMP_OK && srgb && worst < 4 / 255.0, "JPEG of %d channels%s # error %.3f %s",
               i % 2 ? 3 : 1, i / 2 ? ", progressive" : "", worst, st ? imp_last_error(ctx) : "");
        imp_film_destroy(g);
        imp__bytes_free(ctx, &b);
    }
}

/* EXR of 21 x 13 pixels, channels B (half), G (float), R (uint), Z (half): number
 * 8 y + x + 100 channel. */
static struct imp_bytes exr_make(exr_compression_t compression, int tiled)
{
    enum { W = 21, H = 13 };
    static const char *const names[] = {"B", "G", "R", "Z"};
    static const exr_pixel_type_t types[] = {EXR_PIXEL_HALF, EXR_PIXEL_FLOAT, EXR_PIXEL_UINT,
                                             EXR_PIXEL_HALF};
    float values[4][H][W];
    uint32_t whole[H][W];
    for (int c = 0; c < 4; c++)
        for (int y = 0; y < H; y++)
            for (int x = 0; x < W; x++) {
                values[c][y][x] = (float)(8 * y + x + 100 * c);
                if (c == 2) whole[y][x] = (uint32_t)values[c][y][x];
            }
    exr_context_t exr;
    exr_context_initializer_t setup = EXR_DEFAULT_CONTEXT_INITIALIZER;
    int part, bad = exr_start_write(&exr, in_folder("v.exr"), EXR_WRITE_FILE_DIRECTLY, &setup);
    bad |= exr_add_part(exr, NULL, tiled ? EXR_STORAGE_TILED : EXR_STORAGE_SCANLINE, &part);
    bad |= exr_initialize_required_attr_simple(exr, part, W, H, compression);
    exr_attr_box2i_t window;
    window.min.x = -3, window.max.x = window.min.x + W - 1;
    window.min.y = 5, window.max.y = window.min.y + H - 1;
    bad |= exr_set_data_window(exr, part, &window);
    if (tiled) bad |= exr_set_tile_descriptor(exr, part, 8, 8, EXR_TILE_ONE_LEVEL, EXR_TILE_ROUND_DOWN);
    for (int c = 0; c < 4; c++)
        bad |= exr_add_channel(exr, part, names[c], types[c], EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
    bad |= exr_write_header(exr);
    exr_encode_pipeline_t pipe = EXR_ENCODE_PIPELINE_INITIALIZER;
    int32_t lines = 8;
    if (!tiled) bad |= exr_get_scanlines_per_chunk(exr, part, &lines);
    bool first = true;
    for (int y = 0; y < H; y += lines)
        for (int x = 0; x < (tiled ? W : 1); x += 8) {
            exr_chunk_info_t chunk;
            bad |= tiled ? exr_write_tile_chunk_info(exr, part, x / 8, y / 8, 0, 0, &chunk)
                         : exr_write_scanline_chunk_info(exr, part, y + 5, &chunk);
            bad |= first ? exr_encoding_initialize(exr, part, &chunk, &pipe)
                         : exr_encoding_update(exr, part, &chunk, &pipe);
            for (int c = 0; c < 4; c++) {
                exr_coding_channel_info_t *p = &pipe.channels[c];
                p->user_data_type = c == 2 ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
                p->user_bytes_per_element = 4;
                p->user_pixel_stride = 4;
                p->user_line_stride = 4 * W;
                p->encode_from_ptr = c == 2 ? (const uint8_t *)&whole[y][x] : (const uint8_t *)&values[c][y][x];
            }
            if (first) bad |= exr_encoding_choose_default_routines(exr, part, &pipe);
            first = false;
            bad |= exr_encoding_run(exr, part, &pipe);
        }
    exr_encoding_destroy(exr, &pipe);
    bad |= exr_finish(&exr);
    struct imp_bytes b = {0};
    if (bad || imp__file_read(ctx, in_folder("v.exr"), 1 << 20, &b) != IMP_OK)
        printf("# cannot make compression %d tiled %d\n", compression, tiled);
    return b;
}

static void check_exr_variants(void)
{
    static const exr_compression_t compressions[] = {EXR_COMPRESSION_NONE, EXR_COMPRESSION_RLE,
        EXR_COMPRESSION_ZIPS, EXR_COMPRESSION_ZIP, EXR_COMPRESSION_PIZ};
    for (size_t i = 0; i < 2 * imp_count(compressions); i++) {
        struct imp_bytes b = exr_make(compressions[i / 2], i % 2);
        imp_film *g = NULL;
        bool srgb;
        const enum imp_status st = imp__image_parse(ctx, "v.exr", &b, &g, &srgb);
        double worst = 1;
        if (st == IMP_OK && g->channels == 4) {
            static const int base[] = {200, 100, 0, 300}; /* R, G, B, Z */
            worst = 0;
            for (int p = 0; p < 21 * 13; p++)
                for (int c = 0; c < 4; c++)
                    worst = fmax(worst, fabs((double)g->mean[4 * p + c] -
                                             (8 * (p / 21) + p % 21 + base[c])));
        }
        tap_ok(st == IMP_OK && worst == 0 && strcmp(g->names[0], "R") == 0,
               "EXR compression %d%s # error %g %s", compressions[i / 2], i % 2 ? ", tiled" : "",
               worst, st ? imp_last_error(ctx) : "");
        if (st == IMP_OK) {
            const struct imp_pick pick = imp__image_pick(g);
            if (i == 0) tap_ok(pick.n == 3 && pick.channel[2] == 2 && !pick.xyz, "its colours");
        }
        imp_film_destroy(g);
        imp__bytes_free(ctx, &b);
    }
}

/* ---- Hostile files ---------------------------------------------------------------------- */

static struct imp_bytes film_bytes(const char *name, const char *names)
{
    imp_film *f = sample(6, 5, names, false);
    struct imp_bytes b = {0};
    if (imp_film_write(f, in_folder(name), NULL) != IMP_OK ||
        imp__file_read(ctx, in_folder(name), 1 << 20, &b) != IMP_OK)
        exit(1);
    imp_film_destroy(f);
    return b;
}

/* Cut at every byte: an error that names the file; `slack` last bytes may be missing. */
static void check_cut(const char *name, struct imp_bytes b, size_t slack)
{
    int wrong = 0, read = 0;
    for (size_t n = 0; n < b.size; n++) {
        imp_film *g = NULL;
        bool srgb;
        struct imp_bytes cut = {malloc(n ? n : 1), n, 0}; /* exact: overruns are seen */
        memcpy(cut.data, b.data, n);
        const enum imp_status st = imp__image_parse(ctx, name, &cut, &g, &srgb);
        if (st == IMP_OK) read++;
        if (st == IMP_OK && n + slack < b.size) wrong++;
        if (st != IMP_OK && strncmp(imp_last_error(ctx), name, strlen(name)) != 0) wrong++;
        imp_film_destroy(g);
        free(cut.data);
    }
    /* And with every byte damaged in turn: anything but a crash. */
    for (size_t i = 0; i < b.size; i++)
        for (int k = 0; k < 3; k++) {
            imp_film *g = NULL;
            bool srgb;
            const unsigned char old = b.data[i];
            b.data[i] = (unsigned char)(k == 0 ? ~old : k == 1 ? 0xff : 0x80);
            if (imp__image_parse(ctx, name, &b, &g, &srgb) == IMP_OK) imp_film_destroy(g);
            b.data[i] = old;
        }
    tap_ok(wrong == 0, "%s cut and damaged anywhere # %zu bytes, %d wrong, %d read", name, b.size,
           wrong, read);
    imp__bytes_free(ctx, &b);
}

static void check_hostile(void)
{
    check_cut("c.exr", film_bytes("c.exr", "R,G,B"), 0);
    check_cut("v.exr", exr_make(EXR_COMPRESSION_PIZ, 1), 0);
    check_cut("c.pfm", film_bytes("c.pfm", "R,G,B"), 0);
    check_cut("c.hdr", film_bytes("c.hdr", "R,G,B"), 0);
    check_cut("c.npy", film_bytes("c.npy", "R,G,B"), 0);
    check_cut("c.png", film_bytes("c.png", "R,G,B"), 0);
    check_cut("v.png", png_make(PNG_COLOR_TYPE_PALETTE, 1, 1), 0);
    check_cut("v.jpg", jpeg_make(3, 0), 2);
    static const struct { const char *bytes; size_t n; const char *message; } absurd[] = {
        {"PF\n1000000 1000000\n-1\n", 22, "x: cut off"},
        {"PF\nnan 1\n-1\n", 12, "x: PFM of nan x 1, scale -1"},
        {"PF\n-5 1\n-1\n", 11, "x: PFM of -5 x 1, scale -1"},
        {"GIF89a", 6, "x: not an EXR, PNG, JPEG, HDR, PFM or NPY picture"},
        {"", 0, "x: not an EXR, PNG, JPEG, HDR, PFM or NPY picture"},
        /* A PNG that claims 2^19 x 2^19 pixels. */
        {"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\x08\0\0\0\x08\0\0\x08\x02\0\0\0\x8c\x17\x3b\x9b", 33, "x: "}};
    for (size_t i = 0; i < imp_count(absurd); i++) {
        struct imp_bytes b = {(unsigned char *)absurd[i].bytes, absurd[i].n, 0};
        imp_film *g = NULL;
        bool srgb;
        const enum imp_status st = imp__image_parse(ctx, "x", &b, &g, &srgb);
        tap_ok(st == IMP_E_SCENE && strncmp(imp_last_error(ctx), absurd[i].message,
                                            strlen(absurd[i].message)) == 0,
               "%s # %s", absurd[i].message, imp_last_error(ctx));
    }
    imp_film *g = NULL;
    tap_ok(imp_film_read(ctx, in_folder("none.exr"), &g) == IMP_E_IO && !g, "a missing file # %s",
           imp_last_error(ctx));
    tap_ok(imp_film_create(ctx, 0, 5, "Y", &g) == IMP_E_ARG &&
               imp_film_create(ctx, 5, 5, "R,R", &g) == IMP_E_ARG &&
               imp_film_create(ctx, 5, 5, "", &g) == IMP_E_ARG && !g, "films that cannot be");
}

/* ---- Failing writes ---------------------------------------------------------------------- */

static void check_atomic(void)
{
    imp_film *f = sample(64, 64, "R,G,B", false), *g = NULL;
    struct stat info;
    bool ok = imp_film_write(f, in_folder("keep.exr"), NULL) == IMP_OK;
    f->mean[0] = 77;
    /* A limit on the size of files fails the write half way, as a full disk does. */
    struct rlimit old, low;
    getrlimit(RLIMIT_FSIZE, &old);
    low = old;
    low.rlim_cur = 1000;
    setrlimit(RLIMIT_FSIZE, &low);
    const enum imp_status st = imp_film_write(f, in_folder("keep.exr"), NULL);
    setrlimit(RLIMIT_FSIZE, &old);
    tap_ok(ok && st == IMP_E_IO, "a write that cannot finish is an error # %s", imp_last_error(ctx));
    ok = imp_film_read(ctx, in_folder("keep.exr"), &g) == IMP_OK && g->mean[0] != 77;
    tap_ok(ok, "and the old file stays");
    char command[300];
    snprintf(command, sizeof command, "ls %s | grep -q tmp", folder);
    tap_ok(system(command) != 0, "and nothing else is left");
    imp_film_destroy(g);
    tap_ok(imp_film_write(f, "/nowhere/at/all.exr", NULL) == IMP_E_IO, "no such folder # %s",
           imp_last_error(ctx));
    if (access("/dev/full", W_OK) == 0) { /* through a link whose name has an extension */
        if (symlink("/dev/full", in_folder("full.exr")) == 0)
            tap_ok(imp_film_write(f, in_folder("full.exr"), NULL) == IMP_E_IO, "a full device # %s",
                   imp_last_error(ctx));
    }
    if (symlink("keep.exr", in_folder("link.exr")) == 0) {
        ok = imp_film_write(f, in_folder("link.exr"), NULL) == IMP_OK &&
             lstat(in_folder("link.exr"), &info) == 0 && S_ISLNK(info.st_mode);
        g = NULL;
        ok = ok && imp_film_read(ctx, in_folder("keep.exr"), &g) == IMP_OK && g->mean[0] == 77;
        tap_ok(ok, "links are written through");
        imp_film_destroy(g);
    }
    imp_film_destroy(f);
}

/* ---- Memory ------------------------------------------------------------------------------- */

static void check_memory(const char *name, struct imp_bytes b)
{
    struct fail_alloc heap = {0};
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    o.threads = 1;
    o.allocator = fail_alloc_hooks(&heap);
    imp_context *fragile;
    if (imp_context_create(&o, &fragile) != IMP_OK) return;
    int steps = 0, wrong = 0;
    for (enum imp_status st = IMP_E_NOMEM; st != IMP_OK && steps < 10000; steps++) {
        imp_film *g = NULL;
        bool srgb;
        heap.calls = 0;
        heap.fail_at = steps + 1;
        st = imp__image_parse(fragile, name, &b, &g, &srgb);
        struct imp_bytes out = {0};
        struct imp_write_options w = IMP_WRITE_OPTIONS_INIT;
        w.half = 1;
        if (st == IMP_OK) st = imp__exr_encode(g, &w, &out);
        if (st == IMP_OK) {
            unsigned char pixels[3] = {1, 2, 3};
            struct imp_bytes png = {0};
            st = imp__png_encode(fragile, 1, 1, 3, pixels, &png);
            imp__bytes_free(fragile, &png);
        }
        heap.fail_at = 0;
        wrong += st != IMP_OK && st != IMP_E_NOMEM;
        if (st != IMP_OK && st != IMP_E_NOMEM) printf("# step %d: %s\n", steps, imp_last_error(fragile));
        imp__bytes_free(fragile, &out);
        imp_film_destroy(g);
    }
    imp_context_destroy(fragile);
    tap_ok(steps > 3 && wrong == 0 && heap.live == 0,
           "%s: no memory at the n-th allocation # %d allocations, %d wrong, %ld leaked", name, steps,
           wrong, heap.live);
    imp__bytes_free(ctx, &b);
}

int main(void)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    o.threads = 1;
    if (imp_context_create(&o, &ctx) != IMP_OK || !mkdtemp(folder)) return 1;
    signal(SIGXFSZ, SIG_IGN);
    check_exr();
    check_raw();
    check_hdr();
    check_png();
    check_png_variants();
    check_jpeg();
    check_exr_variants();
    check_hostile();
    check_atomic();
    check_memory("c.exr", film_bytes("c.exr", "R,G,B"));
    check_memory("v.png", png_make(PNG_COLOR_TYPE_RGB, 8, 0));
    check_memory("v.jpg", jpeg_make(3, 0));
    char command[300];
    snprintf(command, sizeof command, "rm -r %s", folder);
    if (system(command) != 0) printf("# %s stays\n", folder);
    imp_context_destroy(ctx);
    return tap_done();
}

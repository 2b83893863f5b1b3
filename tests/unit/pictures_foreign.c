/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures from others: every variant of EXR, PNG and JPEG is read; files that are cut
 * off, damaged, absurd or not pictures give an error that names them; memory may end
 * anywhere. */
#include "imp_fail_alloc.h"
#include "picture_kit.h"
#include <jpeglib.h>
#include <openexr.h>
#include <png.h>

/* ---- Foreign variants ---------------------------------------------------------- */

/* PNG of every kind: grey, palette, alpha, 1 to 16 bits, interlaced or not; 8 x 4 pixels,
 * pixel (x, y) has the code (x + 8 y) * maximum / 31 (palettes: index mod colours). */
static struct imp_bytes png_make(int type, int depth, int interlaced)
{
    struct imp_bytes b = {0};
    FILE *file = fopen(in_folder("v.png"), "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, file);
    png_set_IHDR(png, info, 8, 4, depth, type, interlaced ? PNG_INTERLACE_ADAM7 : 0, 0,
                 0);
    png_color colors[2] = {{0, 0, 0}, {255, 0, 51}};
    if (type == PNG_COLOR_TYPE_PALETTE) png_set_PLTE(png, info, colors, 2);
    png_write_info(png, info);
    const int channels = type == PNG_COLOR_TYPE_RGB          ? 3
                         : type == PNG_COLOR_TYPE_RGB_ALPHA  ? 4
                         : type == PNG_COLOR_TYPE_GRAY_ALPHA ? 2
                                                             : 1;
    unsigned char rows[4][64] = {{0}};
    png_bytep pointers[4];
    const int maximum = (1 << depth) - 1;
    for (int y = 0; y < 4; y++) {
        pointers[y] = rows[y];
        for (int x = 0; x < 8; x++)
            for (int c = 0; c < channels; c++) {
                const int code =
                    type == PNG_COLOR_TYPE_PALETTE ? x % 2 : (x + 8 * y) * maximum / 31;
                const int at = (x * channels + c) * depth;
                if (depth == 16)
                    rows[y][at / 8] = (unsigned char)(code >> 8),
                                 rows[y][at / 8 + 1] = (unsigned char)code;
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
    static const int kinds[][2] = {
        {PNG_COLOR_TYPE_GRAY, 1},      {PNG_COLOR_TYPE_GRAY, 4},
        {PNG_COLOR_TYPE_GRAY, 8},      {PNG_COLOR_TYPE_GRAY, 16},
        {PNG_COLOR_TYPE_RGB, 8},       {PNG_COLOR_TYPE_RGB, 16},
        {PNG_COLOR_TYPE_RGB_ALPHA, 8}, {PNG_COLOR_TYPE_GRAY_ALPHA, 16},
        {PNG_COLOR_TYPE_PALETTE, 1},   {PNG_COLOR_TYPE_PALETTE, 8}};
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
                const double want = type == PNG_COLOR_TYPE_PALETTE
                                        ? colors[k % 2][c]
                                        : floor(k * maximum / 31) / maximum;
                worst = fmax(worst, fabs((double)g->mean[k * g->channels + c] - want));
            }
        tap_ok(st == IMP_OK && srgb && worst < 1e-6,
               "PNG type %d, %d bits%s # error %.1e %s", type, depth,
               i % 2 ? ", interlaced" : "", worst, st ? imp_last_error(ctx) : "");
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
                row[x * channels + c] =
                    (unsigned char)(40 + 8 * x + 3 * c * (channels > 1));
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
        tap_ok(st == IMP_OK && srgb && worst < 4 / 255.0,
               "JPEG of %d channels%s # error %.3f %s", i % 2 ? 3 : 1,
               i / 2 ? ", progressive" : "", worst, st ? imp_last_error(ctx) : "");
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
    static const exr_pixel_type_t types[] = {EXR_PIXEL_HALF, EXR_PIXEL_FLOAT,
                                             EXR_PIXEL_UINT, EXR_PIXEL_HALF};
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
    int part,
        bad = exr_start_write(&exr, in_folder("v.exr"), EXR_WRITE_FILE_DIRECTLY, &setup);
    bad |=
        exr_add_part(exr, NULL, tiled ? EXR_STORAGE_TILED : EXR_STORAGE_SCANLINE, &part);
    bad |= exr_initialize_required_attr_simple(exr, part, W, H, compression);
    exr_attr_box2i_t window;
    window.min.x = -3, window.max.x = window.min.x + W - 1;
    window.min.y = 5, window.max.y = window.min.y + H - 1;
    bad |= exr_set_data_window(exr, part, &window);
    if (tiled)
        bad |= exr_set_tile_descriptor(exr, part, 8, 8, EXR_TILE_ONE_LEVEL,
                                       EXR_TILE_ROUND_DOWN);
    for (int c = 0; c < 4; c++)
        bad |= exr_add_channel(exr, part, names[c], types[c],
                               EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
    bad |= exr_write_header(exr);
    exr_encode_pipeline_t pipe = EXR_ENCODE_PIPELINE_INITIALIZER;
    int32_t lines = 8;
    if (!tiled) bad |= exr_get_scanlines_per_chunk(exr, part, &lines);
    bool first = true;
    for (int y = 0; y < H; y += lines)
        for (int x = 0; x < (tiled ? W : 1); x += 8) {
            exr_chunk_info_t chunk;
            bad |= tiled
                       ? exr_write_tile_chunk_info(exr, part, x / 8, y / 8, 0, 0, &chunk)
                       : exr_write_scanline_chunk_info(exr, part, y + 5, &chunk);
            bad |= first ? exr_encoding_initialize(exr, part, &chunk, &pipe)
                         : exr_encoding_update(exr, part, &chunk, &pipe);
            for (int c = 0; c < 4; c++) {
                exr_coding_channel_info_t *p = &pipe.channels[c];
                p->user_data_type = c == 2 ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
                p->user_bytes_per_element = 4;
                p->user_pixel_stride = 4;
                p->user_line_stride = 4 * W;
                p->encode_from_ptr = c == 2 ? (const uint8_t *)&whole[y][x]
                                            : (const uint8_t *)&values[c][y][x];
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
    static const exr_compression_t compressions[] = {
        EXR_COMPRESSION_NONE, EXR_COMPRESSION_RLE, EXR_COMPRESSION_ZIPS,
        EXR_COMPRESSION_ZIP, EXR_COMPRESSION_PIZ};
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
               "EXR compression %d%s # error %g %s", compressions[i / 2],
               i % 2 ? ", tiled" : "", worst, st ? imp_last_error(ctx) : "");
        if (st == IMP_OK) {
            const struct imp_pick pick = imp__image_pick(g);
            if (i == 0)
                tap_ok(pick.n == 3 && pick.channel[2] == 2 && !pick.xyz, "its colours");
        }
        imp_film_destroy(g);
        imp__bytes_free(ctx, &b);
    }
}

/* ---- Hostile files --------------------------------------------------------------------
 */

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
        if (st != IMP_OK && strncmp(imp_last_error(ctx), name, strlen(name)) != 0)
            wrong++;
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
    tap_ok(wrong == 0, "%s cut and damaged anywhere # %zu bytes, %d wrong, %d read", name,
           b.size, wrong, read);
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
    static const struct {
        const char *bytes;
        size_t n;
        const char *message;
    } absurd[] = {
        {"PF\n1000000 1000000\n-1\n", 22, "x: cut off"},
        {"PF\nnan 1\n-1\n", 12, "x: PFM of nan x 1, scale -1"},
        {"PF\n-5 1\n-1\n", 11, "x: PFM of -5 x 1, scale -1"},
        {"GIF89a", 6,
         "x: not an EXR, PNG, JPEG, TIFF, DNG, BMP, TGA, PPM, HDR, PFM or NPY picture"},
        {"", 0,
         "x: not an EXR, PNG, JPEG, TIFF, DNG, BMP, TGA, PPM, HDR, PFM or NPY picture"},
        /* A PNG that claims 2^19 x 2^19 pixels. */
        {"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\x08\0\0\0\x08\0\0\x08\x02\0\0\0\x8c"
         "\x17\x3b\x9b",
         33, "x: "}};
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
    tap_ok(imp_film_read(ctx, in_folder("none.exr"), &g) == IMP_E_IO && !g,
           "a missing file # %s", imp_last_error(ctx));
    tap_ok(imp_film_create(ctx, 0, 5, "Y", &g) == IMP_E_ARG &&
               imp_film_create(ctx, 5, 5, "R,R", &g) == IMP_E_ARG &&
               imp_film_create(ctx, 5, 5, "", &g) == IMP_E_ARG && !g,
           "films that cannot be");
}

/* ---- Memory ---------------------------------------------------------------------------
 */

static void check_memory(const char *name, struct imp_bytes b)
{
    struct fail_alloc heap = {0};
    imp_context *fragile = fail_alloc_context(&heap);
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
        if (st != IMP_OK && st != IMP_E_NOMEM)
            printf("# step %d: %s\n", steps, imp_last_error(fragile));
        imp__bytes_free(fragile, &out);
        imp_film_destroy(g);
    }
    imp_context_destroy(fragile);
    tap_ok(steps > 3 && wrong == 0 && heap.live == 0,
           "%s: no memory at the n-th allocation # %d allocations, %d wrong, %ld leaked",
           name, steps, wrong, heap.live);
    imp__bytes_free(ctx, &b);
}

int main(void)
{
    if (!kit_open()) return 1;
    check_png_variants();
    check_jpeg();
    check_exr_variants();
    check_hostile();
    check_memory("c.exr", film_bytes("c.exr", "R,G,B"));
    check_memory("v.png", png_make(PNG_COLOR_TYPE_RGB, 8, 0));
    check_memory("v.jpg", jpeg_make(3, 0));
    return kit_close();
}

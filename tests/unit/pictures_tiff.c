/* SPDX-License-Identifier: Apache-2.0
 *
 * TIFF files as others write them: every layout that is read gives the numbers that were written, in both
 * byte orders and each compression; others are refused by name, and damaged files end in a message. */
#include "picture_kit.h"
#include <tiffio.h>

enum { WIDTH = 9, HEIGHT = 5 };

struct variant {
    const char *name, *mode; /* "wl", "wb": byte order */
    int bits, samples, photometric, compression, predictor, planar, rows;
};

/* The code of channel c of pixel (x, y); floats are a hundredth of it. */
static int code_of(const struct variant *v, int x, int y, int c)
{
    const int k = 5 * x + 29 * y + 30 * c; /* 246 at most */
    return v->bits == 16 ? 257 * k + 3 * x : k;
}

static struct imp_bytes tiff_make(const struct variant *v)
{
    static uint16_t map[256];
    struct imp_bytes b = {0};
    TIFF *t = TIFFOpen(in_folder("v.tif"), v->mode);
    const int planes = v->planar == PLANARCONFIG_SEPARATE ? v->samples : 1;
    TIFFSetField(t, TIFFTAG_IMAGEWIDTH, WIDTH);
    TIFFSetField(t, TIFFTAG_IMAGELENGTH, HEIGHT);
    TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, v->bits);
    TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, v->samples);
    TIFFSetField(t, TIFFTAG_PHOTOMETRIC, v->photometric);
    TIFFSetField(t, TIFFTAG_COMPRESSION, v->compression);
    TIFFSetField(t, TIFFTAG_PLANARCONFIG, v->planar);
    TIFFSetField(t, TIFFTAG_ROWSPERSTRIP, v->rows);
    if (v->predictor) TIFFSetField(t, TIFFTAG_PREDICTOR, v->predictor);
    if (v->bits == 32) TIFFSetField(t, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
    if (v->photometric == PHOTOMETRIC_PALETTE) /* without one libtiff takes it for grey */
        TIFFSetField(t, TIFFTAG_COLORMAP, map, map, map);
    for (int plane = 0; plane < planes; plane++)
        for (int y = 0; y < HEIGHT; y++) {
            unsigned char row[WIDTH * 4 * 4] = {0};
            const int per = planes > 1 ? 1 : v->samples;
            for (int i = 0; i < WIDTH * per; i++) {
                const int code = code_of(v, i / per, y, planes > 1 ? plane : i % per);
                const uint16_t deep = (uint16_t)code;
                const float real = (float)code / 100;
                if (v->bits == 8) row[i] = (unsigned char)code;
                else if (v->bits == 16) memcpy(row + 2 * i, &deep, 2);
                else memcpy(row + 4 * i, &real, 4);
            }
            TIFFWriteScanline(t, row, (uint32_t)y, (uint16_t)plane);
        }
    TIFFClose(t);
    if (imp__file_read(ctx, in_folder("v.tif"), 1 << 20, &b) != IMP_OK) exit(1);
    return b;
}

static double wanted(const struct variant *v, int x, int y, int c)
{
    const int code = code_of(v, x, y, c);
    const double k = v->bits == 32 ? code / 100. : code / (v->bits == 16 ? 65535. : 255.);
    return v->photometric == PHOTOMETRIC_MINISWHITE && c == 0 ? 1 - k : k;
}

static const struct variant variants[] = {
    {"grey", "wl", 8, 1, PHOTOMETRIC_MINISBLACK, COMPRESSION_NONE, 0, 1, 5},
    {"white is 0", "wb", 8, 1, PHOTOMETRIC_MINISWHITE, COMPRESSION_PACKBITS, 0, 1, 2},
    {"16 bits, LZW", "wl", 16, 3, PHOTOMETRIC_RGB, COMPRESSION_LZW, 2, 1, 2},
    {"16 bits, big end first", "wb", 16, 3, PHOTOMETRIC_RGB, COMPRESSION_NONE, 0, 1, 1},
    {"Deflate", "wb", 16, 1, PHOTOMETRIC_MINISBLACK, COMPRESSION_ADOBE_DEFLATE, 2, 1, 5},
    {"alpha", "wl", 8, 4, PHOTOMETRIC_RGB, COMPRESSION_ADOBE_DEFLATE, 0, 1, 3},
    {"planes", "wl", 16, 3, PHOTOMETRIC_RGB, COMPRESSION_LZW, 0, PLANARCONFIG_SEPARATE,
     2},
    {"floats", "wl", 32, 3, PHOTOMETRIC_RGB, COMPRESSION_ADOBE_DEFLATE, 3, 1, 2},
    {"floats, big end first", "wb", 32, 1, PHOTOMETRIC_MINISBLACK, COMPRESSION_LZW, 0, 1,
     2}};

static void check_variants(void)
{
    for (size_t i = 0; i < imp_count(variants); i++) {
        const struct variant *v = &variants[i];
        struct imp_bytes b = tiff_make(v);
        imp_film *g = NULL;
        bool srgb = false;
        const enum imp_status st = imp__image_parse(ctx, "v.tif", &b, &g, &srgb);
        double worst = g && g->width == WIDTH && g->height == HEIGHT ? 0 : 1;
        for (int k = 0; worst < 1 && k < WIDTH * HEIGHT; k++)
            for (int c = 0; c < v->samples; c++) {
                const double is = (double)g->mean[k * g->channels + c];
                worst = fmax(worst, fabs(is - wanted(v, k % WIDTH, k / WIDTH, c)));
            }
        tap_ok(st == IMP_OK && srgb == (v->bits < 32) && worst < 1e-6,
               "TIFF, %s # error %.1e %s", v->name, worst, st ? imp_last_error(ctx) : "");
        imp_film_destroy(g);
        imp__bytes_free(ctx, &b);
    }
}

static void check_refused(void)
{
    static const struct variant kinds[] = {
        {"with a palette", "wl", 8, 1, PHOTOMETRIC_PALETTE, COMPRESSION_NONE, 0, 1, 5},
        {"of other colours", "wl", 8, 4, PHOTOMETRIC_SEPARATED, COMPRESSION_NONE, 0, 1,
         5}};
    for (size_t i = 0; i < imp_count(kinds); i++) {
        struct imp_bytes b = tiff_make(&kinds[i]);
        imp_film *g = NULL;
        bool srgb;
        const enum imp_status st = imp__image_parse(ctx, "v.tif", &b, &g, &srgb);
        tap_ok(st == IMP_E_UNSUPPORTED && !g &&
                   strstr(imp_last_error(ctx), kinds[i].name),
               "TIFF files %s are refused # %s", kinds[i].name,
               st ? imp_last_error(ctx) : "read");
        imp__bytes_free(ctx, &b);
    }
}

/* Cut at any byte, and with any byte turned: a picture or a message. */
static void check_damaged(void)
{
    struct imp_bytes whole = tiff_make(&variants[2]);
    int good = 0, bad = 0, wrong = 0;
    for (size_t k = 4; k < 2 * whole.size; k++) {
        struct imp_bytes b = {0};
        imp_film *g = NULL;
        bool srgb;
        const size_t n = k < whole.size ? k : whole.size;
        if (!imp__bytes_add(ctx, &b, whole.data, n)) exit(1);
        if (k >= whole.size) b.data[k - whole.size] ^= 0x55;
        const enum imp_status st = imp__image_parse(ctx, "v.tif", &b, &g, &srgb);
        good += st == IMP_OK;
        bad += st != IMP_OK;
        wrong += (st == IMP_OK) != (g != NULL) || st == IMP_E_NOMEM ||
                 (st != IMP_OK && !strstr(imp_last_error(ctx), "v.tif"));
        imp_film_destroy(g);
        imp__bytes_free(ctx, &b);
    }
    tap_ok(wrong == 0 && bad > 20, "damaged TIFF files # %d read, %d refused, %d wrong",
           good, bad, wrong);
    imp__bytes_free(ctx, &whole);
}

int main(void)
{
    if (!kit_open()) return 1;
    check_variants();
    check_refused();
    check_damaged();
    return kit_close();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * EXIF by libexif. The block is found here, as libexif reads JPEG files alone: segment APP1 of a
 * JPEG file (EXIF 2.3, 4.5.4), chunk eXIf of a PNG file (PNG, third edition, 11.3.4.6), the whole of a
 * TIFF file, which is such a block itself where its numbers stand in the first part. */
#include "exif.h"

#include <libexif/exif-data.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define BLOCK_MAX                                                                        \
    65535 /* bytes: what a JPEG segment holds; longer chunks are passed over */
#define PARTS_MAX 4096 /* segments or chunks that are looked at */

static const unsigned char mark[6] = {'E', 'x', 'i', 'f', 0, 0};

bool exif_is_built(void) { return true; }

static unsigned long big(const unsigned char *b, int n)
{
    unsigned long v = 0;
    for (int k = 0; k < n; k++) v = v << 8 | b[k];
    return v;
}

/* block [6 + BLOCK_MAX] gets the mark and what follows; its length, or 0. */
static size_t jpeg_block(FILE *f, unsigned char *block)
{
    unsigned char head[4];
    if (fseek(f, 2, SEEK_SET) != 0) return 0;
    for (int k = 0; k < PARTS_MAX; k++) {
        if (fread(head, 1, 4, f) != 4 || head[0] != 0xff || head[1] == 0xda) return 0;
        const unsigned long length = big(head + 2, 2);
        if (length < 2) return 0;
        if (head[1] == 0xe1 && length - 2 >= sizeof mark) {
            if (fread(block, 1, length - 2, f) != length - 2) return 0;
            if (!memcmp(block, mark, sizeof mark)) return length - 2;
        } else if (fseek(f, (long)length - 2, SEEK_CUR) != 0) {
            return 0;
        }
    }
    return 0;
}

static size_t png_block(FILE *f, unsigned char *block)
{
    unsigned char head[8];
    if (fseek(f, 8, SEEK_SET) != 0) return 0;
    for (int k = 0; k < PARTS_MAX; k++) {
        if (fread(head, 1, 8, f) != 8) return 0;
        const unsigned long length = big(head, 4);
        if (length > 0x7fffffff || !memcmp(head + 4, "IEND", 4)) return 0;
        if (!memcmp(head + 4, "eXIf", 4) && length <= BLOCK_MAX) {
            memcpy(block, mark, sizeof mark);
            if (fread(block + sizeof mark, 1, length, f) != length) return 0;
            return sizeof mark + length;
        }
        if (fseek(f, (long)length + 4, SEEK_CUR) != 0) return 0;
    }
    return 0;
}

/* The EXIF directory may stand anywhere in the file, which is as large as its picture: a writer that puts
 * it behind the picture is not read. */
static size_t tiff_block(FILE *f, unsigned char *block)
{
    if (fseek(f, 0, SEEK_SET) != 0) return 0;
    memcpy(block, mark, sizeof mark);
    return sizeof mark + fread(block + sizeof mark, 1, BLOCK_MAX, f);
}

/* The first number of an entry; 0: there is none, or it is not positive and finite. */
/* Raw files have some of it in their first directory (TIFF/EP, ISO 12234-2). */
static double number_of(ExifData *data, ExifTag tag)
{
    ExifEntry *e = exif_content_get_entry(data->ifd[EXIF_IFD_EXIF], tag);
    if (!e) e = exif_content_get_entry(data->ifd[EXIF_IFD_0], tag);
    const ExifByteOrder order = exif_data_get_byte_order(data);
    double v = 0;
    if (!e || !e->data || e->components < 1 ||
        e->size < exif_format_get_size(e->format) || exif_format_get_size(e->format) == 0)
        return 0;
    if (e->format == EXIF_FORMAT_RATIONAL) {
        const ExifRational r = exif_get_rational(e->data, order);
        v = r.denominator ? (double)r.numerator / (double)r.denominator : 0;
    } else if (e->format == EXIF_FORMAT_SHORT) {
        v = exif_get_short(e->data, order);
    } else if (e->format == EXIF_FORMAT_LONG) {
        v = exif_get_long(e->data, order);
    }
    return isfinite(v) && v > 0 ? v : 0;
}

struct exif_numbers exif_read(const char *path)
{
    struct exif_numbers n = {0, 0, 0, 0};
    unsigned char head[8] = {0}, *block = calloc(1, sizeof mark + BLOCK_MAX);
    size_t size = 0;
    FILE *f = fopen(path, "rb");
    if (f && block && fread(head, 1, 8, f) == 8) {
        if (head[0] == 0xff && head[1] == 0xd8) size = jpeg_block(f, block);
        else if (!memcmp(head, "\x89PNG\r\n\x1a\n", 8)) size = png_block(f, block);
        else if (!memcmp(head, "II*\0", 4) || !memcmp(head, "MM\0*", 4))
            size = tiff_block(f, block);
    }
    if (f) fclose(f);
    ExifData *data = size > 0 ? exif_data_new() : NULL;
    if (data) {
        exif_data_unset_option(data, EXIF_DATA_OPTION_FOLLOW_SPECIFICATION);
        exif_data_load_data(data, block, (unsigned)size);
        n.focal_35mm = number_of(data, EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM);
        n.exposure_s = number_of(data, EXIF_TAG_EXPOSURE_TIME);
        n.iso = number_of(data, EXIF_TAG_ISO_SPEED_RATINGS);
        n.f_number = number_of(data, EXIF_TAG_FNUMBER);
        exif_data_unref(data);
    }
    free(block);
    return n;
}

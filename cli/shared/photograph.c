/* SPDX-License-Identifier: Apache-2.0
 *
 * Targets of 8 or 16 bits: sRGB undone, clipped values counted for a warning, lowest and highest
 * level. */
#include "photograph.h"

#include "picture_files.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* JPEG's own noise makes white a little darker, and black a little brighter. */
#define JPEG_LEVELS 5

/* The format by the file's first bytes, as in imp_film_read; of TIFF by its first directory. */
struct encoding {
    bool srgb, jpeg; /* read as sRGB: not a file of floating-point numbers */
    bool raw;        /* linear, clipped at 1: a DNG */
    double most;     /* largest number of a channel */
};

/* n bytes of a TIFF file in the order that its first two letters say. */
static unsigned long tiff_number(const unsigned char *b, int n, bool little)
{
    unsigned long v = 0;
    for (int k = 0; k < n; k++) v = v << 8 | b[little ? n - 1 - k : k];
    return v;
}

/* Bits of a value, negative of floats, 0 of a DNG (TIFF 6.0, section 2: a directory has entries of 12
 * bytes, tag, type, count and value; tag 258 are bits, 339 the format, 3 for floats, 50706 DNG's
 * version). */
static int tiff_bits(FILE *f, const char *header)
{
    const bool little = header[0] == 'I';
    unsigned char entry[12];
    unsigned long tag;
    int bits = 8;
    bool real = false;
    if (fseek(f, (long)tiff_number((const unsigned char *)header + 4, 4, little),
              SEEK_SET) ||
        fread(entry, 1, 2, f) != 2)
        return bits;
    for (unsigned long left = tiff_number(entry, 2, little); left > 0; left--) {
        if (fread(entry, 1, 12, f) != 12) break;
        tag = tiff_number(entry, 2, little);
        if (tag == 50706) return 0;
        const unsigned long count = tiff_number(entry + 4, 4, little);
        if (tag != 258 && tag != 339) continue;
        unsigned long v = tiff_number(entry + 8, 2, little);
        if (count > 2) { /* they stand elsewhere, all the same */
            const long back = ftell(f);
            if (back < 0 || fseek(f, (long)tiff_number(entry + 8, 4, little), SEEK_SET) ||
                fread(entry, 1, 2, f) != 2 || fseek(f, back, SEEK_SET))
                break;
            v = tiff_number(entry, 2, little);
        }
        if (tag == 258) bits = (int)v;
        else real = v == 3;
    }
    return real ? -bits : bits;
}

static struct encoding encoding_of(const char *spec)
{
    static const char *const linear[] = {"\x76\x2f\x31\x01", "PF", "Pf", "VOL", "#?"};
    const char *at = picture_sensor(spec) >= 0 ? strrchr(spec, '@') : NULL;
    char *path = at ? strndup(spec, (size_t)(at - spec)) : strdup(spec);
    FILE *f = path ? fopen(path, "rb") : NULL;
    char header[1024] = {0};
    struct encoding e = {.srgb = f && fread(header, 1, sizeof header - 1, f) > 2,
                         .most = 255};
    int maxval;
    if (f && (!memcmp(header, "II*\0", 4) || !memcmp(header, "MM\0*", 4))) {
        const int bits = tiff_bits(f, header);
        e.srgb = bits > 0;
        e.raw = bits == 0;
        e.most = bits == 16 ? 65535 : 255;
    }
    if (f) fclose(f);
    free(path);
    for (size_t k = 0; k < sizeof linear / sizeof *linear; k++)
        if (!memcmp(header, linear[k], strlen(linear[k]))) e.srgb = false;
    if (!memcmp(header, "\x93NUMPY", 6)) { /* of whole numbers by its dictionary's type */
        const char *dictionary = header + (header[6] == 1 ? 10 : 12); /* by version */
        const bool words = strstr(dictionary, "'<u2'") != NULL;
        e.srgb = words || strstr(dictionary, "'|u1'") || strstr(dictionary, "'<u1'");
        e.most = words ? 65535 : 255;
    }
    e.jpeg = e.srgb && !memcmp(header, "\xff\xd8", 2);
    /* PNG: the depth is byte 24, behind width and height (RFC 2083, 11.2.1). */
    if (!memcmp(header, "\x89PNG", 4) && header[24] == 16) e.most = 65535;
    if (header[0] == 'P' && sscanf(header, "P%*d %*d %*d %d", &maxval) == 1 && maxval > 0)
        e.most = maxval;
    return e;
}

static double encode(double v)
{
    return v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055;
}
static double decode(double v)
{
    return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

static bool is_photograph(const struct imp_target *t)
{
    struct imp_sensor_info sensor = {.size = sizeof sensor};
    return imp_scene_get_sensor(cli.scene, t->sensor, &sensor) == IMP_OK &&
           sensor.photograph;
}

void photograph_undo_srgb(const char *spec, struct imp_target *t)
{
    float *v = (float *)t->pixels;
    if (!encoding_of(spec).srgb || !is_photograph(t)) return;
    for (size_t i = 0; i < (size_t)t->width * (size_t)t->height * (size_t)t->channels;
         i++)
        v[i] = (float)encode((double)v[i]);
}

static void file_levels(const struct encoding *e, double *low, double *high)
{
    const double part = e->jpeg ? JPEG_LEVELS : 0.5;
    *low = part / e->most;
    *high = 1 - part / e->most;
}

double photograph_step(const char *spec)
{
    const struct encoding e = encoding_of(spec);
    return e.srgb ? 1 / e.most : 0;
}

double photograph_white(const char *spec)
{
    const struct encoding e = encoding_of(spec);
    double low, high;
    if (e.raw) return 1;
    file_levels(&e, &low, &high);
    return e.srgb ? decode(high) : (double)INFINITY;
}

void photograph_warn_clipped(const char *spec, const struct imp_target *t)
{
    double low, high;
    size_t clipped = 0;
    const struct encoding e = encoding_of(spec);
    if (!e.srgb) return;
    file_levels(&e, &low, &high);
    if (!is_photograph(t)) high = decode(high);
    for (size_t i = 0; i < (size_t)t->width * (size_t)t->height; i++) {
        bool over = false;
        for (int c = 0; c < t->channels; c++)
            over |= (double)t->pixels[i * (size_t)t->channels + (size_t)c] >= high;
        clipped += over && !(t->weights && t->weights[i] == 0);
    }
    if (clipped)
        cli_say("importon: warning: %s: %zu of %zu pixels are as bright as the file can "
                "hold, and may have been brighter: give --clip auto, or leave them "
                "out with --mask",
                spec, clipped, (size_t)t->width * (size_t)t->height);
}

int photograph_levels(const char *spec, const char *text, const struct imp_target *t,
                      double *low, double *high)
{
    const struct encoding e = encoding_of(spec);
    *low = (double)-FLT_MAX; /* below all numbers */
    *high = (double)FLT_MAX;
    if (!strcmp(text, "auto") && e.raw) {
        *high = 1;
    } else if (!strcmp(text, "auto")) {
        if (!e.srgb)
            return cli_error(EXIT_USAGE,
                             "--clip auto: %s holds floating-point numbers, and not "
                             "the level where they were clipped: give --clip LOW,HIGH",
                             spec);
        file_levels(&e, low, high);
    } else {
        char *end;
        const char *comma = strchr(text, ',');
        bool fine = comma && (comma > text || comma[1]);
        if (fine && comma > text) {
            *low = strtod(text, &end);
            fine = end == comma;
        }
        if (fine && comma[1]) {
            *high = strtod(comma + 1, &end);
            fine = !*end;
        }
        if (!fine || !(*low < *high))
            return cli_error(EXIT_USAGE,
                             "--clip %s: expected auto, LOW,HIGH, LOW, or ,HIGH in the "
                             "numbers of the file, LOW less than HIGH",
                             text);
    }
    if (e.srgb && !is_photograph(t)) {
        if (*low > (double)-FLT_MAX) *low = decode(*low);
        if (*high < (double)FLT_MAX) *high = decode(*high);
    }
    return 0;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Reads a picture of any known format: finds the format by the first bytes, and
 * picks the colour channels of the film that comes out. */
#include "image.h"
#include "vol_file.h"
#include <string.h>
#include <strings.h>

enum imp_status imp__image_film(imp_context *ctx, const char *name, uint64_t width,
                                uint64_t height, const char *names, size_t bytes,
                                double per_byte, imp_film **out)
{
    if (width < 1 || height < 1 || width > IMP_FILM_SIDE_MAX ||
        height > IMP_FILM_SIDE_MAX)
        return imp__error(ctx, IMP_E_SCENE, "%s: a size of %llu x %llu pixels", name,
                          (unsigned long long)width, (unsigned long long)height);
    if ((double)width * (double)height > per_byte * (double)bytes + 65536)
        return imp__error(ctx, IMP_E_SCENE,
                          "%s: cut off: %llu x %llu pixels in %zu bytes", name,
                          (unsigned long long)width, (unsigned long long)height, bytes);
    double channels = 1;
    for (const char *c = names; *c; c++) channels += *c == ',';
    enum imp_status st =
        imp__unpacks(ctx, name, (double)bytes,
                     4 * channels * (double)width * (double)height, IMP_IMAGE_ALWAYS);
    if (st != IMP_OK) return st;
    st = imp__film_create(ctx, (int)width, (int)height, names, false, out);
    return st == IMP_OK
               ? st
               : imp__error_prefix(ctx, st == IMP_E_ARG ? IMP_E_SCENE : st, "%s", name);
}

enum imp_status imp__image_parse(imp_context *ctx, const char *name,
                                 const struct imp_bytes *file, imp_film **out, bool *srgb)
{
    const unsigned char *d = file->data;
    const size_t n = file->size;
    *srgb = false;
    if (n >= 4 && memcmp(d, "\x76\x2f\x31\x01", 4) == 0)
        return imp__exr_parse(ctx, name, file, out);
    if (n >= 6 && memcmp(d, "\x93NUMPY", 6) == 0)
        return imp__npy_parse(ctx, name, file, out, srgb);
    if (n >= 3 && d[0] == 'P' && (d[1] == 'F' || d[1] == 'f'))
        return imp__pfm_parse(ctx, name, file, out);
    if (n >= 3 && memcmp(d, "VOL", 3) == 0) return imp__vol_picture(ctx, name, file, out);
    if (n >= 2 && d[0] == '#' && d[1] == '?') return imp__hdr_parse(ctx, name, file, out);
    const bool tiff =
        n >= 4 && (memcmp(d, "II*\0", 4) == 0 || memcmp(d, "MM\0*", 4) == 0);
    if (tiff && imp__dng_is(file)) return imp__dng_parse(ctx, name, file, out);
    *srgb = true;
    if (n >= 4 && memcmp(d, "\x89PNG", 4) == 0)
        return imp__png_parse(ctx, name, file, out);
    if (n >= 2 && d[0] == 0xff && d[1] == 0xd8)
        return imp__jpeg_parse(ctx, name, file, out);
    if (n >= 2 && d[0] == 'B' && d[1] == 'M') return imp__bmp_parse(ctx, name, file, out);
    if (n >= 2 && d[0] == 'P' && (d[1] == '5' || d[1] == '6'))
        return imp__ppm_parse(ctx, name, file, out);
    if (tiff) return imp__tiff_parse(ctx, name, file, out, srgb);
    if (imp__tga_is(file)) return imp__tga_parse(ctx, name, file, out);
    return imp__error(
        ctx, IMP_E_SCENE,
        "%s: not an EXR, PNG, JPEG, TIFF, DNG, BMP, TGA, PPM, HDR, PFM or NPY picture",
        name);
}

enum imp_status imp__image_read(imp_context *ctx, const char *path, imp_film **out,
                                bool *srgb)
{
    struct imp_bytes file;
    enum imp_status st = imp__file_read(ctx, path, IMP_IMAGE_BYTES_MAX, &file);
    if (st != IMP_OK) return st;
    st = imp__image_parse(ctx, path, &file, out, srgb);
    imp__bytes_free(ctx, &file);
    return st;
}

/* Length of the layer's name, its dot included. */
static size_t layer_length(const char *name)
{
    const char *dot = strrchr(name, '.');
    return dot ? (size_t)(dot - name) + 1 : 0;
}

/* The channel `suffix` of the layer that channel `like` belongs to; -1: none. */
static int sibling(const imp_film *f, int like, const char *suffix)
{
    const size_t n = layer_length(f->names[like]);
    for (int c = 0; c < f->channels; c++)
        if (layer_length(f->names[c]) == n &&
            memcmp(f->names[c], f->names[like], n) == 0 &&
            strcasecmp(f->names[c] + n, suffix) == 0)
            return c;
    return -1;
}

struct imp_pick imp__image_pick(const imp_film *f)
{
    static const char *const sets[][3] = {{"R", "G", "B"}, {"X", "Y", "Z"}, {"Y"}};
    for (int layers = 0; layers < 2; layers++)
        for (int s = 0; s < 3; s++)
            for (int c = 0; c < f->channels; c++) {
                if ((layer_length(f->names[c]) > 0) != layers) continue;
                struct imp_pick p = {s < 2 ? 3 : 1, {0, 0, 0}, s == 1};
                bool all = true;
                for (int k = 0; k < p.n; k++)
                    all &= (p.channel[k] = sibling(f, c, sets[s][k])) >= 0;
                if (all) return p;
            }
    if (f->channels == 1) return (struct imp_pick){1, {0, 0, 0}, false};
    return (struct imp_pick){0, {0, 0, 0}, false};
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Films in files: reading, and writing by extension. */
#include "base/arguments.h"
#include "color/rgb.h"
#include "exr_spectral.h"
#include "image.h"
#include <math.h>
#include <string.h>
#include <strings.h>

/* ---- PNG previews -------------------------------------------------------------- */

static unsigned char byte(double c)
{
    return c > 0 ? (unsigned char)(255 * imp_min(c, 1.0) + 0.5) : 0; /* NaN: 0 */
}

static const float *pixel(const imp_film *f, size_t i)
{
    return f->mean + i * (size_t)f->channels;
}

/* Linear colours, exposed, as sRGB. */
static void preview(const imp_film *f, const struct imp_pick *pick, double exposure,
                    unsigned char *to)
{
    const double gain = exp2(exposure);
    for (size_t i = 0; i < (size_t)f->width * (size_t)f->height; i++) {
        double c[3] = {0};
        for (int k = 0; k < pick->n; k++)
            c[k] = gain * (double)pixel(f, i)[pick->channel[k]];
        if (pick->xyz) imp__xyz_to_rgb((double[3]){c[0], c[1], c[2]}, c);
        for (int k = 0; k < pick->n; k++)
            *to++ = byte(imp__srgb_encode(imp_clamp(c[k], 0.0, 1.0)));
    }
}

/* One number for a pixel of a signed picture: the mean of its channels. */
static double signed_value(const imp_film *f, const struct imp_pick *pick, size_t i)
{
    double sum = 0;
    for (int k = 0; k < pick->n; k++) sum += (double)pixel(f, i)[pick->channel[k]];
    return sum / pick->n;
}

/* 99.5 percentile of |value|, by bisection on the count: no copy to sort. */
static double signed_range(const imp_film *f, const struct imp_pick *pick)
{
    const size_t n = (size_t)f->width * (size_t)f->height;
    double lo = 0, hi = 0;
    for (size_t i = 0; i < n; i++) {
        const double v = fabs(signed_value(f, pick, i));
        if (isfinite(v)) hi = fmax(hi, v);
    }
    for (int step = 0; step < 40 && hi > 0; step++) {
        const double middle = (lo + hi) / 2;
        size_t above = 0;
        for (size_t i = 0; i < n; i++) above += fabs(signed_value(f, pick, i)) > middle;
        if (above > n / 200) lo = middle;
        else hi = middle;
    }
    return hi > 0 ? hi : 1;
}

/* Blue for negative, white for zero, red for positive; linear in sRGB code values between
 * (0.10, 0.25, 0.70), white, and (0.70, 0.05, 0.10). */
static void diverge(const imp_film *f, const struct imp_pick *pick, double range,
                    unsigned char *to)
{
    static const double ends[2][3] = {{0.10, 0.25, 0.70}, {0.70, 0.05, 0.10}};
    if (!(range > 0)) range = signed_range(f, pick);
    for (size_t i = 0; i < (size_t)f->width * (size_t)f->height; i++) {
        const double v = signed_value(f, pick, i) / range, t = fmin(fabs(v), 1);
        for (int k = 0; k < 3; k++)
            *to++ = isnan(v) ? 0 : byte(1 + t * (ends[v > 0][k] - 1));
    }
}

static enum imp_status png_encode(const imp_film *f, const struct imp_write_options *o,
                                  struct imp_bytes *out)
{
    struct imp_pick pick = imp__image_pick(f);
    if (!pick.n) pick = (struct imp_pick){1, {0, 0, 0}, false};
    const int channels = o->diverging ? 3 : pick.n;
    unsigned char *to =
        imp__alloc(f->ctx, (size_t)f->width * (size_t)f->height, (size_t)channels);
    if (!to) return imp__error(f->ctx, IMP_E_NOMEM, "PNG: no memory for the picture");
    if (o->diverging) diverge(f, &pick, o->range, to);
    else preview(f, &pick, o->exposure, to);
    const enum imp_status st =
        imp__png_encode(f->ctx, f->width, f->height, channels, to, out);
    imp__release(f->ctx, to);
    return st;
}

/* An 8-bit preview; of spectra, their colours. */
static enum imp_status preview_encode(const imp_film *f,
                                      const struct imp_write_options *o,
                                      struct imp_bytes *out)
{
    imp_film *rgb;
    enum imp_status st = imp__exr_spectral_rgb(f, &rgb);
    if (st == IMP_OK) st = png_encode(rgb && !o->diverging ? rgb : f, o, out);
    imp_film_destroy(rgb);
    return st;
}

/* ---- Public calls -------------------------------------------------------------- */

static bool ends_with(const char *path, const char *extension)
{
    const size_t n = strlen(path), m = strlen(extension);
    return n > m && strcasecmp(path + n - m, extension) == 0;
}

enum imp_status imp_film_write(const imp_film *f, const char *path,
                               const struct imp_write_options *options)
{
    IMP_REQUIRE(NULL, f, "film");
    imp_context *ctx = f->ctx;
    struct imp_write_options o = IMP_WRITE_OPTIONS_INIT;
    IMP_REQUIRE(ctx, path, "path");
    if (!*path) return imp__error(ctx, IMP_E_ARG, "film: no file name");
    IMP_OPTIONS(ctx, o, options, "options");
    if (!isfinite(o.exposure) || !isfinite(o.range) || o.range < 0)
        return imp__error(ctx, IMP_E_ARG,
                          "film: exposure %g and range %g must be finite, range >= 0",
                          o.exposure, o.range);
    IMP_FLOAT_MODE;

    struct imp_bytes bytes = {0};
    enum imp_status st;
    if (ends_with(path, ".exr")) st = imp__exr_encode(f, &o, &bytes);
    else if (ends_with(path, ".png")) st = preview_encode(f, &o, &bytes);
    else if (ends_with(path, ".pfm")) st = imp__pfm_encode(f, &bytes);
    else if (ends_with(path, ".npy")) st = imp__npy_encode(f, &bytes);
    else if (ends_with(path, ".hdr")) st = imp__hdr_encode(f, &bytes);
    else
        return imp__error(ctx, IMP_E_ARG,
                          "%s: the name must end in .exr, .png, .pfm, .hdr or .npy",
                          path);
    if (st != IMP_OK) return imp__error_prefix(ctx, st, "%s", path);
    st = imp__file_write(ctx, path, bytes.data, bytes.size);
    imp__bytes_free(ctx, &bytes);
    return st;
}

enum imp_status imp_film_read(imp_context *ctx, const char *path, imp_film **out)
{
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, path, "path");
    IMP_REQUIRE(ctx, out, "out");
    if (!*path) return imp__error(ctx, IMP_E_ARG, "film: no file name");
    IMP_FLOAT_MODE;
    imp_film *f;
    bool srgb;
    enum imp_status st = imp__image_read(ctx, path, &f, &srgb);
    if (st != IMP_OK) return st;
    const size_t c = (size_t)f->channels;
    for (size_t i = 0; srgb && i < imp__film_values(f); i++)
        if (strcmp(f->names[i % c], "A") != 0)
            f->mean[i] = (float)imp__srgb_decode((double)f->mean[i]);
    *out = f;
    return IMP_OK;
}

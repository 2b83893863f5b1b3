/* SPDX-License-Identifier: Apache-2.0
 *
 * Adjoint images for draws from edges, and random contrasts of their noise (moved_adjoint.h). */
#include "moved_adjoint.h"
#include "base/arguments.h"
#include "film/film_tiles.h"
#include "math/rng.h"

static size_t values_of(const struct imp__moved_adjoint *a)
{
    return (size_t)a->film->crop_w * (size_t)a->film->crop_h * (size_t)a->channels;
}

static enum imp_status create(imp_context *ctx, const struct imp_film_desc *film,
                              int channels, int pairs, struct imp__moved_adjoint *out)
{
    *out = (struct imp__moved_adjoint){.ctx = ctx,
                                       .film = film,
                                       .channels = channels,
                                       .pairs = pairs,
                                       .wide = imp__film_border(film) > 0};
    out->margin = film->sample_border ? imp__film_border(film) : 0;
    const size_t n = values_of(out);
    out->image = imp__alloc(ctx, (1 + (size_t)pairs) * n, sizeof *out->image);
    if (!out->image) return imp__error(ctx, IMP_E_NOMEM, "no memory for an adjoint");
    out->apart = out->image + n;
    return IMP_OK;
}

enum imp_status imp__moved_adjoint_fixed(imp_context *ctx,
                                         const struct imp_film_desc *film, int channels,
                                         const float *image,
                                         struct imp__moved_adjoint *out)
{
    IMP_CHECKED(create(ctx, film, channels, 0, out));
    for (size_t k = 0; k < values_of(out); k++) out->image[k] = (double)image[k];
    return IMP_OK;
}

enum imp_status imp__moved_adjoint_loss(imp_context *ctx,
                                        const struct imp_film_desc *film, int channels,
                                        int R, int contrasts,
                                        struct imp__moved_adjoint *out)
{
    IMP_CHECKED(create(ctx, film, channels, R / 2, out));
    out->contrasts = contrasts;
    return IMP_OK;
}

void imp__moved_adjoint_read(struct imp__moved_adjoint *a, const struct imp__splat *splat)
{
    const size_t C = (size_t)a->channels, n = values_of(a);
    for (size_t p = 0; p < n / C && splat->n > 0; p++) {
        const imp_spec mean = imp__splat_pixel(splat, -1, p);
        for (size_t c = 0; c < C; c++) a->image[p * C + c] = mean[c];
        for (int q = 0; q < a->pairs; q++) {
            const imp_spec apart = (imp__splat_pixel(splat, 2 * q, p) -
                                    imp__splat_pixel(splat, 2 * q + 1, p)) *
                                   (0.5 / a->pairs);
            for (size_t c = 0; c < C; c++) a->apart[(size_t)q * n + p * C + c] = apart[c];
        }
    }
}

void imp__moved_adjoint_free(struct imp__moved_adjoint *a)
{
    if (a->ctx) imp__release(a->ctx, a->image);
    *a = (struct imp__moved_adjoint){0};
}

uint64_t imp__contrast_signs(const struct imp__moved_adjoint *a, int x, int y, int pair)
{
    const int side = a->wide ? IMP_TILE_SIDE : 1;
    const uint64_t column = (uint64_t)((x + a->margin) / side),
                   row = (uint64_t)((y + a->margin) / side);
    return imp__mix64((row << 34 ^ column << 4 ^ (uint64_t)pair) + 0x9e3779b97f4a7c15u);
}

/* contrast[m] += x, or -x where bit m of `minus` is set: without a branch, so that lanes do it. */
static void signed_add(int n, uint64_t minus, double x, double *contrast)
{
    union {
        double x;
        uint64_t bits;
    } v;
    for (int m = 0; m < n; m++) {
        v.x = x;
        v.bits ^= (minus >> m & 1) << 63;
        contrast[m] += v.x;
    }
}

double imp__moved_adjoint_at(const struct imp__moved_adjoint *a,
                             const struct imp_splat_scale *scale, double px, double py,
                             const imp_spec *L, double *contrast)
{
    const size_t C = (size_t)a->channels, n = values_of(a);
    struct imp_splat_taps taps;
    double sum = 0;
    imp__splat_taps(a->film, scale, px, py, &taps);
    for (int m = 0; contrast && m < a->contrasts; m++) contrast[m] = 0;
    for (int j = 0; j < taps.down.n; j++)
        for (int i = 0; i < taps.across.n; i++) {
            const int x = taps.across.first + i, y = taps.down.first + j;
            const size_t at = ((size_t)y * (size_t)a->film->crop_w + (size_t)x) * C;
            const double w = taps.down.w[j] * taps.across.w[i];
            double here = 0;
            for (size_t c = 0; c < C; c++) here += a->image[at + c] * (*L)[c];
            sum += w * here;
            for (int q = 0; contrast && q < a->pairs; q++) {
                const uint64_t signs = imp__contrast_signs(a, x, y, q);
                double apart = 0;
                for (size_t c = 0; c < C; c++)
                    apart += a->apart[(size_t)q * n + at + c] * (*L)[c];
                apart *= w;
                signed_add(a->contrasts, ~signs, apart, contrast);
            }
        }
    return sum;
}

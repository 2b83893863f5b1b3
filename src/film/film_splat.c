/* SPDX-License-Identifier: Apache-2.0
 *
 * Footprints of positions on the film, for walks that may reach any pixel. */
#include "film_light.h"

/* 1 over the integral of the filter about each pixel's middle, over the film [lo, hi]. */
static enum imp_status scale_make(imp_context *ctx, const struct imp_filter *f, int n,
                                  int margin, double **out)
{
    enum { STEPS = 2048 };
    double *scale = imp__alloc(ctx, (size_t)n, sizeof *scale);
    if (!scale) return imp__error(ctx, IMP_E_NOMEM, "no memory for a filter");
    for (int i = 0; i < n; i++) {
        const double at = i + 0.5, lo = fmax(at - f->radius, -margin);
        const double hi = fmin(at + f->radius, n + margin), step = (hi - lo) / STEPS;
        double sum = 0;
        for (int k = 0; k < STEPS; k++)
            sum += f->ops->eval(f, lo + (k + 0.5) * step - at);
        scale[i] = sum != 0 ? 1 / (sum * step) : 0;
    }
    *out = scale;
    return IMP_OK;
}

enum imp_status imp__splat_scale_create(imp_context *ctx,
                                        const struct imp_film_desc *film,
                                        struct imp_splat_scale *out)
{
    enum imp_status st = IMP_OK;
    const int border = imp__film_border(film);
    *out = (struct imp_splat_scale){.margin = film->sample_border ? border : 0};
    if (border == 0) return IMP_OK;
    IMP_TRY(scale_make(ctx, &film->filter, film->crop_w, out->margin, &out->across));
    IMP_TRY(scale_make(ctx, &film->filter, film->crop_h, out->margin, &out->down));
out:
    return st;
}

void imp__splat_scale_destroy(imp_context *ctx, struct imp_splat_scale *s)
{
    imp__release(ctx, s->across);
    imp__release(ctx, s->down);
}

static void axis_taps(const struct imp_filter *f, const double *scale, double x, int n,
                      int margin, struct imp_taps *out)
{
    out->n = 0;
    if (!(x >= -margin && x < n + margin)) return;
    if (!scale) {
        out->first = (int)x;
        out->n = 1;
        out->w[0] = 1;
        return;
    }
    imp__film_taps(f, x, 0, n - 1, out);
    for (int k = 0; k < out->n; k++) out->w[k] *= scale[out->first + k];
}

void imp__splat_taps(const struct imp_film_desc *film,
                     const struct imp_splat_scale *scale, double px, double py,
                     struct imp_splat_taps *out)
{
    axis_taps(&film->filter, scale->across, px - film->crop_x, film->crop_w,
              scale->margin, &out->across);
    axis_taps(&film->filter, scale->down, py - film->crop_y, film->crop_h, scale->margin,
              &out->down);
}

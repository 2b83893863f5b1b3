/* SPDX-License-Identifier: Apache-2.0
 *
 * bitmap: a picture. Texel (i, j) has its centre at ((i + .5)/W, (j + .5)/H), row 0 at v
 * = 0. The value is linear in the texels, so its derivative is the set of filter weights
 * itself: eval, scatter and tangent all go through `footprint`. */
#include "bitmap.h"
#include "bitmap_data.h"
#include "color/rgb.h"
#include "color/spectrum.h"
#include "input.h"
#include "math/vec.h"
#include <math.h>
#include <string.h>

extern const struct imp_texture_ops imp__bitmap;

/* u in one period, so that an index made from it fits an int however wild u is. */
static double period(double u, enum wrap wrap)
{
    switch (wrap) {
    case WRAP_REPEAT: u -= floor(u); break;
    case WRAP_MIRROR: u -= 2 * floor(u * 0.5); break;
    case WRAP_CLAMP: u = imp_clamp(u, -1.0, 2.0); break;
    }
    return u >= -1 && u <= 2 ? u : 0; /* NaN and infinity */
}
/* -n <= i <= 2 n */
static int wrap_index(int i, int n, enum wrap wrap)
{
    switch (wrap) {
    case WRAP_REPEAT: return i < 0 ? i + n : i >= n ? (i - n) % n : i;
    case WRAP_MIRROR:
        if (i < 0) i = -1 - i;
        if (i >= 2 * n) i -= 2 * n;
        return i < n ? i : 2 * n - 1 - i;
    case WRAP_CLAMP: break;
    }
    return i < 0 ? 0 : i >= n ? n - 1 : i;
}

/* The up to four texels that a lookup sees, and their weights. */
struct footprint {
    int n;
    size_t texel[4];
    double weight[4], a, b;
};

static inline void footprint(const struct bitmap *t, const struct imp_texcoord *at,
                             struct footprint *f)
{
    double uv[2] = {at->uv[0], at->uv[1]};
    if (!t->identity) imp__to_uv_apply(&t->to_uv, at->uv, uv);
    const double u = period(uv[0], t->wrap), v = period(uv[1], t->wrap);
    const size_t w = (size_t)t->width;
    if (t->filter == FILTER_NEAREST) {
        const int x = wrap_index((int)floor(u * t->width), t->width, t->wrap);
        const int y = wrap_index((int)floor(v * t->height), t->height, t->wrap);
        f->n = 1;
        f->texel[0] = (size_t)y * w + (size_t)x;
        f->weight[0] = 1;
        return;
    }
    const double x = u * t->width - 0.5, y = v * t->height - 0.5;
    const int x0 = (int)floor(x), y0 = (int)floor(y);
    const double a = x - x0, b = y - y0;
    const size_t xs[2] = {(size_t)wrap_index(x0, t->width, t->wrap),
                          (size_t)wrap_index(x0 + 1, t->width, t->wrap)};
    const size_t ys[2] = {w * (size_t)wrap_index(y0, t->height, t->wrap),
                          w * (size_t)wrap_index(y0 + 1, t->height, t->wrap)};
    f->n = 4;
    f->a = a;
    f->b = b;
    f->texel[0] = ys[0] + xs[0];
    f->texel[1] = ys[0] + xs[1];
    f->texel[2] = ys[1] + xs[0];
    f->texel[3] = ys[1] + xs[1];
    f->weight[0] = (1 - a) * (1 - b);
    f->weight[1] = a * (1 - b);
    f->weight[2] = (1 - a) * b;
    f->weight[3] = a * b;
}

/* ---- Wavelengths ------------------------------------------------------------------- */

static bool by_wavelength(const struct bitmap *t, const struct imp_texcoord *at,
                          bool scalar)
{
    return imp_unlikely(at->carried != NULL) && t->spectral && !scalar;
}
static struct imp__texel_sum seen(const struct footprint *f)
{
    return (struct imp__texel_sum){f->n, f->texel, f->weight};
}
/* What grey texels, too, are times. */
static imp_spec light(const struct bitmap *t, const struct imp_carried *carried)
{
    imp_spec f = imp__spec(1);
    for (int j = 0; j < 4 && t->daylight; j++)
        f[j] = imp__spectrum_value(&imp__daylight, carried->nm[j]);
    return f;
}

/* ---- Values -------------------------------------------------------------------------- */

static void eval(const struct imp_texture *tex, const struct imp_texcoord *at,
                 bool scalar, imp_spec *value)
{
    const struct bitmap *t = tex->self;
    struct footprint f;
    footprint(t, at, &f);
    if (t->channels == 1) {
        double sum = 0;
        for (int k = 0; k < f.n; k++) sum += f.weight[k] * t->data[f.texel[k]];
        *value = imp__spec(sum);
        if (by_wavelength(t, at, scalar)) *value *= light(t, at->carried);
        return;
    }
    if (by_wavelength(t, at, scalar)) {
        const struct imp__texel_sum sum = seen(&f);
        imp__lifted_texels_eval(&t->lifted, &sum, at->carried, value);
        *value *= light(t, at->carried);
        return;
    }
    imp_spec sum = imp__spec(0);
    for (int k = 0; k < f.n; k++) {
        imp_float4 p;
        memcpy(&p, t->data + 3 * f.texel[k], sizeof p);
        sum += imp__widen(p) * f.weight[k];
    }
    *value = scalar ? imp__spec(imp__luminance(sum[0], sum[1], sum[2])) : sum;
}

static void scatter(const struct imp_texture *tex, const struct imp_texcoord *at,
                    bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    const struct bitmap *t = tex->self;
    struct footprint f;
    if (tex->param < 0) return;
    footprint(t, at, &f);
    imp_spec own = *bar;
    if (by_wavelength(t, at, scalar)) own *= light(t, at->carried);
    if (by_wavelength(t, at, scalar) && t->channels == 3) {
        const struct imp__texel_sum sum = seen(&f);
        imp__lifted_texels_scatter(&t->lifted, &sum, at->carried, tex->param, &own, sink);
        return;
    }
    for (int k = 0; k < f.n; k++) {
        const imp_spec part = own * f.weight[k];
        if (t->channels == 1) sink->add(sink, tex->param, f.texel[k], 1, &part);
        else if (scalar) imp__luminance_scatter(sink, tex->param, 3 * f.texel[k], part);
        else sink->add(sink, tex->param, 3 * f.texel[k], 3, &part);
    }
}

static void tangent(const struct imp_texture *tex, const struct imp_texcoord *at,
                    bool scalar, imp_dot_fn *dot, const void *x_dot, imp_spec *value_dot)
{
    const struct bitmap *t = tex->self;
    struct footprint f;
    imp_spec sum = imp__spec(0);
    footprint(t, at, &f);
    if (by_wavelength(t, at, scalar) && t->channels == 3) {
        const struct imp__texel_sum seen_at = seen(&f);
        imp__lifted_texels_tangent(&t->lifted, &seen_at, at->carried, tex->param, dot,
                                   x_dot, value_dot);
        *value_dot *= light(t, at->carried);
        return;
    }
    for (int k = 0; k < f.n && tex->param >= 0; k++) {
        imp_spec p;
        if (t->channels == 1) {
            p = imp__spec(dot(x_dot, tex->param, f.texel[k]));
        } else {
            const size_t e = 3 * f.texel[k];
            p = (imp_spec){dot(x_dot, tex->param, e), dot(x_dot, tex->param, e + 1),
                           dot(x_dot, tex->param, e + 2), 0};
        }
        sum += p * f.weight[k];
    }
    *value_dot = scalar && t->channels == 3
                     ? imp__spec(imp__luminance(sum[0], sum[1], sum[2]))
                     : sum;
    if (by_wavelength(t, at, scalar)) *value_dot *= light(t, at->carried);
}

/* Bilinear lookups alone: the others jump. Rows of to_uv give d(u', v')/d(u, v). */
static bool slope(const struct imp_texture *tex, const struct imp_texcoord *at,
                  bool scalar, imp_spec d_uv[2])
{
    const struct bitmap *t = tex->self;
    struct footprint f;
    imp_spec texel[4], d[2];
    if (t->filter != FILTER_BILINEAR) return false;
    footprint(t, at, &f);
    for (int k = 0; k < 4; k++) {
        const float *p = t->data + (size_t)t->channels * f.texel[k];
        texel[k] = t->channels == 1 ? imp__spec(p[0]) : (imp_spec){p[0], p[1], p[2], 0};
        if (scalar && t->channels == 3)
            texel[k] = imp__spec(imp__luminance(p[0], p[1], p[2]));
        if (by_wavelength(t, at, scalar)) {
            const double one = 1;
            const struct imp__texel_sum own = {1, &f.texel[k], &one};
            if (t->channels == 3)
                imp__lifted_texels_eval(&t->lifted, &own, at->carried, &texel[k]);
            texel[k] *= light(t, at->carried);
        }
    }
    const double a = f.weight[1] + f.weight[3], b = f.weight[2] + f.weight[3];
    d[0] = ((texel[1] - texel[0]) * (1 - b) + (texel[3] - texel[2]) * b) * t->width;
    d[1] = ((texel[2] - texel[0]) * (1 - a) + (texel[3] - texel[1]) * a) * t->height;
    for (int k = 0; k < 2; k++)
        d_uv[k] = d[0] * t->to_uv.m[0][k] + d[1] * t->to_uv.m[1][k];
    return true;
}

/* d slope/d texel, as `slope` has it: the texels' numbers times these are d value/du', dv'. */
static bool slope_weights(const struct bitmap *t, const struct imp_texcoord *at,
                          struct footprint *f, double weight[2][4])
{
    if (t->filter != FILTER_BILINEAR) return false;
    footprint(t, at, f);
    const double a = f->weight[1] + f->weight[3], b = f->weight[2] + f->weight[3];
    const double by[2][4] = {{b - 1, 1 - b, -b, b}, {a - 1, -a, 1 - a, a}};
    const double size[2] = {t->width, t->height};
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 4; k++)
            weight[i][k] = by[0][k] * size[0] * t->to_uv.m[0][i] +
                           by[1][k] * size[1] * t->to_uv.m[1][i];
    return true;
}

/* Bump maps alone call it, for numbers: slopes of colours have no derivative. */
static void slope_scatter(const struct imp_texture *tex, const struct imp_texcoord *at,
                          bool scalar, const imp_spec bar[2], struct imp_sink *sink)
{
    const struct bitmap *t = tex->self;
    struct footprint f;
    double weight[2][4];
    if (tex->param < 0 || !slope_weights(t, at, &f, weight)) return;
    for (int k = 0; k < 4; k++) {
        const imp_spec part = bar[0] * weight[0][k] + bar[1] * weight[1][k];
        if (t->channels == 1) sink->add(sink, tex->param, f.texel[k], 1, &part);
        else if (scalar) imp__luminance_scatter(sink, tex->param, 3 * f.texel[k], part);
        else sink->add(sink, tex->param, 3 * f.texel[k], 3, &part);
    }
}

static void slope_tangent(const struct imp_texture *tex, const struct imp_texcoord *at,
                          bool scalar, imp_dot_fn *dot, const void *x_dot,
                          imp_spec d_uv_dot[2])
{
    const struct bitmap *t = tex->self;
    struct footprint f;
    double weight[2][4];
    d_uv_dot[0] = d_uv_dot[1] = imp__spec(0);
    if (tex->param < 0 || !slope_weights(t, at, &f, weight)) return;
    for (int k = 0; k < 4; k++) {
        const size_t e = (size_t)t->channels * f.texel[k];
        imp_spec p = imp__spec(dot(x_dot, tex->param, e));
        if (t->channels == 3) {
            p[1] = dot(x_dot, tex->param, e + 1);
            p[2] = dot(x_dot, tex->param, e + 2);
            if (scalar) p = imp__spec(imp__luminance(p[0], p[1], p[2]));
        }
        for (int i = 0; i < 2; i++) d_uv_dot[i] += p * weight[i][k];
    }
}

bool imp__bitmap_cell(const struct imp_texture *tex, const struct imp_texcoord *at,
                      struct imp__cell *out)
{
    const struct bitmap *t = tex->self;
    struct footprint f;
    if (tex->ops != &imp__bitmap ||
        (uint64_t)t->width * (uint64_t)t->height > UINT32_MAX / 3)
        return false;
    footprint(t, at, &f);
    out->n = f.n;
    for (int k = 0; k < f.n; k++)
        out->element[k] = (uint32_t)(f.texel[k] * (size_t)t->channels);
    out->a = f.n == 4 ? f.a : 0;
    out->b = f.n == 4 ? f.b : 0;
    return true;
}

bool imp__bitmap_texels(const struct imp_texture *tex, struct imp__texels *out)
{
    const struct bitmap *t = tex->self;
    if (tex->ops != &imp__bitmap) return false;
    *out = (struct imp__texels){t->width,
                                t->height,
                                t->channels,
                                t->data,
                                t->identity && t->wrap == WRAP_REPEAT &&
                                    t->filter == FILTER_BILINEAR,
                                t->negative,
                                t->negative_value};
    return true;
}

static const struct imp_input_desc inputs[] = {{0}};

const struct imp_texture_ops imp__bitmap = {.size = sizeof(struct imp_texture_ops),
                                            .name = "bitmap",
                                            .object_size = sizeof(struct bitmap),
                                            .inputs = inputs,
                                            .build = imp__bitmap_build,
                                            .eval = eval,
                                            .scatter = scatter,
                                            .tangent = tangent,
                                            .slope = slope,
                                            .changed = imp__bitmap_changed,
                                            .slope_scatter = slope_scatter,
                                            .slope_tangent = slope_tangent};

/* SPDX-License-Identifier: Apache-2.0
 *
 * Bitmaps in lanes: eval and scatter of bitmap.c, in colours. Indices are whole numbers among doubles, which are
 * exact. */
#include "bitmap_data.h"
#include "color/rgb.h"
#include "texture_lanes.h"

/* An index into texels, of all channels, is an int32_t. */
static bool covers(const struct imp_texture *tex)
{
    const struct bitmap *t = tex->self;
    return (uint64_t)t->width * (uint64_t)t->height <= INT32_MAX / 4;
}

static imp_wide periods(imp_wide u, enum wrap wrap)
{
    const imp_wide least = imp__wide(-1), most = imp__wide(2);
    switch (wrap) {
    case WRAP_REPEAT: u -= imp__wide_floor(u); break;
    case WRAP_MIRROR: u -= 2 * imp__wide_floor(u * 0.5); break;
    case WRAP_CLAMP: u = imp__wide_larger(imp__wide_lesser(u, most), least); break;
    }
    return imp__wide_choose((u >= least) & (u <= most), u, imp__wide(0));
}
static imp_wide wrapped(imp_wide i, int count, enum wrap wrap)
{
    const imp_wide zero = imp__wide(0), n = imp__wide(count);
    switch (wrap) {
    case WRAP_REPEAT:
        return imp__wide_choose(i < zero, i + n, imp__wide_choose(i >= n, i - n, i));
    case WRAP_MIRROR:
        i = imp__wide_choose(i < zero, -1 - i, i);
        i = imp__wide_choose(i >= 2 * n, i - 2 * n, i);
        return imp__wide_choose(i < n, i, 2 * n - 1 - i);
    case WRAP_CLAMP: break;
    }
    return imp__wide_larger(imp__wide_lesser(i, n - 1), zero);
}

/* Numbers of up to four texels, and their weights; how many. */
static inline int footprints(const struct bitmap *t, const imp_wide at[2],
                             imp_wide texel[4], imp_wide weight[4])
{
    imp_wide uv[2] = {at[0], at[1]};
    for (int k = 0; k < 2 && !t->identity; k++)
        uv[k] = t->to_uv.m[k][0] * at[0] + t->to_uv.m[k][1] * at[1] + t->to_uv.m[k][2];
    const imp_wide u = periods(uv[0], t->wrap), v = periods(uv[1], t->wrap);
    const double w = t->width, h = t->height;
    if (t->filter == FILTER_NEAREST) {
        texel[0] = wrapped(imp__wide_floor(v * h), t->height, t->wrap) * w +
                   wrapped(imp__wide_floor(u * w), t->width, t->wrap);
        weight[0] = imp__wide(1);
        return 1;
    }
    const imp_wide x = u * w - 0.5, y = v * h - 0.5;
    const imp_wide x0 = imp__wide_floor(x), y0 = imp__wide_floor(y);
    const imp_wide a = x - x0, b = y - y0;
    const imp_wide xs[2] = {wrapped(x0, t->width, t->wrap),
                            wrapped(x0 + 1, t->width, t->wrap)};
    const imp_wide ys[2] = {wrapped(y0, t->height, t->wrap) * w,
                            wrapped(y0 + 1, t->height, t->wrap) * w};
    for (int k = 0; k < 4; k++) texel[k] = ys[k >> 1] + xs[k & 1];
    weight[0] = (1 - a) * (1 - b);
    weight[1] = a * (1 - b);
    weight[2] = (1 - a) * b;
    weight[3] = a * b;
    return 4;
}

static void eval(const struct imp_texture *tex, const imp_wide uv[2], bool scalar,
                 struct imp_wide_color *value)
{
    const struct bitmap *t = tex->self;
    imp_wide texel[4], weight[4];
    const int n = footprints(t, uv, texel, weight);
    *value = imp__wide_color((imp_spec){0});
    for (int k = 0; k < n; k++) {
        const imp_wide at = texel[k] * t->channels;
        for (int c = 0; c < t->channels; c++)
            value->c[c] += imp__wide_gathered(t->data + c, at) * weight[k];
    }
    if (t->channels == 3 && !scalar) return;
    if (t->channels == 3)
        value->c[0] =
            IMP_LUM_R * value->c[0] + IMP_LUM_G * value->c[1] + IMP_LUM_B * value->c[2];
    for (int c = 1; c < 4; c++) value->c[c] = value->c[0];
}

static bool texels(const struct imp_texture *tex, const imp_wide uv[2], bool scalar,
                   struct imp_wide_texels *out)
{
    const struct bitmap *t = tex->self;
    if (scalar && t->channels == 3) return false; /* a luminance */
    out->n = footprints(t, uv, out->element, out->weight);
    for (int k = 0; k < out->n; k++) out->element[k] *= t->channels;
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        out->param[k] = tex->param;
        out->channels[k] = (int8_t)t->channels;
    }
    return true;
}

const struct imp_texture_lanes imp__bitmap_lanes = {
    .covers = covers, .eval = eval, .texels = texels};

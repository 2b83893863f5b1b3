/* SPDX-License-Identifier: Apache-2.0
 *
 * A parser of .vol grids, the picture of one as a film, and imp_scene_write_volume. */
#include "vol_file.h"
#include "base/arguments.h"
#include "base/little.h"
#include "image.h"
#include "scene/scene.h"
#include <math.h>
#include <string.h>

enum { HEADER = 48 };

/* Bytes of the mark behind the grid, which importon writes. */
static size_t mark_bytes(const struct imp_bytes *bytes)
{
    const size_t n = sizeof IMP_VOL_MARK - 1;
    return bytes->size >= HEADER + n &&
                   !memcmp(bytes->data + bytes->size - n, IMP_VOL_MARK, n)
               ? n
               : 0;
}

enum imp_status imp__vol_parse(imp_context *ctx, struct imp_arena *keep, const char *name,
                               const struct imp_bytes *bytes, struct imp_grid_data *out)
{
    const unsigned char *b = bytes->data;
    struct imp_grid_data g = {.n = {0}};
    if (bytes->size < HEADER || memcmp(b, "VOL", 3) != 0)
        return imp__error(ctx, IMP_E_SCENE, "%s: not a .vol file", name);
    if (b[3] != 3)
        return imp__error(ctx, IMP_E_UNSUPPORTED, "%s: version %d of .vol; 3 is known",
                          name, b[3]);
    if (imp__little_u32(b + 4) != 1)
        return imp__error(ctx, IMP_E_UNSUPPORTED,
                          "%s: values of type %u; 1, floats, is known", name,
                          imp__little_u32(b + 4));
    size_t n = 1;
    for (int k = 0; k < 3; k++) {
        const uint32_t size = imp__little_u32(b + 8 + 4 * k);
        if (size < 1 || size > INT32_MAX / 4 || __builtin_mul_overflow(n, size, &n))
            return imp__error(ctx, IMP_E_SCENE, "%s: %u cells along %c", name, size,
                              "xyz"[k]);
        g.n[k] = (int)size;
    }
    g.channels = (int)imp__little_u32(b + 20);
    if (g.channels != 1 && g.channels != 3)
        return imp__error(ctx, IMP_E_UNSUPPORTED, "%s: %d channels; 1 or 3 are possible",
                          name, g.channels);
    if (__builtin_mul_overflow(n, (size_t)g.channels, &n) ||
        n > (SIZE_MAX - HEADER) / 4 || bytes->size - mark_bytes(bytes) != HEADER + 4 * n)
        return imp__error(ctx, IMP_E_SCENE,
                          "%s: %zu bytes for %d x %d x %d cells of %d channels", name,
                          bytes->size, g.n[0], g.n[1], g.n[2], g.channels);
    for (int k = 0; k < 6; k++) {
        g.box[k] = imp__little_float(b + 24 + 4 * k);
        if (!isfinite(g.box[k]))
            return imp__error(ctx, IMP_E_SCENE, "%s: its box is not finite", name);
    }
    float *value = imp__arena_take(keep, n, sizeof *value);
    if (!value) return imp__error(ctx, IMP_E_NOMEM, "%s: no memory for it", name);
    for (size_t i = 0; i < n; i++) {
        value[i] = imp__little_float(b + HEADER + 4 * i);
        if (!isfinite(value[i])) {
            const size_t cell = i / (size_t)g.channels, row = cell / (size_t)g.n[0];
            return imp__error(
                ctx, IMP_E_SCENE, "%s: the value of cell (%zu, %zu, %zu) is not finite",
                name, cell % (size_t)g.n[0], row % (size_t)g.n[1], row / (size_t)g.n[1]);
        }
    }
    g.value = value;
    *out = g;
    return IMP_OK;
}

enum imp_status imp__vol_picture(imp_context *ctx, const char *name,
                                 const struct imp_bytes *file, imp_film **out)
{
    enum imp_status st = IMP_OK;
    struct imp_arena arena;
    struct imp_grid_data g;
    imp_film *film;
    imp__arena_init(&arena, ctx);
    IMP_TRY(imp__vol_parse(ctx, &arena, name, file, &g));
    const uint64_t height = (uint64_t)g.n[1] * (uint64_t)g.n[2];
    IMP_TRY(imp__image_film(ctx, name, (uint64_t)g.n[0], height,
                            g.channels == 3 ? "R,G,B" : "Y", file->size, 1, &film));
    memcpy(film->mean, g.value,
           (size_t)g.n[0] * (size_t)height * (size_t)g.channels * sizeof *g.value);
    *out = film;
out:
    imp__arena_free(&arena);
    return st;
}

/* ---- Writing ------------------------------------------------------------------------- */

struct written {
    const struct imp_param *param;
    const double *values; /* NULL: the parameter's */
};

static void put_word(struct imp_file_writer *w, uint32_t x)
{
    const unsigned char b[4] = {(unsigned char)x, (unsigned char)(x >> 8),
                                (unsigned char)(x >> 16), (unsigned char)(x >> 24)};
    imp__file_put(w, b, sizeof b);
}
static void put_number(struct imp_file_writer *w, float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    put_word(w, bits);
}

static void fill(struct imp_file_writer *w, const void *payload)
{
    const struct written *v = payload;
    const struct imp_param_info *info = &v->param->info;
    const bool colour = info->flags & IMP_PARAM_COLOR;
    imp__file_put(w, "VOL\3", 4);
    put_word(w, 1);
    put_word(w, (uint32_t)(colour ? info->dims[1] : info->dims[2]));
    put_word(w, (uint32_t)(colour ? info->dims[0] / info->layers : info->dims[1]));
    put_word(w, (uint32_t)info->layers);
    put_word(w, colour ? 3 : 1);
    for (int k = 0; k < 6; k++) put_number(w, v->param->box[k]);
    for (size_t i = 0; i < info->count; i++)
        put_number(w, (float)(v->values ? v->values[i] : imp__param_get(v->param, i)));
    /* Behind the grid, where no reader reads: the command recognises its own files by
     * it. */
    imp__file_put(w, IMP_VOL_MARK, sizeof IMP_VOL_MARK - 1);
}

enum imp_status imp_scene_write_volume(const imp_scene *scene, size_t index,
                                       const double *values, const char *path)
{
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, path, "path");
    if (index >= scene->n_params)
        return imp__error(scene->ctx, IMP_E_ARG, "there is no parameter %zu", index);
    const struct written v = {&scene->params[index], values};
    const struct imp_param_info *info = &v.param->info;
    if (values) IMP_FINITE_ALL(scene->ctx, values, info->count, "values");
    if (!(info->flags & IMP_PARAM_VOLUME))
        return imp__error(scene->ctx, IMP_E_ARG, "%s is no volume", info->name);
    IMP_READS(scene);
    return imp__file_write_by(scene->ctx, path, fill, &v);
}

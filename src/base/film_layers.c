/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures as layers of one. */
#include "arguments.h"
#include "film.h"
#include <stdio.h>
#include <string.h>

#define LAYER_MAX 150

/* Names "layer.NAME" behind those that f has: f->names alone is changed. */
static enum imp_status names_add(imp_film *f, const imp_film *other, const char *layer)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = f->ctx;
    const size_t own = (size_t)f->channels, n = (size_t)other->channels;
    char text[LAYER_MAX + 256], **names = imp__alloc(ctx, own + n, sizeof *names);
    if (!names) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "film: out of memory"));
    for (size_t c = 0; c < n; c++) {
        snprintf(text, sizeof text, "%s.%s", layer, other->names[c]);
        if (imp__film_find(f, text) >= 0)
            IMP_TRY(imp__error(ctx, IMP_E_ARG, "film: channel name twice: '%s'", text));
        if (!(names[own + c] = imp__strdup(ctx, text)))
            IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "film: out of memory"));
    }
    memcpy(names, f->names, own * sizeof *names);
    imp__release(ctx, f->names);
    f->names = names;
    return IMP_OK;
out:
    for (size_t c = 0; names && c < n; c++) imp__release(ctx, names[own + c]);
    imp__release(ctx, names);
    return st;
}

/* [n_pixels][a + b] of two pictures. */
static float *interleaved(imp_context *ctx, size_t n_pixels, const float *a, size_t n_a,
                          const float *b, size_t n_b)
{
    float *out = imp__alloc_raw(ctx, n_pixels * (n_a + n_b), sizeof *out), *to = out;
    for (size_t i = 0; out && i < n_pixels; i++, to += n_a + n_b) {
        memcpy(to, a + i * n_a, n_a * sizeof *to);
        memcpy(to + n_a, b + i * n_b, n_b * sizeof *to);
    }
    return out;
}

enum imp_status imp_film_add_layer(imp_film *f, const imp_film *other, const char *layer)
{
    enum imp_status st = IMP_OK;
    float *mean = NULL, *se = NULL;
    IMP_REQUIRE(NULL, f, "film");
    IMP_REQUIRE(f->ctx, other, "other");
    IMP_REQUIRE(f->ctx, layer, "layer");
    if (!*layer || strlen(layer) > LAYER_MAX || strpbrk(layer, ", "))
        return imp__error(f->ctx, IMP_E_ARG,
                          "film: '%.200s' is no name of a layer: 1 to %d characters "
                          "without commas and blanks",
                          layer, LAYER_MAX);
    if (f->width != other->width || f->height != other->height)
        return imp__error(f->ctx, IMP_E_ARG,
                          "pictures of other sizes: %d x %d and %d x %d", f->width,
                          f->height, other->width, other->height);
    const size_t a = (size_t)f->channels, b = (size_t)other->channels;
    const size_t n = (size_t)f->width * (size_t)f->height;
    if (a + b > IMP_FILM_CHANNELS_MAX || n * (a + b) > IMP_FILM_VALUES_MAX)
        return imp__error(f->ctx, IMP_E_ARG,
                          "film: %d x %d with %zu channels is too large", f->width,
                          f->height, a + b);
    mean = interleaved(f->ctx, n, f->mean, a, other->mean, b);
    if (f->se && other->se) se = interleaved(f->ctx, n, f->se, a, other->se, b);
    if (!mean || (f->se && other->se && !se))
        IMP_TRY(imp__error(f->ctx, IMP_E_NOMEM, "film: no memory for its layers"));
    IMP_TRY(names_add(f, other, layer));
    imp__release(f->ctx, f->mean);
    imp__release(f->ctx, f->se);
    f->mean = mean;
    f->se = se;
    f->channels += other->channels;
    return IMP_OK;
out:
    imp__release(f->ctx, mean);
    imp__release(f->ctx, se);
    return st;
}

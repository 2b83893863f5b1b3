/* SPDX-License-Identifier: Apache-2.0
 *
 * Writing EXR: one part of scanlines, ZIP, half or float. */
#include "exr.h"
#include "image.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define EXR(call)                                                                        \
    do {                                                                                 \
        const exr_result_t code_ = (call);                                               \
        if (code_ != EXR_ERR_SUCCESS) IMP_TRY(imp__exr_error(w->io, code_));             \
    } while (0)

#define HALF_MAX  65504.0f
#define NAME_ROOM 256

struct exr_writer {
    struct imp_exr *io;
    exr_result_t (*compress)(exr_encode_pipeline_t *); /* the library's own */
    exr_context_t exr;
    const imp_film *film;
    const float *mean, *se; /* se NULL: not written */
    bool half;
};

static enum imp_status header_write(struct exr_writer *w)
{
    enum imp_status st = IMP_OK;
    const imp_film *f = w->film;
    const exr_pixel_type_t type = w->half ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT;
    char text[NAME_ROOM];
    int part;
    EXR(exr_set_longname_support(w->exr, 1));
    EXR(exr_add_part(w->exr, NULL, EXR_STORAGE_SCANLINE, &part));
    EXR(exr_initialize_required_attr_simple(w->exr, part, f->width, f->height,
                                            EXR_COMPRESSION_ZIP));
    for (int se = 0; se < (w->se ? 2 : 1); se++)
        for (int c = 0; c < f->channels; c++) {
            snprintf(text, sizeof text, "%s%s", se ? "se." : "", f->names[c]);
            EXR(exr_add_channel(w->exr, part, text, type, EXR_PERCEPTUALLY_LOGARITHMIC, 1,
                                1));
        }
    if (imp__film_find(f, "X") >= 0 && imp__film_find(f, "Z") >= 0) {
        /* Primaries that say: these numbers are X, Y, Z (equal-energy white). */
        const exr_attr_chromaticities_t xyz = {1, 0, 0, 1, 0, 0, 1 / 3.0f, 1 / 3.0f};
        EXR(exr_attr_set_chromaticities(w->exr, part, "chromaticities", &xyz));
    }
    for (size_t i = 0; i < f->n_texts; i++) {
        const exr_result_t code =
            exr_attr_set_string(w->exr, part, f->texts[i].key, f->texts[i].value);
        if (code != EXR_ERR_SUCCESS) {
            st = imp__exr_error(w->io, code);
            IMP_TRY(imp__error_prefix(w->io->ctx, st, "text '%s'", f->texts[i].key));
        }
    }
    if (f->spp > 0) {
        snprintf(text, sizeof text, "%lld", (long long)f->spp);
        EXR(exr_attr_set_string(w->exr, part, IMP_EXR_SPP, text));
    }
    if (f->dropped > 0) {
        snprintf(text, sizeof text, "%llu", (unsigned long long)f->dropped);
        EXR(exr_attr_set_string(w->exr, part, IMP_EXR_DROPPED, text));
    }
    EXR(exr_write_header(w->exr));
out:
    return st;
}

/* A chunk as long as its pixels is read as not compressed. OpenEXR 3.1 stores the pixels
 * only where ZIP makes them longer: at equal length it leaves the ZIP stream, which
 * readers then take for pixels. */
static exr_result_t compress(exr_encode_pipeline_t *pipe)
{
    const struct exr_writer *w = pipe->encoding_user_data;
    const exr_result_t code = w->compress(pipe);
    if (code == EXR_ERR_SUCCESS && pipe->compressed_bytes == pipe->packed_bytes)
        memmove(pipe->compressed_buffer, pipe->packed_buffer, pipe->packed_bytes);
    return code;
}

static enum imp_status pixels_write(struct exr_writer *w)
{
    enum imp_status st = IMP_OK;
    const imp_film *f = w->film;
    exr_encode_pipeline_t pipe = EXR_ENCODE_PIPELINE_INITIALIZER;
    const size_t c = (size_t)f->channels, row = (size_t)f->width * c;
    int32_t lines;
    EXR(exr_get_scanlines_per_chunk(w->exr, 0, &lines));
    for (int y = 0; y < f->height; y += lines) {
        exr_chunk_info_t chunk;
        EXR(exr_write_scanline_chunk_info(w->exr, 0, y, &chunk));
        if (y == 0) EXR(exr_encoding_initialize(w->exr, 0, &chunk, &pipe));
        else EXR(exr_encoding_update(w->exr, 0, &chunk, &pipe));
        for (int i = 0; i < pipe.channel_count; i++) {
            exr_coding_channel_info_t *from = &pipe.channels[i];
            const char *name = from->channel_name;
            int k = imp__film_find(f, name);
            const bool se = k < 0;
            if (se) k = imp__film_find(f, name + strlen("se."));
            from->encode_from_ptr =
                (const uint8_t *)((se ? w->se : w->mean) + (size_t)y * row + (size_t)k);
            from->user_data_type = EXR_PIXEL_FLOAT;
            from->user_bytes_per_element = sizeof(float);
            from->user_pixel_stride = (int32_t)(c * sizeof(float));
            from->user_line_stride = (int32_t)(row * sizeof(float));
        }
        if (y == 0) {
            EXR(exr_encoding_choose_default_routines(w->exr, 0, &pipe));
            w->compress = pipe.compress_fn;
            pipe.encoding_user_data = w;
            if (w->compress) pipe.compress_fn = compress;
        }
        EXR(exr_encoding_run(w->exr, 0, &pipe));
    }
out:
    exr_encoding_destroy(w->exr, &pipe);
    return st;
}

/* Numbers beyond the largest half become the largest half, not infinity. */
static float *clamped(imp_context *ctx, const imp_film *f, const float *from)
{
    const size_t n = imp__film_values(f);
    float *to = imp__alloc(ctx, n, sizeof *to);
    for (size_t i = 0; to && i < n; i++)
        to[i] = isfinite(from[i]) ? imp_clamp(from[i], -HALF_MAX, HALF_MAX) : from[i];
    return to;
}

enum imp_status imp__exr_encode(const imp_film *f, const struct imp_write_options *o,
                                struct imp_bytes *out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = f->ctx;
    struct imp_bytes bytes = {0};
    struct imp_exr io = {.ctx = ctx, .to = &bytes};
    struct exr_writer writer = {.io = &io, .film = f, .half = o->half}, *w = &writer;
    float *mean = NULL, *se = NULL;
    const exr_context_initializer_t setup = imp__exr_begin(&io);

    w->mean = f->mean;
    w->se = o->standard_error ? f->se : NULL;
    if ((size_t)f->width * (size_t)f->channels > 1 << 28)
        IMP_TRY(imp__error(ctx, IMP_E_ARG, "EXR: rows are too long"));
    if (w->half) {
        w->mean = mean = clamped(ctx, f, f->mean);
        if (w->se) w->se = se = clamped(ctx, f, f->se);
        if (!mean || (f->se && o->standard_error && !se))
            IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "EXR: no memory for the picture"));
    }
    EXR(exr_start_write(&w->exr, "picture", EXR_WRITE_FILE_DIRECTLY, &setup));
    IMP_TRY(header_write(w));
    IMP_TRY(pixels_write(w));
    EXR(exr_finish(&w->exr));
    *out = bytes;
    bytes = (struct imp_bytes){0};
out:
    if (w->exr) exr_finish(&w->exr);
    imp__exr_end(&io);
    imp__bytes_free(ctx, &bytes);
    imp__release(ctx, mean);
    imp__release(ctx, se);
    return st;
}

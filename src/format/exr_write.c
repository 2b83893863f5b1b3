/* SPDX-License-Identifier: Apache-2.0
 *
 * Writing EXR: one part of scanlines, ZIP, half or float. */
#include "exr.h"
#include "exr_spectral.h"
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
#define NAME_ROOM IMP_EXR_NAME_ROOM

struct exr_writer {
    struct imp_exr *io;
    exr_result_t (*compress)(exr_encode_pipeline_t *); /* the library's own */
    exr_context_t exr;
    const imp_film *film;
    imp_film *rgb;          /* preview of a spectral film; NULL: not spectral */
    const float *mean, *se; /* se NULL: not written */
    bool half;
};

/* Texts of the layout for spectral images. The unit is the one of the layout;
 * numbers are per nm. */
static enum imp_status spectral_texts(struct exr_writer *w, int part)
{
    enum imp_status st = IMP_OK;
    const imp_film *f = w->film;
    static const char *const texts[][2] = {{"spectralLayoutVersion", "1.0"},
                                           {"emissiveUnits", "W.m^-2.sr^-1"},
                                           {"polarisationHandedness", "right"}};
    bool any = false, emissive = false;
    for (int c = 0; c < f->channels; c++) {
        bool light;
        if (!(imp__exr_wavelength(f->names[c], &light) > 0)) continue;
        any = true;
        emissive = emissive || light;
    }
    for (int k = 0; any && k < (emissive ? 3 : 1); k++)
        if (!imp_film_text(f, texts[k][0]))
            EXR(exr_attr_set_string(w->exr, part, texts[k][0], texts[k][1]));
    if (w->rgb) EXR(exr_attr_set_string(w->exr, part, IMP_EXR_RGB_OF, "spectrum"));
out:
    return st;
}

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
            char name[NAME_ROOM];
            if (strlen(f->names[c]) + strlen("se.") >= sizeof name)
                IMP_TRY(imp__error(w->io->ctx, IMP_E_ARG,
                                   "the name of channel %d is longer than %zu letters", c,
                                   sizeof name - strlen("se.") - 1));
            snprintf(name, sizeof name, "%s%s", se ? "se." : "", f->names[c]);
            imp__exr_name_to_file(name, text);
            EXR(exr_add_channel(w->exr, part, text, type, EXR_PERCEPTUALLY_LOGARITHMIC, 1,
                                1));
        }
    for (int c = 0; w->rgb && c < 3; c++)
        EXR(exr_add_channel(w->exr, part, w->rgb->names[c], type,
                            EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1));
    IMP_TRY(spectral_texts(w, part));
    if (imp__film_find(f, "X") >= 0 && imp__film_find(f, "Z") >= 0) {
        /* Primaries that declare the channels as X, Y, Z (equal-energy white). */
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
    if (f->sets > 0) {
        snprintf(text, sizeof text, "%lld", (long long)f->sets);
        EXR(exr_attr_set_string(w->exr, part, IMP_EXR_SETS, text));
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

/* Channel of the film that has this name in the file, behind `prefix` there; -1: none.
 * Names of wavelengths are not those of the file, and not always found by their number. */
static int channel_of(const imp_film *f, const char *prefix, const char *of_file)
{
    char name[NAME_ROOM], text[NAME_ROOM];
    const size_t skip = strlen(prefix);
    imp__exr_name_to_film(of_file, name);
    const int k = strncmp(name, prefix, skip) == 0 ? imp__film_find(f, name + skip) : -1;
    for (int c = -1; c < f->channels; c++) {
        const int at = c < 0 ? k : c;
        if (at < 0) continue;
        snprintf(name, sizeof name, "%s%s", prefix, f->names[at]);
        imp__exr_name_to_file(name, text);
        if (strcmp(text, of_file) == 0) return at;
    }
    return -1;
}

static enum imp_status pixels_write(struct exr_writer *w)
{
    enum imp_status st = IMP_OK;
    const imp_film *f = w->film;
    exr_encode_pipeline_t pipe = EXR_ENCODE_PIPELINE_INITIALIZER;
    const size_t c = (size_t)f->channels;
    int32_t lines;
    EXR(exr_get_scanlines_per_chunk(w->exr, 0, &lines));
    for (int y = 0; y < f->height; y += lines) {
        exr_chunk_info_t chunk;
        EXR(exr_write_scanline_chunk_info(w->exr, 0, y, &chunk));
        if (y == 0) EXR(exr_encoding_initialize(w->exr, 0, &chunk, &pipe));
        else EXR(exr_encoding_update(w->exr, 0, &chunk, &pipe));
        for (int i = 0; i < pipe.channel_count; i++) {
            exr_coding_channel_info_t *to = &pipe.channels[i];
            const float *from = w->mean;
            size_t n = c; /* numbers from pixel to pixel */
            int k = channel_of(f, "", to->channel_name);
            if (k < 0 && w->rgb && (k = imp__film_find(w->rgb, to->channel_name)) >= 0) {
                from = w->rgb->mean;
                n = 3;
            } else if (k < 0 && w->se) {
                from = w->se;
                k = channel_of(f, "se.", to->channel_name);
            }
            if (k < 0)
                IMP_TRY(imp__error(w->io->ctx, IMP_E_ARG, "channel '%s' has no pixels",
                                   to->channel_name));
            const size_t line = (size_t)f->width * n;
            to->encode_from_ptr = (const uint8_t *)(from + (size_t)y * line + (size_t)k);
            to->user_data_type = EXR_PIXEL_FLOAT;
            to->user_bytes_per_element = sizeof(float);
            to->user_pixel_stride = (int32_t)(n * sizeof(float));
            to->user_line_stride = (int32_t)(line * sizeof(float));
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
static float clamp_half(float v)
{
    return isfinite(v) ? imp_clamp(v, -HALF_MAX, HALF_MAX) : v;
}
static float *clamped(imp_context *ctx, const imp_film *f, const float *from)
{
    const size_t n = imp__film_values(f);
    float *to = imp__alloc(ctx, n, sizeof *to);
    for (size_t i = 0; to && i < n; i++) to[i] = clamp_half(from[i]);
    return to;
}

/* Room for the longest file, of which as much is touched as is written: growing would hold it twice. */
static void room_take(const struct exr_writer *w, struct imp_bytes *bytes)
{
    const size_t values = imp__film_values(w->film) * (w->se ? 2 : 1) +
                          (w->rgb ? imp__film_values(w->rgb) : 0);
    const size_t room = values * (w->half ? 2 : 4) + 8 * (size_t)w->film->height + 65536;
    bytes->data = imp__alloc_raw(w->film->ctx, room, 1);
    bytes->capacity = bytes->data ? room : 0; /* else it grows */
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

    IMP_TRY(imp__exr_spectral_rgb(f, &w->rgb));
    w->mean = f->mean;
    w->se = o->standard_error ? f->se : NULL;
    if ((size_t)f->width * (size_t)f->channels > 1 << 28)
        IMP_TRY(imp__error(ctx, IMP_E_ARG, "EXR: rows are too long"));
    if (w->half) {
        w->mean = mean = clamped(ctx, f, f->mean);
        if (w->se) w->se = se = clamped(ctx, f, f->se);
        if (!mean || (f->se && o->standard_error && !se))
            IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "EXR: no memory for the picture"));
        for (size_t i = 0; w->rgb && i < imp__film_values(w->rgb); i++)
            w->rgb->mean[i] = clamp_half(w->rgb->mean[i]);
    }
    room_take(w, &bytes);
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
    imp_film_destroy(w->rgb);
    imp__release(ctx, mean);
    imp__release(ctx, se);
    return st;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Reading EXR: scanlines or tiles, half, float or uint, any compression of the
 * library. Channels are found by name; those called se.NAME beside a NAME are standard
 * errors. */
#include "base/number.h"
#include "exr.h"
#include "exr_spectral.h"
#include "image.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXR(call)                                                                        \
    do {                                                                                 \
        const exr_result_t code_ = (call);                                               \
        if (code_ != EXR_ERR_SUCCESS) IMP_TRY(imp__exr_error(r->io, code_));             \
    } while (0)

struct exr_reader {
    struct imp_exr *io;
    exr_context_t exr;
    int width, height;
    exr_attr_box2i_t window;
    const exr_attr_chlist_t *list;
    int n_planes, n_se;
    /* R, G, B are made from the spectrum, and have no errors of their own. */
    bool skip_rgb;
    int *order;     /* of the channels in the film: index in list */
    float **target; /* by index in list: first number of the channel */
    imp_film *film;
};

static const char *channel_name(const struct exr_reader *r, int i)
{
    return r->list->entries[i].name.str;
}

static int find(const struct exr_reader *r, const char *name)
{
    for (int i = 0; i < r->list->num_channels; i++)
        if (strcmp(channel_name(r, i), name) == 0) return i;
    return -1;
}

/* Index in the list of the channel whose standard error this is; -1: an ordinary channel,
 * as one is that would be the error of an error. */
static int se_of(const struct exr_reader *r, int i)
{
    const char *name = channel_name(r, i);
    if (strncmp(name, "se.", 3) != 0) return -1;
    const int of = find(r, name + 3);
    return of >= 0 && se_of(r, of) < 0 ? of : -1;
}

/* R, G, B, A are in this order though files have them in alphabetical order; layers stay
 * together, channels without a layer come first. */
static int channel_rank(const char *last)
{
    static const struct {
        char letter;
        int rank;
    } ranks[] = {{'R', 0}, {'G', 1}, {'B', 2}, {'X', 0}, {'Y', 1}, {'Z', 2}, {'A', 9}};
    for (size_t i = 0; last[0] && !last[1] && i < imp_count(ranks); i++)
        if (ranks[i].letter == last[0]) return ranks[i].rank;
    return 5;
}
static int channel_compare(const struct exr_reader *r, int a, int b)
{
    const char *name[2] = {channel_name(r, a), channel_name(r, b)}, *last[2];
    size_t layer[2];
    char own[2][IMP_EXR_NAME_ROOM];
    double nm[2];
    for (int k = 0; k < 2; k++) {
        imp__exr_name_to_film(name[k], own[k]);
        nm[k] = imp__exr_wavelength(own[k], NULL);
    }
    if (nm[0] > 0 && nm[1] > 0 && strncmp(own[0], own[1], 2) == 0 && nm[0] != nm[1])
        return nm[0] < nm[1] ? -1 : 1;
    for (int k = 0; k < 2; k++) {
        const char *dot = strrchr(name[k], '.');
        last[k] = dot ? dot + 1 : name[k];
        layer[k] = (size_t)(last[k] - name[k]);
    }
    const int by_layer = strncmp(name[0], name[1], imp_min(layer[0], layer[1]));
    if (by_layer) return by_layer;
    if (layer[0] != layer[1]) return layer[0] < layer[1] ? -1 : 1;
    const int rank[2] = {channel_rank(last[0]), channel_rank(last[1])};
    return rank[0] != rank[1] ? rank[0] - rank[1] : strcmp(last[0], last[1]);
}

static enum imp_status header_read(struct exr_reader *r, size_t bytes)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = r->io->ctx;
    exr_storage_t storage;
    exr_compression_t compression;
    EXR(exr_get_storage(r->exr, 0, &storage));
    if (storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_TILED)
        IMP_TRY(imp__error(ctx, IMP_E_UNSUPPORTED, "%s: deep EXR files are not read",
                           r->io->name));
    EXR(exr_get_data_window(r->exr, 0, &r->window));
    EXR(exr_get_compression(r->exr, 0, &compression));
    EXR(exr_get_channels(r->exr, 0, &r->list));
    const int64_t w = (int64_t)r->window.max.x - r->window.min.x + 1,
                  h = (int64_t)r->window.max.y - r->window.min.y + 1;
    const int n = r->list ? r->list->num_channels : 0;
    if (w < 1 || h < 1 || w > IMP_FILM_SIDE_MAX || h > IMP_FILM_SIDE_MAX)
        IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: a size of %lld x %lld pixels",
                           r->io->name, (long long)w, (long long)h));
    if (n < 1 || n > IMP_FILM_CHANNELS_MAX || w * n > 1 << 28)
        IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: %d channels in a width of %lld",
                           r->io->name, n, (long long)w));
    for (int i = 0; i < n; i++)
        if (r->list->entries[i].x_sampling != 1 || r->list->entries[i].y_sampling != 1)
            IMP_TRY(imp__error(ctx, IMP_E_UNSUPPORTED, "%s: channel '%s' is subsampled",
                               r->io->name, channel_name(r, i)));
    /* Deflate packs at most 1032:1, PIZ and RLE less; the others are given more room. */
    const double ratio = compression == EXR_COMPRESSION_NONE    ? 1.0
                         : compression <= EXR_COMPRESSION_PXR24 ? 1100.0
                                                                : 1e5;
    if ((double)w * (double)h * n * 2 > ratio * (double)bytes + 65536)
        IMP_TRY(imp__error(ctx, IMP_E_SCENE,
                           "%s: cut off: %lld x %lld pixels in %zu bytes", r->io->name,
                           (long long)w, (long long)h, bytes));
    IMP_TRY(imp__unpacks(ctx, r->io->name, (double)bytes, 4.0 * (double)w * (double)h * n,
                         IMP_IMAGE_ALWAYS));
    r->width = (int)w;
    r->height = (int)h;
out:
    return st;
}

/* Sort the channels, make the film, and find where each channel goes. */
static enum imp_status film_make(struct exr_reader *r)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = r->io->ctx;
    const int n = r->list->num_channels;
    struct imp_bytes names = {0};
    r->order = imp__alloc(ctx, (size_t)n, sizeof *r->order);
    r->target = imp__alloc(ctx, (size_t)n, sizeof *r->target);
    if (!r->order || !r->target)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", r->io->name));
    const exr_attribute_t *rgb;
    r->skip_rgb =
        exr_get_attribute_by_name(r->exr, 0, IMP_EXR_RGB_OF, &rgb) == EXR_ERR_SUCCESS &&
        n > 3;
    *r->io->message = 0; /* that there is none is no error */
    for (int i = 0; i < n; i++) {
        if (se_of(r, i) >= 0) {
            r->n_se++;
            continue;
        }
        const char *name = channel_name(r, i);
        if (r->skip_rgb && name[0] && !name[1] && strchr("RGB", name[0])) continue;
        int k = r->n_planes++;
        for (; k > 0 && channel_compare(r, r->order[k - 1], i) > 0; k--)
            r->order[k] = r->order[k - 1];
        r->order[k] = i;
    }
    for (int k = 0; k < r->n_planes; k++) {
        char name[IMP_EXR_NAME_ROOM];
        imp__exr_name_to_film(channel_name(r, r->order[k]), name);
        if (!imp__bytes_add(ctx, &names, ",", k > 0) ||
            !imp__bytes_add(ctx, &names, name, strlen(name)))
            IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", r->io->name));
        if (strchr(name, ',') || *name == ' ' || !*name)
            IMP_TRY(
                imp__error(ctx, IMP_E_SCENE, "%s: channel name '%s'", r->io->name, name));
    }
    if (!imp__bytes_add(ctx, &names, "", 1))
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", r->io->name));
    st = imp__film_create(ctx, r->width, r->height, (char *)names.data, r->n_se > 0,
                          &r->film);
    if (st != IMP_OK)
        IMP_TRY(imp__error_prefix(ctx, st == IMP_E_ARG ? IMP_E_SCENE : st, "%s",
                                  r->io->name));
    for (int k = 0; k < r->n_planes; k++) r->target[r->order[k]] = r->film->mean + k;
    for (int i = 0; i < n; i++)
        if (se_of(r, i) >= 0 && r->target[se_of(r, i)])
            r->target[i] = r->film->se + (r->target[se_of(r, i)] - r->film->mean);
out:
    imp__bytes_free(ctx, &names);
    return st;
}

/* One chunk, whose first pixel is (x, y) of the film, into the film. */
static enum imp_status chunk_read(struct exr_reader *r, const exr_chunk_info_t *chunk,
                                  int64_t x, int64_t y, exr_decode_pipeline_t *pipe,
                                  bool *open)
{
    enum imp_status st = IMP_OK;
    if (x < 0 || y < 0 || chunk->width < 0 || chunk->height < 0 ||
        x + chunk->width > r->width || y + chunk->height > r->height)
        IMP_TRY(imp__error(r->io->ctx, IMP_E_SCENE, "%s: a block leaves the picture",
                           r->io->name));
    if (*open) EXR(exr_decoding_update(r->exr, 0, chunk, pipe));
    else EXR(exr_decoding_initialize(r->exr, 0, chunk, pipe));
    const size_t c = (size_t)r->film->channels;
    for (int i = 0; i < pipe->channel_count; i++) {
        exr_coding_channel_info_t *to = &pipe->channels[i];
        const int k = find(r, to->channel_name);
        float *first = k >= 0 ? r->target[k] : NULL;
        to->decode_to_ptr =
            first ? (uint8_t *)(first + ((size_t)y * (size_t)r->width + (size_t)x) * c)
                  : NULL;
        to->user_data_type = EXR_PIXEL_FLOAT;
        to->user_bytes_per_element = sizeof(float);
        to->user_pixel_stride = (int32_t)(c * sizeof(float));
        to->user_line_stride = (int32_t)((size_t)r->width * c * sizeof(float));
    }
    if (!*open) EXR(exr_decoding_choose_default_routines(r->exr, 0, pipe));
    *open = true;
    EXR(exr_decoding_run(r->exr, 0, pipe));
out:
    return st;
}

static enum imp_status pixels_read(struct exr_reader *r)
{
    enum imp_status st = IMP_OK;
    exr_decode_pipeline_t pipe = EXR_DECODE_PIPELINE_INITIALIZER;
    exr_chunk_info_t chunk;
    exr_storage_t storage;
    bool open = false;
    EXR(exr_get_storage(r->exr, 0, &storage));
    if (storage == EXR_STORAGE_SCANLINE) {
        int32_t lines;
        EXR(exr_get_scanlines_per_chunk(r->exr, 0, &lines));
        for (int64_t y = 0; y < r->height; y += imp_max(lines, 1)) {
            EXR(exr_read_scanline_chunk_info(r->exr, 0, (int)(y + r->window.min.y),
                                             &chunk));
            IMP_TRY(chunk_read(r, &chunk, 0, y, &pipe, &open));
        }
    } else {
        uint32_t tw, th;
        exr_tile_level_mode_t levels;
        exr_tile_round_mode_t rounding;
        EXR(exr_get_tile_descriptor(r->exr, 0, &tw, &th, &levels, &rounding));
        if (tw < 1 || th < 1)
            IMP_TRY(imp__error(r->io->ctx, IMP_E_SCENE, "%s: empty tiles", r->io->name));
        for (int64_t y = 0, j = 0; y < r->height; y += th, j++)
            for (int64_t x = 0, i = 0; x < r->width; x += tw, i++) {
                EXR(exr_read_tile_chunk_info(r->exr, 0, (int)i, (int)j, 0, 0, &chunk));
                IMP_TRY(chunk_read(r, &chunk, x, y, &pipe, &open));
            }
    }
out:
    exr_decoding_destroy(r->exr, &pipe);
    return st;
}

/* Text attributes, and the two numbers that films carry as such. */
static enum imp_status texts_read(struct exr_reader *r)
{
    enum imp_status st = IMP_OK;
    int32_t n;
    EXR(exr_get_attribute_count(r->exr, 0, &n));
    for (int i = 0; i < n; i++) {
        const exr_attribute_t *a;
        EXR(exr_get_attribute_by_index(r->exr, 0, EXR_ATTR_LIST_FILE_ORDER, i, &a));
        if (a->type != EXR_ATTR_STRING || !a->string || !a->string->str || !*a->name ||
            strlen(a->name) > 200 || strcmp(a->name, "type") == 0 ||
            strcmp(a->name, IMP_EXR_RGB_OF) == 0)
            continue;
        const char *s = a->string->str, *end = s + strlen(s);
        int64_t value;
        if (strcmp(a->name, IMP_EXR_SPP) == 0 && imp__integer(&s, end, &value)) {
            r->film->spp = imp_max(value, (int64_t)0);
        } else if (strcmp(a->name, IMP_EXR_SETS) == 0 && imp__integer(&s, end, &value)) {
            r->film->sets = imp_max(value, (int64_t)0);
        } else if (strcmp(a->name, IMP_EXR_DROPPED) == 0 &&
                   imp__integer(&s, end, &value)) {
            r->film->dropped = (uint64_t)imp_max(value, (int64_t)0);
        } else IMP_TRY(imp_film_set_text(r->film, a->name, a->string->str));
    }
out:
    return st;
}

enum imp_status imp__exr_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out)
{
    enum imp_status st = IMP_OK;
    struct imp_exr io = {.ctx = ctx, .name = name, .from = file};
    struct exr_reader reader = {.io = &io}, *r = &reader;
    const exr_context_initializer_t setup = imp__exr_begin(&io);
    EXR(exr_start_read(&r->exr, name, &setup));
    IMP_TRY(header_read(r, file->size));
    IMP_TRY(film_make(r));
    IMP_TRY(pixels_read(r));
    IMP_TRY(texts_read(r));
    *out = r->film;
    r->film = NULL;
out:
    if (r->exr) exr_finish(&r->exr);
    imp__exr_end(&io);
    imp_film_destroy(r->film);
    imp__release(ctx, r->order);
    imp__release(ctx, r->target);
    return st;
}

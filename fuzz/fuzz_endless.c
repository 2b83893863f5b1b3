/* SPDX-License-Identifier: Apache-2.0
 *
 * Files that never seem to end: the tail of the input is repeated up to a quarter of a megabyte, the
 * first byte chooses the reader, the second the length of the tail. A reader takes no more memory
 * than small files may become (base/file.h), and gives it back. */
#include "format/curve_file.h"
#include "format/ies_file.h"
#include "format/image.h"
#include "format/ldt_file.h"
#include "format/measured_file.h"
#include "format/merl_file.h"
#include "format/mesh_file.h"
#include "format/value.h"
#include "format/vol_file.h"
#include "memory_file.h"
#include <importon/bend.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { BYTES = 1 << 18, HEAD = 64 };
/* In the order of the corpus' first bytes. */
enum {
    OBJ,
    PLY,
    SERIALIZED,
    CURVE,
    IES,
    VOL,
    IMAGE,
    LDT,
    MERL,
    MEASURED,
    SPECTRUM,
    FIELD,
    SCENE,
    KINDS
};
#define MOST ((size_t)IMP_IMAGE_ALWAYS + IMP_UNPACKS_TO * BYTES + ((size_t)64 << 20))

static size_t held;

static void *allocate(size_t bytes, void *payload)
{
    (void)payload;
    if (bytes > MOST || held + bytes > MOST) abort();
    const size_t room = (bytes + HEAD + HEAD - 1) / HEAD * HEAD;
    char *p = aligned_alloc(HEAD, room);
    if (!p) return NULL;
    memcpy(p, &bytes, sizeof bytes);
    held += bytes;
    return p + HEAD;
}

static void release(void *memory, void *payload)
{
    size_t bytes;
    (void)payload;
    if (!memory) return;
    char *p = (char *)memory - HEAD;
    memcpy(&bytes, p, sizeof bytes);
    held -= bytes;
    free(p);
}

static void mesh_read(imp_context *ctx, int kind, const struct imp_bytes *file)
{
    struct imp_arena keep, temporary;
    struct imp_mesh_data mesh;
    imp__arena_init(&keep, ctx);
    imp__arena_init(&temporary, ctx);
    const struct imp_mesh_source source = {.ctx = ctx,
                                           .keep = &keep,
                                           .temporary = &temporary,
                                           .name = "endless",
                                           .text = *file};
    (void)!(kind == OBJ   ? imp__obj_parse(&source, &mesh)
            : kind == PLY ? imp__ply_parse(&source, &mesh)
                          : imp__serialized_parse(&source, 0, &mesh));
    imp__arena_free(&keep);
    imp__arena_free(&temporary);
}

static void table_read(imp_context *ctx, int kind, const struct imp_bytes *file)
{
    struct imp_arena keep;
    struct imp_curve_data curves;
    struct imp_ies_data table;
    struct imp_grid_data grid;
    struct imp_merl_data merl;
    struct imp_measured_data measured;
    imp__arena_init(&keep, ctx);
    (void)!(kind == CURVE  ? imp__curve_parse(ctx, &keep, "endless", file, &curves)
            : kind == IES  ? imp__ies_parse(ctx, &keep, "endless", file, &table)
            : kind == LDT  ? imp__ldt_parse(ctx, &keep, "endless", file, &table)
            : kind == MERL ? imp__merl_parse(ctx, &keep, "endless", file, &merl)
            : kind == MEASURED
                ? imp__measured_parse(ctx, &keep, "endless", file, &measured)
                : imp__vol_parse(ctx, &keep, "endless", file, &grid));
    imp__arena_free(&keep);
}

/* Readers that take a path. */
static void path_read(imp_context *ctx, int kind, const struct imp_bytes *bytes)
{
    static struct memory_file file;
    struct imp_samples samples;
    imp_field *field;
    if (!file.path[0]) memory_file_open(&file);
    memory_file_put(&file, bytes->data, bytes->size);
    if (kind == SPECTRUM) {
        if (imp__samples_read(ctx, file.path, &samples) == IMP_OK)
            imp__release(ctx, samples.list);
    } else if (imp_field_read(ctx, file.path, NULL, &field) == IMP_OK)
        imp_field_destroy(field);
}

static void scene_read(imp_context *ctx, const struct imp_bytes *bytes)
{
    imp_scene *scene = NULL;
    (void)!imp_scene_load_string(ctx, (const char *)bytes->data, bytes->size, "endless",
                                 NULL, &scene);
    imp_scene_destroy(scene);
}

static void image_read(imp_context *ctx, const struct imp_bytes *file)
{
    imp_film *film = NULL;
    bool srgb;
    if (imp__image_parse(ctx, "endless", file, &film, &srgb) == IMP_OK)
        imp_film_destroy(film);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx;
    static unsigned char all[BYTES + 1];
    if (!ctx) {
        struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
        o.threads = 1;
        o.allocator = (struct imp_allocator){allocate, release, NULL};
        if (imp_context_create(&o, &ctx) != IMP_OK) abort();
    }
    if (size < 3 || size > BYTES) return 0;
    const int kind = data[0] % KINDS;
    const size_t n = size - 2, tail = data[1] % n + 1;
    memcpy(all, data + 2, n);
    for (size_t k = n; k < BYTES; k++) all[k] = all[k - tail];
    all[BYTES] = 0;
    const struct imp_bytes file = {all, BYTES, BYTES};
    const size_t before = held;
    if (kind <= SERIALIZED) mesh_read(ctx, kind, &file);
    else if (kind == IMAGE) image_read(ctx, &file);
    else if (kind == SPECTRUM || kind == FIELD) path_read(ctx, kind, &file);
    else if (kind == SCENE) scene_read(ctx, &file);
    else table_read(ctx, kind, &file);
    if (held > before + (1 << 16)) abort(); /* a message may stay */
    return 0;
}

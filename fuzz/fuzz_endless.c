/* SPDX-License-Identifier: Apache-2.0
 *
 * Files that never seem to end: the tail of the input is repeated up to a quarter of a megabyte, the
 * first byte chooses the reader, the second the length of the tail. A reader takes no more memory
 * than small files may become (base/file.h), and gives it back. */
#include "format/curve_file.h"
#include "format/ies_file.h"
#include "format/image.h"
#include "format/mesh_file.h"
#include "format/vol_file.h"
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { BYTES = 1 << 18, HEAD = 64 };
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
    (void)!(kind == 0   ? imp__obj_parse(&source, &mesh)
            : kind == 1 ? imp__ply_parse(&source, &mesh)
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
    imp__arena_init(&keep, ctx);
    (void)!(kind == 3   ? imp__curve_parse(ctx, &keep, "endless", file, &curves)
            : kind == 4 ? imp__ies_parse(ctx, &keep, "endless", file, &table)
                        : imp__vol_parse(ctx, &keep, "endless", file, &grid));
    imp__arena_free(&keep);
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
    const int kind = data[0] % 7;
    const size_t n = size - 2, tail = data[1] % n + 1;
    memcpy(all, data + 2, n);
    for (size_t k = n; k < BYTES; k++) all[k] = all[k - tail];
    all[BYTES] = 0;
    const struct imp_bytes file = {all, BYTES, BYTES};
    imp_film *film = NULL;
    bool srgb;
    const size_t before = held;
    if (kind < 3) mesh_read(ctx, kind, &file);
    else if (kind < 6) table_read(ctx, kind, &file);
    else if (imp__image_parse(ctx, "endless", &file, &film, &srgb) == IMP_OK)
        imp_film_destroy(film);
    if (held > before + (1 << 16)) abort(); /* a message may stay */
    return 0;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Meshes: the first byte chooses OBJ, PLY or serialized and whether v is flipped. What is read has
 * indices in range and finite numbers. */
#include "format/mesh_file.h"
#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(const struct imp_mesh_data *m)
{
    if (m->n_triangles == 0 || m->n_vertices == 0) abort();
    for (size_t i = 0; i < 3 * m->n_triangles; i++)
        if (m->indices[i] >= m->n_vertices) abort();
    for (size_t i = 0; i < 3 * m->n_vertices; i++)
        if (!isfinite(m->positions[i]) || (m->normals && !isfinite(m->normals[i])))
            abort();
    for (size_t i = 0; m->uvs && i < 2 * m->n_vertices; i++)
        if (!isfinite(m->uvs[i])) abort();
    for (int a = 0; a < m->n_attributes; a++) {
        const struct imp_attribute_data *x = &m->attribute[a];
        if (x->n != (x->face ? m->n_triangles : m->n_vertices)) abort();
        for (size_t i = 0; i < x->n * (size_t)x->channels; i++)
            if (!isfinite(x->values[i])) abort();
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx;
    if (!ctx && imp_context_create(NULL, &ctx) != IMP_OK) abort();
    if (size < 1) return 0;
    const int choice = *data++;
    size--;
    struct imp_arena keep, temporary;
    imp__arena_init(&keep, ctx);
    imp__arena_init(&temporary, ctx);
    const struct imp_mesh_source source = {.ctx = ctx,
                                           .keep = &keep,
                                           .temporary = &temporary,
                                           .name = "fuzz",
                                           .text = {(unsigned char *)data, size, size},
                                           .flip_v = choice & 2};
    struct imp_mesh_data mesh;
    if ((choice & 4   ? imp__serialized_parse(&source, choice >> 3 & 1, &mesh)
         : choice & 1 ? imp__ply_parse(&source, &mesh)
                      : imp__obj_parse(&source, &mesh)) == IMP_OK)
        check(&mesh);
    imp__arena_free(&keep);
    imp__arena_free(&temporary);
    return 0;
}

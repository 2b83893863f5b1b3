/* SPDX-License-Identifier: Apache-2.0
 *
 * Arrays for the vertices and triangles of a mesh file. */
#include "mesh_file.h"
#include <string.h>

enum imp_status imp__mesh_arrays(const struct imp_mesh_source *source, size_t n_vertices,
                                 size_t n_triangles, float **positions, float **normals,
                                 float **uvs, uint32_t **indices,
                                 struct imp_mesh_data *out)
{
    *positions = imp__arena_take(source->temporary, 3 * n_vertices + 4, sizeof(float));
    *indices = imp__arena_take(source->keep, 3 * n_triangles, sizeof(uint32_t));
    if (normals)
        *normals = imp__arena_take(source->temporary, 3 * n_vertices, sizeof(float));
    if (uvs) *uvs = imp__arena_take(source->keep, 2 * n_vertices, sizeof(float));
    if (!*positions || !*indices || (normals && !*normals) || (uvs && !*uvs))
        return imp__error(source->ctx, IMP_E_NOMEM, "%s: no memory for %zu triangles",
                          source->name, n_triangles);
    memset(*positions + 3 * n_vertices, 0, 4 * sizeof(float));
    *out = (struct imp_mesh_data){.n_vertices = n_vertices,
                                  .n_triangles = n_triangles,
                                  .positions = *positions,
                                  .normals = normals ? *normals : NULL,
                                  .uvs = uvs ? *uvs : NULL,
                                  .indices = *indices,
                                  .normals_from_file = normals != NULL};
    return IMP_OK;
}

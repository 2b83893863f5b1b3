/* SPDX-License-Identifier: Apache-2.0
 *
 * Triangle meshes in files (docs/scene-format.md 13.1 to 13.3). What a shape keeps (uvs,
 * indices) goes to the arena `keep`, what it copies (positions, normals) to `temporary`.
 * Every number is finite and every index in range in what is returned; messages begin
 * with the file's name and name line, vertex or face. */
#ifndef IMP_FORMAT_MESH_FILE_H
#define IMP_FORMAT_MESH_FILE_H

#include "base/file.h"
#include "base/props.h"

#define IMP_MESH_MAX       ((size_t)INT32_MAX) /* vertices, triangles */
#define IMP_MESH_BYTES_MAX ((size_t)1 << 37)

struct imp_mesh_source {
    imp_context *ctx;
    struct imp_arena *keep, *temporary;
    const char *name;      /* for messages */
    struct imp_bytes text; /* the file */
    bool flip_v;           /* v -> 1 - v */
};

enum imp_status imp__obj_parse(const struct imp_mesh_source *source,
                               struct imp_mesh_data *out);
enum imp_status imp__ply_parse(const struct imp_mesh_source *source,
                               struct imp_mesh_data *out);

/* Mesh `index` of those in the file. */
enum imp_status imp__serialized_parse(const struct imp_mesh_source *source, int index,
                                      struct imp_mesh_data *out);

/* Arrays for a mesh of this size; positions have room for 16 bytes after the end. */
enum imp_status imp__mesh_arrays(const struct imp_mesh_source *source, size_t n_vertices,
                                 size_t n_triangles, float **positions, float **normals,
                                 float **uvs, uint32_t **indices,
                                 struct imp_mesh_data *out);

#endif

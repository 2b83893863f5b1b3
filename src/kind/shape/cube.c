/* SPDX-License-Identifier: Apache-2.0
 *
 * [-1,1]^3 as a mesh: four vertices a face, so that every face has its own normal and uv.
 */
#include "shape.h"

static const float positions[24 * 3] = {
    1,  -1, -1, 1,  -1, 1,  -1, -1, 1,  -1, -1, -1,  /* -Y */
    1,  1,  -1, -1, 1,  -1, -1, 1,  1,  1,  1,  1,   /* +Y */
    1,  -1, -1, 1,  1,  -1, 1,  1,  1,  1,  -1, 1,   /* +X */
    1,  -1, 1,  1,  1,  1,  -1, 1,  1,  -1, -1, 1,   /* +Z */
    -1, -1, 1,  -1, 1,  1,  -1, 1,  -1, -1, -1, -1,  /* -X */
    1,  1,  -1, 1,  -1, -1, -1, -1, -1, -1, 1,  -1}; /* -Z */

#define FACE_UV 0, 1, 1, 1, 1, 0, 0, 0
static const float uvs[24 * 2] = {FACE_UV, FACE_UV, FACE_UV, FACE_UV, FACE_UV, FACE_UV};

#define FACE(k) 4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3, 4 * k, 4 * k + 2
static const uint32_t indices[12 * 3] = {FACE(0), FACE(1), FACE(2),
                                         FACE(3), FACE(4), FACE(5)};

static const struct imp_mesh_data cube = {.n_vertices = 24,
                                          .n_triangles = 12,
                                          .positions = positions,
                                          .uvs = uvs,
                                          .indices = indices};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_shape *s)
{
    return imp__mesh_build(b, self, s, &cube, true);
}

const struct imp_shape_ops imp__cube = {.size = sizeof(struct imp_shape_ops),
                                        .name = "cube",
                                        .flags = IMP_SHAPE_CONVEX | IMP_SHAPE_TRIANGLES,
                                        .object_size = sizeof(struct imp__mesh),
                                        .build = build,
                                        .surface = imp__mesh_surface,
                                        .sample_toward = imp__mesh_sample,
                                        .pdf_toward = imp__mesh_pdf,
                                        .sample_area = imp__mesh_sample_area,
                                        .place = imp__mesh_place,
                                        .move = imp__mesh_move,
                                        .placed = imp__mesh_placed};

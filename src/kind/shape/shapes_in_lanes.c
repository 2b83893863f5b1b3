/* SPDX-License-Identifier: Apache-2.0
 *
 * Which shapes have forms in lanes. */
#include "shape_lanes.h"

extern const struct imp_shape_ops imp__rectangle, imp__sphere;

const struct imp_shape_lanes *imp__shape_lanes(const struct imp_shape *s)
{
    if (s->ops == &imp__rectangle) return &imp__rectangle_lanes;
    if (s->ops == &imp__sphere) return &imp__sphere_lanes;
    if (s->ops->surface == imp__mesh_surface && !s->by_triangle) {
        const struct imp__mesh *m = s->self;
        /* Large meshes: those whose frames follow from positions and normals alone. */
        if (m->facets || !(m->uvs || m->face_tangents)) return &imp__mesh_lanes;
    }
    return NULL;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Where a look past an edge goes (boundary.h). A face beside the edge may be seen at so flat an angle
 * that it is narrower than the look is apart from the edge: near silhouettes of fine meshes that is so
 * along a part of each edge that does not shrink with the triangles. Such a look would pass the face,
 * and see the jump of the silhouette behind it, which has draws of its own, a second time. It goes
 * to a point of the face instead. */
#include "boundary_parts.h"
#include "scene/instances.h"

/* The face that a look along w sees first on the side that m points to. NULL: none is there. */
static const struct imp__edge_face *face_seen(const struct imp__edge_draw *d, imp_v3 w,
                                              imp_v3 m)
{
    const struct imp__edge_face *seen = NULL;
    double least = INFINITY;
    for (int k = 0; k < d->edge->n_faces; k++) {
        const struct imp__edge_face *f = &d->b->edges->face[d->edge->first + (size_t)k];
        const double side = imp__dot(f->in, m), depth = imp__dot(f->in, w) / side;
        if (!(side > 0) || !(depth < least)) continue;
        least = depth;
        seen = f;
    }
    return seen;
}

static void corners(const struct imp_scene *scene, const struct imp__edge_face *f,
                    imp_v3 p[3])
{
    const struct imp_triangles *t = &scene->shapes[f->shape]->triangles;
    struct imp_map to_world, to_local;
    if (f->place > 0) imp__place_map(scene, f->place, 0, &to_world, &to_local);
    for (int k = 0; k < 3; k++) {
        const float *at = t->positions + 3 * (size_t)t->indices[3 * f->prim + k];
        p[k] = imp__v3(at[0], at[1], at[2]);
        if (f->place > 0) p[k] = imp__map_point(&to_world, p[k]);
    }
}

/* Is a point of the triangle's plane in it? */
static bool is_inside(const imp_v3 p[3], imp_v3 n, imp_v3 q)
{
    int same = 0;
    for (int k = 0; k < 3; k++) {
        const imp_v3 side = p[(k + 1) % 3] - p[k];
        const double turn = imp__dot(imp__cross(side, q - p[k]), n);
        same += turn > 0 ? 1 : turn < 0 ? -1 : 0;
    }
    return same == 3 || same == -3;
}

imp_v3 imp__edge_beside(const struct imp__edge_draw *d, imp_v3 w, imp_v3 m, double apart)
{
    const imp_v3 past = d->p + m * apart;
    const struct imp__edge_face *f = d->edge ? face_seen(d, w, m) : NULL;
    if (!f) return past;
    imp_v3 p[3];
    corners(d->b->tracer->scene, f, p);
    if (is_inside(p, f->n, past - w * (apart * imp__dot(m, f->n) / imp__dot(w, f->n))))
        return past;
    const imp_v3 middle = (p[0] + p[1] + p[2]) * (1.0 / 3) - d->p;
    const double across = imp__dot(middle, m);
    return d->p + middle * (across > 2 * apart ? apart / across : 0.5);
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Points that are glued to their shapes, which may be in instances (moves.h). */
#include "moves.h"

int imp__carrier(const struct imp_scene *scene, int shape, int64_t place)
{
    return place > 0 ? IMP_MOVE_INSTANCE(imp__place_instance(scene, place)) : shape;
}

static imp_v3 triple(const float *array, uint32_t i)
{
    const float *p = array + 3 * (size_t)i;
    return imp__v3(p[0], p[1], p[2]);
}

struct imp__corners imp__corners_mapped(const struct imp_scene *scene, int shape,
                                        int prim, const struct imp_map *map)
{
    const struct imp_triangles *t = &scene->shapes[shape]->triangles;
    const uint32_t *i = t->indices + 3 * (size_t)prim;
    struct imp__corners f = {.smooth = imp__moves_smooth(scene, shape)};
    const struct imp__mesh *mesh = f.smooth ? scene->shapes[shape]->self : NULL;
    for (int k = 0; k < 3; k++) {
        f.p[k] = triple(t->positions, i[k]);
        if (mesh) f.n[k] = triple(mesh->normals, i[k]);
        if (map) f.p[k] = imp__map_point(&map[0], f.p[k]);
        if (map) f.n[k] = imp__map_normal(&map[1], f.n[k]);
    }
    return f;
}

struct imp__corners imp__corners(const struct imp_scene *scene, int shape, int prim,
                                 int64_t place, double time)
{
    struct imp_map map[2];
    if (place > 0) imp__place_map(scene, place, time, &map[0], &map[1]);
    return imp__corners_mapped(scene, shape, prim, place > 0 ? map : NULL);
}

static struct imp__glued glued(const struct imp_scene *scene, int shape, int prim,
                               int64_t place, double time, double b1, double b2,
                               imp_v3 side)
{
    const struct imp__corners f = imp__corners(scene, shape, prim, place, time);
    const imp_v3 e1 = f.p[1] - f.p[0], e2 = f.p[2] - f.p[0];
    struct imp__glued x = {.shape = shape,
                           .prim = prim,
                           .place = place,
                           .carrier = imp__carrier(scene, shape, place),
                           .time = time,
                           .b = {1 - b1 - b2, b1, b2}};
    x.p = f.p[0] + e1 * b1 + e2 * b2;
    x.n = imp__normalize(imp__cross(e1, e2));
    if (imp__dot(x.n, side) < 0) x.n = -x.n;
    imp__glued_shade(&x, &f);
    return x;
}

struct imp__glued imp__glued_at(const struct imp_scene *scene, int shape,
                                const struct imp_located *x, int64_t place, double time,
                                imp_v3 n)
{
    const struct imp_shape *s = scene->shapes[shape];
    if (s->geometry == IMP_TRIANGLES)
        return glued(scene, shape, x->prim, place, time, x->at[0], x->at[1], n);
    const double uv[2] = {x->at[0], x->at[1]};
    struct imp_surface at;
    int prim;
    if (place > 0 || s->geometry == IMP_CURVES)
        imp__located_surface(scene, shape, x, place, 0, &at);
    else s->ops->place(s, uv, &at, &prim);
    return imp__glued_curved(scene, shape, x->prim, place, at.p, n);
}

struct imp__glued imp__glued_near(const struct imp_scene *scene, int shape, int prim,
                                  int64_t place, double time, imp_v3 p, imp_v3 n)
{
    const struct imp_shape *s = scene->shapes[shape];
    struct imp_map map[2];
    double b[3];
    if (s->geometry != IMP_TRIANGLES)
        return imp__glued_curved(scene, shape, prim, place, p, n);
    if (place > 0) {
        imp__place_map(scene, place, time, &map[0], &map[1]);
        p = imp__map_point(&map[1], p);
    }
    imp__triangle_weights(s, prim, &p, b);
    return glued(scene, shape, prim, place, time, b[1], b[2], n);
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Points of shapes by primitive and coordinates (located.h): of hits, and back to surfaces. */
#include "located.h"
#include "kind/shape/curve.h"

struct imp_located imp__located_curve(const struct imp_scene *scene,
                                      const struct imp_hit *hit,
                                      const struct imp_surface *at)
{
    imp_v3 n = at->ng;
    if (hit->place > 0) {
        struct imp_map to_world, to_local;
        imp__place_map(scene, hit->place, hit->time, &to_world, &to_local);
        n = imp__normalize(imp__map_normal(&to_world, n));
    }
    return imp__curve_locate(&scene->shapes[hit->shape]->curves, hit->prim, at->uv, n);
}

static bool surface_of(const struct imp_shape *s, const struct imp_located *x,
                       struct imp_surface *out)
{
    const struct imp_hit hit = {
        .shape = s->index, .prim = x->prim, .u = x->at[0], .v = x->at[1]};
    const double uv[2] = {x->at[0], x->at[1]};
    int prim;
    switch (s->geometry) {
    case IMP_TRIANGLES: s->ops->surface(s, &hit, NULL, NULL, out); return true;
    case IMP_CURVES: imp__curve_surface(&s->curves, x->prim, x->at, out); return true;
    case IMP_ANALYTIC: break;
    }
    if (!s->ops->place) return false;
    s->ops->place(s, uv, out, &prim);
    return true;
}

bool imp__located_surface(const struct imp_scene *scene, int shape,
                          const struct imp_located *x, int64_t place, double time,
                          struct imp_surface *out)
{
    struct imp_map to_world, to_local;
    if (scene->rayless || x->prim < 0 || !surface_of(scene->shapes[shape], x, out))
        return false;
    if (place == 0) return true;
    imp__place_map(scene, place, time, &to_world, &to_local);
    imp__surface_move(out, &to_world, &to_local);
    return true;
}

bool imp__located_fits(const struct imp_scene *scene, const struct imp_shape *shape,
                       const struct imp_located *x, int64_t place)
{
    const struct imp_group *world = scene->world;
    const size_t n = shape->geometry == IMP_TRIANGLES ? shape->triangles.n_triangles
                     : shape->geometry == IMP_CURVES  ? shape->curves.n_segments
                                                      : 1;
    if (x->prim < -1 || place < 0) return false;
    if (x->prim >= 0 && !(isfinite(x->at[0]) && isfinite(x->at[1]))) return false;
    if (scene->rayless) return true; /* nothing is looked up there */
    return place <= (world ? world->n_places : 0) &&
           (x->prim == -1 || (size_t)x->prim < n);
}

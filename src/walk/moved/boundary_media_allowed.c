/* SPDX-License-Identifier: Apache-2.0
 *
 * Borders of media that have no derivative (boundary.h): those which a lamp meets, and meshes that open
 * where a vertex moves. */
#include "base/arguments.h"
#include "boundary_allowed.h"
#include "scene/pose.h"
#include "scene/sealed.h"

#define TOUCH 1e-4 /* of a triangle: what is nearer to its sides touches it */

static enum imp_status met_refuse(const struct imp_scene *scene, int a, int b)
{
    const int lamp = scene->shapes[a]->emitter >= 0 ? a : b, border = lamp == a ? b : a;
    return imp__error(
        scene->ctx, IMP_E_UNSUPPORTED,
        "derivatives by what moves: light '%s' meets shape '%s', at which a "
        "medium ends: what points of that receive next to it has no bounded "
        "variance (the light may lie on either side)",
        scene->shapes[lamp]->name, scene->shapes[border]->name);
}

/* Does a segment meet a shape that the body of its triangle is not to meet? -1: no. */
static int segment_meets(const struct imp__edges *edges, const struct imp_scene *scene,
                         int shape, imp_v3 a, imp_v3 b)
{
    const imp_v3 d = b - a;
    struct imp_hit hit;
    for (double from = 0; from < 1 && imp__intersect(scene, &a, &d, from, 1, &hit);
         from = imp_max(from, (double)hit.t) + TOUCH)
        if (imp__edges_pair(edges, scene, hit.shape, shape)) return hit.shape;
    return -1;
}

/* What a shape's triangles meet that are larger by TOUCH. -1: nothing. */
static int triangles_meet(const struct imp__edges *edges, const struct imp_scene *scene,
                          int shape)
{
    const struct imp_triangles *t = &scene->shapes[shape]->triangles;
    for (size_t j = 0; j < t->n_triangles; j++) {
        struct imp__corners f = imp__corners_mapped(scene, shape, (int)j, NULL);
        const imp_v3 middle = (f.p[0] + f.p[1] + f.p[2]) * (1. / 3);
        for (int k = 0; k < 3; k++) f.p[k] += (f.p[k] - middle) * TOUCH;
        for (int k = 0; k < 3; k++) {
            const int met = segment_meets(edges, scene, shape, f.p[k], f.p[(k + 1) % 3]);
            if (met >= 0) return met;
        }
    }
    return -1;
}

/* Triangles meet where a side of one meets the other; of spheres there are arcs, of disks and cylinders
 * rims. */
static enum imp_status apart(const struct imp__edges *edges,
                             const struct imp_scene *scene)
{
    for (size_t k = 0; k < edges->n_bodies; k++) {
        const int shape = edges->body[k].shape;
        const int met = scene->shapes[shape]->geometry == IMP_TRIANGLES
                            ? triangles_meet(edges, scene, shape)
                            : -1;
        if (met >= 0) return met_refuse(scene, shape, met);
    }
    for (size_t k = 0; k < edges->n_arcs; k++) {
        const struct imp__edge_face *side = edges->arc[k].side;
        if (imp__edges_pair(edges, scene, side[0].shape, side[1].shape))
            return met_refuse(scene, side[0].shape, side[1].shape);
    }
    int other;
    const int pierced = imp__edges_pierced(edges, scene, &other);
    return pierced >= 0 ? met_refuse(scene, pierced, other) : IMP_OK;
}

static enum imp_status lamps_allowed(const struct imp_scene *scene)
{
    struct imp__edges edges;
    bool any = false;
    for (int k = 0; k < scene->n_emitters; k++) any |= scene->emitters[k]->shape != NULL;
    if (!any) return IMP_OK;
    IMP_CHECKED(imp__edges_build(scene, IMP_EDGES_LAMPS_BORDERS, &edges));
    const enum imp_status st = apart(&edges, scene);
    imp__edges_free(&edges);
    return st;
}

/* A medium ends at the box of its grid, too. */
static enum imp_status boxes_allowed(const struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    for (int k = 0; k < scene->n_media; k++) {
        const struct imp_medium *m = scene->media[k];
        bool moves = false;
        for (int i = 0; i < scene->n_all_shapes; i++)
            moves |=
                scene->shapes[i]->interior == m && imp__moves_shape(b->moves, i, NULL);
        if (imp__medium_ends_bright(scene, m, m == b->moves->borders.outside, moves))
            return imp__error(
                scene->ctx, IMP_E_UNSUPPORTED,
                "derivatives by what moves: medium '%s' (%s) ends at a side of its "
                "grid where it is not 0%s",
                m->name, m->ops->name,
                moves ? ", and what bounds it, which moves, lies not within that side"
                      : " and nothing else bounds it");
    }
    return IMP_OK;
}

enum imp_status imp__borders_allowed(const struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    if (!b->media) return IMP_OK;
    IMP_CHECKED(boxes_allowed(b));
    for (int k = 0; k < b->moves->n_movers; k++) {
        const struct imp__mover *m = &b->moves->mover[k];
        if (m->kind != IMP_MOVE_VERTICES || m->shape < 0 || b->moves->seams_join)
            continue;
        const struct imp_shape *s = scene->shapes[m->shape];
        if (imp__is_border(scene, s) && !imp__is_welded(&s->triangles))
            return imp__error(
                scene->ctx, IMP_E_UNSUPPORTED,
                "derivatives by what moves: shape '%s' bounds a medium, and "
                "repeats vertices: it opens where one of them moves",
                s->name);
    }
    return lamps_allowed(scene);
}

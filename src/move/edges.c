/* SPDX-License-Identifier: Apache-2.0
 *
 * What is asked of the list of edges (edges.h): points, sides, and whether it is whole. */
#include "edges.h"
#include "base/context.h"

void imp__edges_free(struct imp__edges *edges)
{
    imp__release(edges->ctx, edges->edge);
    imp__release(edges->ctx, edges->laid);
    imp__release(edges->ctx, edges->arc);
    imp__release(edges->ctx, edges->face);
    imp__release(edges->ctx, edges->body);
    imp__release(edges->ctx, edges->run);
    *edges = (struct imp__edges){0};
}

struct imp__glued imp__edge_glued(const struct imp__edges *edges,
                                  const struct imp_scene *scene,
                                  const struct imp__edge *e, int k, double time, imp_v3 p)
{
    const struct imp__edge_face *f = &edges->face[e->first + (size_t)k];
    return imp__glued_near(scene, f->shape, f->prim, f->place, time, p, f->n);
}

void imp__seam_bar(const struct imp__edges *edges, const struct imp__edge *e, imp_v3 m,
                   imp_v3 bar[2])
{
    const struct imp__edge_face *f = &edges->face[e->first], *g = f + 2;
    bar[0] = f->n * (imp__dot(m, g->in) / imp__dot(f->n, g->in));
    bar[1] = g->n * (imp__dot(m, f->in) / imp__dot(g->n, f->in));
}

int imp__edge_side(const struct imp__edges *edges, const struct imp__edge *e, imp_v3 m)
{
    bool before = false, behind = false;
    for (int k = 0; k < e->n_faces; k++) {
        const double side = imp__dot(edges->face[e->first + (size_t)k].in, m);
        before |= side > 0;
        behind |= side <= 0;
    }
    return before && behind ? 0 : before ? -1 : 1;
}

double imp__edge_turn(const struct imp__edges *edges, const struct imp__edge *e)
{
    const struct imp__edge_face *f = &edges->face[e->first];
    return e->n_faces == 2 ? imp_min(0.5 * imp__length(f[0].in + f[1].in), 1.0) : 1;
}

static bool vertices_move(const struct imp__moves *moves, int shape)
{
    for (int k = 0; k < moves->n_movers; k++)
        if (moves->mover[k].shape == shape && moves->mover[k].kind == IMP_MOVE_VERTICES)
            return true;
    return false;
}

/* Have two triangles of a shape a side in common, two vertices; with `places`, two of their places? */
static bool is_welded(const struct imp_scene *scene, int shape, int prim, int other,
                      bool places)
{
    const struct imp_triangles *t = &scene->shapes[shape]->triangles;
    int common = 0;
    for (int k = 0; k < 9; k++) {
        const uint32_t a = t->indices[3 * prim + k / 3],
                       b = t->indices[3 * other + k % 3];
        const float *p = t->positions + 3 * (size_t)a, *q = t->positions + 3 * (size_t)b;
        common += a == b || (places && p[0] == q[0] && p[1] == q[1] && p[2] == q[2]);
    }
    return common == 2;
}

/* Do two faces at an edge move with different velocities? */
static bool move_apart(const struct imp__moves *moves, const struct imp__edge_face *f,
                       const struct imp__edge_face *g)
{
    const int a = imp__carrier(moves->scene, f->shape, f->place),
              b = imp__carrier(moves->scene, g->shape, g->place);
    if (a == b)
        return vertices_move(moves, a) &&
               !is_welded(moves->scene, f->shape, f->prim, g->prim, moves->seams_join);
    return imp__moves_place(moves, a) || imp__moves_place(moves, b);
}

const struct imp__edge *imp__edges_torn(const struct imp__edges *edges,
                                        const struct imp__moves *moves)
{
    for (size_t k = 0; k < edges->n + edges->n_laid; k++) {
        const struct imp__edge *e =
            k < edges->n ? &edges->edge[k] : &edges->laid[k - edges->n];
        for (int j = 1; j < e->n_faces && !e->seam; j++)
            if (move_apart(moves, &edges->face[e->first],
                           &edges->face[e->first + (size_t)j]))
                return e;
    }
    return NULL;
}

/* Hits nearer to the ends of an edge than this part of its length are its own faces, or others
 * that begin there. */
#define END 1e-5

/* A curved shape whose seams are in no list. */
static bool is_seamless(const struct imp_scene *scene, int shape, int64_t place)
{
    struct imp_round round;
    return imp__moves_curved(scene, shape, place) &&
           !imp__moves_sphere(scene, shape, place, &round);
}

static bool any_seamless(const struct imp__edges *edges, const struct imp_scene *scene)
{
    for (size_t k = 0; k < edges->n_bodies; k++)
        if (is_seamless(scene, edges->body[k].shape, edges->body[k].place)) return true;
    return false;
}

/* What is seamless on the way from a to b, and no part of `own`. -1: nothing. */
static int way_pierces(const struct imp__edges *edges, const struct imp_scene *scene,
                       imp_v3 a, imp_v3 b, int own)
{
    const imp_v3 d = b - a;
    struct imp_hit hit;
    for (double from = END; imp__intersect(scene, &a, &d, from, 1 - END, &hit);
         from = imp_max(from, (double)hit.t) + END)
        if (is_seamless(scene, hit.shape, hit.place) &&
            imp__edges_pair(edges, scene, hit.shape, own))
            return hit.shape;
    return -1;
}

/* Both ways: curves are met from outside alone. */
int imp__edges_pierced(const struct imp__edges *edges, const struct imp_scene *scene,
                       int *other)
{
    if (!any_seamless(edges, scene)) return -1;
    for (size_t k = 0; k < edges->n; k++) {
        const struct imp__edge *e = &edges->edge[k];
        *other = edges->face[e->first].shape;
        int met = way_pierces(edges, scene, e->a, e->b, *other);
        if (met < 0) met = way_pierces(edges, scene, e->b, e->a, *other);
        if (met >= 0) return met;
    }
    return imp__curved_pierced(edges, scene, other);
}

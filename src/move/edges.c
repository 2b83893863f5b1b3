/* SPDX-License-Identifier: Apache-2.0
 *
 * What is asked of the list of edges (edges.h): points, sides, and whether it is whole. */
#include "edges.h"
#include "base/context.h"
#include "math/offset.h"

#define TOUCH 1e-5 /* of a sphere's radius: nearer surfaces touch it */

void imp__edges_free(struct imp__edges *edges)
{
    imp__release(edges->ctx, edges->edge);
    imp__release(edges->ctx, edges->face);
    *edges = (struct imp__edges){0};
}

struct imp__glued imp__edge_glued(const struct imp__edges *edges,
                                  const struct imp_scene *scene,
                                  const struct imp__edge *e, imp_v3 p)
{
    const struct imp__edge_face *f = &edges->face[e->first];
    return imp__glued_near(scene, f->shape, f->prim, p, f->n);
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
    if (f->shape == g->shape)
        return vertices_move(moves, f->shape) &&
               !is_welded(moves->scene, f->shape, f->prim, g->prim, moves->seams_join);
    return imp__moves_shape(moves, f->shape, NULL) ||
           imp__moves_shape(moves, g->shape, NULL);
}

const struct imp__edge *imp__edges_torn(const struct imp__edges *edges,
                                        const struct imp__moves *moves)
{
    for (size_t k = 0; k < edges->n; k++) {
        const struct imp__edge *e = &edges->edge[k];
        for (int j = 1; j < e->n_faces; j++)
            if (move_apart(moves, &edges->face[e->first],
                           &edges->face[e->first + (size_t)j]))
                return e;
    }
    return NULL;
}

/* The least and the largest distance of a triangle from a point. */
static void triangle_distances(const struct imp_triangles *t, size_t prim, imp_v3 c,
                               double *least, double *most)
{
    imp_v3 p[3];
    *most = 0;
    *least = INFINITY;
    for (int k = 0; k < 3; k++) {
        const float *at = t->positions + 3 * (size_t)t->indices[3 * prim + (size_t)k];
        p[k] = imp__v3(at[0], at[1], at[2]) - c;
        *most = imp_max(*most, imp__length(p[k]));
    }
    const imp_v3 cross = imp__cross(p[1] - p[0], p[2] - p[0]), n = imp__normalize(cross);
    bool inside = true;
    for (int k = 0; k < 3; k++) {
        const imp_v3 e = p[(k + 1) % 3] - p[k];
        const double s = imp_clamp(-imp__dot(p[k], e) / imp__dot(e, e), 0.0, 1.0);
        *least = imp_min(*least, imp__length(p[k] + e * s));
        inside &= imp__dot(imp__cross(e, -p[k]), n) >= 0;
    }
    if (inside) *least = imp_min(*least, fabs(imp__dot(p[0], n)));
}

/* Chords of a rim, by which it is tested: what is pierced by less than 3e-4 of the radius counts
 * as touched. */
#define CHORDS 128

/* A disk and the surface of a sphere. */
static bool disk_meets(const struct imp_scene *scene, int shape,
                       const struct imp_round *round)
{
    double least = INFINITY, most = 0;
    bool over = true; /* is the centre above the disk? */
    for (int k = 0; k < CHORDS; k++) {
        const struct imp__rim_point rim = imp__disk_rim(scene, shape, (double)k / CHORDS);
        const imp_v3 r = rim.p - round->centre;
        least = imp_min(least, imp__length(r));
        most = imp_max(most, imp__length(r));
        over &= imp__dot(r, rim.out) > 0;
    }
    const struct imp__rim_point rim = imp__disk_rim(scene, shape, 0);
    if (over) least = imp_min(least, fabs(imp__dot(rim.n, rim.p - round->centre)));
    return least < round->radius * (1 - TOUCH) && most > round->radius * (1 + TOUCH);
}

/* A shape that the rim of a disk passes through. */
static int disks_pierced(const struct imp_scene *scene, int *other)
{
    for (int k = 0; k < scene->n_shapes; k++) {
        if (!imp__moves_disk(scene, k)) continue;
        for (int j = 0; j < CHORDS; j++) {
            const imp_v3 a = imp__disk_rim(scene, k, (double)j / CHORDS).p,
                         d = imp__disk_rim(scene, k, (j + 1.0) / CHORDS).p - a;
            struct imp_hit hit;
            for (double from = 0; imp__intersect(scene, &a, &d, from, 1, &hit);
                 from = hit.t + 1e-5) {
                if (hit.shape == k) continue;
                *other = k;
                return hit.shape;
            }
        }
    }
    return -1;
}

/* Does the surface of a sphere meet this shape? Where they touch, it does not. */
static bool meets_sphere(const struct imp_scene *scene, int shape,
                         const struct imp_round *round)
{
    const double inside = round->radius * (1 - TOUCH),
                 outside = round->radius * (1 + TOUCH);
    const struct imp_triangles *t = &scene->shapes[shape]->triangles;
    struct imp_round other;
    if (imp__moves_sphere(scene, shape, &other)) {
        const double d = imp__length(other.centre - round->centre);
        return d < inside + other.radius &&
               d > fabs(round->radius - other.radius) + TOUCH * round->radius;
    }
    if (imp__moves_disk(scene, shape)) return disk_meets(scene, shape, round);
    if (scene->shapes[shape]->geometry != IMP_TRIANGLES) return false;
    for (size_t k = 0; k < t->n_triangles; k++) {
        double least, most;
        triangle_distances(t, k, round->centre, &least, &most);
        if (least < inside && most > outside) return true;
    }
    return false;
}

static int spheres_pierced(const struct imp_scene *scene, int *other)
{
    for (int k = 0; k < scene->n_shapes; k++) {
        struct imp_round round;
        if (!imp__moves_sphere(scene, k, &round)) continue;
        for (int j = 0; j < scene->n_shapes; j++)
            if (j != k && meets_sphere(scene, j, &round)) {
                *other = j;
                return k;
            }
    }
    return -1;
}

/* Hits nearer to the ends of an edge than this part of its length are its own faces, or others
 * that begin there. */
#define END 1e-5

int imp__edges_pierced(const struct imp__edges *edges, const struct imp_scene *scene,
                       int *other)
{
    for (size_t k = 0; k < edges->n; k++) {
        const struct imp__edge *e = &edges->edge[k];
        const imp_v3 d = e->b - e->a;
        double from = END;
        struct imp_hit hit;
        while (imp__intersect(scene, &e->a, &d, from, 1 - END, &hit)) {
            bool own = false;
            for (int j = 0; j < e->n_faces; j++)
                own |= edges->face[e->first + (size_t)j].shape == hit.shape;
            if (!own) {
                *other = edges->face[e->first].shape;
                return hit.shape;
            }
            from = hit.t + END;
        }
    }
    const int pierced = spheres_pierced(scene, other);
    return pierced >= 0 ? pierced : disks_pierced(scene, other);
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * The edges of a scene of triangles, each once: where what is seen past a place may jump. Edges
 * of different triangles, and of different shapes, that lie on each other are one edge with all
 * their faces; where they overlap in part they are cut. Inner edges of a flat face of one shape
 * are left out: nothing jumps there. Where triangles pass through each other, of different bodies or of
 * one, their seam is an edge. */
#ifndef IMP_MOVE_EDGES_H
#define IMP_MOVE_EDGES_H

#include "math/warp.h"
#include "moves.h"

struct imp__edge_face {
    int shape, prim;
    int64_t place; /* the instance that the shape is in (imp_hit.place); 0: none */
    imp_v3 in,
        n; /* unit: in the face, across the edge, away from it; normal of the face */
};

struct imp__edge {
    imp_v3 a, b; /* ends, world */
    size_t first;
    int n_faces; /* face[first .. first + n_faces) */
    bool seam;   /* where two bodies pass through each other (edges_seams.h) */
};

/* A shape that stands in the scene: outside of all groups, or in an instance. */
struct imp__body {
    int shape;
    int64_t place; /* 0: in no instance */
};

/* A part of a circle in which a sphere passes through a triangle or another sphere: it is seen as a
 * seam is. */
struct imp__arc {
    struct imp__edge_face side[2]; /* prim -1: a sphere, which has no n */
    imp_v3 centre, s, t;           /* of the circle; unit, in its plane */
    double radius, from, till;     /* turns, from s to t */
};

/* Whose edges they are. */
enum imp__edges_of {
    IMP_EDGES_ALL,
    IMP_EDGES_BUT_BORDERS, /* where walks go through media that end within the scene */
    IMP_EDGES_LAMPS_BORDERS /* shapes that shine, and borders: by which the two are found to meet */
};

/* The run of edges that move in time with one instance, or rest, behind those of others. */
struct imp__edge_run {
    size_t first;
    int instance; /* of the scene; -1: they rest */
};

struct imp__edges {
    imp_context *ctx;
    size_t n_bodies;
    struct imp__body
        *body; /* [n_bodies] all that rays can meet, as far as it is among `of` */
    enum imp__edges_of of;
    size_t n, n_faces;
    struct imp__edge *edge; /* [n], along a curve through space: neighbours are near */
    struct imp__edge_face *face; /* [n_faces] */
    /* Runs of the list, one for each instance that moves in time, at its place of time 0; the first
     * holds the edges at rest. run[n_runs] is the end of the list. */
    int n_runs;
    struct imp__edge_run *run; /* [n_runs + 1] */
    /* Edges of a body that lie in the surface of another and have faces on both sides of it: the
     * first two faces, then one of the other. They are in `edge`, too, with their own faces. */
    size_t n_laid;
    struct imp__edge *laid; /* [n_laid] */
    size_t n_arcs;
    struct imp__arc *arc; /* [n_arcs] */
};

/* All edges of the scene's shapes of triangles, flat or with vertex normals, also in instances.
 * IMP_E_UNSUPPORTED, with its name: another shape that is no sphere, disk, circular cylinder or
 * bsplinecurve, or that
 * its instance makes none; one that moves in time within a group. */
enum imp_status imp__edges_build(const struct imp_scene *scene, enum imp__edges_of of,
                                 struct imp__edges *out);
void imp__edges_free(struct imp__edges *edges);

/* The point of an edge as one that its face k carries along. */
struct imp__glued imp__edge_glued(const struct imp__edges *edges,
                                  const struct imp_scene *scene,
                                  const struct imp__edge *e, int k, double time,
                                  imp_v3 p);
/* The velocity of a seam counts m: what that is to the points that faces 0 and 2 carry. */
void imp__seam_bar(const struct imp__edges *edges, const struct imp__edge *e, imp_v3 m,
                   imp_v3 bar[2]);
/* Is the edge a silhouette for a line through it: do all faces lie on one side of the plane of
 * edge and line, with this normal? 1: on the side that m points away from, -1: on the other;
 * 0: on both. */
int imp__edge_side(const struct imp__edges *edges, const struct imp__edge *e, imp_v3 m);
/* By how much its two faces turn, 0 to 1: sin of half the angle between their normals. 1: a border,
 * or more faces. */
double imp__edge_turn(const struct imp__edges *edges, const struct imp__edge *e);
/* An edge whose faces move apart: they belong to shapes with different velocities, and it is no seam.
 * NULL: none. */
const struct imp__edge *imp__edges_torn(const struct imp__edges *edges,
                                        const struct imp__moves *moves);
/* A disk, cylinder or curve that passes through another shape: where they meet is an edge that is in no list.
 * -1: none; *other: the other shape. */
int imp__edges_pierced(const struct imp__edges *edges, const struct imp_scene *scene,
                       int *other);

/* Is it asked whether these two shapes pass through each other? */
static inline bool imp__edges_pair(const struct imp__edges *edges,
                                   const struct imp_scene *scene, int a, int b)
{
    const struct imp_shape *s = scene->shapes[a], *t = scene->shapes[b];
    if (edges->of == IMP_EDGES_ALL) return true;
    const bool first = imp__is_border(scene, s), second = imp__is_border(scene, t);
    if (edges->of == IMP_EDGES_BUT_BORDERS) return !first && !second;
    return (first && t->emitter >= 0) || (second && s->emitter >= 0);
}

/* ---- edges_timed.c ---- */
/* From where an instance is at time 0 to where it is then, and back. */
void imp__clock_map(const struct imp_scene *scene, int instance, double time,
                    struct imp_map *there, struct imp_map *back);
/* An edge of a run where it is then, with its faces from *faces [n_faces] on, its first 0. */
void imp__edge_timed(const struct imp__edges *edges, const struct imp_map *there,
                     const struct imp__edge *e, struct imp__edge *out,
                     struct imp__edge_face *faces);
/* IMP_E_UNSUPPORTED, with names: what moves in time and has edges that are in no list. */
enum imp_status imp__clocks_allowed(const struct imp__edges *edges,
                                    const struct imp_scene *scene);
/* May something that moves in time meet this box between these times, or, where it is NULL, another body,
 * *other? By the boxes that it sweeps. -1: nothing; else its shape. */
int imp__clocks_meet(const struct imp__edges *edges, const struct imp_scene *scene,
                     const double time[2], const imp_v3 *box, int *other);

/* ---- edges_arcs.c ---- */
/* Sets the arcs. */
enum imp_status imp__arcs_find(const struct imp_scene *scene, struct imp__edges *edges);
static inline double imp__arc_length(const struct imp__arc *arc)
{
    return IMP_2PI * arc->radius * (arc->till - arc->from);
}
/* A point, by a part u of its length, and the unit direction there. */
void imp__arc_point(const struct imp__arc *arc, double u, imp_v3 *p, imp_v3 *along);
/* The velocity of that point counts m: what that is to points of both surfaces. */
void imp__arc_bar(const struct imp_scene *scene, const struct imp__arc *arc, imp_v3 p,
                  imp_v3 along, imp_v3 m, struct imp__glued x[2], imp_v3 bar[2]);

/* ---- edges_curved.c ---- */
/* Is a sphere beside the box of a body? map: to the world, of its place. */
bool imp__body_is_away(const struct imp_scene *scene, const struct imp__body *body,
                       const struct imp_map *map, const struct imp_round *round);
/* The same of curved shapes alone. */
int imp__curved_pierced(const struct imp__edges *edges, const struct imp_scene *scene,
                        int *other);
/* Does a rim lie on another one, *beside? */
bool imp__rim_beside(const struct imp__edges *edges, const struct imp_scene *scene,
                     const struct imp__rim_name *rim, struct imp__rim_name *beside);
/* A shape whose rim lies on another's, of which one moves without the other, or which are not the lid
 * and the wall of a can that stands still. -1: none; *other: the other shape. */
int imp__rims_torn(const struct imp__edges *edges, const struct imp_scene *scene,
                   const struct imp__moves *moves, int *other);

#endif

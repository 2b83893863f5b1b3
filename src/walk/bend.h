/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks through media of graded index (docs/curved-rays.md, "In scenes"). A walk that is
 * refracted into a body rides along its bent ray to the next shape; nothing else of the
 * walk knows. Not possible, and dropped: bodies in bodies, shapes inside that let light
 * through, cameras inside. No light samples are taken inside, where a straight line leads
 * nowhere; lights are met by chance there. */
#ifndef IMP_WALK_BEND_H
#define IMP_WALK_BEND_H

#include "curved/inside.h"
#include "walk.h"

struct imp_bending {                  /* of a walk on its way */
    const struct imp_medium *medium;  /* that the ray in flight is in; NULL: none */
    imp_v3 ng;                        /* of the surface it left */
    const struct imp_medium *through; /* that the last ray came through */
    struct imp__ride ride;
    bool chain; /* a boundary of an active medium has been met */
    bool moved; /* the ray in flight depends on an active field */
};

/* How a walk came to a vertex: kept from the first boundary of an active medium on. */
struct imp_leg {
    const struct imp_medium *medium; /* that it came through; NULL: straight */
    struct imp__ride ride;           /* if through a medium */
    bool moved; /* position or direction depends on an active field */
    imp_v3 d;   /* unit, arriving */
    struct imp_hit hit;
    imp_v3 dp_du, dp_dv;
    imp_spec P; /* room for the sweep */
};

static inline void imp__bend_begin(struct imp_bending *b)
{
    b->medium = b->through = NULL;
    b->chain = b->moved = false;
}
/* From the vertex at `from` along *d. ratio: index at the start over that at the end. */
bool imp__bend_meet(const struct imp_scene *scene, struct imp_bending *b,
                    const imp_v3 *from, imp_v3 *o, imp_v3 *d, struct imp_hit *hit,
                    double *ratio);
/* At the vertex that was met: its index. False: the walk is dropped. */
bool imp__bend_arrive(const struct imp_tracer *tracer, struct imp_arena *arena,
                      struct imp_walk *walk, struct imp_bending *b, struct imp_vertex *v,
                      struct imp_hit *hit, struct imp_surface *at, imp_v3 d);
/* It goes on along d: into a medium, out of it, or as before. */
void imp__bend_leave(const struct imp_tracer *tracer, struct imp_bending *b,
                     const struct imp_vertex *v, const struct imp_surface *at, imp_v3 d);
/* Inputs of a boundary as `arrive` made them. */
void imp__bend_inputs(const struct imp_vertex *v, imp_spec *in);

/* ---- Derivatives with respect to fields (bend_sweep.c) ------------------------- */

/* The part of sweep, tangent and frozen value that belongs to active media: what moves
 * with the field, and Fresnel's factors. */
void imp__bend_sweep(const struct imp_tracer *tracer, const struct imp_walk *walk,
                     imp_spec adjoint, struct imp_sink *sink);
imp_spec imp__bend_tangent(const struct imp_tracer *tracer, const struct imp_walk *walk,
                           const double *x_dot);
/* Of the whole walk. NaN if it meets other shapes now. */
imp_spec imp__bend_frozen(const struct imp_tracer *tracer, const struct imp_walk *walk);
/* May a ray that moves end on this shape? NULL: yes; else why its derivative is not the
 * whole one. */
const char *imp__bend_obstacle(const struct imp_scene *scene, const struct imp_shape *s,
                               const struct imp_texcoord *at);
/* Length of the straight way from x along d to the surface of v, near where v is. */
double imp__bend_straight(const struct imp_vertex *v, const struct imp__surface *level,
                          imp_v3 x, imp_v3 d);
/* Before a derivative with respect to a field: do rays bent by it see edges, or what has
 * no derivative? IMP_E_BIAS (bend_survey.c). */
enum imp_status imp__bend_survey(const struct imp_tracer *tracer);

#endif

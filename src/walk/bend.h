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
};

/* From the vertex at `from` along *d. ratio: index at the start over that at the end. */
bool imp__bend_meet(const struct imp_scene *scene, struct imp_bending *b,
                    const imp_v3 *from, imp_v3 *o, imp_v3 *d, struct imp_hit *hit,
                    double *ratio);
/* At the vertex that was met: its index. False: the walk is dropped. */
bool imp__bend_arrive(const struct imp_tracer *tracer, struct imp_arena *arena,
                      struct imp_walk *walk, struct imp_bending *b, struct imp_vertex *v,
                      const struct imp_hit *hit, const struct imp_surface *at, imp_v3 d);
/* It goes on along d: into a medium, out of it, or as before. */
void imp__bend_leave(struct imp_bending *b, const struct imp_vertex *v,
                     const struct imp_surface *at, imp_v3 d);
/* Inputs of a boundary as `arrive` made them. */
void imp__bend_inputs(const struct imp_vertex *v, imp_spec *in);

#endif

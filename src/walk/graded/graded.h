/* SPDX-License-Identifier: Apache-2.0
 *
 * Segments in scenes with bodies of graded index (docs/bend.md, "In scenes"). A
 * walk that is refracted into a body follows its bent ray to the next shape; nothing else
 * of the walk changes. Not possible, and dropped: bodies in bodies, shapes inside that let
 * light through, cameras inside. No light samples are taken inside, where a straight line
 * leads nowhere; lights are met by chance there. */
#ifndef IMP_WALK_GRADED_H
#define IMP_WALK_GRADED_H

#include "bend/inside.h"
#include "walk/core/step.h"

extern const struct imp_segment_ops imp__graded_outside, imp__graded_inside;

/* The state of a walk while it is decided. */
struct imp_graded_state {
    const struct imp_body *medium;  /* that the ray in flight is in; NULL: none */
    imp_v3 ng;                      /* of the surface it left */
    const struct imp_body *through; /* that the last ray came through */
    struct imp__ride ride;
    bool chain; /* a boundary of an active medium has been met */
    bool moved; /* the ray in flight depends on an active field */
};

/* What is kept of a segment from the first boundary of an active medium on: the vertex at
 * its end to double precision, since derivatives follow it. */
struct imp_graded_segment {
    struct imp_segment base;
    const struct imp_body *medium; /* that it came through; NULL: straight */
    struct imp__ride ride;         /* if through a medium */
    bool moved;                    /* its end depends on an active field */
    struct imp_exact end;
    imp_v3 d; /* unit direction of arrival, world */
    struct imp_hit hit;
    imp_v3 dp_du, dp_dv;
    imp_spec P; /* adjoint at its end, noted by the sweep */
};

/* NULL: none is kept here. */
static inline struct imp_graded_segment *imp__graded_kept(const struct imp_vertex *v)
{
    return v->segment->ops == &imp__graded_outside
               ? (struct imp_graded_segment *)v->segment
               : NULL;
}

/* ---- Derivatives with respect to fields (graded_sweep.c) -------------------------- */

void imp__graded_sweep(const struct imp_tracer *tracer, const struct imp_walk *walk,
                       imp_spec adjoint, struct imp_sink *sink);
imp_spec imp__graded_chain_tangent(const struct imp_tracer *tracer,
                                   const struct imp_walk *walk, const double *x_dot);
bool imp__graded_place(const struct imp_tracer *tracer, const struct imp_vertex *v,
                       struct imp_moving *moving, struct imp_place *place);
/* May a ray that moves end on this shape? NULL: yes; else why its derivative is not the
 * whole one. */
const char *imp__graded_obstacle(const struct imp_scene *scene, const struct imp_shape *s,
                                 const struct imp_texcoord *at);
/* Length of the straight line from x along d to the surface `level`, near p. */
double imp__graded_straight(imp_v3 p, const struct imp__surface *level, imp_v3 x,
                            imp_v3 d);
/* Before a derivative with respect to a field: do rays bent by it see edges, or what has
 * no derivative? IMP_E_BIAS (graded_survey.c). */
enum imp_status imp__graded_survey(const struct imp_tracer *tracer);

#endif

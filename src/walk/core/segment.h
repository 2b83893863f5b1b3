/* SPDX-License-Identifier: Apache-2.0
 *
 * Segments join the vertices of a walk. What a ray crosses on its way, how it finds the
 * next vertex, and how that depends on parameters is known to the segment's kind alone:
 * straight through nothing (straight.c) or through media that scatter (tracking.c), or bent
 * inside a body of graded index (graded.c).
 * A slot that is NULL has nothing to do. */
#ifndef IMP_WALK_SEGMENT_H
#define IMP_WALK_SEGMENT_H

#include "walk.h"

struct imp_step;
struct imp_shadow;

enum imp_meeting {
    IMP_MEETS_SURFACE,
    IMP_MEETS_MEDIUM,  /* a collision with the medium that it crosses */
    IMP_MEETS_NOTHING, /* the ray leaves the scene */
    IMP_MEETS_DROP     /* the walk is dropped */
};

/* A vertex where it is at the scene's present parameters. It is where it was decided,
 * unless a field bends the rays that lead there. */
struct imp_place {
    struct imp_texcoord at;
    struct imp_dirs dirs;
    struct imp_emission met;
    double ratio; /* T of the segment to here over the decided one */
};

/* What evaluation carries from vertex to vertex while they move. */
struct imp_moving {
    imp_v3 x, ng, d; /* the last kept vertex now: place, normal, direction of arrival */
};

struct imp_segment_ops {
    const char *name;
    bool connects; /* a straight line from its end can reach a light */
    bool through;  /* ... also through lobes that go straight on (imp_bsdf.straight),
                      which are no bounces then */

    /* ---- Decide ---- */
    /* Before the first segment of a walk. False: the walk is dropped. */
    bool (*begin)(struct imp_step *s);
    /* Take the ray in flight to what it meets. */
    enum imp_meeting (*meet)(struct imp_step *s, struct imp_hit *hit);
    /* At the surface that was met, with place and inputs of v set: keep what derivatives
     * need of the segment. Place and inputs may move a little. False: dropped. */
    bool (*arrive)(struct imp_step *s, struct imp_vertex *v, struct imp_hit *hit,
                   struct imp_surface *at);
    /* The walk goes on from v along s->d: choose the next segment's kind. */
    void (*leave)(struct imp_step *s, const struct imp_vertex *v,
                  const struct imp_surface *at);

    /* Is the light sample of v, a point of the surface `from` or of a medium, seen? Sets
     * the transmittance on the way. NULL: it is seen where nothing is in between. */
    bool (*sees)(struct imp_step *s, struct imp_vertex *v, const struct imp_surface *from,
                 const struct imp_shadow *shadow, imp_spec *transmittance);

    /* ---- Evaluate ---- */
    /* Where v is now. False: the segment ends on another shape now. */
    bool (*place)(const struct imp_tracer *tracer, const struct imp_vertex *v,
                  struct imp_moving *moving, struct imp_place *place);

    /* ---- Derivatives: of all the segments of a walk that move with active parameters,
     * since what moves one vertex moves all that follow. ---- */
    void (*sweep)(const struct imp_tracer *tracer, const struct imp_walk *walk,
                  imp_spec adjoint, struct imp_sink *sink);
    imp_spec (*tangent)(const struct imp_tracer *tracer, const struct imp_walk *walk,
                        const double *x_dot);
};

extern const struct imp_segment_ops imp__straight_ops;
extern struct imp_segment imp__straight; /* nothing to keep */

#endif

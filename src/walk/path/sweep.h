/* SPDX-License-Identifier: Apache-2.0
 *
 * Parts of a sweep (walk.h, sweep.c) for walks whose vertices are kept in another way. */
#ifndef IMP_WALK_SWEEP_H
#define IMP_WALK_SWEEP_H

#include "kind/build.h"
#include "walk/core/pieces.h"

/* Where pieces go. In a sweep with two adjoints also to `second`, with the second adjoint, which is
 * `ratio` times the first, lane by lane; else it is NULL. */
struct imp_sweep {
    const struct imp_tracer *tracer;
    struct imp_sink *sink, *second;
    imp_spec ratio;
};

/* A piece of an emitter. */
void imp__sweep_emitter(const struct imp_sweep *s, struct imp_emitter_piece *piece);

/* Pieces d [n] of inputs, which change. */
static inline void imp__sweep_inputs(const struct imp_sweep *s,
                                     const struct imp_input *const *input, int n,
                                     const struct imp_texcoord *at, imp_spec *d)
{
    imp__inputs_scatter(input, n, at, d, s->sink);
    if (!s->second) return;
    for (int j = 0; j < n; j++) d[j] *= s->ratio;
    imp__inputs_scatter(input, n, at, d, s->second);
}

/* The vertices of a walk from v on, which is number `depth`; *P is the adjoint of what leaves v, then of
 * what leaves a vertex behind the last one. False: that is 0. */
bool imp__sweep_vertices(const struct imp_sweep *s, const struct imp_walk *walk,
                         const struct imp_vertex *v, int depth, imp_spec *P);

#endif

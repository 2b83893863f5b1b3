/* SPDX-License-Identifier: Apache-2.0
 *
 * Parts of a sweep (walk.h, sweep.c) for walks whose vertices are kept in another way. */
#ifndef IMP_WALK_SWEEP_H
#define IMP_WALK_SWEEP_H

#include "kind/build.h"
#include "walk/core/pieces.h"

/* Where pieces go. In a sweep with two adjoints also to `second`, with the second adjoint, which is
 * `ratio` times the first, lane by lane; else it and `pair`, which has both sinks, are NULL. */
struct imp_sweep {
    const struct imp_tracer *tracer;
    struct imp_sink *sink, *second;
    const struct imp_sink_pair *pair;
    imp_spec ratio;
};

/* A piece of an emitter. */
void imp__sweep_emitter(const struct imp_sweep *s, struct imp_emitter_piece *piece);

/* A piece of a parameter's numbers; other: with the second adjoint, if there is one. */
static inline void imp__sweep_add(const struct imp_sweep *s, int param, size_t element,
                                  int channels, const imp_spec *bar,
                                  const imp_spec *other)
{
    if (s->pair && s->pair->add) {
        s->pair->add(s->pair, param, element, channels, bar, other);
        return;
    }
    s->sink->add(s->sink, param, element, channels, bar);
    if (s->pair) s->second->add(s->second, param, element, channels, other);
}
static inline void imp__sweep_plain(const struct imp_sweep *s,
                                    const struct imp_input *input, imp_spec bar)
{
    const imp_spec other = bar * s->ratio;
    if (input->param >= 0)
        imp__sweep_add(s, input->param, 0, input->count == 3 ? 3 : 1, &bar, &other);
}

/* Pieces d [n] of inputs, which change. */
static inline void imp__sweep_inputs(const struct imp_sweep *s,
                                     const struct imp_input *const *input, int n,
                                     const struct imp_texcoord *at, imp_spec *d)
{
    if (imp_likely(n == 1 && input[0]->plain && !at->carried)) {
        imp__sweep_plain(s, input[0], d[0]);
        return;
    }
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

/* SPDX-License-Identifier: Apache-2.0
 *
 * The pieces of a walk's gradient: derivatives of a vertex's values by inputs, each with the
 * adjoint that it is multiplied by. They are listed once, by the visitor of a vertex
 * (path/vertex_pieces.h); a table here takes them: into a sink (reverse mode), or
 * along a direction (forward mode). The visitor is one text, which each mode instantiates with a
 * constant table, as ends do with the step (one_step.h). */
#ifndef IMP_WALK_PIECES_H
#define IMP_WALK_PIECES_H

#include "walk.h"

/* The adjoints at vertex k: of what leaves it, of its own emission, and of its light sample.
 * In forward mode the first is 1. */
struct imp_adjoints {
    imp_spec P, own, lit;
};

/* Emission that is met, or sampled, as a piece: of `adjoint through[0] through[1] Le`. */
struct imp_emitter_piece {
    int emitter;
    struct imp_emission x;
    struct imp_texcoord at;
    imp_spec through[2], adjoint;
};

struct imp_pieces_ops {
    void (*emitter)(void *taker, struct imp_emitter_piece *piece);
    /* Inputs of the scatterer of v: begun, then d [v->bsdf->n_in] of each value that they
     * enter, then ended. */
    void (*scatterer_begin)(void *taker, const struct imp_vertex *v);
    void (*scatterer)(void *taker, const struct imp_vertex *v, const imp_spec *d,
                      imp_spec adjoint);
    void (*scatterer_end)(void *taker, const struct imp_vertex *v);
    /* Transmittance of a segment; value: as of imp__track_sweep. */
    void (*track)(void *taker, const struct imp_track *track,
                  const struct imp_carried *carried, const imp_spec *value,
                  imp_spec adjoint);
    /* An input alone; the adjoint is in d. */
    void (*input)(void *taker, const struct imp_input *const *input,
                  const struct imp_texcoord *at, const imp_spec *d);
    /* True: segments that begin at the vertex come before its scatterer (forward mode, which
     * reads last to first); segments_end: after them. */
    bool segments_first;
    void (*segments_end)(void *taker);
};

#endif

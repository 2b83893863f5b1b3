/* SPDX-License-Identifier: Apache-2.0
 *
 * The pieces of gradient that a vertex has in media: of the segments to the next vertex and
 * to the light sample, and of the probe of an extinction; a collision as a scatterer. */
#ifndef IMP_WALK_MEDIA_PIECES_H
#define IMP_WALK_MEDIA_PIECES_H

#include "probe.h"
#include "walk/core/pieces.h"

/* Have v's segments or its probe a derivative? */
static inline bool imp__vertex_crosses(const struct imp_vertex *v)
{
    return v->on || v->to_light || v->probe;
}

/* Hands them over, as the visitor of the vertex does (path/vertex_pieces.h). */
void imp__media_pieces(const struct imp_pieces_ops *ops, void *taker,
                       const struct imp_tracer *tracer, const struct imp_vertex *v,
                       const struct imp_adjoints *a);

/* The places of collisions carry no derivative with respect to an extinction: probes give
 * it, and a collision's albedo none of it. x [b->n_in] */
void imp__extinction_drop(const struct imp_tracer *tracer, const struct imp_vertex *v,
                          imp_spec *x);
/* The transpose: what a point of a medium gives to the inputs of its scatterer. */
void imp__point_scatter(const struct imp_tracer *tracer, const struct imp_vertex *v,
                        const struct imp_texcoord *at, const imp_spec *bar,
                        struct imp_sink *sink);

#endif

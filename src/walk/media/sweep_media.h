/* SPDX-License-Identifier: Apache-2.0
 *
 * Sweep and tangent of what a vertex has in media: the segments to the next vertex and
 * to the light sample, the probe of an extinction, a collision as a scatterer. */
#ifndef IMP_WALK_SWEEP_MEDIA_H
#define IMP_WALK_SWEEP_MEDIA_H

#include "probe.h"

/* Does the derivative of v's segments or its probe have to be asked for? */
static inline bool imp__vertex_crosses(const struct imp_vertex *v)
{
    return v->on || v->to_light || v->probe;
}

/* Pieces of gradient: P the adjoint at v, own that of its light sample. */
void imp__media_scatter(const struct imp_tracer *tracer, const struct imp_vertex *v,
                        imp_spec P, imp_spec own, struct imp_sink *sink);
/* The same along a direction, for P = 1. */
imp_spec imp__media_tangent(const struct imp_tracer *tracer, const struct imp_vertex *v,
                            imp_spec own, imp_dot_fn *dot, const void *x_dot);

/* Where collisions are does not stand for the derivative with respect to an extinction:
 * probes give it, and a collision's albedo none of it. x [b->n_in] */
void imp__extinction_drop(const struct imp_tracer *tracer, const struct imp_vertex *v,
                          imp_spec *x);
/* The transpose: what a point of a medium gives to the inputs of its scatterer. */
void imp__point_scatter(const struct imp_tracer *tracer, const struct imp_vertex *v,
                        const struct imp_texcoord *at, const imp_spec *bar,
                        struct imp_sink *sink);

#endif

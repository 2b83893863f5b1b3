/* SPDX-License-Identifier: Apache-2.0
 *
 * Light tracing. In a reading R = sum over paths of We K .. K Le, a walk may carry either
 * end to the other (Veach 1997, 3.7). A light walk begins with its emission, is
 * scattered by transposed kernels (kind/bsdf/transport.h), and reaches the sensor where it
 * is connected to it or meets its surface. There is no other factor between the directions.
 *
 * The record is that of all walks. Vertex 0 lies on the light, of the others wi is where
 * the walk came from, and wo, drawn, where it goes. What a transposed kernel has more than
 * the kernel, c, depends on decisions alone, so that densities are kept as p/c:
 *
 *     w_k = f T/(s p/c),    B_k = f c We T/..    (to the sensor),    E_k = We  (met)
 *
 * and evaluate, fold, sweep and tangent read them as they read any walk. What they add up
 * are the walk's contributions to all pixels, each with the adjoint of its own (entry). */
#ifndef IMP_WALK_LIGHT_WALK_H
#define IMP_WALK_LIGHT_WALK_H

#include "walk/core/walk.h"

struct imp_both;
/* Light that reaches the sensor from a vertex, or what the walk from the sensor brings of a
 * sample from both ends. */
struct imp_reach {
    struct imp_reach *next; /* of the walk, in order */
    struct imp_vertex
        *vertex;     /* from which it comes; NULL: from that walk, or from a vertex
                                  that was not kept, in lanes (light_bundle.h) */
    int number;      /* of the vertex */
    bool met;        /* E of the vertex; else B */
    double px, py;   /* film position, pixels of the full film */
    imp_spec values; /* by lanes */
    imp_spec L;      /* by the scene's channels */
};

struct imp_light_walk {
    struct imp_walk walk;
    struct imp_arena *arena; /* that it is recorded in */
    struct imp_reach *reach; /* what reaches the film, wherever */
    int n_reach;
    struct imp_both
        *both; /* walks begin at both ends (both.h); NULL: at the light alone */
};

/* Record light walk `index` in the arena with its values at the scene's present
 * parameters. A walk that is dropped reaches nothing. */
void imp__light_walk_trace(const struct imp_tracer *tracer, struct imp_arena *arena,
                           int64_t index, struct imp_light_walk *out);

/* ---- light_sweep.c: `adjoint` has one for each reach, in order, by lanes; false: no
 * memory. ---- */
/* Reverse mode: adds the derivative of the sum over the reaches of adjoint times values,
 * times factor, to the sink. */
bool imp__light_walk_sweep(const struct imp_tracer *tracer, struct imp_arena *arena,
                           struct imp_light_walk *walk, const imp_spec *adjoint,
                           double factor, struct imp_sink *sink);
/* Forward mode: its derivative in the direction x_dot [active->n], by lanes. */
bool imp__light_walk_tangent(const struct imp_tracer *tracer, struct imp_arena *arena,
                             struct imp_light_walk *walk, const imp_spec *adjoint,
                             const double *x_dot, imp_spec *L_dot);
/* All values at the scene's present parameters, to the bit those that tracing gave at the
 * parameters it was done with: at others they are those of a frozen walk. */
bool imp__light_walk_evaluate(const struct imp_tracer *tracer, struct imp_arena *arena,
                              struct imp_light_walk *walk);

/* A material that sends light into single directions; NULL: there is none. */
const struct imp_bsdf *imp__delta_bsdf(const struct imp_scene *scene);
/* Such a material, where walks of this integrator bring no light by it to the sensor: one
 * that they cannot meet, and to which they are connected. NULL: nothing is missing. */
const struct imp_bsdf *
imp__light_walks_miss(const struct imp_scene *scene, const struct imp_sensor *sensor,
                      const struct imp_walk_integrator *integrator);
/* Warn of it. */
void imp__light_walks_tell(const struct imp_scene *scene, const struct imp_sensor *sensor,
                           const struct imp_walk_integrator *integrator);

#endif

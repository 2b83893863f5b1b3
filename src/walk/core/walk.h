/* SPDX-License-Identifier: Apache-2.0
 *
 * The life of a walk: decided once, then evaluated, folded, swept and differentiated as often
 * as wanted (walk_parts.h). */
#ifndef IMP_WALK_H
#define IMP_WALK_H

#include "walk_seen.h"
#include <float.h>

/* ---- Wavelengths (waves.c) ------------------------------------------------------- */

/* When light reaches this sensor, by a number on [0, 1); and that of a walk. */
double imp__sensor_time(const struct imp_sensor *s, double u);
double imp__walk_time(const struct imp_tracer *tracer, const struct imp_walk *walk);

/* Number from which the wavelengths of a walk are drawn, on [0, 1). */
double imp__wave_draw(const struct imp_tracer *tracer, const struct imp_walk *walk,
                      int64_t sample);
/* The walk's wavelengths from that number. False: no memory, it is dropped. */
bool imp__walk_wave(const struct imp_tracer *tracer, struct imp_arena *arena, double u,
                    struct imp_walk *walk);

/* ---- Decide (trace.c) ------------------------------------------------------------ */

/* Record walk (x, y, sample) of the picture (x, y from the crop's corner) in the arena,
 * with its values at the scene's present parameters, and fold it. Running out of memory
 * drops the walk. */
void imp__walk_trace(const struct imp_tracer *tracer, struct imp_arena *arena, int x,
                     int y, int64_t sample, struct imp_walk *walk);

/* A walk with these random numbers and time that begins with a given ray, of these wavelengths (NULL: of
 * colours), in this medium; `depth` vertices of a path lie before it. hit: what the ray meets; NULL: it
 * is traced. along: of such a hit, the direction to which the frame is turned about its normal; 0: it
 * stays. */
void imp__walk_along(const struct imp_tracer *tracer, struct imp_arena *arena,
                     struct imp_key key, double time, const struct imp_sensor_ray *ray,
                     const struct imp_waves *waves, int depth, struct imp_hit *hit,
                     imp_v3 along, const struct imp_medium *medium,
                     struct imp_walk *walk);

/* Nothing yet; its key, film position, point and time are set behind this. Field by field, as
 * compilers clear structs of this size by an instruction that takes 2 % of a walk. */
static inline __attribute__((always_inline)) void imp__walk_clear(struct imp_walk *walk)
{
    walk->first = walk->last = NULL;
    walk->n = walk->depth = 0;
    walk->ray.o = walk->ray.d = (imp_v3){0};
    walk->ray.t_near = walk->ray.t_far = 0;
    walk->L = walk->values = (imp_spec){0};
    walk->waves = NULL;
    walk->wave = 0;
    walk->valid = walk->absorbed = false;
    walk->dropped = IMP_DROP_NONE;
    walk->entry = NULL;
    walk->moving = NULL;
    walk->reduced = NULL;
}

/* Its number, film position, first ray and time alone; lens: the numbers of the ray. */
void imp__walk_begin(const struct imp_tracer *tracer, int x, int y, int64_t sample,
                     struct imp_walk *walk, double lens[2]);

/* What the keys of a pixel have in common (math/rng.h); the key and the point of a walk alone, and its
 * film position alone. */
uint64_t imp__walk_pixel(const struct imp_tracer *tracer, int x, int y);
void imp__walk_numbers(const struct imp_tracer *tracer, int x, int y, int64_t sample,
                       struct imp_walk *walk);
void imp__walk_position(const struct imp_tracer *tracer, int x, int y, int64_t sample,
                        double *px, double *py);

/* The scatterer of a recorded vertex; NULL at the sky and the sensor. */
static inline const struct imp_bsdf *imp__decided_bsdf(const struct imp_scene *scene,
                                                       const struct imp_decision *d)
{
    if (d->shape < 0) return NULL;
    return d->scatterer == IMP_IN_MEDIUM
               ? scene->media[d->shape]->scatterer
               : imp__shape_bsdf(scene, scene->shapes[d->shape]);
}

/* ---- Evaluate (evaluate.c) ------------------------------------------------------- */

/* L of the same decisions at the scene's present parameters: what central differences on
 * frozen walks are made of (docs/estimators.md 13 A). It does not see wrong densities;
 * fresh-seed differences do. NaN if the walk moves with a field and meets other shapes
 * now. */
imp_spec imp__walk_frozen(const struct imp_tracer *tracer, const struct imp_walk *walk);
/* Inputs and values of all vertices at the scene's present parameters, to the bit those
 * that tracing gave at the parameters it was done with. No vertex moves. */
void imp__walk_evaluate(const struct imp_tracer *tracer, struct imp_walk *walk);
/* L of the same decisions in another scene of the same objects, at its parameters; `there`
 * is a tracer of it. The two scenes differ in active parameters alone: a vertex that depends
 * on none of them keeps its values. 0 where the walk was dropped, or is no number there. */
imp_spec imp__walk_elsewhere(const struct imp_tracer *there, const struct imp_walk *walk);
/* Fold, and L as it counts: a walk that is not valid brings 0, and one whose value no
 * light can have, or no picture can hold, is dropped (trace.c). */
void imp__walk_close(const struct imp_tracer *tracer, struct imp_walk *walk);
/* Why a walk of this radiance is dropped: no light can have it, or no picture can hold
 * it. */
enum imp_drop imp__drop_cause(imp_spec L);
/* E_k, B_k and w_k of a vertex that no track belongs to, from its decisions alone. */
struct imp_values {
    imp_spec e, b, w;
};
void imp__decided_values(const struct imp_tracer *tracer, const struct imp_decision *d,
                         const struct imp_bsdf *bsdf, const struct imp_carried *carried,
                         struct imp_values *out);

/* ---- Fold (fold.c), sweep, tangent (sweep.c) ---------------------------------------------- */

/* L = E + B + w L, from the last vertex to the first; sets `beyond` of every vertex. */
imp_spec imp__walk_fold(struct imp_walk *walk);

/* Reverse mode: adds (dL/dtheta)^T adjoint to the sink; adjoint of the walk's values, which
 * are wavelengths where it carries some. */
void imp__walk_sweep_values(const struct imp_tracer *tracer, const struct imp_walk *walk,
                            imp_spec adjoint, struct imp_sink *sink);

/* The transpose of an emitter's radiance at x, looked up at `at` (which changes): what bar gives to its
 * parameters, and its tangent. */
void imp__emitter_scatter(const struct imp_tracer *tracer, int emitter,
                          struct imp_emission *x, struct imp_texcoord *at, imp_spec bar,
                          struct imp_sink *sink);
imp_spec imp__emitter_tangent(const struct imp_tracer *tracer, int emitter,
                              struct imp_emission x, struct imp_texcoord at,
                              imp_dot_fn *dot, const void *x_dot);

/* One vertex: what bar [n_in] of its scatterer's inputs gives to their parameters; their tangent,
 * into in_dot [n_in]. */
void imp__vertex_scatter(const struct imp_tracer *tracer, const struct imp_vertex *v,
                         const imp_spec *bar, struct imp_sink *sink);
void imp__vertex_tangent(const struct imp_tracer *tracer, const struct imp_vertex *v,
                         const double *x_dot, imp_spec *in_dot);

/* As imp__walk_close, when L has been folded. */
static inline __attribute__((always_inline)) void
imp__walk_value(const struct imp_tracer *tracer, struct imp_walk *walk, imp_spec L)
{
    imp_spec used = L;
    if (!tracer->wavelengths) used[3] = 0;
    if (imp_unlikely(!imp__is_within(used, FLT_MAX)))
        walk->dropped = imp__drop_cause(used);
    walk->values = walk->dropped || !walk->valid ? (imp_spec){0} : L;
    walk->L = imp__walk_shown(tracer, walk, walk->values);
}

/* Reverse mode, for an adjoint of the walk's channels. */
static inline void imp__walk_sweep(const struct imp_tracer *tracer,
                                   const struct imp_walk *walk, imp_spec adjoint,
                                   struct imp_sink *sink)
{
    imp__walk_sweep_values(tracer, walk, imp__walk_values(tracer, walk, adjoint), sink);
    if (imp_unlikely(tracer->sensor->gain != NULL))
        imp__gain_sweep(tracer, walk, adjoint, sink);
}

/* ... and for another adjoint into the second sink. Derivatives of kernels and emitters are computed
 * once for both, where the first adjoint is nowhere 0 alone. */
void imp__walk_sweep_both(const struct imp_tracer *tracer, const struct imp_walk *walk,
                          imp_spec adjoint, imp_spec other,
                          const struct imp_sink_pair *to);

/* Forward mode: dL in the direction x_dot [active->n]. */
imp_spec imp__walk_tangent(const struct imp_tracer *tracer, const struct imp_walk *walk,
                           const double *x_dot);
/* That of the walk's values. */
imp_spec imp__walk_tangent_values(const struct imp_tracer *tracer,
                                  const struct imp_walk *walk, const double *x_dot);

#endif

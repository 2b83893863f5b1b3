/* SPDX-License-Identifier: Apache-2.0
 *
 * A walk is one random path from the sensor. It is decided once and evaluated as often as
 * wanted.
 *
 * Decisions are what rays and random numbers settled: where the walk scattered, in which
 * directions, with which densities p and survival probabilities s, which light was
 * sampled and whether it was seen. They are constants to every derivative. Values are
 * what the scene's parameters make of the decisions: emission E, light sample B, step
 * weight w = f T/(p s), with the BSDF f (which holds the cosine) and the transmittance T
 * of the segment that follows. The radiance that leaves vertex k towards the sensor is
 *
 *     L_k = E_k + B_k + w_k L_{k+1}                        (fold: last vertex to first)
 *
 * The sweep carries the adjoint P from the first vertex to the last, P_{k+1} = P_k w_k,
 * and at every vertex a piece of gradient falls off (Stam 2020, Eq. 14 on one path;
 * docs/estimators.md 6):
 *
 *     P_k (dE_k + dB_k + dw_k L_{k+1}),    dw = df T/(p s): densities are constants
 *
 * The tangent is the same product rule run with the fold. Evaluate, fold, sweep and
 * tangent read the same record; none of them draws a number or traces a ray. */
#ifndef IMP_WALK_H
#define IMP_WALK_H

#include "active.h"
#include "decision.h"
#include "emitted.h"
#include "math/points.h"
#include "scene/guide.h"
#include "shaped.h"
#include "walk_integrator.h"
#include <float.h>

/* ---- Record ---------------------------------------------------------------------- */

struct imp_store;
struct imp_segment_ops;
struct imp_tracer;
struct imp_sink;
struct imp_track; /* what a segment crosses (tracking.h) */
struct imp_probe; /* of an extinction's derivative (probe.h) */

/* One segment of a record; kinds put what they keep behind it (segment.h). */
struct imp_segment {
    const struct imp_segment_ops *ops;
    /* Where the vertex at its end moves with a parameter, differences of it are compared
     * with derivatives: place and direction of arrival are not rounded then. Else NULL.
     */
    const struct imp_exact {
        struct imp_texcoord at;
        imp_v3 wo;
    } * exact;
};

struct imp_vertex {
    struct imp_vertex *prev, *next;
    const struct imp_bsdf *bsdf;   /* of the surface; NULL at the sky */
    const struct imp_shape *shape; /* NULL at the sky */
    double t;                      /* length of the segment that leads here */
    imp_spec scale;                /* T/(p s) */

    /* Values. */
    imp_spec e;            /* E_k: all emission of this vertex, weighted */
    imp_spec b;            /* B_k = light_f light_e light_w */
    imp_spec w;            /* f scale: weight of the step to the next vertex */
    imp_spec beyond;       /* L_{k+1}, set by fold */
    struct imp_side *side; /* walks that hang on this vertex; NULL: none */

    /* Walks for their value alone keep nothing from here on. */
    imp_v3 ng;                         /* geometric normal, world */
    imp_spec light_f, light_e;         /* BSDF towards the light, and its radiance */
    imp_spec light_w;                  /* light.weight, times T on the way to the light */
    struct imp_track *on, *to_light;   /* of the segments that begin here; NULL: T is 1 */
    struct imp_probe *probe;           /* of the segment that goes on; NULL: none */
    struct imp_segment *segment;       /* from the last vertex to here (segment.h) */
    imp_spec *in;                      /* [bsdf->n_in] inputs at this point */
    const struct imp_carried *carried; /* of the walk; NULL: colours */
    struct imp_decision d;
};
#define IMP_VERTEX_VALUES offsetof(struct imp_vertex, ng) /* bytes */

/* Asks for the first bytes of a vertex that is read soon: those of a walk in a bundle lie far
 * apart. v may be NULL. */
static inline void imp__vertex_fetch(const struct imp_vertex *v, size_t bytes)
{
    const uintptr_t from = (uintptr_t)v;
    for (size_t at = 0; at < bytes; at += IMP_CACHE_LINE)
        __builtin_prefetch((const void *)(from + at));
}

/* Vertices of a walk. One of more is dropped: nothing ends it, as in a closed white room
 * without roulette. With roulette at 0.95 the chance to get here is 1e-365. */
#define IMP_WALK_MAX (1 << 14)

struct imp_entry {
    imp_spec e, b;
    imp_spec joints; /* from connections to the other walk (both.h) */
};

struct imp_walk {
    struct imp_vertex *first, *last;
    int n;         /* vertices */
    int depth;     /* of the first vertex: 0, unless it hangs on another walk */
    double px, py; /* film position, pixels of the full film */
    struct imp_key key;
    double time;
    struct imp_point point; /* of its set; of none: its numbers are the key's */
    struct imp_sensor_ray ray;
    imp_spec L; /* radiance at the sensor, by the scene's channels; of a side walk its
                   values */
    imp_spec values; /* radiance at the sensor by lanes; channels are made of it */
    /* How its values are read: wavelengths, and what channels make of them. NULL: values are
     * channels. */
    const struct imp_waves *waves;
    double wave;           /* number from which its wavelengths were drawn */
    bool valid;            /* alpha 1 (docs/scene-format.md 11) */
    bool absorbed;         /* Stam: ended by absorption */
    enum imp_drop dropped; /* then L is 0 and there is nothing to sweep */
    /* [n] adjoints with which E and B of vertex k enter: what a sensor that they reach makes
     * of them. NULL: 1, as of a walk from the sensor, whose adjoint enters at its start. */
    const struct imp_entry *entry;
    /* Kind of the segments that move with an active parameter; NULL: none does. */
    const struct imp_segment_ops *moving;
    const struct imp_reduced_ops
        *reduced; /* in place of vertices; NULL: they are there */
};

/* Two sinks, for the same pieces times two adjoints. */
struct imp_sink_pair {
    struct imp_sink *first, *second;
    /* `bar` to the first, `other` to the second. NULL: by their own functions. */
    void (*add)(const struct imp_sink_pair *to, int param, size_t element, int channels,
                const imp_spec *bar, const imp_spec *other);
};

/* Sweep and tangent of what takes the place of vertices: the first member of struct
 * imp_reduced_of (kept/reduced.h) or of struct imp_swept_walk (bundle/swept.h), which has no tangent. The arguments are those of imp__walk_sweep_values and
 * imp__walk_tangent_values. */
struct imp_reduced_ops {
    void (*sweep)(const struct imp_tracer *tracer, const struct imp_walk *walk,
                  imp_spec adjoint, struct imp_sink *sink);
    /* Likewise with `ratio` times the adjoint, lane by lane, into a second sink. NULL: swept twice. */
    void (*both)(const struct imp_tracer *tracer, const struct imp_walk *walk,
                 imp_spec adjoint, imp_spec ratio, const struct imp_sink_pair *to);
    imp_spec (*tangent)(const struct imp_tracer *tracer, const struct imp_walk *walk,
                        imp_dot_fn *dot, const void *x_dot);
};

/* A walk that hangs on a vertex of another: its radiance adds to that vertex's. It begins
 * with a copy of the vertex, which has a continuation of its own and no light. A walk and
 * what hangs on it are one sample. */
struct imp_side {
    struct imp_side *next;
    struct imp_walk walk;
};

/* Where walks come from that are not traced: the first member of struct imp_store. */
struct imp_walk_source {
    /* As imp__walk_trace. */
    void (*walk)(const struct imp_tracer *tracer, struct imp_arena *arena, int x, int y,
                 int64_t sample, struct imp_walk *walk);
    int set; /* walks of a pixel that depend on each other; 0: as those of a picture */
};

/* What walks are made with; read-only, shared by all workers. */
struct imp_tracer {
    const struct imp_scene *scene;
    const struct imp_walk_integrator *integrator;
    const struct imp_sensor *sensor;
    /* NULL: value only. Else walks go on through factors that are zero but have a
     * derivative (docs/estimators.md 9.2). */
    const struct imp_active *active;
    uint64_t seed;
    const struct imp_guide *guide; /* imp__guide_of; NULL: none */
    bool value_only;               /* a walk's L is wanted, and no record of it */
    bool swept_only; /* ... or what a sweep takes of the record (bundle/swept.h) */
    /* How walks draw the wavelengths they carry; NULL: they carry the scene's colours. */
    const struct imp_wavelengths *wavelengths;
    /* The walks of a pixel: each whole `period` is cut into sets of about `set`
     * (imp__set_at), among which wavelengths are stratified; set 0 or 1: each walk is drawn
     * on its own. Sets are independent of each other, walks of a set are not. */
    int set;
    bool stratified; /* walks of a set of points have stratified wavelengths */
    int64_t period;  /* 0: endless */
    /* NULL: a pixel's walks are independent. Else those with the numbers 64 s to 64 s + 63
     * are set s of points, of which any prefix may be used. */
    const struct imp_point_table *points;
    bool whole; /* as few such sets as hold a pixel's walks (IMP_POINTS_WHOLE) */
    const struct imp_mixing *mixing; /* densities in place of the integrator's and the
                                        materials'; NULL: those */
    bool collisions_fixed; /* the derivative of a frozen walk is wanted, whose collisions
                              stay where they are, also of extinctions: no probes */
    const struct imp_photograph *photograph; /* that is compared with; NULL: none */
    int together; /* points of a grid that share what their walks meet first, where these are
                     bundled (bundle/reuse.h); 0: none do */
    const uint8_t
        *more; /* [pixels] their walks beside the film's (bundle/near_walls.h) */
    int split; /* continuations of the first vertex, each with its share; 0: one. Scenes
                  with media have one */
    double
        survival; /* least probability with which roulette lets a walk go on; 0: none */
    double
        headroom; /* collisions are drawn under bounds so much higher (flight.h); 0 or 1:
                        as they are */
    imp_spec baseline;            /* by lanes: subtracted from the light that arrives, in
                          derivatives of flights (baseline.h) */
    const struct imp_store *kept; /* walks that are evaluated in place of tracing
                                    (store.h); NULL: they are traced */
    bool elsewhere;               /* walks are evaluated at other parameter values, too
                       (imp__walk_elsewhere): factors that are zero, but have a
                       derivative, end no walk, however many there are */
};

static inline const struct imp_walk_source *imp__walk_source(const struct imp_tracer *t)
{
    return (const struct imp_walk_source *)t->kept;
}

/* The guide that walks of this integrator follow: its densities are made for paths and for
 * light walks, in scenes that finite elements know. */
static inline const struct imp_guide *imp__guide_of(const struct imp_scene *scene,
                                                    const struct imp_walk_integrator *i,
                                                    const struct imp_guide *guide)
{
    return (i->guided || (i->from_lights && !i->both)) && scene->n_bodies == 0 &&
                   scene->n_media == 0 && !scene->priorities
               ? guide
               : NULL;
}
/* The points of a run through a sensor: independent, or Sobol's, which have the smaller errors
 * where neither the run nor the sampler names a kind (docs/decisions.md). */
static inline enum imp_points imp__points_of(const struct imp_sensor *sensor,
                                             const struct imp_run *run)
{
    const enum imp_points asked =
        run->points != IMP_POINTS_SCENE ? run->points : sensor->points;
    return asked == IMP_POINTS_INDEPENDENT ? asked : IMP_POINTS_SOBOL;
}

/* ---- Wavelengths (waves.c) ------------------------------------------------------- */

/* Random numbers and wavelengths as a run wants them, n walks of a pixel being one
 * whole. */
void imp__tracer_numbers(struct imp_tracer *tracer, const struct imp_run *run, int64_t n);

/* Walks of a pixel that a picture's errors take together, since they depend on each other,
 * about; n in all, 0: not known. Sets are independent of each other: their spread is the
 * error. Those of points are four, at least: more would be smaller, and gain less. */
int imp__tracer_set(const struct imp_tracer *tracer, int64_t n);

/* The set that a walk belongs to: its first walk, and how many it has. A whole is cut into
 * period/set sets, whose sizes differ by one at most; without end, all have `set`. */
static inline void imp__set_at(int set, int64_t period, int64_t sample, int64_t *first,
                               int64_t *n)
{
    if (period <= 0) {
        *first = sample - sample % set;
        *n = set;
        return;
    }
    const int64_t at = sample % period, sets = imp_max(period / set, (int64_t)1);
    const int64_t k = ((at + 1) * sets - 1) / period;
    *first = sample - at + k * period / sets;
    *n = (k + 1) * period / sets - k * period / sets;
}

/* Are the walks of a picture traced in sets of points? Then they have the numbers of
 * imp__set_number. Recorded ones are asked for in the order in which they were traced. */
static inline bool imp__tracer_sets(const struct imp_tracer *tracer)
{
    return tracer->points && !tracer->kept;
}
/* Number of walk k of a pixel, whose sets are sets of points. */
static inline int64_t imp__set_number(int set, int64_t period, int64_t k)
{
    if (period <= 0) return k / set * IMP_SET_POINTS + k % set;
    const int64_t sets = imp_max(period / set, (int64_t)1), at = k % period;
    const int64_t s = ((at + 1) * sets - 1) / period;
    return (k / period * sets + s) * IMP_SET_POINTS + at - s * period / sets;
}

/* When its light reaches the sensor. */
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

/* A walk with these random numbers that begins with a given ray, of these wavelengths (NULL: of
 * colours), in this medium; `depth` vertices of a path lie before it. hit: what the ray meets; NULL: it
 * is traced. along: of such a hit, the direction to which the frame is turned about its normal; 0: it
 * stays. */
void imp__walk_along(const struct imp_tracer *tracer, struct imp_arena *arena,
                     struct imp_key key, const struct imp_sensor_ray *ray,
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

/* ---- From a walk to the picture (gain.c) ------------------------------------------ */

/* The camera's factor for this walk, by channel, and what is added behind it. */
imp_spec imp__walk_gain(const struct imp_tracer *tracer, const struct imp_walk *walk);
imp_spec imp__walk_offset(const struct imp_tracer *tracer, const struct imp_walk *walk);
/* What an adjoint of the walk's channels gives to the camera's own numbers. */
void imp__gain_sweep(const struct imp_tracer *tracer, const struct imp_walk *walk,
                     imp_spec adjoint, struct imp_sink *sink);
/* What the camera makes of the walk's values, in the direction x_dot of its own numbers. */
imp_spec imp__gain_tangent(const struct imp_tracer *tracer, const struct imp_walk *walk,
                           const double *x_dot);

/* Channels of a walk's values, without the camera's factor, and the transpose. */
static inline imp_spec imp__walk_seen(const struct imp_walk *walk, imp_spec values)
{
    return imp_likely(!walk->waves) ? values : imp__waves_channels(walk->waves, values);
}
static inline imp_spec imp__walk_lanes(const struct imp_walk *walk, imp_spec channels)
{
    return imp_likely(!walk->waves) ? channels : imp__waves_lanes(walk->waves, channels);
}
/* With it. */
static inline imp_spec imp__walk_channels(const struct imp_tracer *tracer,
                                          const struct imp_walk *walk, imp_spec values)
{
    const imp_spec seen = imp__walk_seen(walk, values);
    return imp_likely(!tracer->sensor->gain) ? seen : seen * imp__walk_gain(tracer, walk);
}
/* As the target sees them. */
static inline imp_spec imp__walk_shown(const struct imp_tracer *tracer,
                                       const struct imp_walk *walk, imp_spec values)
{
    const imp_spec L = imp__walk_channels(tracer, walk, values);
    return imp_likely(!tracer->photograph) ? L : L + imp__walk_offset(tracer, walk);
}
static inline imp_spec imp__walk_values(const struct imp_tracer *tracer,
                                        const struct imp_walk *walk, imp_spec channels)
{
    if (imp_unlikely(tracer->sensor->gain != NULL))
        channels *= imp__walk_gain(tracer, walk);
    return imp__walk_lanes(walk, channels);
}

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

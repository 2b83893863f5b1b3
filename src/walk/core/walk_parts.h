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
#ifndef IMP_WALK_PARTS_H
#define IMP_WALK_PARTS_H

#include "active.h"
#include "decision.h"
#include "emitted.h"
#include "math/points.h"
#include "shaped.h"

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

/* A walk that hangs on a vertex of another: its radiance adds to that vertex's. It begins
 * with a copy of the vertex, which has a continuation of its own and no light. A walk and
 * what hangs on it are one sample. */
struct imp_side {
    struct imp_side *next;
    struct imp_walk walk;
};

/* ---- In place of vertices --------------------------------------------------------- */

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

#endif

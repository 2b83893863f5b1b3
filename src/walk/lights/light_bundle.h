/* SPDX-License-Identifier: Apache-2.0
 *
 * Values of walks from lights in lanes: as walks of bundles (bundle/bundle.h), some go together, one
 * segment at a time. Each brings to the film what it brings alone (light_walk.h), to the bit; it has no
 * record, and no vertices but perhaps its first.
 *
 * What arrives is the product of all weights before it, so that a walk under way carries that,
 * and nothing is folded. */
#ifndef IMP_WALK_LIGHT_BUNDLE_H
#define IMP_WALK_LIGHT_BUNDLE_H

#include "light_step.h"
#include "walk/bundle/by_shape.h"

struct imp_light_flights {
    struct imp_flights
        rays;           /* in flight; of its columns ray, walk, and beta for roulette */
    double *carries[4]; /* product of the weights so far */
};

/* Connections to the sensor whose shadow rays are to be traced, and what they bring. */
struct imp_light_views {
    struct imp_ray_columns ray;
    double *px, *py, *brings[4];
    int32_t *walk;
};

struct imp_light_bundle {
    struct imp_depth at; /* first: its bundle has the tracer, keys and wavelengths */
    struct imp_bundle bundle;
    struct imp_light_flights
        flights[2]; /* flights[depth & 1] lead to the vertices at work */
    struct imp_hit_columns hits;
    struct imp_by_shape by_shape;
    struct imp_light_views views;
    bool *hidden;
    struct imp_lone lone;
    struct imp_light_walk *out;
    struct imp_reach ***end; /* of each walk's list */
    bool links, goes_on;     /* at this depth: are vertices connected, do walks go on? */
};

/* Are walks of this tracer made so? They go together (light_step.h). */
bool imp__light_bundle_fit(const struct imp_tracer *tracer);
/* As imp__light_walks_trace. */
bool imp__light_bundle_trace(const struct imp_tracer *tracer, struct imp_arena *arena,
                             int64_t first, int n, struct imp_light_walk *out);

/* ---- light_bundle_begin.c ---- */
/* The walks' first rays. False: no memory. */
bool imp__light_bundle_begin(struct imp_light_bundle *l, struct imp_arena *arena,
                             int64_t first);

/* ---- light_vertex.c ---- */
/* The vertices that the rays order[n] lead to: views and the next rays are appended. */
void imp__light_vertices(struct imp_light_bundle *l, const struct imp_bin *bin,
                         const int32_t *order, int n);

/* ---- light_seen.c ---- */
/* How the sensor sees the points p with bits, by the random numbers at this depth. The lanes whose
 * points may be on the film. */
struct imp_light_seen {
    struct imp_wide_seen at;
    imp_wide reach; /* of shadow rays */
};
unsigned imp__light_bundle_see(const struct imp_sensor *sensor,
                               const struct imp_wide_block *numbers, int depth,
                               const imp_wide3 *p, unsigned bits,
                               struct imp_light_seen *out);

#endif

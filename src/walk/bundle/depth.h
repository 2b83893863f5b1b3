/* SPDX-License-Identifier: Apache-2.0
 *
 * What the vertices of a depth of a bundle take, and what they make. */
#ifndef IMP_WALK_BUNDLE_DEPTH_H
#define IMP_WALK_BUNDLE_DEPTH_H

#include "bundle.h"
#include "columns.h"
#include "kind/kind_lanes.h"
#include "walk/core/step.h"

/* The step that makes vertices one by one, and the shadow ray that it leaves. */
struct imp_lone {
    struct imp_step step; /* first */
    struct imp_walk walk;
    struct imp_shadow shadow;
    int medium; /* where it begins, in media (struct imp_shadows) */
    double behind;
    struct imp_light_cut cut; /* at the point of a meter */
    imp_spec scratch[IMP_INPUTS_MAX];
    imp_spec each[IMP_WIDE_LANES * IMP_INPUTS_MAX]; /* inputs of vertices in lanes */
};

struct imp_reuse;
struct imp_depth {
    struct imp_bundle *bundle;
    int depth;
    bool last;                      /* nothing leaves its vertices, by max_depth */
    const struct imp_flights *rays; /* that lead there */
    const struct imp_hit_columns *hits;
    struct imp_bundle_values
        *values;                 /* of the vertices, at their places; of recorded walks
                                         their number alone */
    struct imp_shadows *shadows; /* appended */
    struct imp_flights *next;    /* likewise */
    struct imp_lone *lone;
    struct imp_in_media *media; /* in_media.h; NULL: walks cross none */
    struct imp_reuse
        *reuse; /* records the points and the surfaces met; NULL: not shared */
};

/* A walk before its first segment; first rays of walks from a camera (bundle_begin.c). False: no
 * memory. */
bool imp__begin_alone(struct imp_bundle *b, struct imp_arena *arena, const int at[2],
                      int64_t sample, int k, struct imp_walk *walk);
bool imp__camera_begin(struct imp_arena *arena, struct imp_bundle *b, const int (*xy)[2],
                       int n_samples, const int64_t *samples, struct imp_flights *rays);

/* The vertex that ray i leads to, at place `at` among the values (alone_vertex.c); and the sky,
 * whose value goes to the vertex before. */
void imp__vertex_alone(struct imp_depth *d, int i, int at);
void imp__sky_alone(struct imp_depth *d, int i, double *const beyond[4]);
/* What the rays meet by the step's own search, which passes lights that are hidden from the
 * camera. */
void imp__meet_alone(struct imp_depth *d, const struct imp_hit_columns *hits);
/* The collision that ray i ends in. */
void imp__collision_alone(struct imp_depth *d, int i, int at);
/* The first vertex of a walk from a sensor that is a surface, `begun` (walk.h): number `walk`, at
 * that place; weight: of the step to it. */
void imp__meter_vertex(struct imp_depth *d, const struct imp_walk *begun, int walk,
                       double *weight);

/* Vertices of a material that are made in lanes (lanes_vertex.c), on one shape or several. */
struct imp_bin {
    int medium;  /* they are collisions in it; -1: they lie on surfaces */
    bool sealed; /* ... and no light sample leaves it (scene/sealed.h) */
    const struct imp_shape *shape; /* the one, or one of them */
    const struct imp_bsdf *bsdf;
    const struct imp_shape_lanes *surface; /* of the one; NULL: point by point */
    const struct imp_bsdf_lanes *kernel;   /* NULL: lane by lane (lone_kernel.c) */
    uint64_t derivative;                   /* as of struct imp_dirs */
    bool plain;   /* its inputs are the constants `in`, without a kernel `each` */
    bool even;    /* it sends the same to all who see one side of it */
    bool spectra; /* where walks carry wavelengths: all are plain spectra */
    bool
        texels; /* in colours: those that are not plain are textures with a form in lanes */
    union {
        struct imp_wide_color in[IMP_INPUTS_MAX];
        imp_spec each[IMP_INPUTS_MAX];
    };
};
/* Walks of this tracer may have vertices in lanes. */
bool imp__lanes_fit(const struct imp_tracer *tracer);
/* False: vertices on this shape are made one by one. */
bool imp__shape_in_lanes(const struct imp_tracer *tracer, int shape);
/* Those of the others. */
void imp__shape_bin(const struct imp_tracer *tracer, int shape, struct imp_bin *bin);
/* Those of collisions. False: they are made one by one. */
bool imp__collision_bin(const struct imp_tracer *tracer, int medium, struct imp_bin *bin);
/* Does it send the same to all who see one side of it? Such vertices are in lanes where they are many. */
bool imp__shape_is_even(const struct imp_tracer *tracer, int shape);
/* The vertices of the rays order[n], at places `at` and on. */
void imp__vertices_in_lanes(struct imp_depth *d, const struct imp_bin *bin,
                            const int32_t *order, int n, int at);

#endif

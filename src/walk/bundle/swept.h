/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks of a bundle that are swept, and not read in another way (imp_tracer.swept_only). In place of records
 * (walk.h) they keep columns: values as of walks whose value counts alone, and of vertices in lanes what
 * the pieces of a sweep are made of (walk/core/pieces.h). Where a kind has its derivatives in lanes these are
 * computed with the vertex, for all of the lanes; else when it is swept. Vertices that are made one by one
 * are recorded. Pieces go to the sink walk by walk, in the order in which a record is swept. */
#ifndef IMP_WALK_BUNDLE_SWEPT_H
#define IMP_WALK_BUNDLE_SWEPT_H

#include "lanes_record.h"

/* Directions of vertices, as decided, and inputs of their material: what its derivatives are computed of. */
struct imp_swept_dirs {
    imp_wide3 wo, wi, light;
    imp_wide_lobe lobe;
    struct imp_wide_color lit; /* light_e light_w */
    imp_wide scale;
    imp_spec in[]; /* [lanes][n_in] */
};
/* Where they are, for textures. */
struct imp_swept_place {
    imp_wide uv[2];
    imp_wide3 p;
    int32_t shape[IMP_WIDE_LANES], prim[IMP_WIDE_LANES];
};
/* Light samples, or the sky that is met: what pieces of emitters are made of. */
struct imp_swept_light {
    int32_t emitter[IMP_WIDE_LANES], prim[IMP_WIDE_LANES];
    imp_wide uv[2], dist, cos_light, weight;
    imp_wide3 d, p;
    struct imp_wide_color f;
};

/* Vertices of one material in lanes, as far as active numbers enter there, or, without a material, the sky
 * that is met. */
struct imp_swept_lanes {
    const struct imp_bsdf *bsdf; /* NULL: the sky */
    unsigned lit, on; /* lanes whose light is seen, which shadow rays tell; which go on */
    /* Derivatives of B and of w by the active inputs (bit j: input j) and by luminances of such, one behind
     * the other [colors]; or what those by all inputs are computed of, else NULL. */
    uint64_t inputs;
    imp_wide *by_light, *by_step;
    struct imp_swept_dirs *dirs;
    struct imp_wide_texels
        *texels; /* of inputs that are textures, if they have this form */
    struct imp_swept_place *place; /* NULL: all inputs are constants, or have texels */
    bool numbers; /* inputs with derivatives have them by numbers of the same colours */
    struct imp_swept_light *light; /* NULL: no emitter counts */
};

/* The vertices of a depth, by their places among its values. */
enum { IMP_SWEPT_ALONE = -1, IMP_SWEPT_SKY = -2 };
struct imp_swept_depth {
    struct imp_swept_depth *next;
    const struct imp_bundle_values *values;
    int32_t *place; /* [walks] of the walk's vertex; -1: it has none there */
    /* A vertex in lanes: struct imp_swept_lanes and its lane; else its record, or those of the sky,
     * and which of the two. NULL: nothing goes on there, or no number is active. */
    void **of;
    int8_t *lane;
};

struct imp_swept_walk {
    struct imp_reduced_ops ops; /* first */
    const struct imp_bundle *bundle;
    int number;
};
struct imp_swept {
    struct imp_swept_depth *first, *last;
    int32_t *count; /* [walks] vertices */
    struct imp_swept_walk *walks;
    struct imp_swept_lanes nothing; /* vertices that no active number enters */
    bool lights;                    /* some emitter is active */
};

/* ---- While walks are made (swept.c, lanes_swept.c) ---- */

/* Can the walks of this tracer be kept so? They fit a bundle. */
bool imp__swept_fits(const struct imp_tracer *tracer);
/* False: no memory. */
bool imp__swept_create(struct imp_arena *arena, struct imp_bundle *bundle,
                       struct imp_swept *out);
/* Another depth, with room for n vertices. False: no memory. */
bool imp__swept_deeper(struct imp_arena *arena, struct imp_bundle *bundle, size_t n,
                       const struct imp_bundle_values *values);
/* The record v of the vertex of a walk at this place; kind: alone, or the sky. Without active numbers it
 * is counted, and not kept. */
void imp__swept_alone(struct imp_bundle *bundle, int walk, int at, int8_t kind,
                      struct imp_vertex *v);
/* Vertices in lanes. Where memory is short arena->failed says so, and the bundle is given up. */
void imp__lanes_keep(struct imp_depth *d, const struct imp_bin *bin,
                     const struct imp_lanes_vertices *v, const struct imp_lanes_lit *lit,
                     const struct imp_lanes_step *step);
/* The sky that the rays order[n] of directions wi meet, with these MIS weights, at places `at` and on. */
void imp__lanes_keep_sky(struct imp_depth *d, const int32_t *order, int n, int at,
                         int light, const imp_wide3 *wi, const imp_wide *weight);
/* What became of the light samples of the depth. */
void imp__swept_connect(const struct imp_bundle *bundle,
                        const struct imp_shadows *shadows, const bool *hidden);

/* ---- Then (swept_sweep.c): the members of struct imp_reduced_ops ---- */

void imp__swept_sweep(const struct imp_tracer *tracer, const struct imp_walk *walk,
                      imp_spec adjoint, struct imp_sink *sink);
void imp__swept_both(const struct imp_tracer *tracer, const struct imp_walk *walk,
                     imp_spec adjoint, imp_spec ratio, const struct imp_sink_pair *to);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Loader of problems of bent rays (docs/bend.md): bend_load.c reads the file, and
 * one file reads each element. */
#ifndef IMP_FORMAT_BEND_LOAD_H
#define IMP_FORMAT_BEND_LOAD_H

#include "bend/bend_problem.h"
#include "scene/scene.h"

struct imp__bendfile_frame {
    imp_v3 o, s, t, n;
}; /* of a bundle: z along its rays */

struct imp__bendfile {
    imp_context *ctx;
    struct imp_scene *scene; /* of the tree and the search list; never built */
    imp_bend *bend;
    imp_field *truth; /* the field that `from_truth` data are traced through */
    struct imp_bend_options options;
    struct imp_dispersion dispersion;
    bool dispersive;
    struct imp_bend_surface *surfaces;
    size_t n_surfaces, cap_surfaces;
    struct imp_bend_tap taps[16];
    size_t n_taps;
    struct imp__bendfile_frame *frames; /* [bundles] */
    struct imp_node **nodes;            /* [bundles] the <rays> it comes from */
    size_t cap_frames, cap_nodes;
};

static inline imp_v3 imp__bendfile_point(const struct imp__bendfile_frame *f, imp_v3 p)
{
    return f->o + f->s * p[0] + f->t * p[1] + f->n * p[2];
}
static inline imp_v3 imp__bendfile_direction(const struct imp__bendfile_frame *f,
                                             imp_v3 d)
{
    return f->s * d[0] + f->t * d[1] + f->n * d[2];
}

/* A <volume>: grid, radial, a file or a profile. */
enum imp_status imp__bendfile_volume(struct imp__bendfile *l, struct imp_node *node,
                                     imp_field **out);
/* A distance field that the bend keeps. */
enum imp_status imp__bendfile_sdf(struct imp__bendfile *l, struct imp_node *parent,
                                  const imp_field **out);
enum imp_status imp__bendfile_medium(struct imp__bendfile *l, struct imp_node *node);
/* Bounds, holds and smoothness: when the bend is there. */
enum imp_status imp__bendfile_rules(struct imp__bendfile *l, struct imp_node *node);
enum imp_status imp__bendfile_rays(struct imp__bendfile *l, struct imp_node *node);
/* A <surface>: for `group` in its frame. */
enum imp_status imp__bendfile_surface(struct imp__bendfile *l, struct imp_node *node,
                                      const struct imp__bendfile_frame *f, int group);
enum imp_status imp__bendfile_target(struct imp__bendfile *l, struct imp_node *node,
                                     const struct imp__bendfile_frame *f, int bundle);
/* Put the node's file, line and column before the message of a failed call. */
enum imp_status imp__bendfile_placed(struct imp__bendfile *l, struct imp_node *node,
                                     enum imp_status st);
/* A float property in lo .. hi; required if fallback is NaN. */
enum imp_status imp__bendfile_number(struct imp__bendfile *l, struct imp_node *node,
                                     const char *name, double fallback, double lo,
                                     double hi, double *out);

#endif

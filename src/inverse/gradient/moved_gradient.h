/* SPDX-License-Identifier: Apache-2.0
 *
 * Gradients by poses (scene/pose.h): what a walk of a fixed adjoint gives to them, and the draws
 * from edges that complete it (walk/moved/boundary.h). A replicate of n walks of a pixel has n
 * draws of each kind, of scattered light four times as many, which lie anywhere on the film: pixels
 * only number them, and are strata along the list of edges. Draws of different replicates are
 * independent of each other and of the walks, so standard errors are those of the walks' sums. */
#ifndef IMP_INVERSE_MOVED_GRADIENT_H
#define IMP_INVERSE_MOVED_GRADIENT_H

#include "film/film_light.h"
#include "inverse/estimate/replicates.h"
#include "walk/moved/boundary.h"

struct imp__moved_gradient {
    const struct imp_tracer *tracer;
    const float *seed; /* the adjoint image, [crop_h][crop_w][channels] */
    struct imp_splat_scale scale;
    struct imp__moves moves;
    struct imp__edges edges;
    struct imp__boundary boundary;
    const struct imp_pose **pose; /* [moves.n_movers] that a mover is */
};

/* Is some pose active? */
bool imp__moved_wanted(const struct imp_problem *p);
/* For walks of this tracer, spp a pixel, which stays where it is. IMP_E_UNSUPPORTED, by name, as
 * imp__boundary_begin. Ended by imp__moved_end, also after a failure. */
enum imp_status imp__moved_begin(const struct imp_problem *p,
                                 const struct imp_tracer *tracer, const float *seed,
                                 int spp, struct imp__moved_gradient *out);
void imp__moved_end(struct imp__moved_gradient *m);

/* A walk with its adjoint. False: no memory. */
bool imp__moved_walk(const struct imp__moved_gradient *m, struct imp_arena *arena,
                     const struct imp_walk *walk, imp_spec adjoint,
                     struct imp_sink *sink);
/* The draws of replicate b of pixel (x, y), of plan.n walks. False: no memory. */
bool imp__moved_draws(const struct imp__moved_gradient *m, struct imp_arena *arena,
                      struct imp__replicates plan, int x, int y, int b,
                      struct imp_sink *sink);

#endif

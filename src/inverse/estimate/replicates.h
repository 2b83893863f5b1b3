/* SPDX-License-Identifier: Apache-2.0
 *
 * Replicates: the groups into which the samples of a pixel are cut, and who uses them. */
#ifndef IMP_INVERSE_REPLICATES_H
#define IMP_INVERSE_REPLICATES_H

#include "inverse/problem/problem.h"

#define IMP_BATCH_MAX        64 /* walks of a pixel kept at once (quadratic losses) */
#define IMP_BATCHES_PER_ITEM 8
#define IMP_WIDE_REPLICATES  8 /* most of a Gauss-Newton matrix through wide filters */

/* R replicates of n samples; spp = R n >= the given spp. R = 1 where spp < 4: then
 * neighbouring pixels are paired, which makes the variance an upper bound. And where a replicate
 * of two sets has its own error (`lone`).
 *
 * The samples of a replicate are m sets, independent of each other; what leaves one out
 * leaves out a set. Independent samples are sets of one. Sets of points have n/m samples,
 * rounded up or down, and their estimates count the same. */
struct imp__replicates {
    int n, R, chunks; /* chunks: work items per tile, each with at least 2 replicates */
    int m;
    int stride; /* from the number of a set's first sample to that of the next set */
    bool lone;  /* R = 1, m = 2, and errors are those of imp__replicate_errors */
};
/* The plan for independent samples. */
struct imp__replicates imp__replicates_plan(int spp, int batch_max);
/* Losses of scenes with media have independent points where neither the run nor the sampler
 * of a target's sensor names a kind: most random numbers of such walks are no points, and
 * fewer pairs of sets than of samples cost more than the points gain. */
void imp__points_of_losses(const struct imp_problem *p, struct imp_run *run);
/* So have the losses and normal equations of Levenberg-Marquardt in all scenes: it ends where
 * its gradient is within its noise, of which few sets give too poor an estimate. */
void imp__points_of_normal(const struct imp_problem *p, struct imp_run *run);
/* Those of walks that are recorded, from the sensors k with sensors[k]. If for losses, they are
 * independent where nobody chose: sets for losses are too few for errors of means and regions. */
enum imp_points imp__points_recorded(const struct imp_scene *scene,
                                     const struct imp_run *run, const uint8_t *sensors,
                                     bool losses);
/* The plan of imp_problem_objective. */
struct imp__replicates imp__replicates_loss(const struct imp_problem *p,
                                            const struct imp__target *target,
                                            const struct imp_run *run);
/* The plan of imp_problem_reverse, which has no target, and of losses that are compared with others
 * of the same walks: those of recorded walks, or of Gauss-Newton matrices. */
struct imp__replicates imp__replicates_of(const struct imp_scene *scene,
                                          const struct imp__target *target,
                                          const struct imp_run *run);
/* Those of Gauss-Newton matrices: the first are those of imp__replicates_of, and `rounds` times
 * as many follow. */
struct imp__replicates imp__replicates_normal(const struct imp_scene *scene,
                                              const struct imp__target *target,
                                              const struct imp_run *run, int rounds);
/* The same as pictures, where pixels share walks, or draws from edges. */
struct imp__replicates imp__replicates_pictures(const struct imp_scene *scene,
                                                const struct imp__target *target,
                                                const struct imp_run *run, int rounds);
/* IMP_E_ARG if the tracer has recorded walks, and not all of these. */
enum imp_status imp__replicates_kept(const struct imp_tracer *tracer,
                                     struct imp__replicates r);
/* Replicates b0 <= b < b1 of chunk k. */
static inline int imp__replicates_begin(struct imp__replicates r, int k)
{
    return (int)((int64_t)r.R * k / r.chunks);
}
/* Set s of a replicate has its samples from this one on; s = m: its end. */
static inline int imp__replicates_set(struct imp__replicates r, int s)
{
    return (int)((int64_t)r.n * s / r.m);
}
/* Number of the first sample of set s of replicate b, as of imp__walk_trace. */
static inline int64_t imp__replicates_first(struct imp__replicates r, int b, int s)
{
    return ((int64_t)b * r.m + s) * r.stride;
}

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Gradients by poses (scene/pose.h): what a walk gives to them with its adjoint, and the draws
 * from edges that complete it (walk/moved/boundary.h). A replicate of n walks of a pixel has n
 * draws of each kind, of scattered light four times as many, and of a loss as many as pay
 * (imp__moved_share). They lie anywhere on the film: those of a replicate in all pixels are equal
 * parts of the list of edges, of which a pixel has the same in every replicate, or none. Draws of
 * different replicates are independent of each other and of the walks. With a fixed adjoint, standard
 * errors are those of the walks' sums; those of a loss are in moved_adjoint.h. */
#ifndef IMP_INVERSE_MOVED_GRADIENT_H
#define IMP_INVERSE_MOVED_GRADIENT_H

#include "inverse/estimate/replicates.h"
#include "moved_adjoint.h"
#include "walk/moved/boundary.h"

struct imp__moved_gradient {
    const struct imp_tracer *tracer;
    struct imp_splat_scale scale;
    struct imp__moves moves;
    struct imp__edges edges;
    struct imp__boundary boundary;
    const struct imp_pose **pose;      /* [moves.n_movers] that a mover is */
    bool alone;                        /* no other number of the problem is active */
    struct imp__moved_adjoint adjoint; /* of gradients in reverse mode; else none */
    int64_t first;                     /* number of the first draw of each kind */
    double walks;                      /* of the run */
    double ahead; /* cost of what comes before them (imp__moved_share) */
    double draws[IMP_BOUNDARY_KINDS]; /* for each walk */
};

/* For walks of this tracer, which stays where it is. IMP_E_UNSUPPORTED, by name, as
 * imp__boundary_begin. Ended by imp__moved_end, also after a failure. */
enum imp_status imp__moved_begin(const struct imp_problem *p,
                                 const struct imp_tracer *tracer,
                                 struct imp__moved_gradient *out);
void imp__moved_end(struct imp__moved_gradient *m);
/* The pilot of the draws (imp__boundary_learn), for spp walks a pixel, 0: those of the sensor: by the
 * adjoint, where there is one; else all light counts alike. Once, before the first draw. */
#define IMP_MOVED_PILOT                                                                  \
    8 /* spp of pictures, however many walks their parts and passes have */
enum imp_status imp__moved_learn(struct imp__moved_gradient *m, int spp);
/* IMP_OK, or what imp__moved_begin and imp__problem_tracer say of the scene as it is: an object that
 * passes through another, edges that tear. */
enum imp_status imp__moved_possible(struct imp_problem *p, const struct imp_run *run);
/* Behind the pilot, of a loss: as many draws of each kind as make the variance of its gradient least for
 * the time that they and the walks take. Else draws are imp__moved_times. */
void imp__moved_share(struct imp__moved_gradient *m);
/* `first` of a target's draws, which are not those of another. */
static inline int64_t imp__moved_first(size_t target) { return (int64_t)target << 40; }

/* Draws of a kind for each walk unless they are shared out, and the number of those of one sample of all kinds. */
extern const int imp__moved_times[IMP_BOUNDARY_KINDS];
/* From adjoints of velocities, bar [moves.n], which it overwrites, to the numbers of parameters, times
 * `lane` of the sink's channels. */
void imp__moved_numbers(const struct imp__moved_gradient *m, double *bar, imp_spec lane,
                        struct imp_sink *sink);

/* Has a walk anything to give to bar? */
static inline bool imp__moved_touched(const struct imp__moved_gradient *m,
                                      const struct imp_walk *walk)
{
    return imp__moved_touches(m->tracer, &m->moves, walk);
}
/* A walk with an adjoint of its channels, to bar [moves.n]. False: no memory. */
bool imp__moved_walk(const struct imp__moved_gradient *m, struct imp_arena *arena,
                     const struct imp_walk *walk, imp_spec adjoint, double *bar);

/* Numbers of an item's contrasts: inside of walks, and at edges by two halves of the draws,
 * [3][moves.n][adjoint.contrasts]; 0 with a fixed adjoint. */
static inline size_t imp__moved_contrasts(const struct imp__moved_gradient *m)
{
    return m && m->adjoint.pairs > 0 ? 3 * (size_t)m->adjoint.contrasts * m->moves.n : 0;
}
/* Replicate b of pixel (x, y), of plan.n walks, which gave `inside` [IMP_MOVED_BARS][moves.n], the
 * first row of which is theirs: adds that and, if `draws`, its draws to the sink, and to the contrasts (NULL: a
 * fixed adjoint). The other rows are 0 before, all are behind it. False: no memory. */
#define IMP_MOVED_BARS 3
bool imp__moved_replicate(const struct imp__moved_gradient *m, struct imp_arena *arena,
                          struct imp__replicates plan, int x, int y, int b, bool draws,
                          double *inside, double *contrasts, struct imp_sink *sink);
/* Adds the draws of replicate b of pixel (x, y) to bar [moves.n], of several replicates; velocity
 * [moves.n] is 0 before and after. False: no memory. */
bool imp__moved_draws(const struct imp__moved_gradient *m, struct imp_arena *arena,
                      struct imp__replicates plan, int x, int y, int b, double *bar,
                      double *velocity);
/* The contrasts of all items: what they add to the variance at fixed adjoints,
 * own [active->n], to more [active->n]. IMP_E_NOMEM. */
enum imp_status imp__moved_variance(const struct imp__moved_gradient *m,
                                    const struct imp_active *active,
                                    const double *contrasts, const double *own,
                                    double *more);

#endif

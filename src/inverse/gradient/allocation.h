/* SPDX-License-Identifier: Apache-2.0
 *
 * Samples where they count: between the evaluations of a search, the tiles of its targets get
 * samples by their share of the gradient's variance. With v_i the variance that tile i has at
 * one sample a pixel, and c_i the cost of one there,
 *
 *     sum v_i / n_i   is least for   n_i ~ (v_i / c_i)^1/2,   given sum c_i n_i
 *
 * (Neyman, J. R. Stat. Soc. 97, 1934), between a floor, so that what a tile has not shown yet is
 * found, and a cap. The cost is that of the given samples. v and c come from evaluations
 * before, whose walks are others: every tile's estimate is unbiased whatever its samples, and so
 * are sums over tiles, and their standard errors. */
#ifndef IMP_INVERSE_ALLOCATION_H
#define IMP_INVERSE_ALLOCATION_H

#include "base/fixed_sum.h"
#include "inverse/estimate/replicates.h"
#include "search/metric.h"

/* Numbers of an item: the gradient's variance, the loss's, and rays. */
enum { IMP_ALLOCATION_SEES = 3 };

struct imp__allocation {
    imp_context *ctx;
    size_t n;  /* tiles, of all targets and their parts that are cut into tiles */
    int parts; /* most work items of a tile */
    int *even; /* [n] samples per pixel as given */
    int *spp;  /* [n] of the next evaluation */
    /* [n] share of the variance, [n] cost, both of one sample a pixel; how many evaluations
     * these come from. All that is kept between evaluations, and that checkpoints hold. */
    double *state;
    /* The variance of the evaluation at work is measured by this; NULL: it is not. */
    const struct imp__metric *metric;
    bool measured;   /* the last evaluation was */
    imp_fixed *seen; /* [n][parts][2] variance and vertices of an item: bits of doubles */
    size_t next;     /* first tile of the next job of the evaluation at work */
};

/* n = 0: no target has tiles that samples may be allocated to. */
enum imp_status imp__allocation_create(struct imp_problem *p, const struct imp_run *run,
                                       struct imp__allocation *a);
/* Begins a run with other samples, or the first: the state stays. */
enum imp_status imp__allocation_again(struct imp_problem *p, const struct imp_run *run,
                                      struct imp__allocation *a);
void imp__allocation_destroy(struct imp__allocation *a);
static inline size_t imp__allocation_numbers(const struct imp__allocation *a)
{
    return 2 * a->n + 1;
}

/* May the samples of a target be allocated? Where pixels share walks, or walks are kept, they
 * may not; nor where the loss is not quadratic and has a bias that grows with fewer. */
bool imp__allocation_allowed(const struct imp__target *target,
                             const struct imp_tracer *tracer);
/* Tiles of the next job; the first of them. */
size_t imp__allocation_take(struct imp__allocation *a, size_t tiles);
/* Item `part` of a tile is done, by any thread. */
void imp__allocation_see(struct imp__allocation *a, size_t tile, size_t part,
                         const double seen[IMP_ALLOCATION_SEES]);
/* Shares between the ranks of a team what they have seen in `tiles` tiles. */
enum imp_status imp__allocation_share(struct imp__allocation *a, size_t first,
                                      size_t tiles);
/* Between evaluations: spp from what was seen. */
void imp__allocation_update(struct imp__allocation *a);
/* spp from the state, as a checkpoint has it. */
void imp__allocation_place(struct imp__allocation *a);

#endif

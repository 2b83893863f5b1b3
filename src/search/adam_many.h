/* SPDX-License-Identifier: Apache-2.0
 *
 * Adam for more variables than have directions of their own (textures): the search of
 * adam.c along the axes, with one pace for all, in 40 bytes a variable, gradient
 * included. The iterate is x, in double as the goal wants it; what is behind it are
 * floats, two in the place of a double of the search's arrays. */
#ifndef IMP_SEARCH_ADAM_MANY_H
#define IMP_SEARCH_ADAM_MANY_H

#include "optimize.h"
#include <math.h>

/* Constants of both searches, explained in adam.c. */
#define IMP_ADAM_BETA2   0.99
#define IMP_ADAM_WINDOW  20
#define IMP_ADAM_STALLED 0.5
#define IMP_ADAM_COOLING 1.5
#define IMP_ADAM_FELL    2
#define IMP_ADAM_FAR     4
#define IMP_ADAM_HALVES  6 /* of a step that leads where nothing can be evaluated */
/* Steps after which second moments are known well enough to measure noise in their units, */
#define IMP_ADAM_KNOWN 4
/* and what they count as at least, over their mean: some have hardly been seen yet. */
#define IMP_ADAM_LEAST 0.01

static inline double imp__adam_momentum(const struct imp__opt_options *options,
                                        bool settles)
{
    if (options->momentum > 0) return options->momentum;
    return settles ? IMP_ADAM_MOMENTUM_QUIET : IMP_ADAM_MOMENTUM;
}
/* What the rate is multiplied by in iteration i, which counts those of earlier searches whose
 * history this one has: it begins near its end (docs/fitting.md). */
static inline double imp__adam_fall(int i, bool settles)
{
    return settles ? 1 / sqrt(1 + i / (double)IMP_ADAM_FALLING_QUIET) : 1;
}
static inline bool imp__adam_is_many(const struct imp__goal *goal)
{
    return goal->spans != NULL;
}
/* adam.c: x is another, before the first iteration of few variables. */
void imp__adam_moved(struct imp__search *s);
enum imp_status imp__adam_many_init(struct imp__search *s);
enum imp_status imp__adam_many_run(const struct imp__goal *goal,
                                   const struct imp__opt_options *options,
                                   struct imp__search *s);
/* x: the answer. The search cannot go on: only its start is kept. */
void imp__adam_many_settle(struct imp__search *s);
/* Where the search began, and its answer so far. */
double imp__adam_many_start(const struct imp__search *s, size_t k);
double imp__adam_many_answer(const struct imp__search *s, size_t k);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Optimisers of noisy objectives. Input is a goal: values, gradients and their standard
 * errors, bounds and scales. Nothing here depends on light transport.
 *
 * The whole state between two iterations is in struct imp__search, in numbers that a
 * checkpoint can hold: a search continued from a copy has the same bits as one that was
 * never stopped. */
#ifndef IMP_SEARCH_OPTIMIZE_H
#define IMP_SEARCH_OPTIMIZE_H

#include "base/context.h"
#include "metric.h"
#include "sparse_normal.h"

#define IMP_DENSE_MAX     256  /* most variables of methods that hold [n][n] matrices */
#define IMP_SEARCH_FEW    1024 /* variables, above which Adam's memory counts */
#define IMP_ADAM_MOMENTUM 0.9
/* For variables whose scale is their whole range, where gradients have little noise: */
#define IMP_ADAM_MOMENTUM_QUIET 0.5
#define IMP_ADAM_FALLING_QUIET  10
#define IMP_TRAIL_MAX           64 /* variables, up to which a search keeps where it was */

/* Jackknife groups: parts of the walks that are left out in turn to estimate the noise of
 * a matrix. */
enum { IMP_DEVIATIONS = 8 };

/* Normal equations at one x, from one set of random numbers. */
struct imp__normal {
    double *H;          /* [n][n] Gauss-Newton matrix, unbiased; may be indefinite */
    double *H_same;     /* [n][n] biased upwards, positive semi-definite: damps H */
    double *H_prior;    /* [n][n] the part of H and H_same that is not from data; exact */
    double *g;          /* [n] gradient */
    double *cov_g;      /* [n][n] its covariance by Monte Carlo, too large by */
    double *cov_excess; /* [n][n] this: unbiased, noisy, less than 2/3 of cov_g */
    double *H_meas;     /* [n][n] its covariance by noise of the data */
    /* [IMP_DEVIATIONS][n][n] of the data's part of H: their squares add up to its variance, in
     * every combination; or NULL. */
    double *deviations;
    struct imp_estimate f; /* of the same walks as eval's */
    /* The same by all pairs of walks, which has less noise; value NAN: there is none. */
    struct imp_estimate pairs;
    double chi2; /* sum of weighted squared residuals, Monte Carlo's part taken off */
    double n_residuals;
    bool noise_known; /* H_meas is filled; else the noise is estimated from chi2 */
};

struct imp__search;

/* Variables [end of the span before, end) with one range and scale. */
struct imp__span {
    size_t end;
    double lo, hi, scale;
    bool by_start; /* a start that is larger than `scale` is the variable's scale */
    bool settles;  /* `scale` is the whole range: the variable has no farther to go */
    bool smooth;   /* of a mesh: imp__goal.smooth */
};

struct imp__goal {
    imp_context *ctx;
    size_t n;
    const double *lo, *hi; /* [n] bounds, may be infinite */
    const double *scale;   /* [n] > 0: a large change of each variable */
    const bool *settles;   /* [n] is that its whole range? NULL: of none */
    /* Adam of many variables, which lo, hi and scale have no memory for (NULL): the same
     * in spans; a search then keeps its iterate in x, and imp__search_answer is its
     * answer. NULL: lo, hi and scale are there. */
    const struct imp__span *spans;
    size_t n_spans;
    /* Where spans are smooth: takes derivatives by x to those by other variables u, or a step of u
     * to one of x, in place, both linear; v [n]. Numbers of spans that are not smooth stay. In a
     * smooth span all numbers have the largest second moment of one of them (Nicolet, Jacobson, Jakob
     * 2021), so that a step of u has the direction of the mean derivative. NULL: none is smooth. */
    void (*smooth)(double *v, bool step, void *payload);
    uint64_t seed;
    /* Value and gradient at x (inside the bounds) from the random numbers of `seed`;
     * equal seeds are common random numbers. g and g_se may be NULL. */
    enum imp_status (*eval)(const double *x, uint64_t seed, struct imp_estimate *f,
                            double *g, double *g_se, void *payload);
    /* The next eval measures the variance of its gradient by this, which lives until it
     * returns: what it spends its samples on may follow. NULL: not wanted. */
    void (*measure)(const struct imp__metric *metric, void *payload);
    /* For Levenberg-Marquardt and covariances: sets all of `out`, from `rounds` >= 1 times
     * the samples of eval. NULL: not offered. */
    enum imp_status (*normal)(const double *x, uint64_t seed, int rounds,
                              struct imp__normal *out, void *payload);
    /* Where `normal` is NULL, the same by products with the matrix, of `rounds` times the
     * samples of eval. The caller ends it by imp__sparse_normal_destroy. NULL: not offered. */
    enum imp_status (*sparse)(const double *x, uint64_t seed, int rounds,
                              struct imp__sparse_normal *out, void *payload);
    /* Levenberg-Marquardt: from here on eval and normal take fewer samples, or the full
     * number. A search that ends with fewer has to be tested (imp__covariance) and may
     * have to be continued (imp__search_refine). NULL: they always take the full
     * number. */
    void (*coarsen)(bool fewer, void *payload);
    /* For methods with common random numbers: those of `seed` are drawn at x, and are the
     * ones of all evaluations with this seed until the next draw. NULL: evaluations draw
     * their own. */
    enum imp_status (*draw)(const double *x, uint64_t seed, void *payload);
    /* Was the last evaluation too far from where its numbers were drawn? NULL: never. */
    bool (*is_stale)(void *payload);
    /* Can the objective be evaluated at x, which is inside the bounds? Adam's steps are halved until
     * it can; where it cannot, eval without a gradient is infinite, and with one it is an error. NULL:
     * everywhere. */
    bool (*possible)(const double *x, void *payload);
    /* Called after each complete iteration, when `search` may be copied: report progress,
     * write a checkpoint. Returns IMP_CANCELLED to stop. May be NULL. */
    enum imp_status (*iterated)(const struct imp__search *search, void *payload);
    void *payload;
};

struct imp__opt_options {
    int max_iterations;   /* > 0 */
    double learning_rate; /* Adam: fraction of the scale */
    double tolerance;     /* fraction of the scale */
    /* Adam: what stays of the mean gradient, below 1; 0: IMP_ADAM_MOMENTUM. */
    double momentum;
    /* Adam: gradients have little noise, and variables that settle (imp__span) arrive soon.
     * Their rate is (1 + i/IMP_ADAM_FALLING_QUIET)^-1/2 of the first in iteration i = 0, 1, ... of
     * the history, and their momentum, if it is 0 above, IMP_ADAM_MOMENTUM_QUIET. */
    bool quiet;
};

/* scalar[IMP_SEARCH_AVERAGED], public: number of iterates whose average x is. */
enum { IMP_SEARCH_ARRAYS = 11, IMP_SEARCH_SCALARS = 12, IMP_SEARCH_AVERAGED = 11 };

/* Why a search has finished; a checkpoint holds the number. */
enum imp__finish {
    IMP_FINISH_NOT,
    IMP_FINISH_STEPS,   /* steps stay below the tolerance */
    IMP_FINISH_NOISE,   /* the gradient is within its noise */
    IMP_FINISH_LOWEST,  /* no step lowers the objective further */
    IMP_FINISH_BOUNDED, /* no variable has an effect inside its bounds */
    IMP_FINISH_KINDS
};

struct imp__search {
    imp_context *ctx;
    enum imp_optimizer kind;
    size_t n;
    int iteration;             /* completed */
    enum imp__finish finished; /* converged: more iterations would change nothing */
    const char *reason;        /* why it stopped, a constant string */
    double *start;             /* [n] where it began; NULL: see imp__search_start */
    double *x;                 /* [n] the best estimate so far, inside the bounds */
    size_t n_history, cap_history, cap_history_se, cap_history_x;
    double *history, *history_se;
    double *history_x; /* [n_history][n] where these were; see imp__search_trail */
    /* [n_goal] the goal's state from one iteration to the next, in checkpoints. The goal puts
     * it here before a checkpoint is written, and takes it after one is read. */
    double *goal_numbers;
    size_t n_goal;
    /* Private to the optimiser. */
    double *array[IMP_SEARCH_ARRAYS];
    size_t array_n[IMP_SEARCH_ARRAYS], array_cap[IMP_SEARCH_ARRAYS];
    double scalar[IMP_SEARCH_SCALARS];
};

/* x0 is moved into the bounds. */
enum imp_status imp__search_create(const struct imp__goal *goal, enum imp_optimizer kind,
                                   const struct imp__opt_options *options,
                                   const double *x0, struct imp__search **out);
void imp__search_destroy(struct imp__search *search);

/* Iterate until finished. @return IMP_OK; IMP_CANCELLED with the search where its last
 * complete iteration left it; a failure of the goal. */
enum imp_status imp__optimize(const struct imp__goal *goal,
                              const struct imp__opt_options *options,
                              struct imp__search *search);

/* Is the search one of Levenberg and Marquardt that has ended with fewer samples than
 * given? It goes on from where it is, with these. */
bool imp__search_is_coarse(const struct imp__search *search);
void imp__search_refine(struct imp__search *search);

/* Sets the reason too. */
void imp__search_finish(struct imp__search *search, enum imp__finish why);
/* Variable k at the start of the search, and in its answer so far. */
double imp__search_start(const struct imp__search *search, size_t k);
double imp__search_answer(const struct imp__search *search, size_t k);
/* x: the answer; with many variables, the memory of the search is released. */
void imp__search_settle(struct imp__search *search);

/* For Adam, before its first iteration: go on from x, while `start` stays. */
void imp__search_move(const struct imp__goal *goal, struct imp__search *search,
                      const double *x);
/* Its iterations and their losses follow those of `from`, which has none then; history_x
 * is the caller's to make. */
void imp__search_take_history(struct imp__search *search, struct imp__search *from);

/* Numbers of old variables -> of new ones: how a change of the old is one of the new. */
struct imp__carry {
    enum imp_status (*map)(const double *in, double *out, void *payload);
    void *payload;
    double share; /* of an old variable's derivative that a new one has */
};
/* A search that has not begun takes over what `old` learnt about other variables: Adam's
 * moments. @return IMP_OK also for methods that keep nothing. */
enum imp_status imp__search_carry(const struct imp__search *old,
                                  const struct imp__carry *carry, struct imp__search *s);

/* ---- Between the optimisers' files --------------------------------------------- */

struct imp__opt_kind {
    enum imp_status (*init)(const struct imp__goal *goal,
                            const struct imp__opt_options *options,
                            struct imp__search *search);
    enum imp_status (*run)(const struct imp__goal *goal,
                           const struct imp__opt_options *options,
                           struct imp__search *search);
    enum imp_status (*carry)(const struct imp__search *old,
                             const struct imp__carry *carry,
                             struct imp__search *s); /* NULL: nothing to carry */
};
extern const struct imp__opt_kind imp__opt_adam, imp__opt_lm, imp__opt_nlopt;

/* Room for n numbers in array k; new ones are zero. _exact: an array that will not grow,
 * with no room to spare. */
enum imp_status imp__search_exact(struct imp__search *s, int k, size_t n);
enum imp_status imp__search_array(struct imp__search *s, int k, size_t n);
/* The objective f at x [n]. */
enum imp_status imp__search_log(struct imp__search *s, struct imp_estimate f,
                                const double *x);
/* iteration++, and goal->iterated. */
enum imp_status imp__search_iterated(const struct imp__goal *goal, struct imp__search *s);
/* Random numbers of iteration i, purpose k: independent of each other. */
uint64_t imp__search_seed(const struct imp__goal *goal, int i, int k);

enum imp_status imp__normal_create(imp_context *ctx, size_t n, bool deviate,
                                   struct imp__normal *out);
void imp__normal_destroy(imp_context *ctx, struct imp__normal *normal);

/* Does it keep where it was? With few variables, unless they are coarse values of others
 * (fit_levels.c). */
static inline bool imp__search_trails(const struct imp__search *s)
{
    return s->start && s->n <= IMP_TRAIL_MAX;
}
/* Numbers in history_x. */
static inline size_t imp__search_trail(const struct imp__search *s)
{
    return imp__search_trails(s) ? s->n_history * s->n : 0;
}

static inline struct imp__span imp__goal_span(const struct imp__goal *goal, size_t k)
{
    if (goal->lo)
        return (struct imp__span){.end = k + 1,
                                  .lo = goal->lo[k],
                                  .hi = goal->hi[k],
                                  .scale = goal->scale[k],
                                  .settles = goal->settles && goal->settles[k]};
    size_t lo = 0, hi = goal->n_spans - 1;
    while (lo < hi) {
        const size_t middle = (lo + hi) / 2;
        if (k < goal->spans[middle].end) hi = middle;
        else lo = middle + 1;
    }
    return goal->spans[lo];
}

/* Does it stay where it is? Its derivatives are 0. */
static inline bool imp__goal_held(const struct imp__goal *goal, size_t k)
{
    const struct imp__span a = imp__goal_span(goal, k);
    return a.lo == a.hi;
}
/* -1 or 1 if x[k] is at its lower or upper bound, else 0. */
static inline int imp__at_bound(const struct imp__goal *goal, const double *x, size_t k)
{
    const struct imp__span a = imp__goal_span(goal, k);
    return x[k] <= a.lo ? -1 : x[k] >= a.hi ? 1 : 0;
}
static inline double imp__into_bounds(const struct imp__goal *goal, size_t k, double v)
{
    const struct imp__span a = imp__goal_span(goal, k);
    return imp_clamp(v, a.lo, a.hi);
}

#endif

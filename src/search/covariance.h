/* SPDX-License-Identifier: Apache-2.0
 *
 * Uncertainty of a fit: covariance in two parts, intervals, and directions that the data
 * do not determine (docs/estimators.md 15). */
#ifndef IMP_SEARCH_COVARIANCE_H
#define IMP_SEARCH_COVARIANCE_H

#include "optimize.h"

struct imp__uncertainty {
    size_t n;
    double *x;           /* [n] a last Newton step from the x handed in, made with random
                            numbers of its own: the covariances are those of its error */
    double *measurement; /* [n][n] covariance: noise of the data */
    double *monte_carlo; /* [n][n] covariance: noise of the estimator */
    double *G;           /* [n][n] inverse of H in the directions that are determined */
    double condition;    /* of the scaled H; INFINITY if it is singular */
    int n_loose;         /* directions that are not determined */
    bool hidden;     /* one of these may be, to a tenth of its size: the noise is ours */
    double *loosest; /* [n] unit vector, in units of the scales: the worst of them */
    /* The largest step from the end of a search to x, in standard errors; 0: none is known, or
     * the search ended by few samples (at_newton). */
    double step;
    size_t step_of; /* this variable's */
    /* Estimated variance of the data in units of 1/weight; 0: known. */
    double noise_scale;
    struct imp_estimate loss; /* at x, by the same samples; value NAN: not known */
    int rounds;               /* samples taken, in those of an evaluation */
    double own_part;          /* tr(H monte_carlo)/tr(H measurement); NAN: not known */
    bool found;               /* at_newton: false where the search has to go on */
};

/* Samples, in those of an evaluation by the goal. */
struct imp__rounds {
    int most;        /* >= 2 */
    int look;        /* number of calls before: each has walks of its own */
    double searched; /* behind x, where that is an average over a search; 0: it is none */
    bool at_newton;  /* all but the first are taken at the Newton point of the first */
};

/* Evaluate the normal equations at x with fresh random numbers: two rounds, and as many
 * more, up to rounds->most, as bring Monte Carlo's variance below a fifth of the
 * measurement's. Sets value, se, lo95, hi95, at_bound, determined of variables [n].
 *
 * at_newton, where x is the end of a search with fewer samples, and further away: one round
 * at x, the others at its Newton point u. Where the model is linear the gradient at u is 0
 * but for the noise of both, and all are behind the answer; where it is not, those at u are.
 * If the loss at u is higher than at x, x moves half of the way, or less, and a round is taken
 * there. Where it is higher all the way, or there is no u, out->found is false, and nothing
 * else is set.
 *
 * Where x is an average over a search, these samples are a part of all that are behind the
 * answer. If the Newton step is then no longer than its own noise, it is taken by that part
 * only, as the mean of two estimates would be; the errors stated are still those of the
 * whole step, and so an upper bound. */
enum imp_status imp__covariance(const struct imp__goal *goal, const double *x,
                                const struct imp__rounds *rounds,
                                struct imp_fit_variable *variables,
                                struct imp__uncertainty *out);
void imp__uncertainty_destroy(imp_context *ctx, struct imp__uncertainty *u);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Lighting design by finite elements: numbers of the scene for wanted measurements. With
 * J_k what source k measures, t_k its target and r_k = J_k - t_k,
 *
 *     F(x) = 1/2 sum_k w_k r_k^2 + regularisers,   w_k = weight_k / max(|t_k|, or 1)^2
 *
 * One adjoint solution whose sources weigh w_k r_k gives the gradient; one a source gives
 * the rows A_k = dJ_k/dx of Gauss-Newton. In lights J is linear, so A is made once and
 * the search needs no further solution. Links are fixed during a search; then they are
 * refined at the answer and it is searched again. */
#ifndef IMP_INVERSE_DESIGN_H
#define IMP_INVERSE_DESIGN_H

#include "elements/elements.h"
#include "inverse/problem/problem.h"
#include "search/optimize.h"

struct imp__design {
    imp_elements *e;
    struct imp_problem *p;
    struct imp_elements_fit_options o;
    struct imp__goal goal;
    size_t n, goals;
    double *lo, *hi, *scale;   /* [n] */
    uint8_t *light, *material; /* [n_params] */
    double *t, *w, *J, *unit;  /* [goals] targets, weights, measurements, scratch */
    double *A, *J0;            /* [goals][n], [goals]: J = J0 + A x, if linear */
    double *H_prior;           /* [n][n], n <= IMP_DENSE_MAX */
    bool linear;
    int round;
    double deadline_s;
};

/* IMP_CANCELLED by the host or the clock. */
enum imp_status imp__design_stopped(const struct imp__design *d);
/* Set the weights `w` [goals] of the sources. */
enum imp_status imp__design_weigh(struct imp__design *d, const double *w);
/* Measurements of all sources in the present solution. */
enum imp_status imp__design_measure(struct imp__design *d, double *J);
/* d->J at x: from the matrix, or by solving. */
enum imp_status imp__design_at(struct imp__design *d, const double *x);
/* A and J0 of a linear design, whose solution belongs to x. */
enum imp_status imp__design_matrix(struct imp__design *d, const double *x);
/* The sum over the goals at d->J. */
double imp__design_value(const struct imp__design *d);
/* For imp__goal. */
enum imp_status imp__design_eval(const double *x, uint64_t seed, struct imp_estimate *f,
                                 double *g, double *g_se, void *payload);
enum imp_status imp__design_normal(const double *x, uint64_t seed, int rounds,
                                   struct imp__normal *out, void *payload);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * The metric in which a fit's steps are steepest, where changes of a grid are to be smooth
 * over a length l:
 *
 *     M = (I + sum over axes of (l/h)^2 D^T D)^-1,    D first differences, h the cell
 *
 * (the Sobolev gradient: Neuberger, Sobolev Gradients and Differential Equations, 1997;
 * Nicolet, Jacob, Jakob 2021 for meshes). Where data leave a valley of answers, a search by M
 * reaches a smooth one first. Held numbers do not move, and M is the inverse on the others. */
#ifndef IMP_BEND_SOBOLEV_H
#define IMP_BEND_SOBOLEV_H

#include "bend_problem.h"

struct imp__sobolev {
    const imp_bend *b;
    const uint8_t *held; /* [n_theta] */
    double length;       /* l > 0 */
    double *work;        /* [4][n_theta] */
};

/* For the field that `b` has now; b and held outlive it. IMP_E_NOMEM. */
enum imp_status imp__sobolev_create(const imp_bend *b, const uint8_t *held, double length,
                                    struct imp__sobolev *out);
void imp__sobolev_destroy(struct imp__sobolev *m);
/* x = M x on numbers that are not held, 0 on the others, by conjugate gradients to 1e-10 of
 * the residual's norm. x [n_theta] */
void imp__sobolev_apply(const struct imp__sobolev *m, double *x);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * How Adam with few variables measures the noise of its next step, which is m_j/sqrt(v_j) in the
 * coordinates of its directions, V S g of the gradient g with S the scales:
 *
 *     sum over j of Var(V S g)_j / v_j */
#ifndef IMP_SEARCH_ADAM_NOISE_H
#define IMP_SEARCH_ADAM_NOISE_H

#include "metric.h"
#include "optimize.h"

/* Noise of one iteration. */
struct imp__adam_noise {
    const struct imp__goal *goal;
    int iteration;
    const double *second; /* [n] v */
    const double *rows;   /* [n][n] V; NULL: the axes */
    /* Set by imp__adam_noise_measure. */
    double least; /* v */
    struct imp__metric metric;
};

/* The next evaluation measures it, if it can; `noise` outlives that. least: v over their mean.
 * work [n], probes [IMP_PROBES_MOST][n]: outlive it, too. */
void imp__adam_noise_measure(struct imp__adam_noise *noise, double least, double *work,
                             double *probes);

#endif

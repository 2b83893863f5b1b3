/* SPDX-License-Identifier: Apache-2.0
 *
 * A scalar measure of the variance of a gradient g: that of the step which a search makes
 * of it,
 *
 *     sum over probes of Var <probe, g>,      or      sum over k of weight_k Var g_k
 *
 * Probes are the rows of a root of the step's metric, or mixtures of them with random signs,
 * which have its trace as their expectation (Hutchinson, Commun. Stat. Simul. 18, 1989). Only
 * ratios of such variances count. */
#ifndef IMP_SEARCH_METRIC_H
#define IMP_SEARCH_METRIC_H

#include <stddef.h>

enum { IMP_PROBES_MOST = 8 };

struct imp__metric {
    size_t n_probes;      /* at most IMP_PROBES_MOST; 0: weights */
    const double *probes; /* [n_probes][n] */
    double (*weight)(size_t k, const void *payload);
    const void *payload;
};

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Probes of Adam's step, v^-1/2 V S, and the noise that its variances make of them
 * (adam_noise.h). */
#include "adam_noise.h"
#include "basis.h"
#include "math/rng.h"
#include <math.h>

/* Probes are the rows of v^-1/2 V S, or of many rows mixtures with signs from `seed`.
 * out [IMP_PROBES_MOST][n], work [n]. */
static size_t probes_make(const struct imp__adam_noise *a, uint64_t seed, double *work,
                          double *out)
{
    const size_t n = a->goal->n, rows = n < IMP_PROBES_MOST ? n : IMP_PROBES_MOST;
    for (size_t p = 0; p < rows; p++, out += n) {
        uint64_t signs = 0;
        for (size_t j = 0; j < n; j++) {
            if (j % 64 == 0) signs = imp__mix64(seed + 64 * p + j / 64);
            const double sign = signs >> (j % 64) & 1 ? 1 : -1;
            work[j] = rows == n && p != j ? 0 : sign / sqrt(fmax(a->second[j], a->least));
        }
        imp__basis_back(n, a->rows, work, out);
        for (size_t k = 0; k < n; k++) out[k] *= a->goal->scale[k];
    }
    return rows;
}

/* The same along the axes. */
static double weight(size_t k, const void *payload)
{
    const struct imp__adam_noise *a = payload;
    const double v = fmax(a->second[k], a->least);
    return v > 0 ? a->goal->scale[k] * a->goal->scale[k] / v : 0;
}

void imp__adam_noise_measure(struct imp__adam_noise *a, double least, double *work,
                             double *probes)
{
    const struct imp__goal *goal = a->goal;
    double mean = 0;
    if (!goal->measure) return;
    for (size_t j = 0; j < goal->n; j++) mean += a->second[j] / (double)goal->n;
    if (!(mean > 0)) return;
    a->least = least * mean;
    a->metric = (struct imp__metric){.probes = probes, .weight = weight, .payload = a};
    if (a->rows)
        a->metric.n_probes =
            probes_make(a, imp__search_seed(goal, a->iteration, 2), work, probes);
    goal->measure(&a->metric, goal->payload);
}

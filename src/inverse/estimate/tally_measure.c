/* SPDX-License-Identifier: Apache-2.0
 *
 * The variance of a tally as one scalar, for the allocation of samples. */
#include "tally.h"

void imp__tally_probe_batch(struct imp_tally *t)
{
    const double *probe = t->metric->probes;
    for (size_t p = 0; p < t->metric->n_probes; p++, probe += t->active->n) {
        double sum = 0;
        for (size_t k = 0; k < t->active->n; k++) sum += probe[k] * t->batch[k];
        t->probe_sum[p] += sum;
        t->probe_square[p] += sum * sum;
    }
}

void imp__tally_probe_pixel(struct imp_tally *t, double r, double by_variance)
{
    for (size_t p = 0; p < t->metric->n_probes; p++) {
        t->measured +=
            by_variance * (t->probe_square[p] - t->probe_sum[p] * t->probe_sum[p] * r);
        t->probe_sum[p] = t->probe_square[p] = 0;
    }
}

void imp__tally_probe_error(struct imp_tally *t)
{
    const double *probe = t->metric->probes;
    for (size_t p = 0; p < t->metric->n_probes; p++, probe += t->active->n) {
        double sum = 0;
        for (size_t k = 0; k < t->active->n; k++) sum += probe[k] * t->error[k];
        t->measured += sum * sum;
    }
}

void imp__tally_measure(struct imp_tally *t)
{
    const struct imp__metric *m = t->metric;
    if (!m || m->n_probes > 0) return;
    for (size_t k = 0; t->dense && k < t->active->n; k++)
        if (t->variance[k] > 0) t->measured += m->weight(k, m->payload) * t->variance[k];
    for (size_t k = 0; k < t->n_triples; k++)
        for (uint32_t c = 0; c < 3; c++)
            if (t->triples[k].variance[c] > 0)
                t->measured += m->weight(t->triples[k].key + c, m->payload) *
                               t->triples[k].variance[c];
    for (size_t k = 0; k < t->n_singles; k++)
        if (t->singles[k].variance > 0)
            t->measured +=
                m->weight(t->singles[k].key, m->payload) * t->singles[k].variance;
}

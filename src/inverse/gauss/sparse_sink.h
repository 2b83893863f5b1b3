/* SPDX-License-Identifier: Apache-2.0
 *
 * A sink that keeps the channels of a derivative apart (channel_sink.h), for the values
 * that a walk met only: memory and time are proportional to these, and not to all
 * values. */
#ifndef IMP_INVERSE_SPARSE_SINK_H
#define IMP_INVERSE_SPARSE_SINK_H

#include "inverse/estimate/channel_sink.h"

struct imp__sparse_sink {
    struct imp_sink sink; /* first */
    imp_context *ctx;
    const struct imp_active *active;
    const struct imp_walk *walk;
    int channels; /* 3 or 1 */
    imp_spec gain;
    bool own, failed;
    double scale;   /* of what is added */
    uint32_t *slot; /* [active->n] 1 + place of a value in the lists below; 0: none */
    size_t n, cap_number, cap_x;
    uint32_t *number; /* [n] in order of arrival */
    double (*x)[3];   /* [n] by channel */
    double lost[3];   /* where there was no memory */
};

enum imp_status imp__sparse_sink_create(imp_context *ctx, const struct imp_active *active,
                                        int channels, struct imp__sparse_sink *out);
void imp__sparse_sink_destroy(struct imp__sparse_sink *sink);
/* To no numbers. */
void imp__sparse_sink_clear(struct imp__sparse_sink *sink);
/* Adds `scale` times the derivatives of the walk's channels; test `failed` afterwards. */
void imp__sparse_sink_sweep(struct imp__sparse_sink *sink,
                            const struct imp_tracer *tracer, const struct imp_walk *walk,
                            double scale);

#endif

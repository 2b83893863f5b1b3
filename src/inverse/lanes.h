/* SPDX-License-Identifier: Apache-2.0
 *
 * A sink that keeps the colour channels of a derivative apart: x[k][c] = dL_c / dx_k. By
 * the lane rule (kinds.h) channel c of a coloured parameter moves channel c of the
 * picture only, so one sweep with adjoint 1 yields the whole Jacobian of a walk. */
#ifndef IMP_INVERSE_LANES_H
#define IMP_INVERSE_LANES_H

#include "film/film_picture.h"

struct imp_lanes {
    struct imp_sink sink; /* first */
    const struct imp_active *active;
    int lanes; /* 3 or 1 */
    double *x; /* [active->n][lanes] */
};

static inline void imp__lanes_add(struct imp_sink *sink, int param, size_t element,
                                  int channels, const imp_spec *bar)
{
    struct imp_lanes *s = (struct imp_lanes *)sink;
    const int64_t base = s->active->base[param];
    if (base < 0) return;
    double *x = s->x + ((size_t)base + element) * (size_t)s->lanes;
    for (int c = 0; c < s->lanes; c++) /* number c of a colour, channel c */
        x[(channels == 3 ? c * s->lanes : 0) + c] += (*bar)[c];
}

static inline imp_spec imp__lanes_adjoint(int lanes)
{
    return lanes == 3 ? (imp_spec){1, 1, 1, 0} : (imp_spec){1, 0, 0, 0};
}

/* A walk's radiance and its derivatives, value [1 + active][channels], as a sample of a
 * picture. */
static inline void imp__lanes_sample(const struct imp_tracer *tracer,
                                     struct imp_sample *s)
{
    const int channels = tracer->scene->channels;
    const size_t n = (tracer->active->n + 1) * (size_t)channels;
    struct imp_walk walk;
    imp__sample_walk(s, tracer, &walk);
    for (size_t k = 0; k < n; k++) s->value[k] = 0;
    for (int c = 0; c < channels; c++) s->value[c] = walk.L[c];
    struct imp_lanes lanes = {
        {imp__lanes_add, true}, tracer->active, channels, s->value + channels};
    imp__walk_sweep(tracer, &walk, imp__lanes_adjoint(channels), &lanes.sink);
}

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * A sink that keeps the channels of a derivative apart: x[k][c] = dL_c / dx_k. By the
 * lane rule (kinds.h) lane c of a parameter's pieces moves lane c of a walk's values only,
 * so one sweep with adjoint 1 in every lane yields the whole Jacobian of a walk. Lanes
 * are channels, or wavelengths of which channels are sums. */
#ifndef IMP_INVERSE_LANES_H
#define IMP_INVERSE_LANES_H

#include "film/film_picture.h"

struct imp_lanes {
    struct imp_sink sink; /* first */
    const struct imp_active *active;
    const struct imp_walk *walk;
    int channels; /* 3 or 1 */
    double *x;    /* [active->n][channels] */
};

static inline void imp__lanes_add_tied(struct imp_lanes *s, int param, size_t element,
                                       int channels, const imp_spec *bar)
{
    const int numbers = channels == 3 && !s->walk->waves ? 3 : 1;
    const imp_spec seen =
        s->walk->waves ? imp__waves_channels(s->walk->waves, *bar) : *bar;
    for (int c = 0; c < s->channels; c++) {
        const size_t e = element + (numbers == 3 ? (size_t)c : 0);
        s->x[imp__active_at(s->active, param, e) * (size_t)s->channels + (size_t)c] +=
            seen[c] * imp__active_slope(s->active, param, e);
    }
}

static inline void imp__lanes_add(struct imp_sink *sink, int param, size_t element,
                                  int channels, const imp_spec *bar)
{
    struct imp_lanes *s = (struct imp_lanes *)sink;
    const int64_t base = s->active->base[param];
    if (base < 0) return;
    if (imp_unlikely(s->active->tied != NULL)) {
        imp__lanes_add_tied(s, param, element, channels, bar);
        return;
    }
    double *x = s->x + ((size_t)base + element) * (size_t)s->channels;
    if (imp_unlikely(s->walk->waves != NULL)) {
        const imp_spec seen = imp__waves_channels(s->walk->waves, *bar);
        for (int c = 0; c < s->channels; c++) x[c] += seen[c];
        return;
    }
    for (int c = 0; c < s->channels; c++) /* number c of a colour, channel c */
        x[(channels == 3 ? c * s->channels : 0) + c] += (*bar)[c];
}

/* x [active->n][channels] += derivatives of the walk's channels. */
static inline void imp__lanes_sweep(const struct imp_tracer *tracer,
                                    const struct imp_walk *walk, double *x)
{
    struct imp_lanes lanes = {
        {imp__lanes_add, true}, tracer->active, walk, tracer->scene->channels, x};
    const int n = walk->waves ? walk->waves->carried.n : lanes.channels;
    imp_spec one = {0};
    for (int c = 0; c < n; c++) one[c] = 1;
    imp__walk_sweep_values(tracer, walk, one, &lanes.sink);
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
    imp__lanes_sweep(tracer, &walk, s->value + channels);
}

#endif

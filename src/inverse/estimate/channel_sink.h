/* SPDX-License-Identifier: Apache-2.0
 *
 * A sink that keeps the channels of a derivative apart: x[k][c] = dL_c / dx_k. By the
 * lane rule (kinds.h) lane c of a parameter's pieces moves lane c of a walk's values only,
 * so one sweep with adjoint 1 in every lane yields the whole Jacobian of a walk. Lanes
 * are channels, or wavelengths of which channels are sums. */
#ifndef IMP_INVERSE_CHANNEL_SINK_H
#define IMP_INVERSE_CHANNEL_SINK_H

#include "film/film_picture.h"

struct imp_lanes {
    struct imp_sink sink; /* first */
    const struct imp_active *active;
    const struct imp_walk *walk;
    int channels;  /* 3 or 1 */
    double *x;     /* [active->n][channels] */
    imp_spec gain; /* the camera's; applied after the wavelengths, if walks have them */
    bool own;      /* pieces are of channels, of the camera's own numbers */
};

static inline void imp__lanes_add_tied(struct imp_lanes *s, int param, size_t element,
                                       int channels, const imp_spec *bar)
{
    const bool waves = s->walk->waves && !s->own;
    const int numbers = channels == 3 && !waves ? 3 : 1;
    const imp_spec seen =
        waves ? imp__waves_channels(s->walk->waves, *bar) * s->gain : *bar;
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
    if (imp_unlikely(s->walk->waves != NULL) && !s->own) {
        const imp_spec seen = imp__waves_channels(s->walk->waves, *bar) * s->gain;
        for (int c = 0; c < s->channels; c++) x[c] += seen[c];
        return;
    }
    for (int c = 0; c < s->channels; c++) /* number c of a colour, channel c */
        x[(channels == 3 ? c * s->channels : 0) + c] += (*bar)[c];
}

/* The sink that adds to x [active->n][channels]. */
static inline struct imp_lanes imp__lanes_into(const struct imp_tracer *tracer,
                                               const struct imp_walk *walk, double *x)
{
    return (struct imp_lanes){.sink = {imp__lanes_add, true},
                              .active = tracer->active,
                              .walk = walk,
                              .channels = tracer->scene->channels,
                              .x = x,
                              .gain = imp__spec(1)};
}

/* 1 in every lane that is in use. */
static inline imp_spec imp__lanes_one(const struct imp_tracer *tracer,
                                      const struct imp_walk *walk)
{
    const int n = walk->waves ? walk->waves->carried.n : tracer->scene->channels;
    imp_spec one = {0};
    for (int c = 0; c < n; c++) one[c] = 1;
    return one;
}

/* x [active->n][channels] += derivatives of the walk's channels. */
static inline void imp__lanes_sweep(const struct imp_tracer *tracer,
                                    const struct imp_walk *walk, double *x)
{
    const bool gained = tracer->sensor->gain != NULL;
    struct imp_lanes lanes = imp__lanes_into(tracer, walk, x);
    imp_spec one = imp__lanes_one(tracer, walk);
    if (imp_unlikely(gained)) lanes.gain = imp__walk_gain(tracer, walk);
    if (imp_unlikely(gained) && !walk->waves) one *= lanes.gain;
    imp__walk_sweep_values(tracer, walk, one, &lanes.sink);
    if (imp_likely(!gained)) return;
    lanes.own = true; /* what comes now is of channels */
    imp__gain_sweep(tracer, walk, imp__spec(1), &lanes.sink);
}

/* A walk's radiance and its derivatives, value [1 + active][channels]. */
static inline void imp__lanes_values(const struct imp_tracer *tracer,
                                     const struct imp_walk *walk, double *value)
{
    const int channels = tracer->scene->channels;
    const size_t n = (tracer->active->n + 1) * (size_t)channels;
    for (size_t k = 0; k < n; k++) value[k] = 0;
    for (int c = 0; c < channels; c++) value[c] = walk->L[c];
    imp__lanes_sweep(tracer, walk, value + channels);
}

#endif

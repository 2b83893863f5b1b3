/* SPDX-License-Identifier: Apache-2.0
 *
 * Channels of the numbers of theta that a sweep has met: a list in the order met, and
 * each value's slot in it. */
#include "sparse_sink.h"

static double *place_new(struct imp__sparse_sink *s, size_t number)
{
    uint32_t *numbers =
        imp__grow(s->ctx, s->number, &s->cap_number, s->n + 1, sizeof *numbers);
    if (numbers) s->number = numbers;
    double(*x)[3] = imp__grow(s->ctx, s->x, &s->cap_x, s->n + 1, sizeof *x);
    if (x) s->x = x;
    if (!numbers || !x) {
        s->failed = true;
        return s->lost;
    }
    numbers[s->n] = (uint32_t)number;
    for (int c = 0; c < 3; c++) x[s->n][c] = 0;
    s->slot[number] = (uint32_t)++s->n;
    return x[s->n - 1];
}
static inline double *place(struct imp__sparse_sink *s, size_t number)
{
    const uint32_t at = s->slot[number];
    return imp_likely(at != 0) ? s->x[at - 1] : place_new(s, number);
}

static void add(struct imp_sink *sink, int param, size_t element, int channels,
                const imp_spec *bar)
{
    struct imp__sparse_sink *s = (struct imp__sparse_sink *)sink;
    if (s->active->base[param] < 0) return;
    const bool waves = s->walk->waves && !s->own;
    const bool triple = channels == 3 && !waves;
    const imp_spec seen =
        waves ? imp__waves_channels(s->walk->waves, *bar) * s->gain : *bar;
    for (int c = 0; c < s->channels; c++) { /* number c of a colour, channel c */
        const size_t e = element + (triple ? (size_t)c : 0);
        const double slope = imp__active_slope(s->active, param, e);
        place(s, imp__active_at(s->active, param, e))[c] += s->scale * seen[c] * slope;
    }
}

enum imp_status imp__sparse_sink_create(imp_context *ctx, const struct imp_active *active,
                                        int channels, struct imp__sparse_sink *out)
{
    *out = (struct imp__sparse_sink){
        .sink = {add, true}, .ctx = ctx, .active = active, .channels = channels};
    out->slot = imp__alloc(ctx, active->n, sizeof *out->slot);
    return out->slot ? IMP_OK : imp__error(ctx, IMP_E_NOMEM, "no memory for derivatives");
}

void imp__sparse_sink_destroy(struct imp__sparse_sink *s)
{
    if (!s->ctx) return;
    imp__release(s->ctx, s->slot);
    imp__release(s->ctx, s->number);
    imp__release(s->ctx, s->x);
    *s = (struct imp__sparse_sink){0};
}

void imp__sparse_sink_clear(struct imp__sparse_sink *s)
{
    for (size_t i = 0; i < s->n; i++) s->slot[s->number[i]] = 0;
    s->n = 0;
}

void imp__sparse_sink_sweep(struct imp__sparse_sink *s, const struct imp_tracer *tracer,
                            const struct imp_walk *walk, double scale)
{
    const bool gained = tracer->sensor->gain != NULL;
    imp_spec one = imp__lanes_one(tracer, walk);
    s->walk = walk;
    s->scale = scale;
    s->gain = imp__spec(1);
    s->own = false;
    if (imp_unlikely(gained)) s->gain = imp__walk_gain(tracer, walk);
    if (imp_unlikely(gained) && !walk->waves) one *= s->gain;
    imp__walk_sweep_values(tracer, walk, one, &s->sink);
    if (imp_likely(!gained)) return;
    s->own = true; /* what comes now is of channels */
    imp__gain_sweep(tracer, walk, imp__spec(1), &s->sink);
}

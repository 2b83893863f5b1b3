/* SPDX-License-Identifier: Apache-2.0
 *
 * Room for walks of a bundle that are swept, and which vertices they have. */
#include "swept.h"
#include <string.h>

bool imp__swept_fits(const struct imp_tracer *t)
{
    return t->swept_only && !t->value_only && !t->sensor->shape && !t->sensor->gain &&
           !(t->active && t->active->body) && !t->elsewhere &&
           t->integrator->alpha_gradient == IMP_ALPHA_DETACHED;
}

bool imp__swept_create(struct imp_arena *arena, struct imp_bundle *b,
                       struct imp_swept *out)
{
    const size_t n = (size_t)b->all;
    const struct imp_tracer *t = b->tracer;
    *out = (struct imp_swept){.first = NULL};
    out->count = imp__arena_array(arena, n, sizeof *out->count);
    out->walks = imp__arena_take(arena, n, sizeof *out->walks);
    if (!out->count || !out->walks) return false;
    for (int k = 0; k < b->all; k++)
        out->walks[k] = (struct imp_swept_walk){
            {.sweep = imp__swept_sweep, .both = imp__swept_both}, b, k};
    for (int k = 0; t->active && k < t->scene->n_emitters; k++)
        out->lights |= t->active->emitter[k] != 0;
    return true;
}

bool imp__swept_deeper(struct imp_arena *arena, struct imp_bundle *b, size_t n,
                       const struct imp_bundle_values *values)
{
    struct imp_swept *s = b->swept;
    struct imp_swept_depth *d = imp__arena_take(arena, 1, sizeof *d);
    if (!d) return false;
    *d = (struct imp_swept_depth){
        .values = values,
        .place = imp__arena_take(arena, (size_t)b->all, sizeof *d->place),
        .of = imp__arena_take(arena, n, sizeof *d->of),
        .lane = imp__arena_take(arena, n, sizeof *d->lane)};
    if (!d->place || !d->of || !d->lane) return false;
    memset(d->place, 0xff, (size_t)b->all * sizeof *d->place);
    if (s->last) s->last->next = d;
    else s->first = d;
    s->last = d;
    return true;
}

void imp__swept_alone(struct imp_bundle *b, int walk, int at, int8_t kind,
                      struct imp_vertex *v)
{
    struct imp_swept_depth *d = b->swept->last;
    d->place[walk] = at;
    d->of[at] = b->tracer->active ? v : NULL;
    d->lane[at] = kind;
    for (; v; v = v->next) b->swept->count[walk]++;
}

void imp__swept_connect(const struct imp_bundle *b, const struct imp_shadows *shadows,
                        const bool *hidden)
{
    const struct imp_swept_depth *d = b->swept->last;
    for (int k = 0; k < shadows->ray.n; k++) {
        const int at = shadows->at[k], lane = d->lane[at];
        if (!d->of[at]) continue; /* it is counted alone, or there was no memory */
        if (lane < 0) {
            struct imp_vertex *v = d->of[at];
            if (!hidden[k]) v->d.connection = IMP_CONNECTED;
        } else if (hidden[k]) {
            struct imp_swept_lanes *of = d->of[at];
            of->lit &= ~(1u << lane);
        }
    }
}

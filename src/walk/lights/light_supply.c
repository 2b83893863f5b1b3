/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks from lights, some at a time (light_supply.h). */
#include "light_supply.h"
#include "light_bundle.h"

/* Steps under way fill a part of a processor's own cache; in lanes walks under way are small. */
enum { TOGETHER = 64, IN_LANES = 512 };

typedef bool trace_fn(const struct imp_tracer *tracer, struct imp_arena *arena,
                      int64_t first, int n, struct imp_light_walk *out);

struct imp_light_supply imp__light_supply(const struct imp_tracer *tracer,
                                          struct imp_arena *arena, int64_t first,
                                          int64_t end)
{
    return (struct imp_light_supply){.tracer = tracer,
                                     .arena = arena,
                                     .mark = imp__arena_mark(arena),
                                     .lanes = imp__light_bundle_fit(tracer),
                                     .next = first,
                                     .end = end};
}

static void make(struct imp_light_supply *s)
{
    const int most = s->lanes                                  ? IN_LANES
                     : imp__light_walks_go_together(s->tracer) ? TOGETHER
                                                               : 1;
    trace_fn *const trace = s->lanes ? imp__light_bundle_trace : imp__light_walks_trace;
    const bool failed = s->arena->failed;
    imp__arena_rewind(s->arena, s->mark);
    s->n = (int)imp_min(s->end - s->next, (int64_t)most);
    s->place = 0;
    s->walks = imp__arena_take(s->arena, (size_t)s->n, sizeof *s->walks);
    if (s->n > 1 && s->walks && trace(s->tracer, s->arena, s->next, s->n, s->walks)) {
        s->next += s->n;
        return;
    }
    /* One alone takes less memory. */
    imp__arena_rewind(s->arena, s->mark);
    s->arena->failed = failed;
    s->n = 1;
    s->walks = imp__arena_take(s->arena, 1, sizeof *s->walks);
    if (s->walks) imp__light_walk_trace(s->tracer, s->arena, s->next, s->walks);
    s->next++;
}

const struct imp_light_walk *imp__light_supply_take(struct imp_light_supply *s)
{
    if (s->place == s->n) make(s);
    return s->walks ? &s->walks[s->place++] : NULL;
}

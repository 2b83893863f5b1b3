/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks from lights one after the other, made some at a time: their rays go together (columns of
 * scene/ray_columns.h), or, where values count alone, all of them in lanes (light_bundle.h). Each has the
 * values and the record that it has alone (light_walk.h, imp__light_walk_trace). */
#ifndef IMP_WALK_LIGHT_SUPPLY_H
#define IMP_WALK_LIGHT_SUPPLY_H

#include "light_walk.h"

struct imp_light_supply {
    const struct imp_tracer *tracer;
    struct imp_arena *arena;
    struct imp_arena_mark mark;
    bool lanes;                   /* values are made in lanes (light_bundle.h) */
    int64_t next, end;            /* numbers of the walks that are still to be made */
    struct imp_light_walk *walks; /* those made; in the arena */
    int n, place;
};

/* Walks first, .., end - 1. They are in the arena until the next are made: what is taken from it
 * meanwhile is given back before the next walk is taken. */
struct imp_light_supply imp__light_supply(const struct imp_tracer *tracer,
                                          struct imp_arena *arena, int64_t first,
                                          int64_t end);
/* The next walk. */
const struct imp_light_walk *imp__light_supply_take(struct imp_light_supply *s);

#endif

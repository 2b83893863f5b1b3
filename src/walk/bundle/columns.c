/* SPDX-License-Identifier: Apache-2.0
 *
 * Room for columns. */
#include "columns.h"

/* A cache line apart from what was taken before. */
static void *column(struct imp_arena *arena, size_t n, size_t size, bool *ok)
{
    void *p = imp__arena_take(arena, n + IMP_COLUMN_SLACK, size);
    *ok &= p != NULL;
    return p;
}
#define COLUMN(c) (c) = column(arena, n, sizeof *(c), &ok)
#define COLOR(c)                                                                         \
    for (int k = 0; k < colors; k++) COLUMN((c)[k])
#define VECTOR(c)                                                                        \
    for (int k = 0; k < 3; k++) COLUMN((c)[k])

bool imp__rays_create(struct imp_arena *arena, size_t n, struct imp_ray_columns *out)
{
    bool ok = true;
    *out = (struct imp_ray_columns){.n = 0};
    VECTOR(out->o);
    VECTOR(out->d);
    COLUMN(out->far);
    return ok;
}

bool imp__flights_create(struct imp_arena *arena, size_t n, int colors,
                         struct imp_columns_wanted wanted, struct imp_flights *out)
{
    bool ok = imp__rays_create(arena, n, &out->ray);
    VECTOR(out->from);
    COLUMN(out->pdf);
    COLOR(out->beta);
    COLUMN(out->eta);
    COLUMN(out->walk);
    COLUMN(out->up);
    out->left = NULL;
    if (wanted.left) COLUMN(out->left);
    out->zeros = NULL;
    if (wanted.zeros) COLUMN(out->zeros);
    out->medium = NULL;
    if (wanted.media) {
        COLUMN(out->medium);
        COLUMN(out->behind);
        VECTOR(out->ratio);
        COLUMN(out->share);
    }
    return ok;
}

bool imp__hits_create(struct imp_arena *arena, size_t n, struct imp_hit_columns *out)
{
    bool ok = true;
    COLUMN(out->t);
    COLUMN(out->u);
    COLUMN(out->v);
    COLUMN(out->shape);
    COLUMN(out->prim);
    COLUMN(out->place);
    return ok;
}

bool imp__bundle_values_create(struct imp_arena *arena, size_t n, int colors,
                               struct imp_bundle_values *out)
{
    bool ok = true;
    out->n = 0;
    COLOR(out->e);
    COLOR(out->b);
    COLOR(out->w);
    COLOR(out->beyond);
    COLUMN(out->up);
    return ok;
}

bool imp__shadows_create(struct imp_arena *arena, size_t n,
                         struct imp_columns_wanted wanted, struct imp_shadows *out)
{
    bool ok = imp__rays_create(arena, n, &out->ray);
    COLUMN(out->at);
    COLUMN(out->of);
    out->medium = NULL;
    if (wanted.media) {
        COLUMN(out->walk);
        COLUMN(out->medium);
        COLUMN(out->behind);
    }
    return ok;
}

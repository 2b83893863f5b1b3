/* SPDX-License-Identifier: Apache-2.0
 *
 * Bundles for lists of pixels. */
#include "supply.h"
#include "swept.h"

/* Walks of a bundle, about: enough to fill lanes, few enough for a processor's own cache, in which
 * records need more. A group may be larger than that. */
enum { VALUES = 512, SWEPT = 256, RECORDS = 160, GROUP_MOST = 1024 };

static int block_add(const struct imp_supply_pixels *p, int x0, int y0, int side,
                     int (*xy)[2], int n)
{
    for (int y = y0; y < imp_min(y0 + side, p->y1); y++)
        for (int x = x0; x < imp_min(x0 + side, p->x1); x++) {
            if (!p->counts(p->payload, x, y)) continue;
            xy[n][0] = x;
            xy[n++][1] = y;
        }
    return n;
}

bool imp__supply_begin(const struct imp_tracer *tracer, struct imp_arena *arena,
                       const struct imp_supply_pixels *pixels, const int64_t *numbers,
                       int n_numbers, int group, struct imp_supply *out)
{
    const int most = !tracer || tracer->value_only ? VALUES
                     : imp__swept_fits(tracer)     ? SWEPT
                                                   : RECORDS;
    const size_t all =
        (size_t)(pixels->x1 - pixels->x0) * (size_t)(pixels->y1 - pixels->y0);
    if (!tracer || group < 1 || group > GROUP_MOST || n_numbers < 1) return false;
    int n = 0, (*xy)[2] = imp__arena_take(arena, all, sizeof *xy);
    if (!xy) return false;
    const int together = imp_max(tracer->together, 1), side = together > 1 ? 2 : 1;
    for (int y = pixels->y0; y < pixels->y1; y += side)
        for (int x = pixels->x0; x < pixels->x1; x += side)
            n = block_add(pixels, x, y, side, xy, n);
    *out =
        (struct imp_supply){.tracer = tracer,
                            .arena = arena,
                            .mark = imp__arena_mark(arena),
                            .xy = (const int(*)[2])xy,
                            .n_pixels = n,
                            .numbers = numbers,
                            .n_numbers = n_numbers,
                            .group = group,
                            .pixels = imp_max(most / n_numbers / together, 1) * together};
    if (n_numbers > most) out->pixels = 1;
    out->walks = n_numbers <= most ? n_numbers : imp_max(most / group * group, group);
    return true;
}

static void make(struct imp_supply *s)
{
    const int walks = imp_min(s->walks, s->n_numbers - s->number),
              pixels = imp_min(s->pixels, s->n_pixels - s->pixel);
    const bool failed = s->arena->failed;
    imp__arena_rewind(s->arena, s->mark);
    s->made = imp__bundle_trace(s->tracer, s->arena, pixels, s->xy + s->pixel, walks,
                                s->numbers + s->number, &s->at_work);
    if (!s->made) { /* its walks go alone, which takes less */
        imp__arena_rewind(s->arena, s->mark);
        s->arena->failed = failed;
    }
    s->left = pixels * walks;
    s->place = 0;
    s->number += walks;
    if (s->number < s->n_numbers) return;
    s->number = 0;
    s->pixel += pixels;
}

void imp__supply_ready(struct imp_supply *s)
{
    if (s->left == 0) make(s);
}

void imp__supply_take(struct imp_supply *s, int x, int y, int64_t sample,
                      struct imp_walk *walk)
{
    s->left--;
    if (imp_likely(s->made)) imp__bundle_walk(&s->at_work, s->place++, walk);
    else imp__walk_trace(s->tracer, s->arena, x, y, sample, walk);
}

imp_spec imp__supply_alone(const struct imp_supply *s, const struct imp_walk *walk)
{
    const struct imp_bundle *b = &s->at_work;
    return s->made ? imp__column_color(b->alone, b->colors, s->place - 1) : walk->L;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * One tile in one pass: the samples of its pixels, one by one or in bundles, and what they
 * add to the sums of pixels, of sets and of patches. */
#include "film_pass.h"
#include <string.h>

/* A picture holds floats. */
static IMP_COLD enum imp_drop cause_of(const double *value, int n)
{
    for (int c = 0; c < n; c++)
        if (isnan(value[c])) return IMP_DROP_NAN;
    return IMP_DROP_INFINITE;
}
static inline enum imp_drop beyond_float(const double *value, int n)
{
    return imp_likely(imp__fits_float(value, n)) ? IMP_DROP_NONE : cause_of(value, n);
}

static void sample_take(const struct imp_passes *r, struct imp_tile_worker *w,
                        struct imp_sample *s)
{
    const struct imp_arena_mark mark = imp__arena_mark(s->arena);
    s->dropped = IMP_DROP_NONE;
    r->picture->sample(r->picture->payload, s);
    imp__arena_rewind(s->arena, mark);
    if (s->dropped == IMP_DROP_NONE) s->dropped = beyond_float(s->value, r->patch.n);
    if (imp_likely(s->dropped == IMP_DROP_NONE)) return;
    memset(s->value, 0, (size_t)r->patch.n * sizeof *s->value);
    imp__tile_drop(w, s->dropped, s->x, s->y, s->index);
}

/* A sample of a set; n > 0: the set's last, of n. With a box filter sets of all sizes
 * count the same: their sums are scaled to the mean size. */
static void set_take(const struct imp_passes *r, const struct imp_tile *t, int worker,
                     const struct imp_sample *s, double *own, double *patch, int n)
{
    const size_t width = IMP_WIDE_SUMS(r->patch.n);
    if (r->patch.border > 0) {
        double *set =
            r->set_patches + (size_t)worker * imp__row_apart(imp__patch_size(&r->patch));
        const size_t side = (size_t)imp__patch_side(&r->patch);
        imp__patch_splat(&r->patch, t, set, s);
        for (size_t i = 0; n > 0 && i < side * side; i++)
            imp__patch_set(patch + i * width, set + i * width, r->patch.n);
        return;
    }
    double *sum = r->set_values + (size_t)worker * imp__row_apart((size_t)r->patch.n);
    const double scale = r->sets > 0 && n > 0 ? (double)r->period / r->sets / n : 1;
    for (int c = 0; c < r->patch.n; c++) sum[c] += s->value[c];
    for (int c = 0; n > 0 && c < r->patch.n; c++) {
        const double all = scale * sum[c];
        own[2 * c] += all;
        own[2 * c + 1] += all * all;
        sum[c] = 0;
    }
}

int imp__pass_begin(const struct imp_passes *r, int pass)
{
    if (r->set > 1 && r->sets > 0)
        return (int)((int64_t)r->sets * pass / r->passes * r->period / r->sets);
    return (int)imp_min((int64_t)pass * r->pass_spp, (int64_t)r->spp);
}

/* Number of sample k of a pixel. */
static inline int64_t sample_number(const struct imp_passes *r, int k)
{
    return r->picture->points
               ? imp__set_number(r->set, r->period, k)
               : r->picture->first + (int64_t)k * imp_max(r->picture->step, 1);
}

static bool is_sampled(const void *payload, int x, int y)
{
    const struct imp_passes *r = payload;
    return imp_likely(!r->picture->only) ||
           r->picture->only[(size_t)y * (size_t)r->patch.film->crop_w + (size_t)x];
}

/* The walks of a tile in bundles: NULL, where samples are none, or not of such walks. */
static struct imp_supply *supply_begin(const struct imp_passes *r,
                                       const struct imp_tile *t, struct imp_arena *arena,
                                       int s0, int s1, struct imp_supply *supply)
{
    const struct imp_supply_pixels pixels = {t->x0, t->y0, t->x1, t->y1, is_sampled, r};
    if (!r->picture->walks) return NULL;
    int64_t *numbers = imp__arena_take(arena, (size_t)(s1 - s0), sizeof *numbers);
    for (int k = s0; numbers && k < s1; k++) numbers[k - s0] = sample_number(r, k);
    return numbers && imp__supply_begin(r->picture->walks, arena, &pixels, numbers,
                                        s1 - s0, 1, supply)
               ? supply
               : NULL;
}

/* Pixel i of a tile, in the order in which its walks are made. False: there are not so many. */
static inline bool place_take(const struct imp_tile *t, int i, struct imp_sample *s)
{
    const int width = t->x1 - t->x0;
    const struct imp_supply *walks = s->supply;
    if (i >= (walks ? walks->n_pixels : width * (t->y1 - t->y0))) return false;
    s->x = walks ? walks->xy[i][0] : t->x0 + i % width;
    s->y = walks ? walks->xy[i][1] : t->y0 + i / width;
    return true;
}

enum imp_status imp__pass_work(const struct imp_tile *t, struct imp_tile_worker *w,
                               void *result, void *payload)
{
    struct imp_passes *r = payload;
    const int s0 = imp__pass_begin(r, (int)t->part),
              s1 = imp__pass_begin(r, (int)t->part + 1);
    int n_sets = 0;
    int64_t first = 0, n_set = 0; /* of the set at work */
    const int n = r->patch.n;
    struct imp_supply walks;
    double *tile = result;
    double *patch =
        r->patches + (size_t)w->index * imp__row_apart(imp__patch_size(&r->patch));
    struct imp_sample s = {.arena = &w->arena,
                           .value =
                               r->values + (size_t)w->index * imp__row_apart((size_t)n)};
    memset(tile, 0, imp__film_sums_pixels(&r->sums) * sizeof *tile);
    s.supply = supply_begin(r, t, s.arena, s0, s1, &walks);
    for (int i = 0; place_take(t, i, &s); i++) {
        if (!is_sampled(r, s.x, s.y)) continue;
        double *own = tile + (size_t)((s.y - t->y0) * r->patch.tile_side + s.x - t->x0) *
                                 2 * (size_t)n;
        for (int k = s0; k < s1; k++) {
            s.index = sample_number(r, k);
            if (s.supply) imp__supply_ready(s.supply);
            sample_take(r, w, &s);
            if (imp_unlikely(r->set > 1)) {
                if (k == s0 || k >= first + n_set)
                    imp__set_at(r->set, r->period, k, &first, &n_set);
                const bool last = k + 1 == first + n_set || k + 1 == s1;
                set_take(r, t, w->index, &s, own, patch, last ? (int)n_set : 0);
                n_sets += last;
                continue;
            }
            if (r->patch.border > 0) {
                imp__patch_splat(&r->patch, t, patch, &s);
                continue;
            }
            imp__box_add(s.value, n, own);
        }
        if (r->patch.border > 0)
            imp__patch_add(&r->patch, t, patch, s.x, s.y, r->set > 1 ? n_sets : s1 - s0,
                           tile);
        n_sets = 0;
        const enum imp_status st = imp__tile_check(w);
        if (st != IMP_OK) return st;
    }
    return IMP_OK;
}

void imp__pass_add(void *into, const void *from, void *payload)
{
    const struct imp_passes *r = payload;
    const size_t n = imp__film_sums_pixels(&r->sums);
    double *a = into;
    const double *b = from;
    for (size_t k = 0; k < n; k++) a[k] += b[k];
}

enum imp_status imp__pass_take(size_t tile, const void *sum, void *payload)
{
    struct imp_passes *r = payload;
    imp__film_sums_add(&r->sums, tile, sum, r->sweep_spp);
    return IMP_OK;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Importance weights at other parameters are evaluated for a subset of the recorded walks. Some
 * thousand suffice if the subset contains walks that meet what has changed: one material in few
 * pixels may refuse all. 64 bits of each walk are what it meets: bit a, it goes on at a material
 * of class a; bit 32 + a, roulette is played at such a step, beyond the first (store_weight.c).
 * With n_a walks that meet a, a is rare if each `every`-th walk brings fewer than LEAST of
 * them. A walk that meets something rare is in the subset with the probability
 *
 *     P = min(1, LEAST/n_a),   a the rarest that it meets
 *
 * others every `every`-th, and sums weigh walks by 1/P. Where more than IMP_STORE_CLASSES
 * materials share classes, a rare one counts with those of its class. */
#include "math/rng.h"
#include "store.h"

#define LEAST 64

_Static_assert(2 * IMP_STORE_CLASSES == 64, "bits of what a walk meets");

/* What walk k of the record meets. */
static uint64_t walk_meets(const struct imp_scene *scene, const struct imp_record *r,
                           const struct imp_record_walk *k)
{
    uint64_t meets = 0;
    bool settled = false;
    for (uint32_t j = 0; j < k->n_vertices; j++) {
        struct imp_decision d;
        struct imp_packed_head head;
        imp__packed_step(imp__record_words(r, k->first + j), &head, &d);
        const struct imp_bsdf *b = imp__decided_bsdf(scene, &d);
        if (!d.goes_on || !b) continue;
        const int a = imp__store_class(b);
        meets |= UINT64_C(1) << a;
        if (j >= k->n || !(d.survive < 1)) continue;
        if (settled) meets |= UINT64_C(1) << (IMP_STORE_CLASSES + a);
        settled = true;
    }
    return meets;
}

enum imp_status imp__store_look(struct imp_store *s, const struct imp_scene *scene,
                                size_t tile)
{
    const struct imp_record *r = &s->records[tile];
    uint64_t met[64] = {0};
    uint64_t *meets = imp__alloc(s->ctx, r->n_walks + 1, sizeof *meets);
    if (!meets) return imp__error(s->ctx, IMP_E_NOMEM, "no memory for recorded walks");
    for (size_t i = 0; i < r->n_walks; i++) {
        meets[i] = walk_meets(scene, r, imp__record_at(r, i));
        for (uint64_t m = meets[i]; m; m &= m - 1) met[__builtin_ctzll(m)]++;
    }
    for (int a = 0; a < 64; a++)
        if (met[a] > 0) atomic_fetch_add(&s->met[a], met[a]);
    s->meets[tile] = meets;
    return IMP_OK;
}

struct imp_asking imp__store_asking(const struct imp_store *s,
                                    const struct imp_densities *d, size_t most)
{
    struct imp_asking a = {.every = 1};
    size_t n = 0;
    for (size_t k = 0; k < imp__store_tiles(s); k++) n += s->records[k].n_walks;
    if (most == 0 || d->flights) return a;
    a.every = n / most | 1;
    /* A step that roulette rarely let survive may count many times as much now. */
    const bool rolls = s->roulette && d->integrator->ends_by != IMP_ENDS_BY_ABSORPTION;
    const uint64_t matters = d->matters | (rolls ? d->rolled : 0);
    for (int b = 0; b < 64; b++)
        if ((matters >> b & 1) && s->met[b] > 0 && s->met[b] / a.every < LEAST)
            a.rare |= UINT64_C(1) << b;
    return a;
}

/* Walks of a stratum for each that is drawn. */
static double stratum_weight(const struct imp_store *s, uint64_t rare)
{
    size_t least = SIZE_MAX;
    for (; rare; rare &= rare - 1)
        least = imp_min(least, (size_t)s->met[__builtin_ctzll(rare)]);
    return imp_max((double)least / LEAST, 1.0);
}

size_t imp__store_next(const struct imp_store *s, const struct imp_asking *a, size_t tile,
                       size_t i, double *weight)
{
    const size_t n = s->records[tile].n_walks;
    /* All walks, as if tiles at the border were whole. */
    const size_t before = tile * IMP_STORE_SIDE * IMP_STORE_SIDE * s->n;
    size_t due = i + (a->every - (before + i) % a->every) % a->every;
    for (; a->rare && i < n; i++) {
        const uint64_t rare = s->meets[tile][i] & a->rare;
        if (rare) {
            const double of = stratum_weight(s, rare);
            *weight = of;
            if (of * 0x1p-64 * (double)imp__mix64(before + i) <= 1) return i;
        } else if (i == due) {
            break;
        }
        if (i == due) due += a->every;
    }
    *weight = (double)a->every;
    return imp_min(due, n);
}

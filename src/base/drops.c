/* SPDX-License-Identifier: Apache-2.0
 *
 * Counts of dropped walks by cause, and the smallest keys among them in a fixed order. */
#include "drops.h"
#include <stdio.h>
#include <string.h>

const char *imp_drop_text(enum imp_drop cause)
{
#define DROP_CASE(name, value, text)                                                     \
    case name: return text;
    switch (cause) {
        IMP_DROP_LIST(DROP_CASE)
    }
#undef DROP_CASE
    return "unknown cause";
}

/* The first pass of a picture comes first: its walks are in every longer run too. */
static int order(const struct imp_drop_key *a, const struct imp_drop_key *b)
{
#define BY(field)                                                                        \
    if (a->field != b->field) return a->field < b->field ? -1 : 1
    BY(sample);
    BY(y);
    BY(x);
    BY(sensor);
    BY(seed);
    BY(cause);
#undef BY
    return 0;
}

static void key_insert(struct imp_drops *d, const struct imp_drop_key *key)
{
    int at = d->n_keys;
    for (; at > 0; at--) {
        const int o = order(key, &d->keys[at - 1]);
        if (o == 0) return;
        if (o > 0) break;
    }
    if (at == IMP_DROP_KEYS) return;
    if (d->n_keys < IMP_DROP_KEYS) d->n_keys++;
    memmove(&d->keys[at + 1], &d->keys[at],
            (size_t)(d->n_keys - at - 1) * sizeof *d->keys);
    d->keys[at] = *key;
    d->keys[at].size = sizeof *key;
}

void imp__drops_add(struct imp_drops *d, const struct imp_drop_key *key)
{
    if (key->cause <= IMP_DROP_NONE || key->cause >= IMP_DROP_CAUSES) return;
    d->by_cause[key->cause]++;
    key_insert(d, key);
}

void imp__drops_merge(struct imp_drops *into, const struct imp_drops *from)
{
    for (int c = 0; c < IMP_DROP_CAUSES; c++) into->by_cause[c] += from->by_cause[c];
    for (int k = 0; k < from->n_keys; k++) key_insert(into, &from->keys[k]);
}

uint64_t imp__drops_total(const struct imp_drops *d)
{
    uint64_t n = 0;
    for (int c = 0; c < IMP_DROP_CAUSES; c++) n += d->by_cause[c];
    return n;
}

enum imp_status imp__drops_budget(imp_context *ctx, const struct imp_drops *d,
                                  double budget, double walks, const char *points)
{
    const uint64_t total = imp__drops_total(d), boundary = d->by_cause[IMP_DROP_MEDIUM];
    if (budget > 0 ? (double)total <= 1 + budget * walks
                   : (double)(total - boundary) <= 1 + IMP_DROP_SHARE * walks &&
                         (double)boundary <= 1 + IMP_DROP_SHARE_BOUNDARY * walks)
        return IMP_OK;
    char causes[1024] = "", first[128] = "";
    size_t used = 0;
    for (int c = 0; c < IMP_DROP_CAUSES && used < sizeof causes; c++)
        if (d->by_cause[c])
            used += (size_t)snprintf(causes + used, sizeof causes - used, "%s%llu: %s",
                                     used ? "; " : "", (unsigned long long)d->by_cause[c],
                                     imp_drop_text((enum imp_drop)c));
    if (d->n_keys)
        snprintf(first, sizeof first,
                 "; the first is --pixel %d,%d --sample %lld --seed %llu --sensor %d%s",
                 d->keys[0].x, d->keys[0].y, (long long)d->keys[0].sample,
                 (unsigned long long)d->keys[0].seed, d->keys[0].sensor, points);
    return imp__error(ctx, IMP_E_PATHS, "%llu of %.0f walks were dropped (%s%s)",
                      (unsigned long long)total, walks, causes, first);
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Dropped walks: how many of each cause, and which walks they were. What is kept depends
 * on the set of dropped walks alone, in whatever order they are added or merged, so any
 * number of threads gives the same. */
#ifndef IMP_BASE_DROPS_H
#define IMP_BASE_DROPS_H

#include "context.h"

struct imp_drops {
    uint64_t by_cause[IMP_DROP_CAUSES];
    int n_keys;
    /* The lowest n_keys of all that were added, ascending by sample, row, column, then
     * the rest of the key; each once. */
    struct imp_drop_key keys[IMP_DROP_KEYS];
};

/* Count one dropped walk. A key whose cause is IMP_DROP_NONE is not counted. */
void imp__drops_add(struct imp_drops *drops, const struct imp_drop_key *key);
void imp__drops_merge(struct imp_drops *into, const struct imp_drops *from);
uint64_t imp__drops_total(const struct imp_drops *drops);

/* Shares of walks that may be dropped where a run names none: of one cause, a boundary that
 * a scanned mesh crosses or leaves open in a few places, more. They are missing from the
 * picture, whose mean is too dark by their share if they carry as much as others. */
#define IMP_DROP_SHARE          1e-4
#define IMP_DROP_SHARE_BOUNDARY 1e-3

/* IMP_E_PATHS if more than 1 + budget * walks were dropped; budget 0: the shares above, each
 * of its causes. The message has the count of each cause and the key of the walk to look at
 * first; `points`: an option that names its random numbers, or "". */
enum imp_status imp__drops_budget(imp_context *ctx, const struct imp_drops *drops,
                                  double budget, double walks, const char *points);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Where the sweep's pieces of gradient are added up, with standard errors.
 *
 * The samples of a pixel come in R independent replicates of n, each with its own
 * leave-one-out adjoint; a pixel's gradient is their mean, its variance comes from their
 * spread, and pixels are independent, so variances add (docs/estimators.md 14). Few
 * numbers are kept in arrays; many (textures) in a hash table of what a tile of pixels
 * touched, so memory and time follow the touched texels and not the texture. */
#ifndef IMP_INVERSE_TALLY_H
#define IMP_INVERSE_TALLY_H

#include "walk/walk.h"

#define IMP_TALLY_DENSE 1024 /* numbers, above which the hash table is used */

struct imp__tally_entry {        /* three neighbouring numbers, or one (then lane 0) */
    imp_spec batch, sum, square; /* of the pixel at work */
    double mean[3], variance[3]; /* of the tile so far */
    uint32_t key, channels;
    bool touched; /* by the pixel at work */
};

struct imp_tally {
    struct imp_sink sink; /* first: the sweep gets a pointer to it */
    imp_context *ctx;
    const struct imp_active *active;
    int lanes; /* 3 or 1 */
    bool dense, failed;
    /* dense: [n] each */
    double *batch, *sum, *square, *mean, *variance;
    /* hash: open addressing; `entries` in order of arrival, `touched` of the pixel */
    uint32_t *table; /* [table_size] entry + 1, 0: free */
    size_t table_size, n_entries, cap_entries;
    struct imp__tally_entry *entries;
    uint32_t *touched;
    size_t n_touched, cap_touched;
};

enum imp_status imp__tally_create(imp_context *ctx, const struct imp_active *active,
                                  int lanes, struct imp_tally *out);
void imp__tally_destroy(struct imp_tally *t);
/* Between tiles. */
void imp__tally_clear(struct imp_tally *t);
/* After the sweeps of one replicate. */
void imp__tally_batch(struct imp_tally *t);
/* After a pixel's `replicates`: tile mean += by_mean sum, tile variance += by_variance
 * (sum of squares - sum^2/replicates). */
void imp__tally_pixel(struct imp_tally *t, double replicates, double by_mean,
                      double by_variance);

/* ---- Totals of a whole estimate, in x's order ---------------------------------- */
struct imp_tally_result { /* a tile's means and variances, handed from worker to commit */
    size_t n, capacity;
    struct imp__tally_piece {
        uint32_t key, channels;
        double mean[3], variance[3];
    } * pieces;
    double *dense; /* [2 n_active] */
};
enum imp_status imp__tally_export(const struct imp_tally *t,
                                  struct imp_tally_result *out);
/* gradient, variance [n_active] += */
void imp__tally_add(const struct imp_tally_result *r, size_t n_active, double *gradient,
                    double *variance);
void imp__tally_result_destroy(imp_context *ctx, struct imp_tally_result *r);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Where the sweep's pieces of gradient are added up, with standard errors.
 *
 * The samples of a pixel come in R independent replicates of n, each with its own
 * leave-one-out adjoint; a pixel's gradient is their mean, its variance comes from their
 * spread, and pixels are independent, so variances add (docs/estimators.md 14). Where
 * pixels share walks, replicates are also added up over the tile (overlap.h). Few values
 * are kept in arrays; many (textures) in a hash table of what a tile of pixels touched,
 * so memory and time follow the touched texels and not the texture. */
#ifndef IMP_INVERSE_TALLY_H
#define IMP_INVERSE_TALLY_H

#include "base/fixed_sum.h"
#include "search/metric.h"
#include "walk/core/walk.h"

#define IMP_TALLY_DENSE 1024 /* values, above which the hash table is used */
#define IMP_TALLY_FULL  16384

struct imp__tally_triple { /* three adjacent values */
    /* Sums of the present pixel. What additions need is on one cache line. */
    _Alignas(IMP_CACHE_LINE) double batch[3];
    double error[3];
    uint32_t key;
    bool touched;
    _Alignas(IMP_CACHE_LINE) double sum[3];
    double square[3];
    double mean[3], variance[3]; /* of the tile so far */
};
struct imp__tally_single {
    double batch, error, sum, square, mean, variance;
    uint32_t key;
    bool touched;
};

struct imp_tally {
    struct imp_sink sink; /* first: the sweep gets a pointer to it */
    /* What has the mean 0 and the variance of the pixel's gradient (imp__tally_error). */
    struct imp_tally_errors {
        struct imp_sink sink; /* first */
        struct imp_tally *of;
    } errors;
    struct imp_sink_pair both; /* sink and errors.sink */
    imp_context *ctx;
    const struct imp_active *active;
    int lanes; /* of what sweeps bring: 1, 3 or 4 */
    bool dense, failed;
    int R; /* replicates of pixels that share walks; 0: pixels share none */
    /* dense: [n] each; tile: variance of sums over the tile, from of_tile [R][n] */
    double *batch, *error, *sum, *square, *mean, *variance, *tile, *of_tile;
    /* hash: of each entry [R] sums over the tile */
    double *singles_of_tile;
    imp_spec *triples_of_tile;
    size_t cap_singles_of_tile, cap_triples_of_tile;
    /* hash: open addressing; entries in order of arrival, `touched` of the pixel */
    struct imp__tally_slot {
        uint32_t tag, entry; /* key and kind of the entry, 0: free; its index */
    } * table;               /* [table_size], a power of two */
    size_t table_size;
    int shift; /* of a hash of 32 bits to a table of this size in eights */
    struct imp__tally_triple *triples;
    struct imp__tally_single *singles;
    size_t n_triples, cap_triples, n_singles, cap_singles;
    struct imp__tally_list {
        uint32_t *index;
        size_t n, cap;
    } touched_triples, touched_singles;
    /* The scalar measure of the variance; NULL: none. */
    const struct imp__metric *metric;
    double probe_sum[IMP_PROBES_MOST], probe_square[IMP_PROBES_MOST]; /* of the pixel */
    double measured; /* of the tile so far */
    double rays; /* of the tile's walks: one to each vertex, and one from it to a light */
};

/* R: replicates of pixels that share walks; 0: of others. *out is to stay where it is: `errors` and
 * `both` refer to it. */
enum imp_status imp__tally_create(imp_context *ctx, const struct imp_active *active,
                                  int lanes, int R, struct imp_tally *out);
void imp__tally_destroy(struct imp_tally *t);
/* tally_add.c: the sinks; a larger table, or the first one. False: no memory. */
void imp__tally_sinks(struct imp_tally *t);
bool imp__tally_table_grow(struct imp_tally *t);
/* Between tiles. */
void imp__tally_clear(struct imp_tally *t);
/* After the sweeps of one replicate, number b of the pixel. */
void imp__tally_batch(struct imp_tally *t, int b);
/* After a pixel's `replicates`: tile mean += by_mean sum, tile variance += by_variance
 * (sum of squares - sum^2/replicates). */
void imp__tally_pixel(struct imp_tally *t, double replicates, double by_mean,
                      double by_variance);
/* After the sweeps into `errors`: their squares. */
void imp__tally_error(struct imp_tally *t);
/* Many numbers, between pixels that share no walks: has the tile so many that they are to
 * be flushed and cleared before it goes on? Memory then does not grow with the samples, and
 * stays in the cache. */
static inline bool imp__tally_full(const struct imp_tally *t)
{
    return !t->dense && t->R == 0 && t->n_triples + t->n_singles > IMP_TALLY_FULL;
}
/* Few numbers, after a tile whose pixels share walks: the variance of sums over it,
 * by_variance (sum of squares - sum^2/R). */
void imp__tally_tile(struct imp_tally *t, double by_variance);

/* ---- The variance as one number (tally_measure.c) ---- */
/* Is it that of probes, which need every batch and every pixel? r: 1 / replicates. */
static inline bool imp__tally_probes(const struct imp_tally *t)
{
    return t->metric && t->dense && t->metric->n_probes > 0;
}
void imp__tally_probe_batch(struct imp_tally *t);
void imp__tally_probe_pixel(struct imp_tally *t, double r, double by_variance);
void imp__tally_probe_error(struct imp_tally *t);
/* Before a tile is taken over or flushed: `measured` has all of its variance. */
void imp__tally_measure(struct imp_tally *t);

/* Few numbers: mean, variance and, where pixels share walks, that of sums over the tile,
 * [3][n] in x's order. */
static inline const double *imp__tally_dense(const struct imp_tally *t)
{
    return t->mean;
}
/* Many numbers: add mean and variance of the tile to sums in x's order; variance may be
 * NULL. Where pixels share walks: by_variance as of imp__tally_tile, factor as of
 * imp__overlap_variance. */
void imp__tally_flush(const struct imp_tally *t, double by_variance, double factor,
                      struct imp_fixed_sum *mean, struct imp_fixed_sum *variance);

#endif

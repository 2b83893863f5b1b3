/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums that several processes share. Every rank of a team makes the same calls; a sum
 * over items (sum_tree.h) is the only thing that is divided. Each rank computes some of
 * the items, then all get the nodes of all, and complete the same tree: the result has
 * the bits of one process, on every rank, and what follows from it is computed by each.
 *
 *     rank 0:  items 0 .. 4   ->  nodes (2, 0), (0, 4)  \   everybody's nodes
 *     rank 1:  items 5 .. 7   ->  nodes (0, 5), (1, 3)  /   make node (3, 0) on each rank
 *
 * Parts of a run that are written to files (film/parts.h) are a team whose ranks never
 * meet: a part computes its share and keeps its messages; a merge computes nothing and
 * reads the messages of all. */
#ifndef IMP_BASE_TEAM_H
#define IMP_BASE_TEAM_H

#include "drops.h"
#include "fixed_sum.h"
#include "pool.h"

enum imp_team_role {
    IMP_TEAM_RANK,
    IMP_TEAM_PART,   /* what the others compute is not known: results are not whole */
    IMP_TEAM_MERGE,  /* computes no item */
    IMP_TEAM_RECORD, /* computes all, and keeps the sums of chunks */
    IMP_TEAM_VERIFY  /* computes some of the chunks again, and takes the sums of all */
};

struct imp__team {
    struct imp_team host;
    enum imp_team_role role;
    uint64_t round;
    /* Hash of the parameters and random numbers of the present call: ranks that follow an
     * optimiser of their own find out where one of them has left the others. 0: none. */
    uint64_t state;
    int here;                    /* ranks on this machine, this one too; 0: not known */
    int alone;                   /* > 0: inside of what every rank computes whole */
    bool (*pick)(void *payload); /* is the next chunk verified? */
    /* Chunks of a sum to keep, no more than `most`, which take so many bytes, and for each
     * chunk so many; 0: the sum is not kept. */
    size_t (*chunks)(size_t bytes, size_t each, size_t most, void *payload);
    size_t n_kept; /* chunks */
    bool in_fixed; /* recorded: there were sums in fixed point */
    bool differs;  /* verified: a chunk did not have the sums that were kept */
};

/* Is work of this context divided now? */
static inline bool imp__team_shares(const imp_context *ctx)
{
    return ctx->team && ctx->team->alone == 0;
}
/* Are the results of this call those of a part? Then outputs are left alone, and the call
 * returns IMP_PART. */
static inline bool imp__team_part(const imp_context *ctx)
{
    return ctx->team && ctx->team->role == IMP_TEAM_PART;
}

/* Do results of other processes go into this one's, at another time? */
static inline bool imp__team_apart(const imp_context *ctx)
{
    return ctx->team &&
           (ctx->team->role == IMP_TEAM_PART || ctx->team->role == IMP_TEAM_MERGE);
}

/* Are walks read from parts, in the place of being made? */
static inline bool imp__team_merges(const imp_context *ctx)
{
    return ctx->team && ctx->team->role == IMP_TEAM_MERGE;
}

/* Are there other processes that work at this moment? */
static inline bool imp__team_ranks(const imp_context *ctx)
{
    return ctx->team && ctx->team->role == IMP_TEAM_RANK;
}

/* Does this process write files? Of the ranks of a team, the first. */
static inline bool imp__team_writes(const imp_context *ctx)
{
    return !ctx->team || ctx->team->role != IMP_TEAM_RANK || ctx->team->host.rank == 0;
}

/* Do files come from rank 0? Then all ranks make every call that reads a file or tests
 * whether it exists. */
static inline bool imp__team_broadcasts(const imp_context *ctx)
{
    return ctx->team && ctx->team->role == IMP_TEAM_RANK && ctx->team->host.broadcast;
}

/* Processes that take the same memory of this machine as this one, itself too. */
static inline int imp__team_here(const imp_context *ctx)
{
    return imp__team_ranks(ctx) && ctx->team->here > 0 ? ctx->team->here : 1;
}

/* What imp__shared_sum finds out besides the sum. */
struct imp_shared {
    struct imp_drops *drops; /* in: those of this rank's items; out: of all */
    bool late;               /* stopped by the deadline of some rank */
};

/* Sum over all items of desc; without a team, imp__parallel_sum. The status is that of the
 * first rank that failed, on every rank. */
enum imp_status imp__shared_sum(imp_context *ctx, const struct imp_loop *loop,
                                const struct imp_sum_desc *desc,
                                enum imp_status (*work)(size_t i, int worker,
                                                        void *result, void *payload),
                                struct imp_shared *shared);

/* Add up what the ranks have in f, so that all have the sums; blocks without a term are
 * not sent. f->sum may be NULL. */
enum imp_status imp__shared_fixed(imp_context *ctx, struct imp_fixed_sum *f);

/* Is it so on any rank? Clocks and users differ between ranks; what follows may not. Parts
 * have no ranks to compare with: `here`. */
enum imp_status imp__team_any(imp_context *ctx, bool here, bool *any);

/* All get the status of rank 0, its message, and its bytes. */
struct imp_bytes;
enum imp_status imp__team_broadcast(imp_context *ctx, enum imp_status st,
                                    struct imp_bytes *bytes);

/* Bytes that every rank has computed alike: parts keep them, and *known: a merge
 * has read them instead. */
enum imp_status imp__team_keep(imp_context *ctx, void *bytes, size_t n, bool *known);

/* The version, and the instruction sets by which Embree and libm choose their code: equal
 * where bits are to be. */
void imp__machine_text(char text[256]);

/* Join a team of this role; host.ranks == 0: leave. */
enum imp_status imp__team_join(imp_context *ctx, const struct imp_team *host,
                               enum imp_team_role role);

#endif

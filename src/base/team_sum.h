/* SPDX-License-Identifier: Apache-2.0
 *
 * Inside of sums by a team: a rank's share of the items, and its message. */
#ifndef IMP_BASE_TEAM_SUM_H
#define IMP_BASE_TEAM_SUM_H

#include "file.h"
#include "sum_tree.h"
#include "team.h"

/* The items of this rank among [first, first + n_items), in the order of its calls. */
struct imp__share {
    struct imp__team *team;
    pthread_mutex_t lock;
    size_t first, n_items;
    size_t begin, next, end; /* of the present chunk */
    size_t before, after; /* items that the team has done when it begins, and has ended */
    bool more;            /* there may be other chunks */
};

/* A rank's message to the others: a head, then nodes of the tree, each behind its place. */
struct imp__sum_head {
    uint32_t status, late;
    uint64_t items, group, size, nodes, state;
    struct imp_drops drops;
    char error[512];
};
struct imp__sum_place {
    uint64_t group, index;
    int64_t level;
};

struct imp__sharing {
    imp_context *ctx;
    const struct imp_sum_desc *desc; /* the caller's */
    struct imp_sum_tree tree;
    struct imp__share share;
    enum imp_status (*work)(size_t i, int worker, void *result, void *payload);
    void *payload;
    struct imp_bytes message;
    uint64_t nodes; /* in the message */
    bool own;       /* this rank's items are being computed */
    bool no_memory;
    struct imp__sum_head all; /* the messages of all ranks, combined */
    int failed;               /* the first rank that did */
    bool strange;
    int left; /* > 0: the first rank whose parameters are others, plus 1 */
};

void imp__message_node(struct imp__sharing *s, const struct imp_sum_node *node);
/* The message: what was computed, and how it went. In `head` alone where there is no
 * memory for it. */
void imp__message_end(struct imp__sharing *s, enum imp_status st,
                      const struct imp_shared *shared, struct imp__sum_head *head);
/* Put the nodes of a message, behind its head, into the tree. False: there are less, or
 * they are of another tree. */
bool imp__message_nodes_put(struct imp__sharing *s, const unsigned char *at, size_t bytes,
                            uint64_t nodes);
/* As imp_sum_desc.add, and as the `receive` of a gather; their payload is the sharing. */
void imp__sharing_add(void *into, const void *from, void *payload);
void imp__sharing_receive(void *receiver, int rank, const void *message, size_t bytes);

/* Compute all, and keep the sums of chunks. */
enum imp_status imp__chunks_keep(struct imp__sharing *s, const struct imp_loop *loop,
                                 struct imp_shared *shared);
/* Chunk by chunk: take what was kept, after computing it again where it was picked. */
enum imp_status imp__chunks_verify(struct imp__sharing *s, const struct imp_loop *loop,
                                   struct imp_shared *shared);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums in a fixed binary tree. Items 0, 1, 2, ... are cut into groups of `group`; node
 * (l, i) of a group is the sum of its items [i 2^l, (i + 1) 2^l):
 *
 *     node(l, i) = node(l - 1, 2 i) + node(l - 1, 2 i + 1)
 *
 * in this order, or the first child alone where the second has no items. Results may
 * arrive in any order and from several threads: floating-point sums depend on the items
 * alone. Nodes of a range of items that was computed elsewhere may be put in place of the
 * items. What is kept is one result for every node whose sibling is not known yet: for
 * items that arrive nearly in order, log2(group) and a few per thread. */
#ifndef IMP_BASE_SUM_TREE_H
#define IMP_BASE_SUM_TREE_H

#include "context.h"

struct imp_sum_desc {
    size_t n_items;
    size_t group; /* items of one sum; the last group may have less */
    size_t size;  /* bytes of a result */
    void (*add)(void *into, const void *from, void *payload); /* into += from */
    /* A group's sum is complete; `sum` is the tree's again after the call. Called by any
     * thread, once a group. NULL: the sums stay in the tree as nodes. */
    enum imp_status (*take)(size_t group, void *sum, void *payload);
    void *payload;
};

struct imp_sum_node {
    size_t group, index;
    int level;
    void *sum;
};

struct imp_sum_tree {
    imp_context *ctx;
    struct imp_sum_desc desc;
    pthread_mutex_t lock;
    /* Known, and their siblings are not. */
    struct imp_sum_node *nodes;
    size_t n_nodes, cap_nodes;
    void *spare; /* results not in use: each begins with a pointer to the next */
    size_t most; /* results that were in use at once */
    size_t in_use;
};

enum imp_status imp__sum_tree_create(imp_context *ctx, const struct imp_sum_desc *desc,
                                     struct imp_sum_tree *out);
void imp__sum_tree_destroy(struct imp_sum_tree *t);

/* Room for one result, not cleared; NULL: no memory. It goes back by a put or a drop. */
void *imp__sum_tree_room(struct imp_sum_tree *t);
void imp__sum_tree_drop(struct imp_sum_tree *t, void *room);
/* Result of an item. @return IMP_E_NOMEM, or what `take` returned. */
enum imp_status imp__sum_tree_put(struct imp_sum_tree *t, size_t item, void *room);
/* Sum of a node from elsewhere. IMP_E_ARG if the tree has no such node, or has a part of
 * it already. */
enum imp_status imp__sum_tree_put_node(struct imp_sum_tree *t,
                                       const struct imp_sum_node *node);

#endif

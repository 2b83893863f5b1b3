/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums in a fixed binary tree: nodes that wait for their siblings. */
#include "sum_tree.h"
#include <string.h>

enum imp_status imp__sum_tree_create(imp_context *ctx, const struct imp_sum_desc *desc,
                                     struct imp_sum_tree *out)
{
    *out = (struct imp_sum_tree){.ctx = ctx, .desc = *desc};
    out->desc.group =
        imp_clamp(desc->group, (size_t)1, imp_max(desc->n_items, (size_t)1));
    if (pthread_mutex_init(&out->lock, NULL) == 0) return IMP_OK;
    out->ctx = NULL;
    return imp__error(ctx, IMP_E_NOMEM, "no lock for a sum");
}

void imp__sum_tree_destroy(struct imp_sum_tree *t)
{
    if (!t->ctx) return;
    for (size_t k = 0; k < t->n_nodes; k++) imp__release(t->ctx, t->nodes[k].sum);
    for (void *room = t->spare, *next; room; room = next) {
        memcpy(&next, room, sizeof next);
        imp__release(t->ctx, room);
    }
    imp__release(t->ctx, t->nodes);
    pthread_mutex_destroy(&t->lock);
    *t = (struct imp_sum_tree){0};
}

void *imp__sum_tree_room(struct imp_sum_tree *t)
{
    void *room = NULL;
    pthread_mutex_lock(&t->lock);
    if (t->spare) {
        room = t->spare;
        memcpy(&t->spare, room, sizeof t->spare);
    }
    t->most = imp_max(t->most, ++t->in_use);
    pthread_mutex_unlock(&t->lock);
    return room ? room : imp__alloc_raw(t->ctx, 1, imp_max(t->desc.size, sizeof room));
}

/* Lock held. */
static void spare_add(struct imp_sum_tree *t, void *room)
{
    memcpy(room, &t->spare, sizeof t->spare);
    t->spare = room;
    t->in_use--;
}

void imp__sum_tree_drop(struct imp_sum_tree *t, void *room)
{
    if (!room) return;
    pthread_mutex_lock(&t->lock);
    spare_add(t, room);
    pthread_mutex_unlock(&t->lock);
}

static size_t group_items(const struct imp_sum_tree *t, size_t group)
{
    return imp_min(t->desc.group, t->desc.n_items - group * t->desc.group);
}

/* Are there no items in the node beside this one? Those of left nodes have some. */
static bool alone(size_t items, int level, size_t index)
{
    return (index & 1) == 0 && (index + 1) << level >= items;
}

/* Lock held; index of the node, or n_nodes. */
static size_t node_find(const struct imp_sum_tree *t, size_t group, int level,
                        size_t index)
{
    size_t k = 0;
    while (k < t->n_nodes && !(t->nodes[k].group == group && t->nodes[k].level == level &&
                               t->nodes[k].index == index))
        k++;
    return k;
}

/* Lock held, and given back: the node waits for its sibling, or for who takes it. */
static enum imp_status node_keep(struct imp_sum_tree *t, struct imp_sum_node node)
{
    struct imp_sum_node *grown =
        imp__grow(t->ctx, t->nodes, &t->cap_nodes, t->n_nodes + 1, sizeof *grown);
    if (grown) {
        t->nodes = grown;
        t->nodes[t->n_nodes++] = node;
    } else {
        spare_add(t, node.sum);
    }
    pthread_mutex_unlock(&t->lock);
    return grown ? IMP_OK : imp__error(t->ctx, IMP_E_NOMEM, "no memory for sums");
}

/* Put a node, and add up while siblings are there. */
static enum imp_status node_put(struct imp_sum_tree *t, struct imp_sum_node node)
{
    const size_t items = group_items(t, node.group);
    pthread_mutex_lock(&t->lock);
    for (;; node.level++, node.index >>= 1) {
        if (node.index == 0 && (size_t)1 << node.level >= items) break;
        if (alone(items, node.level, node.index)) continue;
        const size_t k = node_find(t, node.group, node.level, node.index ^ 1);
        if (k == t->n_nodes) return node_keep(t, node);
        void *other = t->nodes[k].sum;
        t->nodes[k] = t->nodes[--t->n_nodes];
        void *left = node.index & 1 ? other : node.sum;
        void *right = node.index & 1 ? node.sum : other;
        pthread_mutex_unlock(&t->lock);
        t->desc.add(left, right, t->desc.payload);
        pthread_mutex_lock(&t->lock);
        spare_add(t, right);
        node.sum = left;
    }
    if (t->desc.take) {
        pthread_mutex_unlock(&t->lock);
        const enum imp_status st = t->desc.take(node.group, node.sum, t->desc.payload);
        imp__sum_tree_drop(t, node.sum);
        return st;
    }
    return node_keep(t, node);
}

enum imp_status imp__sum_tree_put(struct imp_sum_tree *t, size_t item, void *room)
{
    const size_t group = item / t->desc.group;
    return node_put(t,
                    (struct imp_sum_node){group, item - group * t->desc.group, 0, room});
}

enum imp_status imp__sum_tree_put_node(struct imp_sum_tree *t,
                                       const struct imp_sum_node *node)
{
    const size_t groups = (t->desc.n_items + t->desc.group - 1) / t->desc.group;
    bool fine = node->group < groups && node->level >= 0 && node->level < 63 &&
                node->index < SIZE_MAX >> node->level;
    fine = fine && node->index << node->level < group_items(t, node->group);
    pthread_mutex_lock(&t->lock);
    for (size_t k = 0; fine && k < t->n_nodes; k++) { /* one inside the other? */
        const struct imp_sum_node *n = &t->nodes[k];
        const int level = imp_max(n->level, node->level);
        fine = n->group != node->group ||
               n->index >> (level - n->level) != node->index >> (level - node->level);
    }
    pthread_mutex_unlock(&t->lock);
    if (!fine)
        return imp__error(t->ctx, IMP_E_ARG,
                          "node %d:%zu of sum %zu is not one of this tree, or known",
                          node->level, node->index, node->group);
    struct imp_sum_node own = *node;
    own.sum = imp__sum_tree_room(t);
    if (!own.sum) return imp__error(t->ctx, IMP_E_NOMEM, "no memory for sums");
    memcpy(own.sum, node->sum, t->desc.size);
    return node_put(t, own);
}

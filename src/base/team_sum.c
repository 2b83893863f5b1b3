/* SPDX-License-Identifier: Apache-2.0
 *
 * A sum over items by all ranks of a team. */
#include "team_sum.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- Who computes what --------------------------------------------------------------- */

/* A picture is exchanged in windows: what a rank sends and receives between two gathers
 * takes this much memory, or 64 groups of each rank, which are enough for equal shares. */
#define WINDOW_BYTES  ((size_t)2 << 20)
#define WINDOW_GROUPS ((size_t)64)

static size_t window_items(const struct imp__sharing *s)
{
    const size_t n = s->desc->n_items, group = s->tree.desc.group;
    const size_t groups =
        imp_max(WINDOW_BYTES / (s->desc->size + sizeof(struct imp__sum_place)),
                WINDOW_GROUPS * (size_t)s->share.team->host.ranks);
    return groups < n / group ? groups * group : n;
}

static void share_begin(struct imp__share *s, size_t first, size_t n_items)
{
    const struct imp_team *team = &s->team->host;
    const size_t ranks = (size_t)team->ranks, rank = (size_t)team->rank;
    s->first = s->begin = s->next = s->end = first;
    s->n_items = n_items;
    s->before = s->after = s->team->role == IMP_TEAM_MERGE ? n_items : 0;
    s->more = team->next != NULL;
    if (s->team->role == IMP_TEAM_MERGE || team->next) return;
    /* Parts of any two cuts with a common border meet there: floor(n i/k). */
    s->begin = s->next = first + (size_t)((unsigned __int128)n_items * rank / ranks);
    s->end = first + (size_t)((unsigned __int128)n_items * (rank + 1) / ranks);
    s->after = n_items;
}

/* Whoever is idle takes the next chunk. As many chunks as there are ranks have one size,
 * the largest power of two with which they take half of what is left: the first begin at
 * multiples of their size, so that few nodes are their sums, and the last are one item, so
 * that all ranks end together. Returns false behind the last. */
static bool chunk_at(struct imp__share *s, uint64_t chunk)
{
    const size_t ranks = (size_t)s->team->host.ranks;
    size_t done = 0, size = 1;
    while (size * 2 * ranks * 2 <= s->n_items) size *= 2;
    for (;; chunk -= ranks) {
        while (size > 1 && size * ranks * 2 > s->n_items - done) size /= 2;
        if (chunk < ranks || size == 1) break;
        done += ranks * size;
    }
    s->before = imp_min(done + chunk / ranks * ranks * size, s->n_items);
    s->after = imp_min(s->before + ranks * size, s->n_items);
    s->begin = s->next = s->first + imp_min(done + (size_t)chunk * size, s->n_items);
    s->end = imp_min(s->next + size, s->first + s->n_items);
    return s->next < s->end;
}

static bool share_take(struct imp__share *s, size_t *item)
{
    pthread_mutex_lock(&s->lock);
    while (s->next == s->end && s->more) {
        const int64_t c = s->team->host.next(s->team->round, s->team->host.payload);
        s->more = c >= 0 && (uint64_t)c <= s->n_items && chunk_at(s, (uint64_t)c);
    }
    const bool got = s->next < s->end;
    if (got) *item = s->next++;
    pthread_mutex_unlock(&s->lock);
    return got;
}

/* Items that all ranks have done, if they are equally fast. */
static size_t share_reached(void *payload)
{
    struct imp__share *s = &((struct imp__sharing *)payload)->share;
    pthread_mutex_lock(&s->lock);
    const double part = s->end > s->begin
                            ? (double)(s->next - s->begin) / (double)(s->end - s->begin)
                            : 1;
    const size_t reached = s->before + (size_t)(part * (double)(s->after - s->before));
    pthread_mutex_unlock(&s->lock);
    return reached;
}

/* ---- Messages of a rank to the others -------------------------------------------------- */

void imp__message_node(struct imp__sharing *s, const struct imp_sum_node *node)
{
    const struct imp__sum_place at = {node->group, node->index, node->level};
    s->no_memory |= !imp__bytes_add(s->ctx, &s->message, &at, sizeof at) ||
                    !imp__bytes_add(s->ctx, &s->message, node->sum, s->desc->size);
    s->nodes++;
}

void imp__sharing_add(void *into, const void *from, void *payload)
{
    const struct imp__sharing *s = payload;
    s->desc->add(into, from, s->desc->payload);
}

/* A group that this rank completed alone goes to the others; by any thread. */
static enum imp_status sum_take(size_t group, void *sum, void *payload)
{
    struct imp__sharing *s = payload;
    if (s->own) {
        const size_t items =
            imp_min(s->tree.desc.group, s->desc->n_items - group * s->tree.desc.group);
        struct imp_sum_node node = {.group = group, .sum = sum};
        while ((size_t)1 << node.level < items) node.level++;
        pthread_mutex_lock(&s->share.lock);
        imp__message_node(s, &node);
        pthread_mutex_unlock(&s->share.lock);
    }
    return s->desc->take(group, sum, s->desc->payload);
}

static enum imp_status item_work(size_t i, int worker, int slot, void *payload)
{
    struct imp__sharing *s = payload;
    size_t item;
    (void)i, (void)slot;
    if (!share_take(&s->share, &item)) return IMP_OK;
    void *result = imp__sum_tree_room(&s->tree);
    if (!result) return imp__error(s->ctx, IMP_E_NOMEM, "no memory for a part of a sum");
    const enum imp_status st = s->work(item, worker, result, s->payload);
    if (st == IMP_OK) return imp__sum_tree_put(&s->tree, item, result);
    imp__sum_tree_drop(&s->tree, result);
    return st;
}

bool imp__message_nodes_put(struct imp__sharing *s, const unsigned char *at, size_t bytes,
                            uint64_t nodes)
{
    struct imp__sum_place p;
    if (bytes / (sizeof p + s->desc->size) < nodes) return false;
    for (uint64_t k = 0; k < nodes; k++, at += sizeof p + s->desc->size) {
        memcpy(&p, at, sizeof p);
        const struct imp_sum_node node = {.group = (size_t)p.group,
                                          .index = (size_t)p.index,
                                          .level = (int)p.level,
                                          .sum = (void *)(uintptr_t)(at + sizeof p)};
        if (imp__sum_tree_put_node(&s->tree, &node) != IMP_OK) return false;
    }
    return true;
}

void imp__sharing_receive(void *receiver, int rank, const void *message, size_t bytes)
{
    struct imp__sharing *s = receiver;
    const unsigned char *at = message;
    struct imp__sum_head head;
    if (s->strange) return;
    s->strange = bytes < sizeof head;
    if (s->strange) return;
    memcpy(&head, at, sizeof head);
    s->strange = head.items != s->desc->n_items || head.group != s->tree.desc.group ||
                 head.size != s->desc->size || head.drops.n_keys < 0 ||
                 head.drops.n_keys > IMP_DROP_KEYS;
    if (s->strange) return;
    head.error[sizeof head.error - 1] = 0;
    if (s->share.team->role == IMP_TEAM_RANK && head.state != s->share.team->state &&
        !s->left)
        s->left = rank + 1;
    s->all.late |= head.late;
    imp__drops_merge(&s->all.drops, &head.drops);
    /* A failure counts before a wish to stop, and that before a time that is up. */
    const uint32_t was = s->all.status, is = head.status;
    if (is != IMP_OK &&
        (was == IMP_OK || (was == IMP_CANCELLED && is != IMP_CANCELLED))) {
        s->all.status = is;
        s->failed = rank;
        memcpy(s->all.error, head.error, sizeof head.error);
    }
    if (rank == s->share.team->host.rank) return;
    s->strange =
        !imp__message_nodes_put(s, at + sizeof head, bytes - sizeof head, head.nodes);
}

void imp__message_end(struct imp__sharing *s, enum imp_status st,
                      const struct imp_shared *shared, struct imp__sum_head *head)
{
    memset(head, 0, sizeof *head); /* with what is between the fields: it is written */
    for (size_t k = 0; k < s->tree.n_nodes; k++) imp__message_node(s, &s->tree.nodes[k]);
    if (s->no_memory) st = imp__error(s->ctx, IMP_E_NOMEM, "no memory for a message");
    head->status = st;
    head->late = shared->late;
    head->items = s->desc->n_items;
    head->group = s->tree.desc.group;
    head->size = s->desc->size;
    head->nodes = s->no_memory ? 0 : s->nodes;
    head->state = s->ctx->team->role == IMP_TEAM_RANK ? s->ctx->team->state : 0;
    head->drops = *shared->drops;
    if (st != IMP_OK)
        snprintf(head->error, sizeof head->error, "%s", imp_last_error(s->ctx));
    if (!s->no_memory) memcpy(s->message.data, head, sizeof *head);
}

/* Sends what this rank computed, and completes the tree with what the others did. */
static enum imp_status exchange(struct imp__sharing *s, enum imp_status st,
                                struct imp_shared *shared)
{
    struct imp__team *team = s->share.team;
    struct imp__sum_head head;
    imp__message_end(s, st, shared, &head);
    const enum imp_status mine = (enum imp_status)head.status;
    s->own = false;
    st = team->host.gather(s->no_memory ? (const void *)&head : s->message.data,
                           s->no_memory ? sizeof head : s->message.size,
                           imp__sharing_receive, s, team->host.payload);
    team->round++;
    if (st != IMP_OK) return imp__error_prefix(s->ctx, st, "the team");
    /* A part gets no answer: its status is that of its own work. */
    if (team->role == IMP_TEAM_PART && mine != IMP_OK) return mine;
    if (s->strange)
        return imp__error(s->ctx, IMP_E_ARG,
                          "what the ranks of a team, or parts, have computed is not of "
                          "one and the same run");
    if (s->left)
        return imp__error(s->ctx, IMP_E_ARG,
                          "the parameters of rank %d are not those of rank %d: their "
                          "optimisers have gone apart",
                          s->left - 1, team->host.rank);
    *shared->drops = s->all.drops;
    shared->late = s->all.late != 0;
    st = (enum imp_status)s->all.status;
    if (st != IMP_OK && st != IMP_CANCELLED)
        return imp__error(s->ctx, st, "rank %d: %s", s->failed, s->all.error);
    return st;
}

/* ---- All --------------------------------------------------------------------------- */

/* Items [first, end): each rank computes some, and all get the sums of all. */
static enum imp_status window_run(struct imp__sharing *s, const struct imp_loop *loop,
                                  size_t first, size_t end, struct imp_shared *shared)
{
    const struct imp__sum_head none = {0};
    const double hi = loop->fraction_hi > 0 ? loop->fraction_hi : 1,
                 span = hi - loop->fraction_lo, all = (double)s->desc->n_items;
    struct imp_loop each = *loop;
    enum imp_status st = IMP_OK;
    share_begin(&s->share, first, end - first);
    s->own = true;
    s->nodes = 0;
    s->message.size = 0;
    *shared->drops = (struct imp_drops){0};
    /* A rank that cannot begin sends its failure to the others. */
    s->no_memory |= !imp__bytes_add(s->ctx, &s->message, &none, sizeof none);
    each.n_items = end - first;
    each.fraction_lo = loop->fraction_lo + span * (double)first / all;
    each.fraction_hi = loop->fraction_lo + span * (double)end / all;
    each.units *= (double)(end - first) / all;
    each.work = item_work;
    each.commit = NULL;
    each.payload = s;
    each.window = imp__sum_window(s->ctx);
    each.reached = share_reached;
    if (!s->no_memory) st = imp__parallel(s->ctx, &each, NULL);
    shared->late =
        st == IMP_CANCELLED && loop->deadline_s > 0 && imp__now() >= loop->deadline_s;
    return exchange(s, st, shared);
}

enum imp_status imp__shared_sum(imp_context *ctx, const struct imp_loop *loop,
                                const struct imp_sum_desc *desc,
                                enum imp_status (*work)(size_t i, int worker,
                                                        void *result, void *payload),
                                struct imp_shared *shared)
{
    enum imp_status st = IMP_OK;
    struct imp_sum_desc own = *desc;
    struct imp__sharing s = {
        .ctx = ctx, .desc = desc, .work = work, .payload = loop->payload};
    const bool shares = imp__team_shares(ctx);
    shared->late = false;
    if (shares) {
        own.add = imp__sharing_add;
        own.take = sum_take;
        own.payload = &s;
        s.share.team = ctx->team;
    }
    IMP_TRY(imp__sum_tree_create(ctx, &own, &s.tree));
    if (!shares) {
        st = imp__parallel_sum(ctx, loop, &s.tree, 0, work, NULL);
        shared->late =
            st == IMP_CANCELLED && loop->deadline_s > 0 && imp__now() >= loop->deadline_s;
    } else if (ctx->team->role == IMP_TEAM_RECORD) {
        st = imp__chunks_keep(&s, loop, shared);
    } else if (ctx->team->role == IMP_TEAM_VERIFY) {
        st = imp__chunks_verify(&s, loop, shared);
    } else {
        const bool locks = pthread_mutex_init(&s.share.lock, NULL) == 0;
        /* Files hold one message a sum. */
        const size_t n = desc->n_items,
                     window = imp__team_apart(ctx) ? n : window_items(&s);
        s.no_memory = !locks;
        for (size_t first = 0; first < n && st == IMP_OK; first += window)
            st = window_run(&s, loop, first, imp_min(first + window, n), shared);
        if (locks) pthread_mutex_destroy(&s.share.lock);
    }
out:
    imp__bytes_free(ctx, &s.message);
    imp__sum_tree_destroy(&s.tree);
    return st;
}

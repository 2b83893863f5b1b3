/* SPDX-License-Identifier: Apache-2.0
 *
 * A sum over items by all ranks of a team. */
#include "file.h"
#include "team.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- Who computes what --------------------------------------------------------------- */

/* Chunks of a rank, where whoever is idle takes the next. */
#define CHUNKS 16

/* The items of this rank, in the order of its calls. */
struct share {
    struct imp__team *team;
    pthread_mutex_t lock;
    size_t n_items, chunk;
    size_t next, end; /* of the present chunk */
    bool more;        /* there may be other chunks */
};

static void share_begin(struct share *s, struct imp__team *team, size_t n_items)
{
    const size_t ranks = (size_t)team->host.ranks, rank = (size_t)team->host.rank;
    *s = (struct share){.team = team, .n_items = n_items, .chunk = 1};
    if (team->role == IMP_TEAM_MERGE) return;
    if (team->host.next) {
        while (s->chunk * 2 * ranks * CHUNKS <= n_items) s->chunk *= 2;
        s->more = true;
        return;
    }
    /* Parts of any two cuts with a common border meet there: floor(n i/k). */
    s->next = (size_t)((unsigned __int128)n_items * rank / ranks);
    s->end = (size_t)((unsigned __int128)n_items * (rank + 1) / ranks);
}

static bool share_take(struct share *s, size_t *item)
{
    pthread_mutex_lock(&s->lock);
    while (s->next == s->end && s->more) {
        const int64_t c = s->team->host.next(s->team->round, s->team->host.payload);
        s->more = c >= 0 && (uint64_t)c <= s->n_items / s->chunk;
        if (!s->more) break;
        s->next = imp_min((size_t)c * s->chunk, s->n_items);
        s->end = imp_min(s->next + s->chunk, s->n_items);
        s->more = s->next < s->n_items;
    }
    const bool got = s->next < s->end;
    if (got) *item = s->next++;
    pthread_mutex_unlock(&s->lock);
    return got;
}

/* ---- What a rank tells the others ------------------------------------------------------ */

struct head {
    uint32_t status, late;
    uint64_t items, group, size, nodes;
    struct imp_drops drops;
    char error[512];
};
struct place {
    uint64_t group, index;
    int64_t level;
};

struct sharing {
    imp_context *ctx;
    const struct imp_sum_desc *desc; /* the caller's */
    struct imp_sum_tree tree;
    struct share share;
    enum imp_status (*work)(size_t i, int worker, void *result, void *payload);
    void *payload;
    struct imp_bytes message;
    uint64_t nodes; /* in the message */
    bool own;       /* this rank's items are being computed */
    bool no_memory;
    struct head all; /* what all ranks say together */
    int failed;      /* the first rank that did */
    bool strange;
};

static void message_node(struct sharing *s, const struct imp_sum_node *node)
{
    const struct place at = {node->group, node->index, node->level};
    s->no_memory |= !imp__bytes_add(s->ctx, &s->message, &at, sizeof at) ||
                    !imp__bytes_add(s->ctx, &s->message, node->sum, s->desc->size);
    s->nodes++;
}

static void sum_add(void *into, const void *from, void *payload)
{
    const struct sharing *s = payload;
    s->desc->add(into, from, s->desc->payload);
}

/* A group that this rank completed alone is told to the others; by any thread. */
static enum imp_status sum_take(size_t group, void *sum, void *payload)
{
    struct sharing *s = payload;
    if (s->own) {
        const size_t items =
            imp_min(s->tree.desc.group, s->desc->n_items - group * s->tree.desc.group);
        struct imp_sum_node node = {.group = group, .sum = sum};
        while ((size_t)1 << node.level < items) node.level++;
        pthread_mutex_lock(&s->share.lock);
        message_node(s, &node);
        pthread_mutex_unlock(&s->share.lock);
    }
    return s->desc->take(group, sum, s->desc->payload);
}

static enum imp_status item_work(size_t i, int worker, int slot, void *payload)
{
    struct sharing *s = payload;
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

static void receive(void *receiver, int rank, const void *message, size_t bytes)
{
    struct sharing *s = receiver;
    const unsigned char *at = message;
    struct head head;
    if (s->strange) return;
    s->strange = bytes < sizeof head;
    if (s->strange) return;
    memcpy(&head, at, sizeof head);
    s->strange = head.items != s->desc->n_items || head.group != s->tree.desc.group ||
                 head.size != s->desc->size || head.drops.n_keys < 0 ||
                 head.drops.n_keys > IMP_DROP_KEYS ||
                 (bytes - sizeof head) / (sizeof(struct place) + head.size) < head.nodes;
    if (s->strange) return;
    head.error[sizeof head.error - 1] = 0;
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
    at += sizeof head;
    if (rank == s->share.team->host.rank) return;
    for (uint64_t k = 0; k < head.nodes && !s->strange; k++) {
        struct place p;
        memcpy(&p, at, sizeof p);
        at += sizeof p;
        const struct imp_sum_node node = {.group = (size_t)p.group,
                                          .index = (size_t)p.index,
                                          .level = (int)p.level,
                                          .sum = (void *)(uintptr_t)at};
        s->strange = imp__sum_tree_put_node(&s->tree, &node) != IMP_OK;
        at += s->desc->size;
    }
}

/* Threads complete groups in any order. */
static int place_compare(const void *a, const void *b)
{
    struct place x, y;
    memcpy(&x, a, sizeof x);
    memcpy(&y, b, sizeof y);
    if (x.group != y.group) return x.group < y.group ? -1 : 1;
    if (x.level != y.level) return x.level < y.level ? -1 : 1;
    return (x.index > y.index) - (x.index < y.index);
}
static void nodes_sort(struct sharing *s)
{
    qsort(s->message.data + sizeof(struct head), (size_t)s->nodes,
          sizeof(struct place) + s->desc->size, place_compare);
}

/* The message: what was computed, and how it went. In `head` alone where there is no
 * memory for it. */
static void message_end(struct sharing *s, enum imp_status st,
                        const struct imp_shared *shared, struct head *head)
{
    memset(head, 0, sizeof *head); /* with what is between the fields: it is written */
    for (size_t k = 0; k < s->tree.n_nodes; k++) message_node(s, &s->tree.nodes[k]);
    if (s->no_memory) st = imp__error(s->ctx, IMP_E_NOMEM, "no memory for a message");
    head->status = st;
    head->late = shared->late;
    head->items = s->desc->n_items;
    head->group = s->tree.desc.group;
    head->size = s->desc->size;
    head->nodes = s->no_memory ? 0 : s->nodes;
    head->drops = *shared->drops;
    if (st != IMP_OK)
        snprintf(head->error, sizeof head->error, "%s", imp_last_error(s->ctx));
    if (!s->no_memory) memcpy(s->message.data, head, sizeof *head);
}

/* Tell what this rank computed, and complete the tree with what the others did. */
static enum imp_status exchange(struct sharing *s, enum imp_status st,
                                struct imp_shared *shared)
{
    struct imp__team *team = s->share.team;
    struct head head;
    message_end(s, st, shared, &head);
    s->own = false;
    st = team->host.gather(s->no_memory ? (const void *)&head : s->message.data,
                           s->no_memory ? sizeof head : s->message.size, receive, s,
                           team->host.payload);
    team->round++;
    if (st != IMP_OK) return imp__error_prefix(s->ctx, st, "the team");
    if (s->strange)
        return imp__error(s->ctx, IMP_E_ARG,
                          "what the ranks of a team, or parts, have computed is not of "
                          "one and the same run");
    *shared->drops = s->all.drops;
    shared->late = s->all.late != 0;
    st = (enum imp_status)s->all.status;
    if (st != IMP_OK && st != IMP_CANCELLED)
        return imp__error(s->ctx, st, "rank %d: %s", s->failed, s->all.error);
    return st;
}

/* ---- Sums that are kept, or verified -------------------------------------------------- */

#define KEPT_CHUNKS 64 /* of a sum, at most */

/* Items of a chunk: aligned, so that few nodes are its sum. */
static size_t chunk_size(const struct imp_sum_desc *desc)
{
    size_t n = 1;
    while (n * KEPT_CHUNKS < desc->n_items) n *= 2;
    return desc->group < n ? (n + desc->group - 1) / desc->group * desc->group : n;
}

static enum imp_status chunk_take(size_t group, void *sum, void *payload)
{
    struct sharing *c = payload;
    const size_t items =
        imp_min(c->tree.desc.group, c->desc->n_items - group * c->tree.desc.group);
    struct imp_sum_node node = {.group = group, .sum = sum};
    while ((size_t)1 << node.level < items) node.level++;
    pthread_mutex_lock(&c->share.lock);
    message_node(c, &node);
    pthread_mutex_unlock(&c->share.lock);
    return IMP_OK;
}

/* The message that a rank would send that computed items [first, end). */
static enum imp_status chunk_compute(const struct sharing *s, const struct imp_loop *loop,
                                     size_t first, size_t end, struct imp_shared *shared,
                                     struct imp_bytes *message)
{
    enum imp_status st = IMP_OK;
    const struct head none = {0};
    struct sharing c = {
        .ctx = s->ctx, .desc = s->desc, .work = s->work, .payload = s->payload};
    struct imp_sum_desc own = *s->desc;
    struct imp_loop each = *loop;
    struct head head;
    const double all = (double)s->desc->n_items,
                 span = loop->fraction_hi - loop->fraction_lo;
    own.add = sum_add;
    own.take = chunk_take;
    own.payload = &c;
    *shared->drops = (struct imp_drops){0};
    IMP_TRY(imp__sum_tree_create(s->ctx, &own, &c.tree));
    if (pthread_mutex_init(&c.share.lock, NULL) != 0 ||
        !imp__bytes_add(s->ctx, &c.message, &none, sizeof none))
        IMP_TRY(imp__error(s->ctx, IMP_E_NOMEM, "no memory for a message"));
    each.n_items = end - first;
    each.fraction_lo = loop->fraction_lo + span * (double)first / all;
    each.fraction_hi = loop->fraction_lo + span * (double)end / all;
    IMP_TRY(imp__parallel_sum(s->ctx, &each, &c.tree, first, c.work, NULL));
    message_end(&c, IMP_OK, shared, &head);
    if (c.no_memory) IMP_TRY(IMP_E_NOMEM);
    nodes_sort(&c);
    *message = c.message;
    c.message = (struct imp_bytes){0};
out:
    if (c.tree.ctx) pthread_mutex_destroy(&c.share.lock);
    imp__bytes_free(s->ctx, &c.message);
    imp__sum_tree_destroy(&c.tree);
    return st;
}

struct stored {
    const void *message;
    size_t bytes;
};
static void stored_receive(void *receiver, int rank, const void *message, size_t bytes)
{
    (void)rank;
    *(struct stored *)receiver = (struct stored){message, bytes};
}

static bool same_nodes(const struct stored *m, const struct imp_bytes *own)
{
    const size_t head = sizeof(struct head);
    return m->bytes == own->size && m->bytes >= head &&
           !memcmp((const unsigned char *)m->message + head, own->data + head,
                   own->size - head);
}

/* Chunk by chunk: compute and keep it, or take what was kept, after computing it again
 * where it was picked. */
static enum imp_status chunks_exchange(struct sharing *s, const struct imp_loop *loop,
                                       struct imp_shared *shared)
{
    struct imp__team *team = s->share.team;
    const bool records = team->role == IMP_TEAM_RECORD;
    const size_t n = s->desc->n_items, step = chunk_size(s->desc);
    enum imp_status st = IMP_OK;
    struct imp_bytes message = {0};
    for (size_t first = 0; first < n; first += step) {
        const size_t end = imp_min(first + step, n);
        struct stored m = {0};
        const bool computes = records || team->pick(team->host.payload);
        if (computes) IMP_TRY(chunk_compute(s, loop, first, end, shared, &message));
        if (records) m = (struct stored){message.data, message.size};
        IMP_TRY(team->host.gather(m.message, m.bytes, stored_receive, &m,
                                  team->host.payload));
        if (computes && !records && !same_nodes(&m, &message)) {
            team->differs = true;
            IMP_TRY(imp__error(s->ctx, IMP_E_ARG,
                               "walks %zu to %zu of %zu pieces have other sums", first,
                               end - 1, n));
        }
        receive(s, team->host.rank + 1, m.message, m.bytes);
        imp__bytes_free(s->ctx, &message);
        if (s->strange)
            IMP_TRY(imp__error(s->ctx, IMP_E_ARG,
                               "the sums that were kept are of "
                               "another run"));
    }
    *shared->drops = s->all.drops;
out:
    imp__bytes_free(s->ctx, &message);
    return st;
}

enum imp_status imp__shared_sum(imp_context *ctx, const struct imp_loop *loop,
                                const struct imp_sum_desc *desc,
                                enum imp_status (*work)(size_t i, int worker,
                                                        void *result, void *payload),
                                struct imp_shared *shared)
{
    enum imp_status st = IMP_OK;
    struct imp_sum_desc own = *desc;
    struct sharing s = {.ctx = ctx, .desc = desc, .work = work, .payload = loop->payload};
    const struct head none = {0};
    const bool shares = imp__team_shares(ctx);
    const bool keeps = shares && (ctx->team->role == IMP_TEAM_RECORD ||
                                  ctx->team->role == IMP_TEAM_VERIFY);
    shared->late = false;
    if (shares) {
        own.add = sum_add;
        own.take = sum_take;
        own.payload = &s;
    }
    IMP_TRY(imp__sum_tree_create(ctx, &own, &s.tree));
    if (keeps) {
        s.share.team = ctx->team;
        st = chunks_exchange(&s, loop, shared);
        goto out;
    }
    if (!shares) {
        st = imp__parallel_sum(ctx, loop, &s.tree, 0, work, NULL);
    } else {
        struct imp_loop each = *loop;
        share_begin(&s.share, ctx->team, desc->n_items);
        s.own = true;
        const bool locks = pthread_mutex_init(&s.share.lock, NULL) == 0;
        /* A rank that cannot begin tells the others. */
        s.no_memory = !locks || !imp__bytes_add(ctx, &s.message, &none, sizeof none);
        each.work = item_work;
        each.commit = NULL;
        each.payload = &s;
        each.window = imp__sum_window(ctx);
        if (!s.no_memory) st = imp__parallel(ctx, &each, NULL);
    }
    shared->late =
        st == IMP_CANCELLED && loop->deadline_s > 0 && imp__now() >= loop->deadline_s;
    if (shares) {
        st = exchange(&s, st, shared);
        pthread_mutex_destroy(&s.share.lock);
    }
out:
    imp__bytes_free(ctx, &s.message);
    imp__sum_tree_destroy(&s.tree);
    return st;
}

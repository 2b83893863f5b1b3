/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums that are kept, or verified: chunks of items, of each the nodes of the tree that it
 * makes by itself. A sum is a head and a message for each chunk. */
#include "team_sum.h"
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#define KEPT_CHUNKS ((size_t)64) /* of a sum, at most */

struct kept_head {
    uint64_t items, group, size, chunks;
    struct imp_drops drops;
};

/* Items of a chunk: aligned, so that few nodes are its sum. */
static size_t chunk_size(const struct imp__sharing *s, size_t chunks)
{
    const size_t group = s->tree.desc.group;
    size_t n = 1;
    while (n * chunks < s->desc->n_items) n *= 2;
    return group < n ? (n + group - 1) / group * group : n;
}

/* ---- A chunk ------------------------------------------------------------------------- */

static enum imp_status chunk_take(size_t group, void *sum, void *payload)
{
    struct imp__sharing *c = payload;
    const size_t items =
        imp_min(c->tree.desc.group, c->desc->n_items - group * c->tree.desc.group);
    struct imp_sum_node node = {.group = group, .sum = sum};
    while ((size_t)1 << node.level < items) node.level++;
    pthread_mutex_lock(&c->share.lock);
    imp__message_node(c, &node);
    pthread_mutex_unlock(&c->share.lock);
    return IMP_OK;
}

static enum imp_status chunk_begin(const struct imp__sharing *s, struct imp__sharing *c)
{
    struct imp_sum_desc own = *s->desc;
    *c = (struct imp__sharing){
        .ctx = s->ctx, .desc = s->desc, .work = s->work, .payload = s->payload};
    own.add = imp__sharing_add;
    own.take = chunk_take;
    own.payload = c;
    const enum imp_status st = imp__sum_tree_create(s->ctx, &own, &c->tree);
    if (st != IMP_OK || pthread_mutex_init(&c->share.lock, NULL) == 0) return st;
    imp__sum_tree_destroy(&c->tree);
    return imp__error(s->ctx, IMP_E_NOMEM, "no lock for a sum");
}

static int place_compare(const void *a, const void *b)
{
    struct imp__sum_place x, y;
    memcpy(&x, a, sizeof x);
    memcpy(&y, b, sizeof y);
    if (x.group != y.group) return x.group < y.group ? -1 : 1;
    if (x.level != y.level) return x.level < y.level ? -1 : 1;
    return (x.index > y.index) - (x.index < y.index);
}

/* Its message, of what it has; threads complete groups in any order. */
static enum imp_status chunk_message(struct imp__sharing *c)
{
    for (size_t k = 0; k < c->tree.n_nodes; k++) imp__message_node(c, &c->tree.nodes[k]);
    if (c->no_memory) return imp__error(c->ctx, IMP_E_NOMEM, "no memory for a message");
    if (c->nodes > 1)
        qsort(c->message.data, (size_t)c->nodes,
              sizeof(struct imp__sum_place) + c->desc->size, place_compare);
    return IMP_OK;
}

static void chunk_end(struct imp__sharing *c)
{
    if (c->tree.ctx) pthread_mutex_destroy(&c->share.lock);
    imp__sum_tree_destroy(&c->tree);
}

static enum imp_status of_another_run(imp_context *ctx)
{
    return imp__error(ctx, IMP_E_ARG, "the sums that were kept are of another run");
}

/* ---- Keeping ------------------------------------------------------------------------- */

struct keeping {
    struct imp__sharing *s;
    struct imp__sharing *chunks;
    _Atomic size_t *left; /* [chunks] items that are not done */
    size_t step;
};

/* All items are done, or none follows: to the whole. */
static enum imp_status chunk_close(struct imp__sharing *s, struct imp__sharing *c)
{
    const enum imp_status st = chunk_message(c);
    chunk_end(c);
    if (st != IMP_OK) return st;
    return imp__message_nodes_put(s, c->message.data, c->message.size, c->nodes)
               ? IMP_OK
               : of_another_run(s->ctx);
}

static enum imp_status item_keep(size_t i, int worker, int slot, void *payload)
{
    const struct keeping *k = payload;
    struct imp__sharing *c = &k->chunks[i / k->step];
    void *result = imp__sum_tree_room(&c->tree);
    (void)slot;
    if (!result) return imp__error(c->ctx, IMP_E_NOMEM, "no memory for a part of a sum");
    enum imp_status st = c->work(i, worker, result, c->payload);
    if (st != IMP_OK) {
        imp__sum_tree_drop(&c->tree, result);
        return st;
    }
    st = imp__sum_tree_put(&c->tree, i, result);
    if (st == IMP_OK && atomic_fetch_sub(&k->left[i / k->step], 1) == 1)
        st = chunk_close(k->s, c);
    return st;
}

enum imp_status imp__chunks_keep(struct imp__sharing *s, const struct imp_loop *loop,
                                 struct imp_shared *shared)
{
    imp_context *ctx = s->ctx;
    struct imp__team *team = ctx->team;
    const size_t n = s->desc->n_items, group = s->tree.desc.group;
    const size_t node = sizeof(struct imp__sum_place) + s->desc->size;
    /* With several groups the sum of each is kept; with one group, a node for each
     * chunk. */
    const bool one = group >= n;
    size_t chunks = team->chunks(one ? 0 : ((n - 1) / group + 1 + KEPT_CHUNKS) * node,
                                 one ? node : 0, KEPT_CHUNKS, team->host.payload);
    enum imp_status st = IMP_OK;
    if (chunks == 0) {
        st = imp__parallel_sum(ctx, loop, &s->tree, 0, s->work, NULL);
        goto out;
    }
    struct kept_head head;
    memset(&head, 0, sizeof head); /* with what is between the fields */
    struct keeping k = {.s = s, .step = chunk_size(s, chunks)};
    struct imp_loop each = *loop;
    chunks = (n - 1) / k.step + 1;
    k.chunks = imp__alloc(ctx, chunks, sizeof *k.chunks);
    k.left = imp__alloc(ctx, chunks, sizeof *k.left);
    st = k.chunks && k.left ? IMP_OK
                            : imp__error(ctx, IMP_E_NOMEM, "no memory for chunks");
    for (size_t c = 0; c < chunks && st == IMP_OK; c++) {
        atomic_init(&k.left[c], imp_min(k.step, n - c * k.step));
        st = chunk_begin(s, &k.chunks[c]);
    }
    each.work = item_keep;
    each.commit = NULL;
    each.payload = &k;
    each.window = imp__sum_window(ctx);
    if (st == IMP_OK) st = imp__parallel(ctx, &each, NULL);
    /* What was done before it was stopped counts. */
    for (size_t c = 0; c < chunks && st == IMP_CANCELLED; c++)
        if (k.chunks[c].tree.ctx && chunk_close(s, &k.chunks[c]) != IMP_OK)
            st = IMP_E_NOMEM;
    head.items = n;
    head.group = group;
    head.size = s->desc->size;
    head.chunks = chunks;
    head.drops = *shared->drops;
    if (st == IMP_OK) {
        team->n_kept += chunks;
        st = team->host.gather(&head, sizeof head, NULL, NULL, team->host.payload);
    }
    for (size_t c = 0; k.chunks && c < chunks; c++) {
        const struct imp_bytes *m = &k.chunks[c].message;
        if (st == IMP_OK)
            st = team->host.gather(m->data, m->size, NULL, NULL, team->host.payload);
        chunk_end(&k.chunks[c]);
        imp__bytes_free(ctx, &k.chunks[c].message);
    }
    imp__release(ctx, k.chunks);
    imp__release(ctx, (void *)k.left);
out:
    shared->late =
        st == IMP_CANCELLED && loop->deadline_s > 0 && imp__now() >= loop->deadline_s;
    return st;
}

/* ---- Verifying ----------------------------------------------------------------------- */

/* The message of items [first, end). */
static enum imp_status chunk_compute(const struct imp__sharing *s,
                                     const struct imp_loop *loop, size_t first,
                                     size_t end, struct imp_bytes *message)
{
    enum imp_status st = IMP_OK;
    struct imp__sharing c = {0};
    struct imp_loop each = *loop;
    const double all = (double)s->desc->n_items,
                 span = loop->fraction_hi - loop->fraction_lo;
    IMP_TRY(chunk_begin(s, &c));
    each.n_items = end - first;
    each.fraction_lo = loop->fraction_lo + span * (double)first / all;
    each.fraction_hi = loop->fraction_lo + span * (double)end / all;
    IMP_TRY(imp__parallel_sum(s->ctx, &each, &c.tree, first, c.work, NULL));
    IMP_TRY(chunk_message(&c));
    *message = c.message;
    c.message = (struct imp_bytes){0};
out:
    chunk_end(&c);
    imp__bytes_free(s->ctx, &c.message);
    return st;
}

struct stored {
    const unsigned char *message;
    size_t bytes;
};
static void stored_receive(void *receiver, int rank, const void *message, size_t bytes)
{
    (void)rank;
    *(struct stored *)receiver = (struct stored){message, bytes};
}

static enum imp_status stored_take(const struct imp__team *team, struct stored *m)
{
    *m = (struct stored){0};
    return team->host.gather(NULL, 0, stored_receive, m, team->host.payload);
}

enum imp_status imp__chunks_verify(struct imp__sharing *s, const struct imp_loop *loop,
                                   struct imp_shared *shared)
{
    struct imp__team *team = s->share.team;
    const size_t n = s->desc->n_items,
                 node = sizeof(struct imp__sum_place) + s->desc->size;
    enum imp_status st = IMP_OK;
    struct imp_bytes message = {0};
    struct kept_head head = {0};
    struct stored m;
    IMP_TRY(stored_take(team, &m));
    if (m.bytes == sizeof head) memcpy(&head, m.message, sizeof head);
    if (head.items != n || head.group != s->tree.desc.group ||
        head.size != s->desc->size || head.chunks < 1 || head.chunks > KEPT_CHUNKS ||
        head.drops.n_keys < 0 || head.drops.n_keys > IMP_DROP_KEYS)
        IMP_TRY(of_another_run(s->ctx));
    const size_t step = chunk_size(s, (size_t)head.chunks);
    for (size_t first = 0; first < n; first += step) {
        const size_t end = imp_min(first + step, n);
        const bool computes = team->pick(team->host.payload);
        if (computes) IMP_TRY(chunk_compute(s, loop, first, end, &message));
        IMP_TRY(stored_take(team, &m));
        if (computes && (m.bytes != message.size ||
                         memcmp(m.message, message.data, message.size) != 0)) {
            team->differs = true;
            IMP_TRY(imp__error(s->ctx, IMP_E_ARG,
                               "walks %zu to %zu of %zu pieces have other sums", first,
                               end - 1, n));
        }
        imp__bytes_free(s->ctx, &message);
        if (!imp__message_nodes_put(s, m.message, m.bytes, m.bytes / node))
            IMP_TRY(of_another_run(s->ctx));
    }
    *shared->drops = head.drops;
out:
    imp__bytes_free(s->ctx, &message);
    return st;
}

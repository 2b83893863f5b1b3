/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums that are kept, or verified: chunks of items, with the message that a rank would
 * have sent which computed them. */
#include "team_sum.h"
#include <string.h>

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

/* The message that a rank would send that computed items [first, end). */
static enum imp_status chunk_compute(const struct imp__sharing *s,
                                     const struct imp_loop *loop, size_t first,
                                     size_t end, struct imp_shared *shared,
                                     struct imp_bytes *message)
{
    enum imp_status st = IMP_OK;
    const struct imp__sum_head none = {0};
    struct imp__sharing c = {
        .ctx = s->ctx, .desc = s->desc, .work = s->work, .payload = s->payload};
    struct imp_sum_desc own = *s->desc;
    struct imp_loop each = *loop;
    struct imp__sum_head head;
    const double all = (double)s->desc->n_items,
                 span = loop->fraction_hi - loop->fraction_lo;
    own.add = imp__sharing_add;
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
    imp__message_end(&c, IMP_OK, shared, &head);
    if (c.no_memory) IMP_TRY(IMP_E_NOMEM);
    imp__message_sort(&c);
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
    const size_t head = sizeof(struct imp__sum_head);
    return m->bytes == own->size && m->bytes >= head &&
           !memcmp((const unsigned char *)m->message + head, own->data + head,
                   own->size - head);
}

enum imp_status imp__chunks_exchange(struct imp__sharing *s, const struct imp_loop *loop,
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
        imp__sharing_receive(s, team->host.rank + 1, m.message, m.bytes);
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

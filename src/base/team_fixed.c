/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums in fixed point by all ranks of a team: blocks of numbers without a term are not
 * sent. Integers have no order, so that a host that can add them on the way (a tree, or
 * a ring in two rounds) does: a rank then sends and receives two times the blocks that any
 * rank has touched, however many ranks there are. */
#include "file.h"
#include "team.h"
#include <string.h>

#define BLOCK 512        /* numbers */
#define PIECE (1u << 20) /* numbers that are added up at once */

struct head {
    uint64_t n, too_large, bits, blocks, failed;
    double unit;
};

/* How many numbers a block has: the last one has fewer. */
static size_t block_size(const struct imp_fixed_sum *f, size_t block)
{
    return imp_min(f->n - block * BLOCK, (size_t)BLOCK);
}

static bool touched(const struct imp_fixed_sum *f, size_t block)
{
    const size_t first = block * BLOCK, n = block_size(f, block);
    imp_fixed any = 0;
    for (size_t k = first; k < first + n; k++) any |= *imp__fixed_at(f, f->sum, k);
    for (size_t k = first; f->fine && k < first + n; k++)
        any |= *imp__fixed_at(f, f->fine, k);
    return any != 0;
}

/* ---- Gathered: a head, then number and terms of each block ------------------------------ */

struct receiving {
    struct imp_fixed_sum *f;
    int own;
    bool strange, failed;
};

static void blocks_add(struct receiving *r, const unsigned char *at, size_t left,
                       uint64_t blocks)
{
    struct imp_fixed_sum *f = r->f;
    const size_t rows = f->fine ? 2 : 1;
    for (uint64_t b = 0; b < blocks && !r->strange; b++) {
        uint64_t block;
        r->strange = left < sizeof block;
        if (r->strange) break;
        memcpy(&block, at, sizeof block);
        r->strange = !f->sum || block > f->n / BLOCK || block * BLOCK >= f->n;
        if (r->strange) break;
        const size_t first = (size_t)block * BLOCK, n = block_size(f, (size_t)block);
        r->strange = left < sizeof block + rows * n * sizeof(imp_fixed);
        if (r->strange) break;
        at += sizeof block;
        for (size_t row = 0; row < rows; row++) {
            imp_fixed *to = row ? f->fine : f->sum;
            for (size_t k = 0; k < n; k++) {
                int64_t term;
                memcpy(&term, at + k * sizeof term, sizeof term);
                *imp__fixed_at(f, to, first + k) += term;
            }
            at += n * sizeof(imp_fixed);
        }
        left -= sizeof block + rows * n * sizeof(imp_fixed);
    }
}

static void receive(void *receiver, int rank, const void *message, size_t bytes)
{
    struct receiving *r = receiver;
    struct imp_fixed_sum *f = r->f;
    struct head head;
    if (r->strange) return;
    r->strange = bytes < sizeof head;
    if (r->strange) return;
    memcpy(&head, message, sizeof head);
    r->strange = head.n != f->n || (f->sum && head.unit != f->unit);
    r->failed |= head.failed != 0;
    if (rank == r->own || r->strange) return;
    f->too_large += head.too_large;
    f->bits = imp_max(f->bits, head.bits);
    blocks_add(r, (const unsigned char *)message + sizeof head, bytes - sizeof head,
               head.blocks);
}

static bool block_write(imp_context *ctx, const struct imp_fixed_sum *f, imp_fixed *row,
                        size_t first, size_t n, struct imp_bytes *out)
{
    imp_fixed packed[BLOCK];
    for (size_t k = 0; k < n; k++) packed[k] = *imp__fixed_at(f, row, first + k);
    return imp__bytes_add(ctx, out, packed, n * sizeof *packed);
}

static bool blocks_write(imp_context *ctx, const struct imp_fixed_sum *f,
                         struct head *head, struct imp_bytes *out)
{
    bool fits = imp__bytes_add(ctx, out, head, sizeof *head);
    for (uint64_t b = 0; f->sum && b * BLOCK < f->n && fits; b++) {
        const size_t first = (size_t)b * BLOCK, n = block_size(f, (size_t)b);
        if (!touched(f, (size_t)b)) continue;
        head->blocks++;
        fits = imp__bytes_add(ctx, out, &b, sizeof b) &&
               block_write(ctx, f, f->sum, first, n, out) &&
               (!f->fine || block_write(ctx, f, f->fine, first, n, out));
    }
    return fits;
}

/* ---- Added up on the way ---------------------------------------------------------------- */

struct packing {
    struct imp_fixed_sum *f;
    int64_t *ranks;  /* [blocks] how many have touched it */
    int64_t *packed; /* [PIECE + 2 BLOCK] */
};

/* Blocks that are touched from *block on, until a piece is full, to `packed` or, `back`,
 * from it. Returns how many numbers. */
static size_t piece_copy(const struct packing *p, size_t *block, bool back)
{
    const struct imp_fixed_sum *f = p->f;
    size_t at = 0;
    for (; *block * BLOCK < f->n && at < PIECE; ++*block) {
        const size_t first = *block * BLOCK, n = block_size(f, *block);
        if (!p->ranks[*block]) continue;
        for (int row = 0; row < (f->fine ? 2 : 1); row++, at += n) {
            imp_fixed *own = row ? f->fine : f->sum;
            if (back)
                for (size_t k = 0; k < n; k++)
                    *imp__fixed_at(f, own, first + k) = p->packed[at + k];
            else
                for (size_t k = 0; k < n; k++)
                    p->packed[at + k] = *imp__fixed_at(f, own, first + k);
        }
    }
    return at;
}

static enum imp_status blocks_sum(const struct imp__team *team, const struct packing *p)
{
    const size_t blocks = (p->f->n + BLOCK - 1) / BLOCK;
    for (size_t b = 0; b < blocks; b++) p->ranks[b] = touched(p->f, b);
    enum imp_status st = team->host.sum(p->ranks, blocks, team->host.payload);
    for (size_t block = 0, from = 0; block < blocks && st == IMP_OK; from = block) {
        const size_t n = piece_copy(p, &block, false);
        if (n == 0) break;
        st = team->host.sum(p->packed, n, team->host.payload);
        (void)piece_copy(p, &from, true);
    }
    return st;
}

/* ---- Either ------------------------------------------------------------------------------ */

enum imp_status imp__shared_fixed(imp_context *ctx, struct imp_fixed_sum *f)
{
    struct imp__team *team = ctx->team;
    struct imp_bytes out = {0};
    enum imp_status st = IMP_OK;
    if (!imp__team_shares(ctx)) return IMP_OK;
    if (team->role == IMP_TEAM_RECORD) team->in_fixed = true;
    if (team->role == IMP_TEAM_RECORD || team->role == IMP_TEAM_VERIFY) return IMP_OK;
    struct head head = {
        .n = f->n, .too_large = f->too_large, .bits = f->bits, .unit = f->unit};
    const bool sums = team->host.sum && team->role == IMP_TEAM_RANK && f->sum;
    struct packing p = {.f = f};
    struct receiving r = {.f = f, .own = team->host.rank};
    if (sums) {
        p.ranks = imp__alloc(ctx, f->n / BLOCK + 1, sizeof *p.ranks);
        p.packed = imp__alloc_raw(ctx, PIECE + 2 * BLOCK, sizeof *p.packed);
        head.failed = !p.ranks || !p.packed;
    } else {
        head.failed = !blocks_write(ctx, f, &head, &out);
        if (!head.failed) memcpy(out.data, &head, sizeof head);
    }
    /* A rank without memory sends its failure to the others; a part has no others. */
    const bool whole = !sums && !head.failed;
    st = team->role != IMP_TEAM_RANK && head.failed
             ? IMP_E_NOMEM
             : team->host.gather(whole ? (const void *)out.data : &head,
                                 whole ? out.size : sizeof head, receive, &r,
                                 team->host.payload);
    if (st == IMP_OK && (r.strange || r.failed)) st = r.failed ? IMP_E_NOMEM : IMP_E_ARG;
    if (st == IMP_OK && sums) st = blocks_sum(team, &p);
    if (st == IMP_E_NOMEM)
        st = imp__error(ctx, st, "no memory for the sums of %zu numbers", f->n);
    else if (st == IMP_E_ARG)
        st = imp__error(ctx, st, "sums of other ranks are not of this run");
    imp__release(ctx, p.ranks);
    imp__release(ctx, p.packed);
    imp__bytes_free(ctx, &out);
    return st;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Blocks of the bump allocator. Each new block is at least half of everything before
 * it, so the number of allocations grows with the logarithm of the bytes. */
#include "arena.h"
#include <stdint.h>
#include <string.h>

#define BLOCK_MIN ((size_t)64 << 10)

void imp__arena_init(struct imp_arena *a, imp_context *ctx)
{
    *a = (struct imp_arena){.ctx = ctx};
}

void imp__arena_free(struct imp_arena *a)
{
    for (struct imp__arena_block *b = a->first, *next; b; b = next) {
        next = b->next;
        imp__release(a->ctx, b);
    }
    imp__arena_init(a, a->ctx);
}

static bool block_next(struct imp_arena *a, size_t bytes)
{
    struct imp__arena_block *next = a->current ? a->current->next : a->first;
    while (next && next->size < bytes) next = next->next; /* kept blocks may be smaller */
    if (!next) {
        size_t size = imp_max(bytes, imp_max(BLOCK_MIN, a->total / 2));
        size = (size + 31) & ~(size_t)31; /* so that `used`, rounded up, stays inside */
        next = imp__alloc_raw(a->ctx, 1, sizeof *next + size);
        if (!next) return false;
        next->next = NULL;
        next->size = size;
        a->total += size;
        struct imp__arena_block **tail = &a->first;
        while (*tail) tail = &(*tail)->next;
        *tail = next;
    }
    a->current = next;
    a->used = 0;
    return true;
}

void *imp__arena_take_more(struct imp_arena *a, size_t n, size_t size)
{
    size_t bytes;
    if (__builtin_mul_overflow(n, size, &bytes) || bytes > SIZE_MAX / 4) return NULL;
    bytes = (bytes + 31) & ~(size_t)31;
    if (!block_next(a, bytes)) {
        a->failed = true;
        return NULL;
    }
    void *p = a->current->bytes + a->used;
    a->used += bytes;
    return p;
}

void *imp__arena_array(struct imp_arena *a, size_t n, size_t size)
{
    void *p = imp__arena_take(a, n, size);
    if (p) memset(p, 0, n * size);
    return p;
}

char *imp__arena_strdup(struct imp_arena *a, const char *text)
{
    const size_t n = strlen(text) + 1;
    char *copy = imp__arena_take(a, n, 1);
    if (copy) memcpy(copy, text, n);
    return copy;
}

struct imp_arena_mark imp__arena_mark(const struct imp_arena *a)
{
    return (struct imp_arena_mark){a->current, a->used};
}

void imp__arena_rewind(struct imp_arena *a, struct imp_arena_mark mark)
{
    /* A mark of an empty arena leads to the block that it has by now. */
    a->current = mark.block ? mark.block : a->first;
    a->used = mark.used;
}

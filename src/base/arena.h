/* SPDX-License-Identifier: Apache-2.0
 *
 * Bump allocator: many small objects, one release. Blocks are chained, so pointers stay
 * valid while the arena grows; a mark taken before can be rewound to. After a rewind the
 * blocks stay for reuse: a worker's arena stops allocating once it has seen its largest
 * batch. Not for sharing between threads. */
#ifndef IMP_BASE_ARENA_H
#define IMP_BASE_ARENA_H

#include "context.h"

struct imp_arena {
    /* A cache line of its own: every vertex writes it, and its neighbour is another
     * thread's. */
    _Alignas(IMP_CACHE_LINE) imp_context *ctx;
    struct imp__arena_block *first, *current;
    size_t used;  /* in current */
    size_t total; /* bytes of all blocks */
    bool failed;  /* an allocation has failed */
};

struct imp_arena_mark {
    struct imp__arena_block *block;
    size_t used;
};

void imp__arena_init(struct imp_arena *a, imp_context *ctx);
void imp__arena_free(struct imp_arena *a);
struct imp__arena_block {
    struct imp__arena_block *next;
    size_t size;
    _Alignas(64) unsigned char bytes[];
};
void *imp__arena_take_more(struct imp_arena *a, size_t n, size_t size);

/* n*size bytes, aligned to 32, NOT zeroed; NULL if out of memory. */
static inline void *imp__arena_take(struct imp_arena *a, size_t n, size_t size)
{
    size_t bytes;
    if (imp_likely(!__builtin_mul_overflow(n, size, &bytes) && a->current &&
                   bytes <= a->current->size - a->used)) {
        void *p = a->current->bytes + a->used;
        a->used += (bytes + 31) & ~(size_t)31;
        return p;
    }
    return imp__arena_take_more(a, n, size);
}
/* The same, zeroed. */
void *imp__arena_array(struct imp_arena *a, size_t n, size_t size);
char *imp__arena_strdup(struct imp_arena *a, const char *text);
struct imp_arena_mark imp__arena_mark(const struct imp_arena *a);
void imp__arena_rewind(struct imp_arena *a, struct imp_arena_mark mark);

#endif

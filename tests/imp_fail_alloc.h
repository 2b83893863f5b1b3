/* SPDX-License-Identifier: Apache-2.0
 *
 * An allocator that counts blocks and bytes, and fails from the n-th allocation on:
 *
 *     struct fail_alloc heap = {0};
 *     imp_context *fragile = fail_alloc_context(&heap);
 *     heap.fail_at = 3;                                   // 0: never
 *     ... heap.live == 0 afterwards, or something leaked.
 */
#ifndef IMP_FAIL_ALLOC_H
#define IMP_FAIL_ALLOC_H

#include <importon/importon.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct fail_alloc {
    long fail_at;       /* 1: the first */
    bool once;          /* those after it succeed */
    long calls;         /* so far */
    long live;          /* blocks not released */
    size_t bytes, peak; /* in them; the most so far, by one thread */
};
enum { FAIL_ALLOC_HEAD = 64 }; /* in front of a block: its size */

static inline void *fail_alloc_allocate(size_t bytes, void *payload)
{
    struct fail_alloc *heap = payload;
    const long n = __atomic_add_fetch(&heap->calls, 1, __ATOMIC_RELAXED);
    void *p = NULL;
    if (heap->fail_at && (heap->once ? n == heap->fail_at : n >= heap->fail_at))
        return NULL;
    if (bytes > SIZE_MAX - FAIL_ALLOC_HEAD ||
        posix_memalign(&p, 64, bytes + FAIL_ALLOC_HEAD) != 0)
        return NULL;
    __atomic_add_fetch(&heap->live, 1, __ATOMIC_RELAXED);
    const size_t now = __atomic_add_fetch(&heap->bytes, bytes, __ATOMIC_RELAXED);
    if (now > heap->peak) heap->peak = now;
    memcpy(p, &bytes, sizeof bytes);
    return (char *)p + FAIL_ALLOC_HEAD;
}
static inline void fail_alloc_release(void *memory, void *payload)
{
    struct fail_alloc *heap = payload;
    char *block = (char *)memory - FAIL_ALLOC_HEAD;
    size_t bytes;
    memcpy(&bytes, block, sizeof bytes);
    __atomic_sub_fetch(&heap->live, 1, __ATOMIC_RELAXED);
    __atomic_sub_fetch(&heap->bytes, bytes, __ATOMIC_RELAXED);
    free(block);
}
static inline struct imp_allocator fail_alloc_hooks(struct fail_alloc *heap)
{
    return (struct imp_allocator){fail_alloc_allocate, fail_alloc_release, heap};
}
/* A context of one thread on this heap; without one the test program ends. */
static inline imp_context *fail_alloc_context(struct fail_alloc *heap)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    imp_context *ctx;
    o.threads = 1;
    o.allocator = fail_alloc_hooks(heap);
    if (imp_context_create(&o, &ctx) == IMP_OK) return ctx;
    printf("Bail out! no context\n");
    exit(99);
}
/* `call` with every allocation failing in turn, until it succeeds: how many failed, or -1 if one
 * of them was told as something else than IMP_E_NOMEM. */
static inline int fail_alloc_in_turn(struct fail_alloc *heap,
                                     enum imp_status (*call)(imp_context *ctx),
                                     imp_context *ctx)
{
    enum imp_status st;
    int n = 0, other = 0;
    do {
        heap->calls = 0;
        heap->fail_at = ++n;
        st = call(ctx);
        heap->fail_at = 0;
        other += st != IMP_OK && st != IMP_E_NOMEM;
    } while (st != IMP_OK && n < 1000);
    return st == IMP_OK && other == 0 ? n - 1 : -1;
}

#endif

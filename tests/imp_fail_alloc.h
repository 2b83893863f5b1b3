/* SPDX-License-Identifier: Apache-2.0
 *
 * An allocator that counts, and fails from the n-th allocation on:
 *
 *     struct fail_alloc heap = {0};
 *     imp_context *fragile = fail_alloc_context(&heap);
 *     heap.fail_at = 3;                                   // 0: never
 *     ... heap.live == 0 afterwards, or something leaked.
 */
#ifndef IMP_FAIL_ALLOC_H
#define IMP_FAIL_ALLOC_H

#include <importon/importon.h>
#include <stdio.h>
#include <stdlib.h>

struct fail_alloc {
    long fail_at; /* 1: the first */
    long calls;   /* so far */
    long live;    /* blocks not released */
};

static inline void *fail_alloc_allocate(size_t bytes, void *payload)
{
    struct fail_alloc *heap = payload;
    const long n = __atomic_add_fetch(&heap->calls, 1, __ATOMIC_RELAXED);
    void *p = NULL;
    if (heap->fail_at && n >= heap->fail_at) return NULL;
    if (posix_memalign(&p, 64, bytes) != 0) return NULL;
    __atomic_add_fetch(&heap->live, 1, __ATOMIC_RELAXED);
    return p;
}
static inline void fail_alloc_release(void *memory, void *payload)
{
    struct fail_alloc *heap = payload;
    __atomic_sub_fetch(&heap->live, 1, __ATOMIC_RELAXED);
    free(memory);
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

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * malloc, realloc and free for other libraries, on the allocator of the context. A
 * header before each block holds its context and size, which free is not given. */
#include "hooks.h"
#include <stdint.h>
#include <string.h>

static _Thread_local imp_context *current;
static _Thread_local bool failed;

struct header {
    _Alignas(64) imp_context *ctx;
    size_t bytes;
};

imp_context *imp__hooks_enter(imp_context *ctx)
{
    imp_context *previous = current;
    current = ctx;
    return previous;
}

void imp__hooks_leave(imp_context *previous) { current = previous; }

bool imp__hooks_failed(void)
{
    const bool was = failed;
    failed = false;
    return was;
}

static void *allocate(imp_context *ctx, size_t bytes)
{
    struct header *h =
        ctx && bytes < SIZE_MAX / 8 ? imp__alloc(ctx, 1, sizeof *h + bytes) : NULL;
    failed |= !h;
    if (!h) return NULL;
    h->ctx = ctx;
    h->bytes = bytes;
    return h + 1;
}

void *imp__hooks_malloc(size_t bytes) { return allocate(current, bytes); }

void *imp__hooks_realloc(void *memory, size_t bytes)
{
    if (!memory) return imp__hooks_malloc(bytes);
    struct header *h = (struct header *)memory - 1;
    void *grown = allocate(h->ctx, bytes);
    if (!grown) return NULL;
    memcpy(grown, memory, imp_min(h->bytes, bytes));
    imp__hooks_free(memory);
    return grown;
}

void imp__hooks_free(void *memory)
{
    if (!memory) return;
    struct header *h = (struct header *)memory - 1;
    imp__release(h->ctx, h);
}

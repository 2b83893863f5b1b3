/* SPDX-License-Identifier: Apache-2.0
 *
 * The context: allocator hooks, error messages, log. The rest of the library reports a
 * failure with imp__error, which records the message for the calling thread and returns
 * the status, so that a failing line reads
 *
 *     IMP_TRY(imp__error(ctx, IMP_E_IO, "%s: cannot open", path));
 */
#ifndef IMP_BASE_CONTEXT_H
#define IMP_BASE_CONTEXT_H

#include "compiler.h"
#include <importon/importon.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdbool.h>

struct imp_pool;
struct imp__team;

/* A kind that the host registered: a table of kinds.h (kind/registry.c). */
struct imp_registered {
    struct imp_registered *next; /* registered later */
    int concept;
    _Alignas(64) unsigned char ops[];
};

struct imp_context {
    struct imp_allocator allocator;
    void (*log)(enum imp_log_level, const char *, void *);
    void *log_payload;
    int threads;
    pthread_key_t error_key;        /* struct error_text * of each thread */
    pthread_mutex_t lock;           /* guards errors, kinds and pool creation */
    struct imp__error_text *errors; /* list of all threads' texts, freed at the end */
    struct imp_pool *pool;          /* made on first use */
    struct imp__team *team;         /* NULL: alone */
    /* Called with every file that is read whole, and may refuse it; NULL: not called. */
    enum imp_status (*on_read)(void *payload, const char *path, const void *bytes,
                               size_t n);
    void *on_read_payload;
    struct imp_registered *kinds;
    const struct imp_declared
        *declared;        /* a feature with rules (walk/rules/features.h) */
    bool has_scenes;      /* one was made: kinds are not registered any more */
    _Atomic int held;     /* by the host, and by every object made from it */
    _Atomic long process; /* whose threads and locks these are; see imp__context_own */
};

/* After a fork, threads are gone and locks may be held by them: the child's first call
 * leaves the pool to the parent and begins with none. Called before pool and lock are
 * used. */
void imp__context_own(imp_context *ctx);

/* An object that keeps `ctx` holds it from its making to its end: a host may destroy the
 * context before its objects. */
void imp__context_hold(imp_context *ctx);
void imp__context_drop(imp_context *ctx);

/* Needs a local `enum imp_status st` and a label `out`. */
#define IMP_TRY(call)                                                                    \
    do {                                                                                 \
        if ((st = (call)) != IMP_OK) goto out;                                           \
    } while (0)

/* Record the message for this thread; returns `status`. Never fails: out of memory leaves
 * a fixed text. ctx NULL: where no context is known; imp_last_error(NULL) has it. */
IMP_COLD enum imp_status imp__error(imp_context *ctx, enum imp_status status,
                                    const char *format, ...) IMP_PRINTF(3, 4);
/* Put "prefix: " before the message that is there. */
IMP_COLD enum imp_status imp__error_prefix(imp_context *ctx, enum imp_status status,
                                           const char *format, ...) IMP_PRINTF(3, 4);
IMP_COLD void imp__warn(imp_context *ctx, const char *format, ...) IMP_PRINTF(2, 3);

/* 64-byte aligned; NULL if out of memory or n*size overflows. Zeroed. */
void *imp__alloc(imp_context *ctx, size_t n, size_t size);
void *imp__alloc_raw(imp_context *ctx, size_t n, size_t size); /* not zeroed */
void imp__release(imp_context *ctx, void *memory);
/* The same, of which `bytes` from the beginning are kept, and the rest is given back if it can be;
 * aligned as malloc does it. bytes > 0. */
void *imp__shrunk(imp_context *ctx, void *memory, size_t bytes);
/* IMP_E_NOMEM, with both sizes, if so many bytes are more than the machine has left. Not
 * checked with a host's own allocator, which has its own limits. `what` begins the message. */
enum imp_status imp__memory_check(imp_context *ctx, double bytes, const char *what);
/* Grow an array of `old_n` elements to at least `n` (doubling); keeps the contents, new
 * ones are zero. On failure returns NULL and the old array stays. */
void *imp__grow(imp_context *ctx, void *array, size_t *capacity, size_t n, size_t size);
char *imp__strdup(imp_context *ctx, const char *text);

#endif

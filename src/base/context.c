/* SPDX-License-Identifier: Apache-2.0
 *
 * Context, errors and memory. Error texts are kept per thread through a pthread key of
 * the context, until the thread or the context ends. A call whose context is not known (an
 * object is NULL) leaves a short text that belongs to the thread. */
#include "arguments.h"
#include "pool.h"
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#define ERROR_LENGTH 2048
#define THREADS_MAX  4096
#define BEING_SET_UP (-1L) /* no process has this number */

struct imp__error_text {
    imp_context *ctx;
    struct imp__error_text *next;
    char text[ERROR_LENGTH];
};

/* More than the machine has is refused here: an overcommitting kernel would grant it, and
 * end the process when it is touched. */
static bool fits_machine(size_t bytes)
{
    if (bytes < (size_t)1 << 30) return true;
    const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGE_SIZE);
    return pages <= 0 || page <= 0 || bytes / (size_t)page < (size_t)pages;
}

/* Large arrays are read at random (volumes, their gradients): with pages of 2 MB the
 * processor keeps their addresses, and the system does not map each 4 kB by itself. */
#define HUGE_PAGE ((size_t)1 << 21)

static void *default_allocate(size_t bytes, void *payload)
{
    (void)payload;
    const bool large = bytes >= HUGE_PAGE;
    void *p = NULL;
    if (!fits_machine(bytes)) return NULL;
    if (posix_memalign(&p, large ? HUGE_PAGE : IMP_CACHE_LINE, bytes) != 0) return NULL;
#ifdef MADV_HUGEPAGE
    if (large) (void)madvise(p, bytes / HUGE_PAGE * HUGE_PAGE, MADV_HUGEPAGE);
#endif
    return p;
}
static void default_release(void *memory, void *payload)
{
    (void)payload;
    free(memory);
}

/* What can be had without driving others out of memory; 0: not known. */
static double memory_left(void)
{
    double kib = 0;
    char line[128];
    FILE *f = fopen("/proc/meminfo", "r");
    while (f && fgets(line, sizeof line, f)) {
        unsigned long long n;
        if (sscanf(line, "MemAvailable: %llu", &n) == 1 ||
            sscanf(line, "SwapFree: %llu", &n) == 1)
            kib += (double)n;
    }
    if (f) fclose(f);
    return 1024 * kib;
}

enum imp_status imp__memory_check(imp_context *ctx, double bytes, const char *what)
{
    const double certain = (double)((size_t)1 << 28); /* not worth a look */
    if (bytes < certain || ctx->allocator.allocate != default_allocate) return IMP_OK;
    const double left = memory_left();
    if (left <= 0 || bytes < left) return IMP_OK;
    return imp__error(ctx, IMP_E_NOMEM,
                      "%s takes %.3g GB of memory; %.3g GB are available", what,
                      bytes * 1e-9, left * 1e-9);
}

const char *imp_status_text(enum imp_status status)
{
#define STATUS_CASE(name, value, text)                                                   \
    case name: return text;
    switch (status) {
        IMP_STATUS_LIST(STATUS_CASE)
    }
#undef STATUS_CASE
    return "unknown status";
}

const char *imp_version(void) { return IMP_VERSION_STRING; }

int imp_version_number(void) { return IMP_VERSION_NUMBER; }

/* The message if there is no memory for the text of another. */
static const struct imp__error_text no_memory = {NULL, NULL, "out of memory"};

/* A thread ends before the context: hosts may make a thread for every call. */
static void error_forget(void *text)
{
    struct imp__error_text *e = text;
    if (e == &no_memory) return;
    imp_context *ctx = e->ctx;
    imp__context_own(ctx);
    pthread_mutex_lock(&ctx->lock);
    struct imp__error_text **at = &ctx->errors;
    while (*at && *at != e) at = &(*at)->next;
    if (*at) *at = e->next;
    pthread_mutex_unlock(&ctx->lock);
    imp__release(ctx, e);
}

enum imp_status imp_context_create(const struct imp_context_options *options,
                                   imp_context **out)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    IMP_REQUIRE(NULL, out, "out");
    IMP_OPTIONS(NULL, o, options, "options");
    if (o.threads < 0 || o.threads > THREADS_MAX)
        return imp__error(NULL, IMP_E_ARG, "%s: threads %d is outside [0, %d]", __func__,
                          o.threads, THREADS_MAX);
    if (!o.allocator.allocate != !o.allocator.release)
        return imp__error(NULL, IMP_E_ARG,
                          "%s: allocator has only one of allocate and release", __func__);

    struct imp_allocator a = o.allocator;
    if (!a.allocate) a = (struct imp_allocator){default_allocate, default_release, NULL};
    imp_context *ctx = a.allocate(sizeof *ctx, a.payload);
    if (!ctx) return imp__error(NULL, IMP_E_NOMEM, "%s: out of memory", __func__);
    memset(ctx, 0, sizeof *ctx);
    ctx->allocator = a;
    atomic_init(&ctx->held, 1);
    atomic_init(&ctx->process, (long)getpid());
    ctx->log = o.log;
    ctx->log_payload = o.log_payload;
    ctx->threads = o.threads ? o.threads : (int)sysconf(_SC_NPROCESSORS_ONLN);
    if (ctx->threads < 1) ctx->threads = 1;
    if (pthread_key_create(&ctx->error_key, error_forget) != 0) {
        a.release(ctx, a.payload);
        return imp__error(NULL, IMP_E_NOMEM, "%s: no key for the errors of threads",
                          __func__);
    }
    pthread_mutex_init(&ctx->lock, NULL);
    *out = ctx;
    return IMP_OK;
}

void imp_context_destroy(imp_context *ctx)
{
    if (ctx) imp__context_drop(ctx);
}

void imp__context_hold(imp_context *ctx) { atomic_fetch_add(&ctx->held, 1); }

void imp__context_drop(imp_context *ctx)
{
    if (atomic_fetch_sub(&ctx->held, 1) > 1) return;
    IMP_FLOAT_MODE;
    imp__context_own(ctx);
    imp__pool_destroy(ctx, ctx->pool);
    imp__release(ctx, ctx->team);
    for (struct imp__error_text *e = ctx->errors, *next; e; e = next) {
        next = e->next;
        imp__release(ctx, e);
    }
    for (struct imp_registered *k = ctx->kinds, *next; k; k = next) {
        next = k->next;
        imp__release(ctx, k);
    }
    pthread_key_delete(ctx->error_key);
    pthread_mutex_destroy(&ctx->lock);
    ctx->allocator.release(ctx, ctx->allocator.payload);
}

/* A child has one thread at first; where its threads call at once, one of them sets up
 * and the others wait for it. */
void imp__context_own(imp_context *ctx)
{
    const long here = (long)getpid();
    long was = atomic_load(&ctx->process);
    if (was == here) return;
    while (was == BEING_SET_UP ||
           !atomic_compare_exchange_weak(&ctx->process, &was, BEING_SET_UP)) {
        was = atomic_load(&ctx->process);
        if (was == here) return;
    }
    pthread_mutex_init(&ctx->lock, NULL);
    ctx->pool = NULL; /* lost: what holds the parent's threads is not touched */
    atomic_store(&ctx->process, here);
}

int imp_context_threads(const imp_context *ctx) { return ctx ? ctx->threads : 0; }

/* Last error of this thread's calls that had no context. */
/* Aligned: mold 1.10 places bytes of threads at an address of any kind in front of what is made
 * read-only, and a program whose page begins there does not start. */
static _Thread_local _Alignas(16) char without_context[256];

const char *imp_last_error(const imp_context *ctx)
{
    if (!ctx) return without_context;
    const struct imp__error_text *e = pthread_getspecific(ctx->error_key);
    return e ? e->text : "";
}

static struct imp__error_text *error_text(imp_context *ctx)
{
    struct imp__error_text *e = pthread_getspecific(ctx->error_key);
    if (e && e != &no_memory) return e;
    e = imp__alloc(ctx, 1, sizeof *e);
    if (e) e->ctx = ctx;
    if (!e) {
        pthread_setspecific(ctx->error_key, &no_memory);
        return NULL;
    }
    if (pthread_setspecific(ctx->error_key, e) != 0) {
        imp__release(ctx, e);
        return NULL;
    }
    imp__context_own(ctx);
    pthread_mutex_lock(&ctx->lock);
    e->next = ctx->errors;
    ctx->errors = e;
    pthread_mutex_unlock(&ctx->lock);
    return e;
}

enum imp_status imp__error(imp_context *ctx, enum imp_status status, const char *format,
                           ...)
{
    va_list args;
    if (!ctx) {
        va_start(args, format);
        vsnprintf(without_context, sizeof without_context, format, args);
        va_end(args);
        return status;
    }
    struct imp__error_text *e = error_text(ctx);
    if (!e) return status;
    va_start(args, format);
    char text[ERROR_LENGTH]; /* the arguments may point into the old message */
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    memcpy(e->text, text, sizeof text);
    return status;
}

enum imp_status imp__error_prefix(imp_context *ctx, enum imp_status status,
                                  const char *format, ...)
{
    struct imp__error_text *e = error_text(ctx);
    if (!e) return status;
    char text[ERROR_LENGTH];
    va_list args;
    va_start(args, format);
    int n = vsnprintf(text, sizeof text, format, args);
    va_end(args);
    const size_t used = n < 0 ? 0 : imp_min((size_t)n, sizeof text - 3);
    memcpy(text + used, ": ", 2);
    const size_t kept = imp_min(strlen(e->text), sizeof text - used - 3);
    memcpy(text + used + 2, e->text, kept);
    text[used + 2 + kept] = 0;
    memcpy(e->text, text, sizeof text);
    return status;
}

void imp__warn(imp_context *ctx, const char *format, ...)
{
    if (!ctx->log) return;
    char text[ERROR_LENGTH];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    ctx->log(IMP_LOG_WARNING, text, ctx->log_payload);
}

void *imp__alloc_raw(imp_context *ctx, size_t n, size_t size)
{
    size_t bytes;
    if (__builtin_mul_overflow(n, size, &bytes) || bytes > SIZE_MAX / 4) return NULL;
    return ctx->allocator.allocate(bytes ? bytes : 1, ctx->allocator.payload);
}

void *imp__alloc(imp_context *ctx, size_t n, size_t size)
{
    void *p = imp__alloc_raw(ctx, n, size);
    const size_t bytes = n * size;
    if (p) memset(p, 0, bytes > 0 ? bytes : 1);
    return p;
}

void imp__release(imp_context *ctx, void *memory)
{
    if (memory) ctx->allocator.release(memory, ctx->allocator.payload);
}

void *imp__shrunk(imp_context *ctx, void *memory, size_t bytes)
{
    void *p;
    if (ctx->allocator.allocate == default_allocate) {
        p = realloc(memory, bytes);
        return p ? p : memory;
    }
    p = imp__alloc_raw(ctx, bytes, 1);
    if (!p) return memory;
    memcpy(p, memory, bytes);
    imp__release(ctx, memory);
    return p;
}

void imp_free(imp_context *ctx, void *memory)
{
    IMP_REQUIRE_OR(NULL, ctx, "context", );
    imp__release(ctx, memory);
}

void *imp__grow(imp_context *ctx, void *array, size_t *capacity, size_t n, size_t size)
{
    if (n <= *capacity && array) return array;
    size_t wanted = *capacity ? *capacity : 16;
    while (wanted < n) {
        if (wanted > SIZE_MAX / 2) return NULL;
        wanted *= 2;
    }
    char *p = imp__alloc_raw(ctx, wanted, size);
    const size_t kept = array ? *capacity * size : 0;
    if (!p) return NULL;
    if (kept) memcpy(p, array, kept);
    memset(p + kept, 0, wanted * size - kept);
    imp__release(ctx, array);
    *capacity = wanted;
    return p;
}

char *imp__strdup(imp_context *ctx, const char *text)
{
    const size_t n = strlen(text) + 1;
    char *copy = imp__alloc(ctx, n, 1);
    if (copy) memcpy(copy, text, n);
    return copy;
}

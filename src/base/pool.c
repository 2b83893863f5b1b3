/* SPDX-License-Identifier: Apache-2.0
 *
 * A pool of pthreads, made on first use and kept by the context. One loop runs at a time;
 * a loop started by a second host thread waits for the first one, or is left to the caller;
 * a loop started by a worker runs inline. */
#include "pool.h"
#include "float_mode.h"
#include <stdio.h>
#include <string.h>
#include <time.h>

#define SLOTS_PER_THREAD 3

struct run {
    const struct imp_loop *loop;
    size_t next;      /* item to hand out */
    size_t committed; /* items committed so far */
    int n_slots;
    char *slot_done; /* [n_slots] item (committed + k) computed, k = slot order */
    enum imp_status *slot_status;
    enum imp_status status; /* first failure, in item order */
    bool stop;
    bool committing; /* a thread is inside commit or progress */
    double last_report_s, start_s;
    size_t error_item; /* whose message `error` is: the lowest failed item */
    size_t failed;     /* of a loop without commits: the lowest failed item */
    size_t *at;        /* [threads] item that a worker is at, SIZE_MAX: none */
    int threads;
    char error[1024];
};

struct worker {
    struct imp_pool *pool;
    pthread_t thread;
    int index;
};

struct imp_pool {
    imp_context *ctx;
    int n_workers; /* besides the caller */
    struct worker *workers;
    pthread_mutex_t lock;
    pthread_cond_t wake, changed;
    pthread_mutex_t turn; /* one loop at a time */
    struct run *run;
    uint64_t generation;
    int busy; /* workers inside the run */
    bool quit;
    pthread_key_t inside; /* non-NULL on a thread that works on a loop */
};

double imp__now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int imp__pool_slots(const imp_context *ctx) { return SLOTS_PER_THREAD * ctx->threads; }

/* Called without the lock by the one committing thread. */
static bool report(struct run *r, size_t committed, bool force)
{
    const struct imp_loop *l = r->loop;
    const double now = imp__now();
    bool stop = l->deadline_s > 0 && now > l->deadline_s;
    if (l->progress && (force || now - r->last_report_s > 0.1)) {
        r->last_report_s = now;
        const double hi = l->fraction_hi > 0 ? l->fraction_hi : 1;
        const size_t reached = l->reached ? l->reached(l->payload) : committed;
        const double part = (double)reached / (double)imp_max(l->n_items, (size_t)1);
        const double fraction = l->fraction_lo + (hi - l->fraction_lo) * part;
        const double elapsed = now - r->start_s;
        const double origin = l->start_s > 0 ? l->start_s : r->start_s;
        const struct imp_progress p = {
            .size = sizeof p,
            .stage = l->stage,
            .fraction = fraction,
            .elapsed_s = now - origin,
            .eta_s = fraction > 1e-3 ? (now - origin) * (1 - fraction) / fraction : -1,
            .rate = elapsed > 0 ? l->units * part / elapsed : 0,
            .rate_unit = l->rate_unit};
        stop |= l->progress(&p, l->progress_payload) != 0;
    }
    return stop;
}

/* An item of a loop that has nothing to collect. The items before it were handed out
 * before it and are waited for, so the lowest that failed is the same for any number of
 * threads. Lock held on entry and exit. */
static void item_done(struct imp_pool *pool, struct run *r, size_t item,
                      enum imp_status st)
{
    if (st != IMP_OK) {
        if (r->status == IMP_OK || item < r->failed) {
            r->status = st;
            r->failed = item;
        }
        r->stop = true;
        return;
    }
    const size_t done = ++r->committed;
    if (r->committing || !(r->loop->progress || r->loop->deadline_s > 0)) return;
    r->committing = true;
    pthread_mutex_unlock(&pool->lock);
    const bool stop = report(r, done, false);
    pthread_mutex_lock(&pool->lock);
    r->committing = false;
    if (stop) r->stop = true;
}

/* Is the next item within the window behind the oldest that somebody is at? */
static bool may_begin(const struct run *r)
{
    if (r->loop->window == 0) return true;
    size_t oldest = r->next;
    for (int k = 0; k < r->threads; k++) oldest = imp_min(oldest, r->at[k]);
    return r->next - oldest < r->loop->window;
}

/* Take items until there are none. Lock held on entry and exit. */
static void work_on(struct imp_pool *pool, struct run *r, int worker)
{
    const struct imp_loop *l = r->loop;
    const bool ordered = l->commit != NULL;
    while (!r->stop && r->next < l->n_items) {
        if (ordered && r->next >= r->committed + (size_t)r->n_slots) {
            pthread_cond_wait(&pool->changed, &pool->lock); /* ran ahead of commits */
            continue;
        }
        if (!ordered && !may_begin(r)) {
            pthread_cond_wait(&pool->changed, &pool->lock);
            continue;
        }
        const size_t i = r->next++;
        r->at[worker] = i;
        const int slot = ordered ? (int)(i % (size_t)r->n_slots) : worker;
        pthread_mutex_unlock(&pool->lock);
        const enum imp_status st = l->work(i, worker, slot, l->payload);
        pthread_mutex_lock(&pool->lock);
        if (st != IMP_OK && (!r->error[0] || i < r->error_item)) {
            r->error_item = i;
            snprintf(r->error, sizeof r->error, "%s", imp_last_error(pool->ctx));
        }
        r->at[worker] = SIZE_MAX;
        if (!ordered) {
            item_done(pool, r, i, st);
            if (l->window > 0 || r->stop) pthread_cond_broadcast(&pool->changed);
            continue;
        }
        r->slot_status[slot] = st;
        r->slot_done[slot] = 1;
        if (r->committing) continue;
        r->committing = true;
        while (r->committed < l->n_items && r->status == IMP_OK) {
            const int s = (int)(r->committed % (size_t)r->n_slots);
            if (!r->slot_done[s]) break;
            const size_t item = r->committed;
            enum imp_status cst = r->slot_status[s];
            pthread_mutex_unlock(&pool->lock);
            if (cst == IMP_OK) cst = l->commit(item, s, l->payload);
            const bool stop = cst == IMP_OK && report(r, item + 1, false);
            pthread_mutex_lock(&pool->lock);
            r->slot_done[s] = 0;
            if (cst != IMP_OK) {
                if (!r->error[0] || r->error_item != item)
                    snprintf(r->error, sizeof r->error, "%s", imp_last_error(pool->ctx));
                r->status = cst;
                r->stop = true;
                break;
            }
            r->committed = item + 1;
            if (stop) r->stop = true;
            pthread_cond_broadcast(&pool->changed);
        }
        r->committing = false;
        if (r->stop) pthread_cond_broadcast(&pool->changed);
    }
}

static void *worker_main(void *arg)
{
    struct worker *w = arg;
    struct imp_pool *pool = w->pool;
    uint64_t seen = 0;
    fesetenv(FE_DFL_ENV); /* not that of the thread that made this one */
    pthread_setspecific(pool->inside, pool);
    pthread_mutex_lock(&pool->lock);
    while (!pool->quit) {
        if (pool->generation == seen || !pool->run) {
            pthread_cond_wait(&pool->wake, &pool->lock);
            continue;
        }
        seen = pool->generation;
        pool->busy++;
        work_on(pool, pool->run, w->index);
        pool->busy--;
        pthread_cond_broadcast(&pool->changed);
    }
    pthread_mutex_unlock(&pool->lock);
    return NULL;
}

void imp__pool_destroy(imp_context *ctx, struct imp_pool *pool)
{
    if (!pool) return;
    pthread_mutex_lock(&pool->lock);
    pool->quit = true;
    pthread_cond_broadcast(&pool->wake);
    pthread_mutex_unlock(&pool->lock);
    for (int i = 0; i < pool->n_workers; i++) pthread_join(pool->workers[i].thread, NULL);
    pthread_mutex_destroy(&pool->lock);
    pthread_mutex_destroy(&pool->turn);
    pthread_cond_destroy(&pool->wake);
    pthread_cond_destroy(&pool->changed);
    pthread_key_delete(pool->inside);
    imp__release(ctx, pool->workers);
    imp__release(ctx, pool);
}

static struct imp_pool *pool_create(imp_context *ctx)
{
    struct imp_pool *pool = imp__alloc(ctx, 1, sizeof *pool);
    if (!pool) return NULL;
    pool->ctx = ctx;
    if (pthread_key_create(&pool->inside, NULL) != 0) {
        imp__release(ctx, pool);
        return NULL;
    }
    pthread_mutex_init(&pool->lock, NULL);
    pthread_mutex_init(&pool->turn, NULL);
    pthread_cond_init(&pool->wake, NULL);
    pthread_cond_init(&pool->changed, NULL);
    pool->workers = imp__alloc(ctx, (size_t)ctx->threads, sizeof *pool->workers);
    for (int i = 1; pool->workers && i < ctx->threads; i++) {
        struct worker *w = &pool->workers[pool->n_workers];
        *w = (struct worker){.pool = pool, .index = i};
        if (pthread_create(&w->thread, NULL, worker_main, w) != 0)
            break; /* fewer will do */
        pool->n_workers++;
    }
    return pool;
}

bool imp__pool_inside(imp_context *ctx)
{
    imp__context_own(ctx);
    pthread_mutex_lock(&ctx->lock);
    const struct imp_pool *pool = ctx->pool;
    pthread_mutex_unlock(&ctx->lock);
    return pool && pthread_getspecific(pool->inside) != NULL;
}

/* `ran` NULL: wait for the loop of another thread, else do not, and say whether it ran. */
static enum imp_status loop_run(imp_context *ctx, const struct imp_loop *loop,
                                size_t *done, bool *ran)
{
    IMP_FLOAT_MODE;
    if (ran) *ran = true;
    imp__context_own(ctx);
    pthread_mutex_lock(&ctx->lock);
    if (!ctx->pool) ctx->pool = pool_create(ctx);
    struct imp_pool *pool = ctx->pool;
    pthread_mutex_unlock(&ctx->lock);
    if (!pool) return imp__error(ctx, IMP_E_NOMEM, "no memory for the thread pool");

    const bool nested = pthread_getspecific(pool->inside) != NULL;
    const int n_slots = imp__pool_slots(ctx);
    enum imp_status st = IMP_E_NOMEM;
    struct run r = {.loop = loop, .n_slots = n_slots, .start_s = imp__now()};
    r.slot_done = imp__alloc(ctx, (size_t)n_slots, sizeof *r.slot_done);
    r.at = imp__alloc(ctx, 1,
                      (size_t)ctx->threads * sizeof *r.at +
                          (size_t)n_slots * sizeof *r.slot_status);
    r.threads = ctx->threads;
    for (int k = 0; r.at && k < ctx->threads; k++) r.at[k] = SIZE_MAX;
    if (!r.slot_done || !r.at) {
        imp__error(ctx, IMP_E_NOMEM, "no memory for a parallel loop");
        goto out;
    }

    r.slot_status = (enum imp_status *)(r.at + ctx->threads);

    if (nested) { /* the pool is busy with the loop we are in */
        st = IMP_OK;
        for (; r.committed < loop->n_items && st == IMP_OK; r.committed += st == IMP_OK) {
            st = loop->work(r.committed, 0, 0, loop->payload);
            if (st == IMP_OK && loop->commit)
                st = loop->commit(r.committed, 0, loop->payload);
        }
    } else {
        if (!ran) {
            pthread_mutex_lock(&pool->turn);
        } else if (pthread_mutex_trylock(&pool->turn) != 0) {
            *ran = false;
            st = IMP_OK;
            goto out;
        }
        pthread_setspecific(pool->inside, pool);
        pthread_mutex_lock(&pool->lock);
        pool->run = &r;
        pool->generation++;
        pthread_cond_broadcast(&pool->wake);
        work_on(pool, &r, 0);
        /* All items are handed out, or the run stopped: wait for the ones in progress. */
        while (pool->busy > 0) pthread_cond_wait(&pool->changed, &pool->lock);
        pool->run = NULL;
        pthread_mutex_unlock(&pool->lock);
        pthread_setspecific(pool->inside, NULL);
        pthread_mutex_unlock(&pool->turn);
        st = r.status;
        if (st != IMP_OK)
            imp__error(ctx, st, "%s", r.error); /* from the worker's thread */
        if (st == IMP_OK && r.committed < loop->n_items)
            st = imp__error(ctx, IMP_CANCELLED, "%s", imp_status_text(IMP_CANCELLED));
        if (st == IMP_OK) report(&r, r.committed, true);
    }
    if (done) *done = r.committed;
out:
    imp__release(ctx, r.slot_done);
    imp__release(ctx, r.at);
    return st;
}

enum imp_status imp__parallel(imp_context *ctx, const struct imp_loop *loop, size_t *done)
{
    return loop_run(ctx, loop, done, NULL);
}

bool imp__parallel_try(imp_context *ctx, const struct imp_loop *loop, enum imp_status *st)
{
    bool ran;
    *st = loop_run(ctx, loop, NULL, &ran);
    return ran;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Parallel loops: every item once, commits in order, the first failure whatever the
 * threads, and no waiting where there is nothing to commit. */
#include "base/pool.h"
#include "base/context.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <stdatomic.h>

enum { N = 1000 };

struct job {
    imp_context *ctx;
    atomic_int count[N], running, worst_running, slot_busy[64];
    atomic_int done, bad_slots;
    size_t fail[2], next;
    bool ordered, out_of_order, patient, waited;
};

static enum imp_status work(size_t item, int worker, int slot, void *payload)
{
    struct job *j = payload;
    (void)worker;
    atomic_fetch_add(&j->count[item], 1);
    if (slot < 0 || slot >= imp__pool_slots(j->ctx) ||
        (!j->ordered && atomic_exchange(&j->slot_busy[slot], 1)))
        atomic_fetch_add(&j->bad_slots, 1);
    if (j->patient && item == 0) { /* every other item ends while this one lasts */
        const double start = imp__now();
        while (atomic_load(&j->done) < N - 1 && imp__now() - start < 20) {}
        j->waited = atomic_load(&j->done) == N - 1;
    }
    atomic_store(&j->slot_busy[slot], 0);
    atomic_fetch_add(&j->done, 1);
    if (item == j->fail[0]) return imp__error(j->ctx, IMP_E_NUMERIC, "item %zu", item);
    if (item == j->fail[1]) return imp__error(j->ctx, IMP_E_IO, "item %zu", item);
    return IMP_OK;
}

static enum imp_status commit(size_t item, int slot, void *payload)
{
    struct job *j = payload;
    (void)slot;
    j->out_of_order |= item != j->next++;
    return IMP_OK;
}

static int stop_at_once(const struct imp_progress *p, void *payload)
{
    (void)p, (void)payload;
    return 1;
}

static void loops(int threads, bool ordered)
{
    imp_context *ctx = test_context(threads);
    size_t done = 0;
    for (int again = 0; again < 20; again++) {
        static struct job j;
        memset(&j, 0, sizeof j);
        j.ctx = ctx, j.ordered = ordered, j.fail[0] = j.fail[1] = N;
        struct imp_loop loop = {.n_items = N, .work = work, .payload = &j};
        if (ordered) loop.commit = commit;
        if (again % 2) j.fail[0] = 137, j.fail[1] = 138;
        const enum imp_status st = imp__parallel(ctx, &loop, &done);
        int once = 0, more = 0;
        for (int k = 0; k < N; k++) {
            once += j.count[k] == 1;
            more += j.count[k] > 1;
        }
        const bool right = again % 2 ? st == IMP_E_NUMERIC && more == 0 && once >= 138 &&
                                           strcmp(imp_last_error(ctx), "item 137") == 0
                                     : st == IMP_OK && once == N && done == N;
        if (again < 2 || !right || j.bad_slots || j.out_of_order)
            tap_ok(right && !j.bad_slots && !j.out_of_order,
                   "%d threads, %s, %s # once %d done %zu bad slots %d: %s", threads,
                   ordered ? "in order" : "free", again % 2 ? "137 and 138 fail" : "all",
                   once, done, j.bad_slots, imp_last_error(ctx));
    }
    imp_context_destroy(ctx);
}

int main(void)
{
    for (int threads = 1; threads <= 4; threads += 1 + (threads == 2))
        for (int ordered = 0; ordered < 2; ordered++) loops(threads, ordered);

    static struct job j;
    imp_context *ctx = test_context(2);
    size_t done = 0;
    j = (struct job){.ctx = ctx, .fail = {N, N}, .patient = true};
    struct imp_loop loop = {.n_items = N, .work = work, .payload = &j};
    const enum imp_status st = imp__parallel(ctx, &loop, &done);
    tap_ok(st == IMP_OK && j.waited && done == N,
           "nobody waits for a long item without commits # done %zu", done);

    memset(&j, 0, sizeof j);
    j.ctx = ctx, j.fail[0] = j.fail[1] = N;
    loop.progress = stop_at_once;
    loop.deadline_s = imp__now() - 1;
    const enum imp_status stopped = imp__parallel(ctx, &loop, &done);
    tap_ok(stopped == IMP_CANCELLED && done < N && done == (size_t)j.done,
           "asked to stop: cancelled, and so many were done # %zu", done);
    imp_context_destroy(ctx);
    return tap_done();
}

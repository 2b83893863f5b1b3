/* SPDX-License-Identifier: Apache-2.0
 *
 * Daylight of a year, point by point: walks of some points first, then their hours, a part of the
 * year after the other. So the skies of a part are made once for all points, and stay in the cache. A point
 * has its hours in the order of the year: the number of threads changes no bit. */
#include "annual.h"
#include "base/arguments.h"
#include "base/pool.h"
#include <string.h>

enum {
    AT_ONCE = 256,        /* points, at most */
    PART = 4 * IMP__BATCH /* blocks of hours */
};
/* For hours with direct sun, all points at work together. */
#define SUNLIT_BYTES (256.0 * 1024 * 1024)

struct job {
    const struct imp__annual_year *y;
    struct imp__annual_worker *worker; /* [threads] */
    size_t at_once;                    /* points */
    struct imp__annual_at *at;         /* [at_once] */
    size_t first, points;              /* those at work */
    imp__annual_skies *sky;            /* [PART / 2] */
    size_t block, blocks;              /* of the part */
    pthread_mutex_t lock;
    struct imp_drops drops;
};

static enum imp_status no_memory(const struct job *j)
{
    return imp__error(j->y->a->scene->ctx, IMP_E_NOMEM,
                      "no memory for daylight of a year");
}

/* ---- Walks --------------------------------------------------------------------------- */

static void drops_take(struct job *j, struct imp__annual_worker *w)
{
    if (imp__drops_total(&w->drops) == 0) return;
    pthread_mutex_lock(&j->lock);
    imp__drops_merge(&j->drops, &w->drops);
    pthread_mutex_unlock(&j->lock);
    memset(&w->drops, 0, sizeof w->drops);
}

/* An item is a group of a point: a caller who stops does not wait for all walks of it. Threads
 * side by side are at other points, whose numbers are not in the same cache lines. */
static enum imp_status group_walk(size_t item, int worker, int slot, void *payload)
{
    struct job *j = payload;
    const size_t i = item % j->points;
    const int g = (int)(item / j->points);
    struct imp__annual_worker *w = &j->worker[worker];
    struct imp__annual_at *at = &j->at[i];
    const struct imp__annual *a = j->y->a;
    const size_t width = (size_t)a->sensor->film.crop_w, point = j->first + i;
    const int x = (int)(point % width), y = (int)(point / width);
    (void)slot;
    const enum imp_status st = imp__annual_walks(a, x, y, g, w, at);
    drops_take(j, w);
    if (st != IMP_OK) return st == IMP_E_NOMEM ? no_memory(j) : st;
    if (g > 0) return IMP_OK;
    at->next = 0;
    at->n_sunlit = imp__annual_direct(a, x, y, w->sunlit);
    struct imp__annual_sunlit *kept =
        imp__arena_take(&w->keep, at->n_sunlit, sizeof *kept);
    if (!kept) return no_memory(j);
    memcpy(kept, w->sunlit, at->n_sunlit * sizeof *kept);
    at->sunlit = kept;
    return IMP_OK;
}

static enum imp_status points_walk(struct job *j, double start)
{
    const struct imp__annual_year *y = j->y;
    const double all = (double)y->points, walks = (double)y->a->walks * IMP__GROUPS;
    for (size_t i = 0; i < j->points; i++) {
        struct imp__annual_at *at = &j->at[i];
        const size_t cells = (size_t)y->a->hours.n_cells + 1;
        at->I = imp__arena_take(&j->worker[0].keep, cells, sizeof *at->I);
        if (!at->I) return no_memory(j);
    }
    const struct imp_loop loop = {.n_items = j->points * IMP__GROUPS,
                                  .work = group_walk,
                                  .payload = j,
                                  .progress = y->run->progress,
                                  .progress_payload = y->run->progress_payload,
                                  .stage = "year",
                                  .rate_unit = "walks",
                                  .units = walks * (double)j->points,
                                  .fraction_lo = (double)j->first / all,
                                  .fraction_hi = (double)(j->first + j->points) / all,
                                  .start_s = start};
    return imp__parallel(y->a->scene->ctx, &loop, NULL);
}

/* ---- Hours --------------------------------------------------------------------------- */

/* Light of the suns that come straight at some blocks. */
static void suns_set(struct imp__annual_at *at, size_t block, size_t blocks,
                     imp__annual_lanes (*S)[IMP__GROUPS], bool *sun)
{
    memset(S, 0, blocks * sizeof *S);
    memset(sun, 0, blocks * sizeof *sun);
    for (; at->next < at->n_sunlit; at->next++) {
        const struct imp__annual_sunlit *s = &at->sunlit[at->next];
        const size_t b = s->hour / IMP__AT_ONCE - block;
        if (b >= blocks) break;
        for (int g = 0; g < IMP__GROUPS; g++)
            S[b][g][s->hour % IMP__AT_ONCE] = s->light[g % IMP__SUN_RAYS];
        sun[b] = true;
    }
}

static void hours_give(const struct imp__annual_year *y, size_t point, size_t block,
                       size_t blocks, const imp__annual_lanes (*E)[IMP__GROUPS])
{
    const struct imp__annual_hours *h = &y->a->hours;
    const size_t first = block * IMP__AT_ONCE,
                 end = imp_min(first + blocks * IMP__AT_ONCE, h->n);
    for (size_t k = first; k < end; k++) {
        double group[IMP__GROUPS];
        for (int g = 0; g < IMP__GROUPS; g++)
            group[g] = (double)E[k / IMP__AT_ONCE - block][g][k % IMP__AT_ONCE];
        const struct imp_estimate e = imp__annual_mean(group);
        if (y->reading) y->reading[point * y->n + h->hour[k]] = e.value;
        if (y->se) y->se[point * y->n + h->hour[k]] = e.se;
    }
}

/* The part of the year at points [first, end). */
static enum imp_status hours_work(size_t first, size_t end, void *payload)
{
    const struct job *j = payload;
    const struct imp__annual_year *y = j->y;
    for (size_t i = first; i < end; i++) {
        struct imp__annual_counts counts;
        struct imp__annual_numbers *out = &y->numbers[j->first + i];
        memset(&counts, 0, sizeof counts);
        for (size_t b = 0; b < j->blocks; b += IMP__BATCH) {
            imp__annual_lanes S[IMP__BATCH][IMP__GROUPS], E[IMP__BATCH][IMP__GROUPS];
            bool sun[IMP__BATCH];
            const size_t block = j->block + b,
                         n = imp_min(j->blocks - b, (size_t)IMP__BATCH);
            suns_set(&j->at[i], block, n, S, sun);
            memcpy(E, S, n * sizeof *E);
            imp__annual_light_add(y->a, &j->at[i], &j->sky[b / 2], block, n, E);
            imp__annual_add(y->options, &y->used[block], n, E, S, sun, &counts, out);
            if (y->reading || y->se) hours_give(y, j->first + i, block, n, E);
        }
        imp__annual_count(&counts, out);
    }
    return IMP_OK;
}

static enum imp_status points_year(struct job *j)
{
    const struct imp__annual *a = j->y->a;
    for (j->block = 0; j->block < a->hours.blocks; j->block += PART) {
        j->blocks = imp_min(a->hours.blocks - j->block, (size_t)PART);
        IMP_CHECKED(imp__annual_skies_make(a, j->block, j->blocks, j->sky));
        IMP_CHECKED(imp__parallel_ranges(a->scene->ctx, j->points, 1, hours_work, j));
    }
    return IMP_OK;
}

/* ---- All of it ------------------------------------------------------------------------ */

static bool workers_make(struct job *j, int threads)
{
    const struct imp__annual *a = j->y->a;
    imp_context *ctx = a->scene->ctx;
    bool got = true;
    j->worker = imp__alloc(ctx, (size_t)threads, sizeof *j->worker);
    for (int t = 0; j->worker && t < threads; t++) {
        struct imp__annual_worker *w = &j->worker[t];
        imp__arena_init(&w->arena, ctx);
        imp__arena_init(&w->keep, ctx);
        w->C_sum = imp__alloc(ctx, IMP__PATCHES, sizeof *w->C_sum);
        w->I_sum = imp__alloc(ctx, IMP__PATCHES, sizeof *w->I_sum);
        w->sunlit = imp__alloc(ctx, a->hours.n_suns + 1, sizeof *w->sunlit);
        got &= w->C_sum && w->I_sum && w->sunlit;
    }
    return got && j->worker;
}
static void workers_free(struct job *j, int threads)
{
    imp_context *ctx = j->y->a->scene->ctx;
    for (int t = 0; j->worker && t < threads; t++) {
        struct imp__annual_worker *w = &j->worker[t];
        imp__arena_free(&w->arena);
        imp__arena_free(&w->keep);
        imp__release(ctx, w->C_sum);
        imp__release(ctx, w->I_sum);
        imp__release(ctx, w->sunlit);
    }
    imp__release(ctx, j->worker);
}

/* As many as have room, in the worst case that the sun comes to all of them at each hour. */
static size_t at_once(const struct imp__annual_year *y)
{
    const double each =
        (double)(y->a->hours.n_suns + 1) * sizeof(struct imp__annual_sunlit);
    const double room = imp_clamp(SUNLIT_BYTES / each, 1.0, (double)AT_ONCE);
    const size_t threads = imp_min((size_t)y->a->scene->ctx->threads, (size_t)AT_ONCE);
    return imp_max((size_t)room, threads);
}

enum imp_status imp__annual_points(const struct imp__annual_year *y)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = y->a->scene->ctx;
    const int threads = ctx->threads;
    const double start = imp__now();
    struct job j = {.y = y, .at_once = at_once(y)};
    size_t lit = 0;
    if (pthread_mutex_init(&j.lock, NULL) != 0) return no_memory(&j);
    j.at = imp__alloc(ctx, imp_min(y->points, j.at_once), sizeof *j.at);
    j.sky = imp__alloc(ctx, PART / 2, sizeof *j.sky);
    if (!workers_make(&j, threads) || !j.at || !j.sky) IMP_TRY(no_memory(&j));
    for (; j.first < y->points; j.first += j.at_once) {
        j.points = imp_min(y->points - j.first, j.at_once);
        IMP_TRY(points_walk(&j, start));
        IMP_TRY(points_year(&j));
        for (int t = 0; t < threads; t++)
            imp__arena_rewind(&j.worker[t].keep, (struct imp_arena_mark){0});
    }
    IMP_TRY(imp__drops_budget(ctx, &j.drops, y->run->drop_budget,
                              (double)y->a->walks * IMP__GROUPS * (double)y->points, ""));
    for (size_t b = 0; b < y->a->hours.blocks; b++)
        for (int t = 0; t < IMP__AT_ONCE; t++) lit += y->used[b][t] != 0;
    for (size_t i = 0; i < y->points; i++)
        imp__annual_end(y->options, y->n_used, lit, &y->numbers[i]);
out:
    pthread_mutex_destroy(&j.lock);
    workers_free(&j, threads);
    imp__release(ctx, j.at);
    imp__release(ctx, j.sky);
    return st;
}

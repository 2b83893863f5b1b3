/* SPDX-License-Identifier: Apache-2.0
 *
 * Workers, groups and sums of a picture by light tracing or by bidirectional samples, and standard
 * errors from the spread of groups (film_light.h). */
#include "film_light.h"
#include "base/team.h"
#include "walk/lights/light_supply.h"
#include <stdio.h>
#include <string.h>

#define ITEMS_MAX   64
#define ITEM_WALKS  256 /* at least */
#define CHECK_WALKS 1024
#define GROUPS_MAX  256 /* of bidirectional samples */
#define GROUP_ITEMS 16

struct worker {
    struct imp_arena arena;
    struct imp_drops drops;
    int32_t *slot; /* [pixels] where the walk at work has a pixel, from 1; 0: nowhere */
    int32_t *touched; /* [cap] pixels of the walk at work */
    double *sum;      /* [cap][n] what it adds to them */
    int n_touched, cap;
    double *value; /* [n] */
};

struct job {
    const struct imp_light_picture *picture;
    const struct imp_film_desc *film;
    imp_context *ctx;
    struct imp_splat_scale scale;
    size_t pixels, n, items;
    /* Bidirectional samples, and sweeps: groups of `group` items each, whose spread is the error. */
    size_t groups, group;
    int64_t each;     /* walks of a pixel, or sweeps, in groups as even as can be */
    double *spread;   /* [pixels][n][2]: sums of S^2 and N S over groups of N walks */
    double **waiting; /* [groups] sums of groups behind one that is not there yet */
    size_t next;      /* group to be added, guarded by lock */
    struct worker *workers; /* [threads] */
    pthread_mutex_t lock;   /* guards drops */
    bool has_lock;
    struct imp_drops drops;
    double *mean, *se;
};

static enum imp_status touch(const struct job *j, struct worker *w, size_t pixel,
                             double weight)
{
    const size_t n = j->n;
    int32_t at = w->slot[pixel];
    if (at == 0) {
        if (w->n_touched == w->cap) {
            const int cap = w->cap ? 2 * w->cap : 64;
            int32_t *touched = imp__alloc(j->ctx, (size_t)cap, sizeof *touched);
            double *sum = imp__alloc(j->ctx, (size_t)cap * n, sizeof *sum);
            if (!touched || !sum) {
                imp__release(j->ctx, touched);
                imp__release(j->ctx, sum);
                return imp__error(j->ctx, IMP_E_NOMEM, "no memory for a walk's pixels");
            }
            if (w->cap) {
                memcpy(touched, w->touched, (size_t)w->cap * sizeof *touched);
                memcpy(sum, w->sum, (size_t)w->cap * n * sizeof *sum);
            }
            imp__release(j->ctx, w->touched);
            imp__release(j->ctx, w->sum);
            w->touched = touched;
            w->sum = sum;
            w->cap = cap;
        }
        at = w->slot[pixel] = ++w->n_touched;
        w->touched[at - 1] = (int32_t)pixel;
        memset(w->sum + (size_t)(at - 1) * n, 0, n * sizeof *w->sum);
    }
    double *sum = w->sum + (size_t)(at - 1) * n;
    for (size_t c = 0; c < n; c++) sum[c] += weight * w->value[c];
    return IMP_OK;
}

static void walk_drop(const struct job *j, struct worker *w, enum imp_drop cause,
                      int64_t index)
{
    const struct imp_run *run = j->picture->run;
    const struct imp_drop_key key = {.seed = run->seed,
                                     .sample = index,
                                     .x = -1,
                                     .y = -1,
                                     .sensor = run->sensor,
                                     .cause = (int32_t)cause};
    imp__drops_add(&w->drops, &key);
}

/* Adds walk `index`, the next of the supply, to the item's sums, [pixels][n][2]; with groups
 * [pixels][n], since the square of their sum is needed. */
static enum imp_status walk_add(const struct job *j, struct worker *w,
                                struct imp_light_supply *supply, int64_t index,
                                double *sums)
{
    const struct imp_light_picture *p = j->picture;
    struct imp_light_walk own = {.walk = {.dropped = IMP_DROP_MEMORY}};
    const struct imp_light_walk *walk =
        imp_likely(!p->trace) ? imp__light_supply_take(supply) : NULL;
    const struct imp_arena_mark mark = imp__arena_mark(&w->arena);
    enum imp_status st = IMP_OK;
    if (p->trace) p->trace(p->payload, &w->arena, index, &own);
    if (!walk) walk = &own;
    if (imp_unlikely(walk->walk.dropped == IMP_DROP_MEMORY || w->arena.failed))
        IMP_TRY(imp__error(j->ctx, IMP_E_NOMEM, "no memory to record a walk"));
    if (imp_unlikely(walk->walk.dropped)) walk_drop(j, w, walk->walk.dropped, index);
    if (p->whole && walk->reach) {
        p->whole(p->payload, walk, w->value);
        if (imp_unlikely(w->arena.failed))
            IMP_TRY(imp__error(j->ctx, IMP_E_NOMEM, "no memory for a walk's derivative"));
        IMP_TRY(touch(j, w, 0, 1));
    }
    for (const struct imp_reach *r = p->whole ? NULL : walk->reach; r; r = r->next) {
        struct imp_splat_taps taps;
        imp__splat_taps(j->film, &j->scale, r->px, r->py, &taps);
        if (taps.across.n <= 0 || taps.down.n <= 0) continue;
        p->values(p->payload, walk, r, w->value);
        for (int y = 0; y < taps.down.n; y++)
            for (int x = 0; x < taps.across.n; x++)
                IMP_TRY(touch(j, w,
                              (size_t)(taps.down.first + y) * (size_t)j->film->crop_w +
                                  (size_t)(taps.across.first + x),
                              taps.down.w[y] * taps.across.w[x]));
    }
    if (imp_unlikely(
            w->arena.failed)) /* what is made of the walk takes room in it, too */
        IMP_TRY(imp__error(j->ctx, IMP_E_NOMEM, "no memory for a walk's derivatives"));
    for (int k = 0; k < w->n_touched; k++) {
        const size_t pixel = (size_t)w->touched[k];
        const double *from = w->sum + (size_t)k * j->n;
        double *to = sums + pixel * j->n * (j->groups ? 1 : 2);
        if (j->groups)
            for (size_t c = 0; c < j->n; c++) to[c] += from[c];
        else
            for (size_t c = 0; c < j->n; c++) {
                to[2 * c] += from[c];
                to[2 * c + 1] += from[c] * from[c];
            }
        w->slot[pixel] = 0;
    }
    w->n_touched = 0;
out:
    imp__arena_rewind(&w->arena, mark);
    return st;
}

static size_t result_size(const struct job *j)
{
    return j->pixels * j->n * (j->groups ? 1 : 2) * sizeof(double);
}

/* The first walk of a group: of each pixel, or stratum, it has the same number. */
static int64_t group_begin(const struct job *j, size_t group)
{
    const int64_t pixels = j->picture->walks / j->each;
    return j->each * (int64_t)group / (int64_t)j->groups * pixels;
}

static enum imp_status item_work(size_t item, int worker, void *result, void *payload)
{
    struct job *j = payload;
    const struct imp_light_picture *p = j->picture;
    struct worker *w = &j->workers[worker];
    double *sums = result;
    enum imp_status st = IMP_OK;
    int64_t from = p->walks * (int64_t)item / (int64_t)j->items;
    int64_t to = p->walks * (int64_t)(item + 1) / (int64_t)j->items;
    if (j->groups) {
        const size_t g = item / j->group, k = item % j->group;
        const int64_t begin = group_begin(j, g), walks = group_begin(j, g + 1) - begin;
        from = begin + walks * (int64_t)k / (int64_t)j->group;
        to = begin + walks * (int64_t)(k + 1) / (int64_t)j->group;
    }
    from += p->first;
    to += p->first;
    memset(sums, 0, result_size(j));
    struct imp_light_supply supply = imp__light_supply(p->tracer, &w->arena, from, to);
    for (int64_t i = from; i < to && st == IMP_OK; i++) {
        st = walk_add(j, w, &supply, i, sums);
        if (st == IMP_OK && (i - from) % CHECK_WALKS == 0 && imp__drops_total(&w->drops))
            st = imp__drops_budget(j->ctx, &w->drops, p->run->drop_budget,
                                   (double)p->walks, "");
    }
    imp__arena_rewind(&w->arena, supply.mark);
    if (imp__drops_total(&w->drops) > 0) {
        pthread_mutex_lock(&j->lock);
        imp__drops_merge(&j->drops, &w->drops);
        pthread_mutex_unlock(&j->lock);
        memset(&w->drops, 0, sizeof w->drops);
    }
    return st;
}

static void item_add(void *into, const void *from, void *payload)
{
    const struct job *j = payload;
    double *a = into;
    const double *b = from;
    for (size_t k = 0; k < result_size(j) / sizeof *a; k++) a[k] += b[k];
}

/* Groups are taken in any order, and each is added in its turn. */
static enum imp_status group_take(size_t group, void *sum, void *payload)
{
    struct job *j = payload;
    const size_t n = j->pixels * j->n;
    double *kept = imp__alloc(j->ctx, n, sizeof *kept);
    if (!kept) return imp__error(j->ctx, IMP_E_NOMEM, "no memory for a picture");
    memcpy(kept, sum, n * sizeof *kept);
    pthread_mutex_lock(&j->lock);
    j->waiting[group] = kept;
    for (; j->next < j->groups && j->waiting[j->next]; j->next++) {
        const double *s = j->waiting[j->next];
        const double N = (double)(group_begin(j, j->next + 1) - group_begin(j, j->next));
        for (size_t k = 0; k < n; k++) {
            j->mean[k] += s[k];
            if (!j->spread) continue;
            j->spread[2 * k] += s[k] * s[k];
            j->spread[2 * k + 1] += N * s[k];
        }
        imp__release(j->ctx, j->waiting[j->next]);
        j->waiting[j->next] = NULL;
    }
    pthread_mutex_unlock(&j->lock);
    return IMP_OK;
}

static enum imp_status sums_take(size_t group, void *sum, void *payload)
{
    const struct job *j = payload;
    const double *s = sum, N = (double)j->picture->walks;
    (void)group;
    for (size_t k = 0; k < j->pixels * j->n; k++) {
        const double total = s[2 * k], square = s[2 * k + 1];
        j->mean[k] = total / N;
        if (j->se)
            j->se[k] =
                N > 1 ? sqrt(fmax(0, square - total * total / N) / (N * (N - 1))) : NAN;
    }
    return IMP_OK;
}

/* From the groups' sums the mean, and with N_g walks of N in group g
 *
 *     se^2 = G/(G - 1) sum (S_g - N_g mean)^2 / N^2 */
static void groups_end(struct job *j)
{
    const double N = (double)j->picture->walks, G = (double)j->groups;
    double square = 0;
    for (size_t g = 0; g < j->groups; g++)
        square += imp__sqr((double)(group_begin(j, g + 1) - group_begin(j, g)));
    for (size_t k = 0; k < j->pixels * j->n; k++) {
        const double mean = j->mean[k] / N;
        j->mean[k] = mean;
        if (!j->se) continue;
        const double sum =
            j->spread[2 * k] - 2 * mean * j->spread[2 * k + 1] + mean * mean * square;
        j->se[k] = G > 1 ? sqrt(fmax(0, sum) * G / (G - 1)) / N : NAN;
    }
}

static enum imp_status groups_create(struct job *j)
{
    const size_t n = j->pixels * j->n;
    j->waiting = imp__alloc(j->ctx, j->groups, sizeof *j->waiting);
    if (j->se) j->spread = imp__alloc(j->ctx, 2 * n, sizeof *j->spread);
    if (!j->waiting || (j->se && !j->spread))
        return imp__error(j->ctx, IMP_E_NOMEM, "no memory for a picture");
    memset(j->mean, 0, n * sizeof *j->mean);
    return IMP_OK;
}

static void groups_destroy(struct job *j)
{
    for (size_t g = 0; j->waiting && g < j->groups; g++)
        imp__release(j->ctx, j->waiting[g]);
    imp__release(j->ctx, j->waiting);
    imp__release(j->ctx, j->spread);
}

static enum imp_status workers_create(struct job *j)
{
    imp_context *ctx = j->ctx;
    const size_t threads = (size_t)ctx->threads;
    char what[96];
    int levels = 2;
    while ((size_t)1 << levels < j->items) levels++;
    snprintf(what, sizeof what, "light walks to %d x %d pixels of %zu values",
             j->film->crop_w, j->film->crop_h, j->n);
    const double sums = (double)(j->pixels * j->n * 2) * sizeof(double);
    const enum imp_status st = imp__memory_check(
        ctx, sums * ((double)threads + levels) + (double)j->pixels * 4. * (double)threads,
        what);
    if (st != IMP_OK) return st;
    j->workers = imp__alloc(ctx, threads, sizeof *j->workers);
    j->has_lock = j->workers && pthread_mutex_init(&j->lock, NULL) == 0;
    if (!j->has_lock) return imp__error(ctx, IMP_E_NOMEM, "no memory for workers");
    for (size_t k = 0; k < threads; k++) {
        struct worker *w = &j->workers[k];
        imp__arena_init(&w->arena, ctx);
        w->slot = imp__alloc(ctx, j->pixels, sizeof *w->slot);
        w->value = imp__alloc(ctx, j->n, sizeof *w->value);
        if (!w->slot || !w->value)
            return imp__error(ctx, IMP_E_NOMEM, "no memory for workers");
    }
    return IMP_OK;
}

static void workers_destroy(struct job *j)
{
    for (int k = 0; j->has_lock && k < j->ctx->threads; k++) {
        struct worker *w = &j->workers[k];
        if (w->arena.ctx) imp__arena_free(&w->arena);
        imp__release(j->ctx, w->slot);
        imp__release(j->ctx, w->touched);
        imp__release(j->ctx, w->sum);
        imp__release(j->ctx, w->value);
    }
    if (j->has_lock) pthread_mutex_destroy(&j->lock);
    imp__release(j->ctx, j->workers);
}

enum imp_status imp__light_picture_make(const struct imp_light_picture *p, double *mean,
                                        double *se, struct imp_drops *drops)
{
    enum imp_status st = IMP_OK;
    const struct imp_film_desc *film = &p->tracer->sensor->film;
    imp_context *ctx = p->tracer->scene->ctx;
    struct job j = {.picture = p,
                    .film = film,
                    .ctx = ctx,
                    .pixels = p->whole ? 1 : (size_t)film->crop_w * (size_t)film->crop_h,
                    .n = (size_t)p->n,
                    .mean = mean,
                    .se = se};
    j.items = (size_t)imp_clamp(p->walks / ITEM_WALKS, (int64_t)1, (int64_t)ITEMS_MAX);
    if (j.pixels > INT32_MAX)
        IMP_TRY(imp__error(ctx, IMP_E_UNSUPPORTED, "light walks: more than 2^31 pixels"));
    if (p->tracer->integrator->both || p->sweep > 0) {
        const int64_t pixels = (int64_t)film->crop_w * film->crop_h;
        j.each = p->walks / (p->sweep > 0 ? p->sweep : pixels);
        j.groups = (size_t)imp_clamp(j.each, (int64_t)1, (int64_t)GROUPS_MAX);
        j.group = (size_t)imp_clamp(p->walks / (int64_t)j.groups / ITEM_WALKS, (int64_t)1,
                                    (int64_t)GROUP_ITEMS);
        j.items = j.groups * j.group;
        IMP_TRY(groups_create(&j));
    }
    IMP_TRY(imp__splat_scale_create(ctx, film, &j.scale));
    IMP_TRY(workers_create(&j));
    struct imp_shared shared = {.drops = &j.drops};
    const struct imp_sum_desc desc = {.n_items = j.items,
                                      .group = j.groups ? j.group : j.items,
                                      .size = result_size(&j),
                                      .add = item_add,
                                      .take = j.groups ? group_take : sums_take,
                                      .payload = &j};
    const struct imp_loop loop = {.n_items = j.items,
                                  .payload = &j,
                                  .progress = p->run->progress,
                                  .progress_payload = p->run->progress_payload,
                                  .stage = p->stage,
                                  .rate_unit = "walks",
                                  .units = (double)p->walks,
                                  .fraction_lo = p->lo,
                                  .fraction_hi = p->hi};
    IMP_TRY(imp__shared_sum(ctx, &loop, &desc, item_work, &shared));
    IMP_TRY(imp__drops_budget(ctx, &j.drops, p->run->drop_budget, (double)p->walks, ""));
    if (drops) imp__drops_merge(drops, &j.drops);
    if (j.groups) groups_end(&j);
out:
    workers_destroy(&j);
    groups_destroy(&j);
    imp__splat_scale_destroy(ctx, &j.scale);
    return st;
}

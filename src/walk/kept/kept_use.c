/* SPDX-License-Identifier: Apache-2.0
 *
 * Whether recorded walks may be evaluated at the scene's present parameters, and what they are
 * worth there. */
#include "base/arguments.h"
#include "base/team.h"
#include "store.h"
#include "walk/media/tracking.h"
#include <string.h>

#define TILES_AT_ONCE 16
#define SEEN_LEAST                                                                       \
    0.5 /* least mean of new over old density; 1 if the walks cover the new one */
#define CLEAR 1.25 /* the subset decides if it clears a limit by this factor */
/* Roulette's growth, over all its steps of walks that have a last depth. */
#define GROWTH_MOST 4

const struct imp_store *imp__walks_store(const struct imp_walks *w,
                                         const struct imp_sensor *sensor)
{
    for (int k = 0; k < w->n_stores; k++)
        if (w->stores[k].sensor == sensor) return &w->stores[k];
    return NULL;
}

void imp__walks_destroy(struct imp_walks *w)
{
    if (!w) return;
    imp_context *ctx = w->ctx;
    for (int k = 0; k < w->n_stores; k++) imp__store_destroy(&w->stores[k]);
    imp__release(ctx, w->stores);
    imp__densities_destroy(ctx, &w->densities);
    imp__reduction_destroy(w->reduction);
    imp__release(ctx, w->theta);
    imp__release(ctx, w->chosen);
    imp__release(ctx, w->flights);
    if (w->owns_scene) imp_scene_destroy(w->scene);
    imp__release(ctx, w);
    imp__context_drop(ctx);
}

enum imp_status imp__walks_run(imp_context *ctx, const char *function,
                               struct imp_run *run)
{
    const struct imp_walks *w = run->walks;
    if (run->time_limit_s > 0)
        return imp__error(ctx, IMP_E_ARG,
                          "%s: run->time_limit_s is of pictures that are traced; the "
                          "number of recorded walks is what it is",
                          function);
    if (run->from == IMP_FROM_LIGHTS)
        return imp__error(ctx, IMP_E_ARG, "%s: recorded walks begin at the sensor",
                          function);
    run->seed = w->run.seed;
    run->spp = w->run.spp;
    run->points = w->run.points;
    run->wavelengths = w->run.wavelengths;
    run->wavelength_set = w->run.wavelength_set;
    run->from = IMP_FROM_SENSOR;
    run->guide = NULL; /* what it decided is kept */
    return IMP_OK;
}

/* Where an extinction was 0 nothing collided, so that walks say nothing of another one. */
static enum imp_status zeros_check(const struct imp_walks *w, const struct imp_param *p)
{
    for (size_t e = 0; e < p->info.count; e++)
        if (w->theta[p->info.offset + e] == 0 && imp__param_get(p, e) != 0)
            return imp__error(
                w->ctx, IMP_E_UNSUPPORTED,
                "recorded walks: number %zu of %s was 0 when they were drawn, "
                "so that no collision was, and is %g now",
                e, p->info.name, imp__param_get(p, e));
    return IMP_OK;
}

enum imp_status imp__walks_changed(const struct imp_walks *w, uint8_t *changed)
{
    const struct imp_scene *scene = w->scene;
    for (size_t k = 0; k < scene->n_params; k++) {
        const struct imp_param *p = &scene->params[k];
        changed[k] = 0;
        for (size_t e = 0; e < p->info.count && !changed[k]; e++)
            changed[k] = imp__param_get(p, e) != w->theta[p->info.offset + e];
        if (!changed[k] || w->chosen[k]) continue;
        if (!w->flights[k])
            return imp__error(w->ctx, IMP_E_UNSUPPORTED,
                              "recorded walks: %s has another value than when they were "
                              "drawn, and rays or densities follow it that were not kept",
                              p->info.name);
        IMP_CHECKED(zeros_check(w, p));
    }
    return IMP_OK;
}

struct weighing {
    const struct imp_store *store;
    const struct imp_densities *densities;
    struct imp_tracer tracer;
    const float *mask;
    struct imp_asking asking;
    struct imp_arena *arenas; /* [threads] */
    struct imp_moments sum;
};

static enum imp_status tiles_weigh(size_t item, int worker, void *result, void *payload)
{
    struct weighing *w = payload;
    const size_t end = imp_min((item + 1) * TILES_AT_ONCE, imp__store_tiles(w->store));
    enum imp_status st = IMP_OK;
    memset(result, 0, sizeof(struct imp_moments));
    for (size_t k = item * TILES_AT_ONCE; k < end && st == IMP_OK; k++)
        st = imp__store_moments(w->store, w->densities, &w->tracer, &w->arenas[worker], k,
                                w->mask, &w->asking, result);
    return st;
}
static void moments_add(void *into, const void *from, void *payload)
{
    double *a = into;
    const double *b = from;
    (void)payload;
    for (size_t k = 0; k < sizeof(struct imp_moments) / sizeof *a; k++) a[k] += b[k];
}
static enum imp_status moments_take(size_t group, void *sum, void *payload)
{
    struct weighing *w = payload;
    (void)group;
    w->sum = *(struct imp_moments *)sum;
    return IMP_OK;
}

static enum imp_status moments_sum(const struct imp_walks *all, struct weighing *w)
{
    imp_context *ctx = all->ctx;
    enum imp_status st = IMP_OK;
    const size_t items = (imp__store_tiles(w->store) - 1) / TILES_AT_ONCE + 1;
    const struct imp_sum_desc desc = {.n_items = items,
                                      .group = items,
                                      .size = sizeof(struct imp_moments),
                                      .add = moments_add,
                                      .take = moments_take,
                                      .payload = w};
    const struct imp_loop loop = {.n_items = items, .payload = w};
    struct imp_drops drops = {0};
    struct imp_shared shared = {.drops = &drops};
    w->arenas = imp__alloc(ctx, (size_t)ctx->threads, sizeof *w->arenas);
    if (!w->arenas) return imp__error(ctx, IMP_E_NOMEM, "no memory for recorded walks");
    for (int k = 0; k < ctx->threads; k++) imp__arena_init(&w->arenas[k], ctx);
    if (ctx->team) ctx->team->alone++;
    st = imp__shared_sum(ctx, &loop, &desc, tiles_weigh, &shared);
    if (ctx->team) ctx->team->alone--;
    for (int k = 0; k < ctx->threads; k++) imp__arena_free(&w->arenas[k]);
    imp__release(ctx, w->arenas);
    return st;
}

/* Over how many steps roulette's growth counts; negative: without end. */
static int growing_steps(const struct imp_walk_integrator *i)
{
    return i->max_depth < 0 ? -1 : imp_max(i->max_depth - imp_max(i->rr_depth, 1), 0);
}

bool imp__walks_finite(const struct imp_walks *w, const struct imp_walks_weight *x)
{
    const int steps = growing_steps(w->integrator);
    return !(x->growth > 0) ||
           (steps < 0 ? x->growth < 1 : pow(x->growth, steps) <= GROWTH_MOST);
}

/* Are there collisions that say nothing? The medium of some, and how many. */
static bool collisions_of(const struct imp_scene *scene, const double *count,
                          const char **medium, double *n)
{
    *n = 0;
    for (int k = IMP_STORE_CLASSES; k-- > 0;) {
        *n += count[k];
        if (count[k] > 0 && k < scene->n_media) *medium = scene->media[k]->name;
    }
    return *n > 0;
}

/* Could walks with the present collisions, and without them, be drawn? */
static enum imp_status collisions_check(const struct imp_walks *w,
                                        const struct imp_moments *sum)
{
    const char *medium = "";
    double n;
    if (collisions_of(w->scene, sum->passed, &medium, &n))
        return imp__error(
            w->ctx, IMP_E_UNSUPPORTED,
            "recorded walks: the extinction of medium '%s' is above the bound "
            "under which %g collisions were drawn; draw new ones",
            medium, n);
    if (collisions_of(w->scene, sum->certain, &medium, &n))
        return imp__error(w->ctx, IMP_E_UNSUPPORTED,
                          "recorded walks: the extinction of medium '%s' had reached its "
                          "bound where it is smaller now, so that no null collisions "
                          "were drawn beside %g real ones; draw new ones",
                          medium, n);
    return IMP_OK;
}

/* The reason why walks of this worth are not evaluated, as an error. */
static enum imp_status worth_check(const struct imp_walks *w,
                                   const struct imp_walks_weight *x)
{
    if (!imp__walks_finite(w, x))
        return imp__error(
            w->ctx, IMP_E_NUMERIC,
            "recorded walks: by roulette their second moment grows by %.3g a "
            "step at these parameters%s; draw new ones",
            x->growth,
            growing_steps(w->integrator) < 0 ? ", so that their variance is infinite"
                                             : "");
    if (x->ess < w->ess)
        return imp__error(w->ctx, IMP_E_NUMERIC,
                          "recorded walks: at these parameters %.2g of them count "
                          "(effective sample size), less than %.2g; draw new ones",
                          x->ess, w->ess);
    return IMP_OK;
}

static void weighing_begin(const struct imp_walks *w, const struct imp_store *store,
                           const struct imp_densities *densities, const float *mask,
                           size_t most, struct weighing *x)
{
    struct imp_run run = w->run;
    *x = (struct weighing){.store = store,
                           .densities = densities,
                           .tracer = {.scene = w->scene,
                                      .integrator = w->integrator,
                                      .sensor = store->sensor},
                           .mask = mask,
                           .asking = imp__store_asking(store, densities, most)};
    run.sensor = store->index;
    imp__tracer_numbers(&x->tracer, &run, 0);
}

enum imp_status imp__walks_weigh(const struct imp_walks *w, const struct imp_store *store,
                                 const float *mask, size_t most,
                                 struct imp_walks_weight *out, bool *all)
{
    imp_context *ctx = w->ctx;
    enum imp_status st = IMP_OK;
    struct imp_densities own = w->densities; /* with `moved` of this call */
    own.guided = w->guided;
    own.least = imp__real_least(w->headroom);
    uint8_t *changed = imp__alloc(ctx, w->scene->n_params + 1, 1);
    const size_t walks = imp__store_tiles(store);
    own.moved = imp__alloc(ctx, (size_t)w->scene->n_bsdfs + 1, 1);
    *out = (struct imp_walks_weight){.size = sizeof *out, .ess = 1};
    if (all) *all = true;
    for (size_t k = 0; k < walks; k++) out->n_walks += (double)store->records[k].n_walks;
    if (!changed || !own.moved)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for recorded walks"));
    IMP_TRY(imp__walks_changed(w, changed));
    imp__densities_move(&own, changed);
    /* Roulette's own growth is of interest at the parameters of the draw, too. */
    if (!own.any && !(store->roulette && own.weights)) goto out;
    struct weighing x;
    weighing_begin(w, store, &own, mask, most, &x);
    if (all) *all = x.asking.every == 1;
    IMP_TRY(moments_sum(w, &x));
    out->n_walks = x.sum.n;
    if (x.sum.w2 > 0) out->ess = x.sum.w * x.sum.w / (x.sum.n * x.sum.w2);
    else if (x.sum.n > 0) out->ess = 0;
    /* A mean of ratios that is below 1 by chance is not looked at. */
    if (x.sum.seen < SEEN_LEAST * x.sum.moved)
        out->ess = imp_min(x.sum.seen / x.sum.moved, out->ess);
    out->growth = imp__moments_radius(&x.sum);
    IMP_TRY(collisions_check(w, &x.sum));
out:
    imp__release(ctx, changed);
    imp__release(ctx, own.moved);
    return st;
}

/* Walks that are worth their use by far need no more than a look at some of them: to ask all
 * of them takes longer than a picture of their values. */
static enum imp_status use_check(const struct imp_walks *w, const struct imp_store *store)
{
    struct imp_walks_weight x;
    bool all;
    /* Classes that materials share say nothing of each. */
    const bool apart = w->scene->n_bsdfs <= IMP_STORE_CLASSES;
    IMP_CHECKED(imp__walks_weigh(w, store, NULL, apart ? IMP_WALKS_ASKED : 0, &x, &all));
    struct imp_walks_weight worse = x;
    worse.growth *= CLEAR;
    if (!all && x.ess >= CLEAR * w->ess && imp__walks_finite(w, &worse)) return IMP_OK;
    if (!all) IMP_CHECKED(imp__walks_weigh(w, store, NULL, 0, &x, NULL));
    return worth_check(w, &x);
}

/* Are all active parameters among those that may change? */
static enum imp_status active_check(const struct imp_walks *w,
                                    const struct imp_active *active)
{
    for (size_t k = 0; active && k < w->scene->n_params; k++)
        if (active->base[k] >= 0 && !w->chosen[k])
            return imp__error(w->ctx, IMP_E_UNSUPPORTED,
                              "recorded walks have no derivative with respect to %s: %s",
                              w->scene->params[k].info.name,
                              w->flights[k] ? "their collisions were drawn by it"
                                            : "rays or densities follow it");
    return IMP_OK;
}

enum imp_status imp__walks_use(const struct imp_run *run, struct imp_tracer *tracer)
{
    const struct imp_walks *w = run->walks;
    imp_context *ctx = tracer->scene->ctx;
    if (w->scene != tracer->scene)
        return imp__error(ctx, IMP_E_ARG, "recorded walks of another scene");
    const struct imp_store *store = imp__walks_store(w, tracer->sensor);
    if (!store)
        return imp__error(ctx, IMP_E_ARG, "there are no recorded walks of sensor '%s'",
                          tracer->sensor->name);
    if (tracer->integrator != w->integrator)
        return imp__error(ctx, IMP_E_ARG, "recorded walks of another integrator");
    IMP_CHECKED(active_check(w, tracer->active));
    if (w->ess >= 0) IMP_CHECKED(use_check(w, store)); /* else whoever made them has */
    tracer->kept = store;
    return IMP_OK;
}

/* ---- Public ------------------------------------------------------------------------- */

void imp_walks_destroy(imp_walks *w) { imp__walks_destroy(w); }

imp_scene *imp_walks_scene(const imp_walks *w)
{
    IMP_REQUIRE_OR(NULL, w, "walks", NULL);
    return w->scene;
}

enum imp_status imp_walks_get_info(const imp_walks *w, struct imp_walks_info *info)
{
    IMP_REQUIRE(NULL, w, "walks");
    IMP_REQUIRE(w->ctx, info, "info");
    struct imp_walks_info all = {.size = sizeof all,
                                 .n_sensors = w->n_stores,
                                 .spp = (int)w->stores[0].n,
                                 .seed = w->run.seed,
                                 .survival = w->survival,
                                 .losses = w->losses};
    for (int k = 0; k < w->n_stores; k++)
        for (size_t t = 0; t < imp__store_tiles(&w->stores[k]); t++) {
            const struct imp_record *r = &w->stores[k].records[t];
            all.n_walks += (double)r->n_walks;
            all.n_vertices += (double)r->n_vertices;
            all.bytes += (double)imp__store_bytes(&w->stores[k], t);
        }
    IMP_GIVE(w->ctx, info, all, "info");
    return IMP_OK;
}

enum imp_status imp_walks_weigh(const imp_walks *w, int sensor, const float *mask,
                                struct imp_walks_weight *weight)
{
    IMP_REQUIRE(NULL, w, "walks");
    IMP_REQUIRE(w->ctx, weight, "weight");
    IMP_SIZED(w->ctx, weight, "weight");
    IMP_FLOAT_MODE;
    IMP_READS(w->scene);
    struct imp_walks_weight all;
    const struct imp_store *store = NULL;
    for (int k = 0; k < w->n_stores; k++)
        if (w->stores[k].index == sensor) store = &w->stores[k];
    if (!store)
        return imp__error(w->ctx, IMP_E_ARG, "there are no recorded walks of sensor %d",
                          sensor);
    const struct imp_film_desc *film = &store->sensor->film;
    const size_t pixels = (size_t)film->crop_w * (size_t)film->crop_h;
    for (size_t i = 0; mask && i < pixels; i++)
        if (!isfinite(mask[i]))
            return imp__error(w->ctx, IMP_E_ARG, "mask: pixel %zu is %g", i, mask[i]);
    enum imp_status st = imp__walks_weigh(w, store, mask, 0, &all, NULL);
    if (st == IMP_OK) st = worth_check(w, &all);
    if (st != IMP_OK && st != IMP_E_UNSUPPORTED && st != IMP_E_NUMERIC) return st;
    if (st != IMP_OK) all.refused = imp_last_error(w->ctx);
    if (st == IMP_E_UNSUPPORTED) all.ess = 0;
    IMP_GIVE(w->ctx, weight, all, "weight");
    return IMP_OK;
}

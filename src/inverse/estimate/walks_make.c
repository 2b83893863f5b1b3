/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks are drawn and kept (walk/kept/store.h), by all threads, tile by tile. Every rank
 * of a team keeps all of them, and evaluates its share. */
#include "walks_make.h"
#include "base/arguments.h"
#include "base/team.h"
#include "film/film_filter.h"
#include "film/film_measure.h"
#include "replicates.h"
#include "scene/in_medium.h"
#include "scene/pose.h"
#include "walk/rules/features.h"
#include "walk/run/run.h"
#include <string.h>

#define SURVIVAL    0.8
#define ESS         0.5
#define MEMORY      ((size_t)1 << 30)
#define BUDGET_MOST ((size_t)1 << 62)

/* ---- Their numbers --------------------------------------------------------------- */

struct numbers {
    imp_context *ctx;
    int64_t *sample;
    size_t n, cap;
};

static enum imp_status number_add(struct numbers *s, int64_t k)
{
    int64_t *grown = imp__grow(s->ctx, s->sample, &s->cap, s->n + 1, sizeof *grown);
    if (!grown) return imp__error(s->ctx, IMP_E_NOMEM, "no memory for recorded walks");
    s->sample = grown;
    grown[s->n++] = k;
    return IMP_OK;
}

/* Sample numbers to keep. A picture needs 0, 1, 2, ..., or the same of its sets; losses need
 * those of the replicates: the sets of Sobol points, or with independent points enough for all kinds
 * of loss. */
static enum imp_status numbers_of(const struct imp_scene *scene, int sensor,
                                  const struct imp_walks *w, struct numbers *out)
{
    const struct imp__target l2 = {.desc = {.sensor = sensor, .loss = IMP_LOSS_L2}};
    const struct imp__target log = {.desc = {.sensor = sensor, .loss = IMP_LOSS_LOG}};
    struct imp_run run = w->run;
    run.sensor = sensor;
    const int spp = run.spp > 0 ? run.spp : scene->sensors[sensor]->spp;
    const bool sobol = imp__points_of(scene->sensors[sensor], &run) == IMP_POINTS_SOBOL;
    if (w->losses && sobol) {
        run.walks = w;
        const struct imp__replicates r = imp__replicates_of(scene, &l2, &run);
        for (int b = 0; b < r.R; b++)
            for (int s = 0; s < r.m; s++) {
                const int n = imp__replicates_set(r, s + 1) - imp__replicates_set(r, s);
                for (int i = 0; i < n; i++)
                    IMP_CHECKED(number_add(out, imp__replicates_first(r, b, s) + i));
            }
        return IMP_OK;
    }
    if (sobol) {
        const struct imp_tracer tracer = {.points = imp__points(),
                                          .sensor = scene->sensors[sensor]};
        const int set = imp__tracer_set(&tracer, spp);
        for (int k = 0; k < spp; k++)
            IMP_CHECKED(number_add(out, imp__set_number(set, spp, k)));
        return IMP_OK;
    }
    int64_t n = spp;
    if (w->losses) {
        const struct imp__replicates plans[] = {
            imp__replicates_of(scene, &l2, &run), imp__replicates_of(scene, &log, &run),
            imp__replicates_of(scene, NULL, &run),
            imp__replicates_normal(scene, &l2, &run, 1)};
        for (size_t k = 0; k < imp_count(plans); k++)
            n = imp_max(n, (int64_t)plans[k].n * plans[k].R);
    }
    for (int64_t k = 0; k < n; k++) IMP_CHECKED(number_add(out, k));
    return IMP_OK;
}

/* ---- Drawing --------------------------------------------------------------------- */

struct filling {
    struct imp_store *store;
    struct imp_tracer tracer;
    struct imp_arena *arenas; /* [threads] */
    size_t first;             /* tile of this process */
};

static enum imp_status tile_fill(size_t item, int worker, int slot, void *payload)
{
    (void)slot;
    struct filling *f = payload;
    return imp__store_fill(f->store, &f->tracer, &f->arenas[worker], f->first + item);
}

static enum imp_status store_fill(const struct imp_walks *w, struct filling *f)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = w->ctx;
    const struct imp_run *run = &w->run;
    const int rank = w->spread ? ctx->team->host.rank : 0,
              ranks = w->spread ? ctx->team->host.ranks : 1;
    const size_t end = imp__store_share(f->store, rank + 1, ranks);
    f->first = imp__store_share(f->store, rank, ranks);
    const double walks = (double)f->store->width * f->store->height *
                         (double)f->store->n * (double)(end - f->first) /
                         (double)imp__store_tiles(f->store);
    const struct imp_loop loop = {.n_items = end - f->first,
                                  .work = tile_fill,
                                  .payload = f,
                                  .progress = run->progress,
                                  .progress_payload = run->progress_payload,
                                  .stage = "walks",
                                  .rate_unit = "walks",
                                  .units = walks,
                                  .fraction_lo = 0,
                                  .fraction_hi = 1,
                                  .start_s = imp__now()};
    f->arenas = imp__alloc(ctx, (size_t)ctx->threads, sizeof *f->arenas);
    if (!f->arenas) return imp__error(ctx, IMP_E_NOMEM, "no memory for recorded walks");
    for (int k = 0; k < ctx->threads; k++) imp__arena_init(&f->arenas[k], ctx);
    st = imp__parallel(ctx, &loop, NULL);
    for (int k = 0; k < ctx->threads; k++) imp__arena_free(&f->arenas[k]);
    imp__release(ctx, f->arenas);
    return st;
}

enum imp_status imp__walks_sensor(struct imp_walks *w, const struct imp_active *active,
                                  int index, size_t budget, struct imp_tracer *tracer)
{
    enum imp_status st = IMP_OK;
    struct imp_scene *scene = w->scene;
    const struct imp_sensor *sensor = scene->sensors[index];
    struct numbers numbers = {.ctx = w->ctx};
    struct imp_run run = w->run;
    struct imp_store *store = &w->stores[w->n_stores];
    run.sensor = index;
    struct imp_job job = imp__job(scene, sensor, &run, NULL);
    imp__job_state(&job, IMP_HAS_RECORDING, NULL);
    IMP_TRY(imp__job_allowed(&job));
    IMP_TRY(numbers_of(scene, index, w, &numbers));
    *tracer = (struct imp_tracer){.scene = scene,
                                  .integrator = w->integrator,
                                  .sensor = sensor,
                                  .active = active,
                                  .seed = run.seed,
                                  .guide = imp__guide_of(scene, w->integrator, run.guide),
                                  .collisions_fixed = true,
                                  .survival = w->survival,
                                  .headroom = w->headroom};
    imp__tracer_numbers(tracer, &run, w->losses ? 0 : (int64_t)numbers.n);
    if (w->losses) tracer->set = 1;
    IMP_TRY(imp__store_create(
        tracer, index, sensor->film.sample_border ? imp__film_border(&sensor->film) : 0,
        numbers.sample, numbers.n, budget, w->reduction, store));
    w->n_stores++;
    store->stratified = tracer->wavelengths && tracer->set > 1;
    if (w->losses && tracer->points) {
        const struct imp__target l2 = {.desc = {.sensor = index}};
        run.walks = w;
        const struct imp__replicates r = imp__replicates_of(scene, &l2, &run);
        store->source.set = r.n / r.m;
    }
out:
    imp__release(w->ctx, numbers.sample);
    return st;
}

static enum imp_status sensor_keep(struct imp_walks *w, const struct imp_active *active,
                                   int index, size_t budget, int left)
{
    struct filling f = {.store = &w->stores[w->n_stores]};
    enum imp_status st = imp__walks_sensor(w, active, index, budget, &f.tracer);
    if (st == IMP_OK) st = store_fill(w, &f);
    f.store->left = left;
    if (st == IMP_OK) imp__store_settle(f.store);
    return st;
}

/* ---- All of them ----------------------------------------------------------------- */

/* Is it an extinction of media that vary, beside an albedo, and of no others? */
static bool is_grid(const struct imp_walks *w, size_t param, uint8_t *one)
{
    bool any = false;
    one[param] = 1;
    for (int k = 0; k < w->scene->n_media; k++) {
        const struct imp_medium *m = w->scene->media[k];
        for (int j = 0; j < m->n_own; j++) {
            if (!(m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION) ||
                !imp__input_depends(m->input[j], one))
                continue;
            any = m->majorants && imp__in_medium_has_albedo(m);
            if (!any) goto out;
        }
    }
out:
    one[param] = 0;
    return any;
}

/* Chooses the parameters whose derivative is that of frozen walks, and those by which
 * collisions were drawn. */
static enum imp_status chosen_make(struct imp_walks *w, const uint8_t *free)
{
    const struct imp_scene *scene = w->scene;
    w->chosen = imp__alloc(w->ctx, scene->n_params + 1, 1);
    w->flights = imp__alloc(w->ctx, scene->n_params + 1, 1);
    w->theta = imp__alloc(w->ctx, scene->n_theta + 1, sizeof *w->theta);
    uint8_t *one = imp__alloc(w->ctx, scene->n_params + 1, 1);
    if (!w->chosen || !w->flights || !w->theta || !one) {
        imp__release(w->ctx, one);
        return imp__error(w->ctx, IMP_E_NOMEM, "no memory for recorded walks");
    }
    for (size_t k = 0; k < scene->n_params; k++) {
        const struct imp_param *p = &scene->params[k];
        const bool smooth =
            p->info.flags & IMP_PARAM_DIFFERENTIABLE && (!free || free[k]);
        w->chosen[k] = smooth && (!p->probed || (w->headroom > 1 && is_grid(w, k, one)));
        w->flights[k] = smooth && !w->chosen[k];
        for (size_t e = 0; e < p->info.count; e++)
            w->theta[p->info.offset + e] = imp__param_get(p, e);
    }
    imp__release(w->ctx, one);
    for (int b = 0; b < scene->n_bodies; b++)
        for (int k = 0; k < scene->bodies[b]->n_numbers; k++) {
            const int param = scene->bodies[b]->numbers[k].param;
            if (param >= 0) w->chosen[param] = w->flights[param] = 0;
        }
    /* Rays and collisions are where things were; what a volume said there is not kept. */
    for (const struct imp_pose *p = scene->poses; p; p = p->next)
        w->chosen[p->param] = w->flights[p->param] = 0;
    return IMP_OK;
}

enum imp_status imp__walks_begin(imp_scene *scene, const struct imp_run *run,
                                 const struct imp_walks_options *o, const uint8_t *free,
                                 imp_walks **out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    const struct imp_walk_integrator *integrator =
        scene->integrator ? imp__walk_integrator_of(scene->integrator) : NULL;
    struct imp_walks *w;
    struct imp_job job = imp__job(scene, NULL, run, NULL);
    imp__job_state(&job, IMP_HAS_RECORDING, NULL);
    IMP_CHECKED(imp__job_allowed(&job));
    integrator = imp__walks_from(integrator, run->from);
    w = imp__alloc(ctx, 1, sizeof *w);
    if (!w) return imp__error(ctx, IMP_E_NOMEM, "no memory for recorded walks");
    imp__context_hold(ctx);
    *w = (struct imp_walks){.ctx = ctx,
                            .scene = scene,
                            .run = *run,
                            .losses = o->losses != 0,
                            .guided = run->guide && run->guide->expected,
                            .spread = o->spread && imp__team_ranks(ctx),
                            .survival = o->survival < 0 ? 0 : o->survival,
                            .headroom = o->headroom > 1 ? o->headroom : 0,
                            .ess = o->ess,
                            .integrator = integrator};
    w->stores = imp__alloc(ctx, (size_t)scene->n_sensors + 1, sizeof *w->stores);
    if (!w->stores) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for recorded walks"));
    IMP_TRY(chosen_make(w, free));
    IMP_TRY(
        imp__densities_create(scene, integrator, w->chosen, w->survival, &w->densities));
    if (!w->spread)
        IMP_TRY(imp__reduction_create(scene, integrator, w->chosen, &w->reduction));
    *out = w;
    return IMP_OK;
out:
    imp__walks_destroy(w);
    return st;
}

static enum imp_status sensors_keep(struct imp_walks *w, const uint8_t *sensors,
                                    size_t memory)
{
    enum imp_status st = IMP_OK;
    struct imp_active active = {0};
    int left = 0;
    IMP_TRY(imp__active_create(w->scene, w->chosen, &active));
    for (int k = 0; k < w->scene->n_sensors; k++) left += sensors[k] != 0;
    for (int k = 0; k < w->scene->n_sensors; k++) {
        if (!sensors[k]) continue;
        IMP_TRY(sensor_keep(w, &active, k, imp_min(memory, BUDGET_MOST), left--));
        const struct imp_store *s = &w->stores[w->n_stores - 1];
        const size_t taken = s->bytes + s->reduced_bytes;
        memory -= imp_min(memory, taken);
    }
out:
    imp__active_destroy(w->ctx, &active);
    return st;
}

/* A share may fail on one rank alone, but all have to go on alike. */
static enum imp_status spread_agree(struct imp_walks *w, enum imp_status st)
{
    bool any;
    if (!w->spread) return st;
    const enum imp_status asked = imp__team_any(w->ctx, st != IMP_OK, &any);
    if (st != IMP_OK || asked != IMP_OK) return st != IMP_OK ? st : asked;
    if (any) return imp__error(w->ctx, IMP_E_NOMEM, "another rank keeps no walks");
    for (int k = 0; k < w->n_stores; k++) { /* the walks of all are one draw */
        IMP_CHECKED(imp__team_any(w->ctx, atomic_load(&w->stores[k].roulette), &any));
        atomic_store(&w->stores[k].roulette, any);
    }
    return IMP_OK;
}

enum imp_status imp__walks_make(imp_scene *scene, const struct imp_run *run,
                                const struct imp_walks_options *o, const uint8_t *sensors,
                                const uint8_t *free, imp_walks **out)
{
    enum imp_status st = IMP_OK;
    struct imp_walks *w = NULL;
    IMP_TRY(imp__walks_begin(scene, run, o, free, &w));
    IMP_TRY(spread_agree(w, sensors_keep(w, sensors, o->memory)));
    w->run.progress = NULL; /* of this call alone */
    w->run.guide = NULL;
    *out = w;
    w = NULL;
out:
    imp__walks_destroy(w);
    return st;
}

enum imp_status imp_walks_keep(imp_scene *scene, const struct imp_run *run,
                               const struct imp_walks_options *options, imp_walks **out)
{
    struct imp_run own;
    struct imp_walks_options o = IMP_WALKS_OPTIONS_INIT;
    IMP_REQUIRE(NULL, scene, "scene");
    imp_context *ctx = scene->ctx;
    IMP_REQUIRE(ctx, out, "out");
    IMP_RUN(ctx, own, run);
    IMP_OPTIONS(ctx, o, options, "options");
    IMP_FLOAT_MODE;
    IMP_READS(scene);
    enum imp_status st = IMP_OK;
    const struct imp_sensor *sensor;
    uint8_t *sensors = NULL;
    if (!(o.survival <= 1) || isinf(o.survival) || !(o.ess >= 0 && o.ess <= 1) ||
        !(o.headroom >= 0 && o.headroom <= IMP_HEADROOM_MOST))
        return imp__error(ctx, IMP_E_ARG,
                          "options: survival %g, ess %g or headroom %g is out of range",
                          o.survival, o.ess, o.headroom);
    if (own.walks || own.time_limit_s > 0)
        return imp__error(ctx, IMP_E_ARG,
                          "recorded walks are traced, run->spp in each pixel");
    if (o.memory == 0) o.memory = MEMORY;
    if (o.survival == 0) o.survival = SURVIVAL;
    if (o.ess == 0) o.ess = ESS;
    IMP_TRY(imp__run_sensor(scene, &own, &sensor));
    sensors = imp__alloc(ctx, (size_t)scene->n_sensors, 1);
    if (!sensors) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for recorded walks"));
    for (int k = 0; k < scene->n_sensors; k++)
        sensors[k] = o.all_sensors || k == own.sensor;
    own.points = imp__points_recorded(scene, &own, sensors, o.losses);
    IMP_TRY(imp__walks_make(scene, &own, &o, sensors, NULL, out));
out:
    imp__release(ctx, sensors);
    return st;
}

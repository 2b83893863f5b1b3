/* SPDX-License-Identifier: Apache-2.0
 *
 * Loss and gradient from the same walks. The n walks of a replicate are kept in the arena
 * until their adjoints are known (adjoint.c), then swept: the price of one render and a
 * sweep. A fixed adjoint image needs no mean, and no walk is kept. Filters wider than a
 * pixel take two passes with the same random numbers (splat.c). */
#include "estimate.h"
#include "adjoint.h"
#include "film/film_picture.h"
#include "loss.h"
#include "splat.h"
#include "tally.h"
#include "walk/run.h"
#include <string.h>

struct imp__replicates imp__replicates_plan(int spp, int batch_max)
{
    struct imp__replicates r;
    spp = imp_max(spp, 2);
    r.n = spp < 4 ? spp : imp_min(spp / 2, batch_max);
    r.R = (spp - 1) / r.n + 1;
    r.chunks = imp_max(1, r.R / IMP_BATCHES_PER_ITEM);
    return r;
}

/* ---- One pixel's replicate ----------------------------------------------------- */

struct job {
    const struct imp_problem *problem;
    const struct imp_run *run;
    double walks; /* planned */
    struct imp_tracer tracer;
    struct imp__replicates plan;
    const struct imp__target *target; /* NULL: fixed adjoint */
    const float *seed;                /* fixed adjoint image, [h][w][channels] */
    const struct imp__splat *splat;   /* wide filters: pass 2; NULL: box */
    int width, height, margin, channels;
    bool want_gradient;
    struct imp_active nothing; /* what the tally keeps without want_gradient */
    struct worker {
        struct imp_arena arena;
        struct imp_tally tally;
    } * workers;
    struct slot {
        struct imp_tally_result tally;
        double objective, variance;
        uint64_t dropped;
    } * slots;
    double objective, variance, *gradient, *gradient_variance;
    uint64_t dropped;
};

/* Replicate b of a pixel: trace, fold, adjoints, sweep. Returns its loss estimate. */
static double replicate(struct job *j, struct worker *w, int x, int y, int b,
                        uint64_t *dropped)
{
    const int n = j->plan.n;
    const struct imp_arena_mark mark = imp__arena_mark(&w->arena);
    struct imp_walk *walks = imp__arena_take(&w->arena, (size_t)n, sizeof *walks);
    imp_spec *L = imp__arena_take(&w->arena, (size_t)n, sizeof *L);
    imp_spec *P = imp__arena_take(&w->arena, (size_t)n, sizeof *P);
    double value = 0;
    if (!walks || !L || !P) {
        w->tally.failed = true;
        goto out;
    }
    const bool keep = j->target && !j->splat; /* the others' mean is needed first */
    const size_t pixel = (size_t)y * (size_t)j->width + (size_t)x;
    for (int i = 0; i < n; i++) {
        const struct imp_arena_mark one = imp__arena_mark(&w->arena);
        const int64_t sample = (int64_t)b * n + i;
        imp__walk_trace(&j->tracer, &w->arena, x, y, sample, &walks[i]);
        *dropped += walks[i].dropped != IMP_DROP_NONE;
        if (walks[i].dropped == IMP_DROP_MEMORY) w->tally.failed = true;
        L[i] = walks[i].L;
        if (keep) continue;
        if (j->splat)
            P[0] = imp__splat_adjoint(j->splat, b, walks[i].px, walks[i].py, L[i]);
        else
            for (int c = 0; c < 4; c++)
                P[0][c] =
                    c < j->channels
                        ? j->seed[pixel * (size_t)j->channels + (size_t)c] / (double)n
                        : 0;
        imp__walk_sweep(&j->tracer, &walks[i], P[0], &w->tally.sink);
        imp__arena_rewind(&w->arena, one);
    }
    if (keep) {
        value = imp__replicate_adjoints(j->target, j->channels, pixel, n, L, P);
        if (j->want_gradient)
            for (int i = 0; i < n; i++)
                imp__walk_sweep(&j->tracer, &walks[i], P[i], &w->tally.sink);
    }
    imp__tally_batch(&w->tally);
out:
    imp__arena_rewind(&w->arena, mark);
    return value;
}

/* ---- Tiles --------------------------------------------------------------------- */

static enum imp_status tile_work(size_t item, int worker, int slot, void *payload)
{
    struct job *j = payload;
    struct worker *w = &j->workers[worker];
    struct slot *out = &j->slots[slot];
    const struct imp__tile t =
        imp__tile_of(item, j->width, j->height, j->margin, j->plan.chunks);
    const int b0 = imp__replicates_begin(j->plan, t.chunk);
    const int b1 = imp__replicates_begin(j->plan, t.chunk + 1);
    const double R = b1 - b0, all = j->plan.R;
    const bool paired = j->plan.R == 1; /* pixels two by two stand in for replicates */
    double first = 0;
    int in_pair = 0;

    out->objective = out->variance = 0;
    out->dropped = 0;
    imp__tally_clear(&w->tally);
    for (int y = t.y0; y < t.y1; y++)
        for (int x = t.x0; x < t.x1; x++) {
            double sum = 0, square = 0;
            for (int b = b0; b < b1; b++) {
                const double v = replicate(j, w, x, y, b, &out->dropped);
                sum += v;
                square += v * v;
            }
            if (w->arena.failed)
                return imp__error(j->problem->ctx, IMP_E_NOMEM,
                                  "no memory to record walks");
            /* Lost already: walks that nothing ends take long. */
            const enum imp_status st =
                imp__drops_check(j->problem->ctx, j->run, out->dropped, j->walks);
            if (st != IMP_OK) return st;
            if (!paired) {
                /* mean over all R replicates; variance R/(R-1) spread / all^2 */
                imp__tally_pixel(&w->tally, R, 1 / all, R / ((R - 1) * all * all));
                out->objective += sum / all;
                out->variance += (square - sum * sum / R) * R / ((R - 1) * all * all);
                continue;
            }
            out->objective += sum;
            if (in_pair++ == 0) {
                first = sum;
                continue;
            }
            imp__tally_pixel(&w->tally, 2, 1, 2);
            out->variance += imp__sqr(first - sum);
            in_pair = 0;
        }
    if (in_pair) {
        imp__tally_pixel(&w->tally, 2, 1, 2);
        out->variance += imp__sqr(first);
    }
    return imp__tally_export(&w->tally, &out->tally);
}

static enum imp_status tile_commit(size_t item, int slot, void *payload)
{
    struct job *j = payload;
    const struct slot *in = &j->slots[slot];
    (void)item;
    j->objective += in->objective;
    j->variance += in->variance;
    j->dropped += in->dropped;
    imp__tally_add(&in->tally, j->want_gradient ? j->problem->n : 0, j->gradient,
                   j->gradient_variance);
    return imp__drops_check(j->problem->ctx, j->run, j->dropped, j->walks);
}

static void job_destroy(struct job *j)
{
    imp_context *ctx = j->problem->ctx;
    for (int k = 0; j->workers && k < ctx->threads; k++) {
        if (j->workers[k].arena.ctx) imp__arena_free(&j->workers[k].arena);
        imp__tally_destroy(&j->workers[k].tally);
    }
    for (int k = 0; j->slots && k < imp__pool_slots(ctx); k++)
        imp__tally_result_destroy(ctx, &j->slots[k].tally);
    imp__release(ctx, j->workers);
    imp__release(ctx, j->slots);
}

/* Adds objective, variance and gradients of this job to the totals in it. */
static enum imp_status job_run(struct job *j, const struct imp_run *run,
                               const char *stage, double lo, double hi, double start_s)
{
    imp_context *ctx = j->problem->ctx;
    enum imp_status st = IMP_OK;
    const struct imp_film_desc *film = &j->tracer.sensor->film;
    j->width = film->crop_w;
    j->height = film->crop_h;
    j->channels = j->problem->scene->channels;
    j->margin = j->splat && film->sample_border ? imp__film_border(film) : 0;
    j->dropped = 0;
    j->workers = imp__alloc(ctx, (size_t)ctx->threads, sizeof *j->workers);
    j->slots = imp__alloc(ctx, (size_t)imp__pool_slots(ctx), sizeof *j->slots);
    if (!j->workers || !j->slots) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory"));
    for (int k = 0; k < ctx->threads; k++) {
        imp__arena_init(&j->workers[k].arena, ctx);
        IMP_TRY(imp__tally_create(ctx, j->want_gradient ? j->tracer.active : &j->nothing,
                                  j->channels, &j->workers[k].tally));
    }
    const double walks = (double)j->width * j->height * j->plan.n * j->plan.R;
    j->run = run;
    j->walks = walks;
    const struct imp_loop loop = {.n_items =
                                      imp__tile_count(j->width, j->height, j->margin) *
                                      (size_t)j->plan.chunks,
                                  .work = tile_work,
                                  .commit = tile_commit,
                                  .payload = j,
                                  .progress = run->progress,
                                  .progress_payload = run->progress_payload,
                                  .stage = stage,
                                  .rate_unit = "walks",
                                  .units = walks,
                                  .fraction_lo = lo,
                                  .fraction_hi = hi,
                                  .start_s = start_s};
    IMP_TRY(imp__parallel(ctx, &loop, NULL));
out:
    job_destroy(j);
    return st;
}

/* ---- Public -------------------------------------------------------------------- */

/* Pass 1 of a wide filter: the replicates' pictures, and the adjoints of their pixels. */
static enum imp_status splat_prepare(struct job *j, const struct imp_run *run,
                                     struct imp__splat *splat)
{
    const enum imp_status st = imp__splat_create(j->problem, &j->tracer, j->target,
                                                 j->seed, j->plan, run, splat);
    if (st == IMP_OK) {
        j->splat = splat;
        j->objective += splat->objective;
        j->variance += splat->objective_variance;
    }
    return st;
}

static enum imp_status target_estimate(struct imp_problem *p,
                                       const struct imp__target *target,
                                       const struct imp_run *run, double lo, double hi,
                                       double start_s, struct job *total)
{
    struct imp_run own = *run;
    struct imp__splat splat = {0};
    struct job j = *total;
    own.sensor = target->desc.sensor;
    j.target = target;
    enum imp_status st = imp__problem_tracer(p, &own, &j.tracer);
    if (st != IMP_OK) return st;
    const int spp = own.spp > 0 ? own.spp : j.tracer.sensor->spp;
    /* A loss that is not quadratic has its bias cut by longer batches. */
    const int batch =
        imp__loss_quadratic(target->desc.loss) ? IMP_BATCH_MAX : IMP_REPLICATE_MAX;
    if (!j.want_gradient) j.tracer.active = NULL;
    j.plan = imp__replicates_plan(spp, batch);
    if (imp__film_border(&j.tracer.sensor->film) > 0) {
        j.plan = imp__splat_plan(spp);
        st = splat_prepare(&j, &own, &splat);
    }
    if (st == IMP_OK && (!j.splat || j.want_gradient))
        st = job_run(&j, &own, "gradient", lo, hi, start_s);
    imp__splat_destroy(p->ctx, &splat);
    total->objective = j.objective;
    total->variance = j.variance;
    return st;
}

enum imp_status imp_problem_objective(imp_problem *p, const double *x,
                                      const struct imp_run *run,
                                      struct imp_estimate *objective, double *gradient,
                                      double *gradient_se)
{
    enum imp_status st = IMP_OK;
    struct imp_run own;
    IMP_REQUIRE(NULL, p, "problem");
    imp_context *ctx = p->ctx;
    IMP_RUN(ctx, own, run);
    if (p->n_targets == 0) return imp__error(ctx, IMP_E_ARG, "the problem has no target");
    IMP_FLOAT_MODE;
    const struct imp__access_held access
        __attribute__((cleanup(imp__access_leave), unused)) =
            x ? imp__access_set(p->scene, &st) : imp__access_read(p->scene);
    if (st != IMP_OK) return st;
    double *buffer = imp__alloc(ctx, 3 * p->n, sizeof *buffer);
    struct imp_estimate estimate = {0};
    if (!buffer) return imp__error(ctx, IMP_E_NOMEM, "no memory for gradients");
    double *g = buffer, *v = buffer + p->n, *at = v + p->n;
    if (x) IMP_TRY(imp_problem_set_x(p, x));
    imp_problem_get_x(p, at);

    struct job total = {.problem = p,
                        .want_gradient = gradient || gradient_se,
                        .gradient = g,
                        .gradient_variance = v};
    const double start = p->progress_start_s > 0 ? p->progress_start_s : imp__now();
    const double lo = p->progress_lo, hi = p->progress_hi > 0 ? p->progress_hi : 1;
    for (size_t t = 0; t < p->n_targets; t++) {
        const double a = lo + (hi - lo) * (double)t / (double)p->n_targets;
        const double b = lo + (hi - lo) * (double)(t + 1) / (double)p->n_targets;
        IMP_TRY(target_estimate(p, &p->targets[t], &own, a, b, start, &total));
        const int bias = imp__loss_bias_order(p->targets[t].desc.loss);
        const struct imp_film_desc *film =
            &p->scene->sensors[p->targets[t].desc.sensor]->film;
        const int here = imp__film_border(film) > 0 ? 1 : bias; /* ratio of sums */
        if (here && (!estimate.bias_order || here < estimate.bias_order))
            estimate.bias_order = here;
    }
    estimate.value = total.objective + imp__regularise(p, at, gradient ? g : NULL);
    estimate.se = sqrt(fmax(total.variance, 0));
    if (objective) *objective = estimate;
    if (gradient) memcpy(gradient, g, p->n * sizeof *g);
    for (size_t k = 0; gradient_se && k < p->n; k++) gradient_se[k] = sqrt(fmax(v[k], 0));
out:
    imp__release(ctx, buffer);
    return st;
}

enum imp_status imp__adjoint_check(const struct imp_problem *p,
                                   const struct imp_film_desc *film, const float *adjoint,
                                   const char *name)
{
    const size_t channels = (size_t)p->scene->channels, width = (size_t)film->crop_w;
    for (size_t i = 0; i < width * (size_t)film->crop_h * channels; i++)
        if (!isfinite(adjoint[i]))
            return imp__error(p->ctx, IMP_E_ARG,
                              "%s: channel %zu of pixel (%zu, %zu) is %g", name,
                              i % channels, i / channels % width, i / channels / width,
                              (double)adjoint[i]);
    return IMP_OK;
}

enum imp_status imp_problem_reverse(imp_problem *p, const float *seed_image,
                                    const struct imp_run *run, double *gradient,
                                    double *gradient_se)
{
    enum imp_status st = IMP_OK;
    struct imp_run own;
    IMP_REQUIRE(NULL, p, "problem");
    imp_context *ctx = p->ctx;
    IMP_REQUIRE(ctx, seed_image, "seed_image");
    IMP_REQUIRE(ctx, gradient, "gradient");
    IMP_RUN(ctx, own, run);
    IMP_FLOAT_MODE;
    IMP_READS(p->scene);
    struct imp__splat splat = {0};
    double *g = imp__alloc(ctx, 2 * p->n, sizeof *g);
    struct job j = {.problem = p,
                    .seed = seed_image,
                    .want_gradient = true,
                    .gradient = g,
                    .gradient_variance = g ? g + p->n : NULL};
    if (!g) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for gradients"));
    IMP_TRY(imp__problem_tracer(p, &own, &j.tracer));
    IMP_TRY(imp__adjoint_check(p, &j.tracer.sensor->film, seed_image, "seed_image"));
    const int spp = own.spp > 0 ? own.spp : j.tracer.sensor->spp;
    j.plan = imp__replicates_plan(spp, IMP_BATCH_MAX);
    if (imp__film_border(&j.tracer.sensor->film) > 0) {
        j.plan = imp__splat_plan(spp);
        IMP_TRY(splat_prepare(&j, &own, &splat));
    }
    IMP_TRY(job_run(&j, &own, "gradient", 0, 1, imp__now()));
    memcpy(gradient, g, p->n * sizeof *g);
    for (size_t k = 0; gradient_se && k < p->n; k++)
        gradient_se[k] = sqrt(fmax(g[p->n + k], 0));
out:
    imp__splat_destroy(ctx, &splat);
    imp__release(ctx, g);
    return st;
}

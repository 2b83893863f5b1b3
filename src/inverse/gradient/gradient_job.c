/* SPDX-License-Identifier: Apache-2.0
 *
 * Work of one tile and sums over tiles, for the loss and the gradient of a target
 * (gradient_job.h). */
#include "gradient_job.h"
#include "base/arguments.h"
#include "base/team.h"
#include "film/film_filter.h"
#include "inverse/estimate/moved_gradient.h"
#include <string.h>

/* An item's result, and the sum of several. */
struct part {
    double objective, variance;
    double dense[]; /* [2 or 3][n] of few values, as of imp__tally_dense; then moments of
                       the variate, if there is one; or contrasts of `moved` */
};

static size_t dense_numbers(const struct imp__gradient_job *j)
{
    const size_t rows = j->shared ? 3 : 2;
    return j->want_gradient && !j->totals->many ? rows * j->problem->n : 0;
}

static size_t moment_numbers(const struct imp__gradient_job *j)
{
    return j->variate ? IMP_VARIATE_MOMENTS : 0;
}

static size_t result_numbers(const struct imp__gradient_job *j)
{
    return dense_numbers(j) + moment_numbers(j) + imp__moved_contrasts(j->moved);
}

/* ---- Pixels of a tile ------------------------------------------------------------ */

/* An item at work: replicates b0 to b1 of all R of the tile's pixels. */
struct item {
    struct imp__gradient_job *job;
    struct imp_tally *tally;
    struct part *out;
    double R, all;
    /* A pixel of one replicate shows no spread: its difference to the one before does, as an
     * upper bound. */
    bool paired, second;
    double first; /* loss of the first of a pair */
    /* Variance of the mean over all, of a spread over R replicates. */
    double by_variance;
};

/* Between pixels: what a tally is full of goes to the sums. */
static void tally_empty(const struct item *i)
{
    const struct imp__gradient_job *j = i->job;
    if (imp_likely(!imp__tally_full(i->tally))) return;
    imp__tally_measure(i->tally);
    imp__tally_flush(i->tally, i->by_variance, j->overlap.gradient, j->mean, j->spread);
    imp__tally_clear(i->tally);
}

static void pixel_add(const struct item *i, double sum, double square)
{
    /* mean over all replicates; variance R/(R-1) spread / all^2 */
    imp__tally_pixel(i->tally, i->R, 1 / i->all, i->by_variance);
    tally_empty(i);
    i->out->objective += sum / i->all;
    i->out->variance +=
        (square - sum * sum / i->R) * i->R / ((i->R - 1) * i->all * i->all);
}

static void pair_end(struct item *i, double difference)
{
    imp__tally_pixel(i->tally, 2, 1, 2);
    i->out->variance += imp__sqr(difference);
    i->second = false;
}

static void pair_add(struct item *i, double value)
{
    i->out->objective += value;
    if (i->second) {
        pair_end(i, i->first - value);
        tally_empty(i);
        return;
    }
    i->first = value;
    i->second = true;
}

static void lone_add(const struct item *i, double value, double variance)
{
    imp__tally_pixel(i->tally, 1, 1, 0);
    tally_empty(i);
    i->out->objective += value;
    i->out->variance += variance;
}

static bool counts(const void *job, int x, int y)
{
    return imp__gradient_counts(job, x, y);
}

static enum imp_status pixels_work(const struct imp_tile *t, struct imp_tile_worker *w,
                                   struct imp__replicates plan, struct item *i,
                                   double *moments)
{
    const int b0 = imp__replicates_begin(plan, (int)t->part);
    const int b1 = imp__replicates_begin(plan, (int)t->part + 1);
    struct imp__tile_walks walks = {.bundled = false};
    if (!i->job->light && i->job->of != IMP_JOB_OF_DRAWS)
        imp__tile_walks_begin(&i->job->tracer, t, w, plan, b0, b1, plan.n, counts, i->job,
                              &walks);
    for (int y = t->y0; y < t->y1; y++)
        for (int x = t->x0; x < t->x1; x++) {
            double sum = 0, square = 0, variance = 0;
            if (!imp__gradient_counts(i->job, x, y)) continue;
            for (int b = b0; b < b1; b++) {
                const double v = imp__gradient_replicate(
                    i->job, plan, w, &walks, x, y, b, (int)t->part, moments, &variance);
                sum += v;
                square += v * v;
            }
            w->no_memory |= i->tally->failed;
            const enum imp_status st = imp__tile_check(w);
            if (st != IMP_OK) return st;
            if (plan.lone) lone_add(i, sum, variance);
            else if (i->paired) pair_add(i, sum);
            else pixel_add(i, sum, square);
        }
    if (i->second) pair_end(i, i->first);
    return IMP_OK;
}

/* ---- Tiles --------------------------------------------------------------------- */

/* The bars of a worker; NULL: there are none. */
static double *item_bar(const struct imp__gradient_job *j, int worker)
{
    const size_t n = j->item_bars ? IMP_MOVED_BARS * j->moved->moves.n : 0;
    return j->item_bars ? j->item_bars + (size_t)worker * n : NULL;
}

/* What all replicates of the item gave to velocities goes to its tally at once. */
static void item_bar_end(const struct item *i, double *bar)
{
    if (!bar || i->job->bars_of_replicates) return;
    imp__moved_numbers(i->job->moved, bar, (imp_spec){1, 0, 0, 0}, &i->tally->sink);
    imp__tally_batch(i->tally, 0);
    imp__tally_pixel(i->tally, 1, 1 / i->all, 0);
}

static enum imp_status tile_work(const struct imp_tile *t, struct imp_tile_worker *w,
                                 void *result, void *payload)
{
    struct imp__gradient_job *j = payload;
    struct imp_tally *tally = &j->tallies[w->index];
    struct part *out = result;
    double *moments = out->dense + dense_numbers(j);
    const struct imp__replicates plan = imp__gradient_plan(j, t->index);
    struct item item = {.job = j, .tally = tally, .out = out};

    out->objective = out->variance = 0;
    memset(moments, 0, moment_numbers(j) * sizeof *moments);
    const size_t contrasts = imp__moved_contrasts(j->moved);
    double *own = contrasts ? j->item_contrasts + (size_t)w->index * contrasts : NULL;
    double *bar = item_bar(j, w->index);
    if (own) memset(own, 0, contrasts * sizeof *own);
    if (bar) memset(bar, 0, IMP_MOVED_BARS * j->moved->moves.n * sizeof *bar);
    imp__tally_clear(tally);
    tally->measured = tally->rays = 0;
    if (t->part < (size_t)plan.chunks) { /* other tiles may have more parts */
        item.R = imp__replicates_begin(plan, (int)t->part + 1) -
                 imp__replicates_begin(plan, (int)t->part);
        item.all = plan.R;
        item.paired = plan.R == 1;
        if (plan.R > 1) item.by_variance = item.R / ((item.R - 1) * item.all * item.all);
        const enum imp_status st = pixels_work(t, w, plan, &item, moments);
        if (st != IMP_OK) return st;
        item_bar_end(&item, bar);
        w->no_memory |= tally->failed;
        IMP_CHECKED(imp__tile_check(w));
    }
    if (own) memcpy(moments + moment_numbers(j), own, contrasts * sizeof *own);
    imp__tally_measure(tally);
    imp__gradient_see(j, t, tally, out->variance);
    if (tally->dense) {
        if (j->shared) imp__tally_tile(tally, item.by_variance);
        memcpy(out->dense, imp__tally_dense(tally),
               dense_numbers(j) * sizeof *out->dense);
    } else
        imp__tally_flush(tally, item.by_variance, j->overlap.gradient, j->mean,
                         j->spread);
    return IMP_OK;
}

static void tile_add(void *into, const void *from, void *payload)
{
    const size_t n = result_numbers(payload);
    struct part *a = into;
    const struct part *b = from;
    a->objective += b->objective;
    a->variance += b->variance;
    for (size_t k = 0; k < n; k++) a->dense[k] += b->dense[k];
}

static enum imp_status tile_take(size_t group, const void *sum, void *payload)
{
    const struct imp__gradient_job *j = payload;
    const size_t n = dense_numbers(j) ? j->problem->n : 0;
    const struct part *in = sum;
    struct imp__totals *to = j->totals;
    (void)group;
    if (j->look) return IMP_OK;
    to->objective += in->objective;
    to->variance += in->variance;
    for (size_t k = 0; k < moment_numbers(j); k++)
        j->variate->moments[k] += in->dense[dense_numbers(j) + k];
    for (size_t k = 0; k < imp__moved_contrasts(j->moved); k++)
        j->contrasts[k] += in->dense[dense_numbers(j) + moment_numbers(j) + k];
    for (size_t k = 0; k < n; k++) {
        double variance = in->dense[n + k];
        if (j->shared)
            variance = imp__overlap_variance(j->overlap.gradient, j->overlap.few,
                                             variance, in->dense[2 * n + k]);
        to->gradient[k] += in->dense[k];
        to->gradient_variance[k] += variance;
    }
    return IMP_OK;
}

/* ---- A whole estimate ------------------------------------------------------------ */

static enum imp_status tallies_create(struct imp__gradient_job *j)
{
    imp_context *ctx = j->problem->ctx;
    j->tallies = imp__alloc(ctx, (size_t)ctx->threads, sizeof *j->tallies);
    if (!j->tallies) return imp__error(ctx, IMP_E_NOMEM, "no memory");
    const size_t contrasts = imp__moved_contrasts(j->moved);
    if (contrasts) {
        j->item_contrasts =
            imp__alloc(ctx, (size_t)ctx->threads * contrasts, sizeof(double));
        if (!j->item_contrasts) return imp__error(ctx, IMP_E_NOMEM, "no memory");
    }
    j->bars_of_replicates = !j->totals->many || j->want_errors;
    if (j->moved && j->totals->many) {
        j->item_bars =
            imp__alloc_raw(ctx, (size_t)ctx->threads * IMP_MOVED_BARS * j->moved->moves.n,
                           sizeof *j->item_bars);
        if (!j->item_bars) return imp__error(ctx, IMP_E_NOMEM, "no memory");
    }
    for (int k = 0; k < ctx->threads; k++) {
        IMP_CHECKED(imp__tally_create(
            ctx, j->want_gradient ? j->tracer.active : &j->nothing,
            j->problem->scene->lanes, j->shared ? j->plan.R : 0, &j->tallies[k]));
        j->tallies[k].metric = imp__gradient_metric(j);
    }
    return IMP_OK;
}

static void job_destroy(struct imp__gradient_job *j)
{
    imp_context *ctx = j->problem->ctx;
    for (int k = 0; j->tallies && k < ctx->threads; k++)
        imp__tally_destroy(&j->tallies[k]);
    imp__release(ctx, j->tallies);
    imp__release(ctx, j->item_contrasts);
    imp__release(ctx, j->item_bars);
    j->tallies = NULL;
    j->item_contrasts = NULL;
    j->item_bars = NULL;
    if (j->tiles.ctx) imp__tiles_destroy(&j->tiles);
}

enum imp_status imp__gradient_job_run(struct imp__gradient_job *j,
                                      const struct imp_run *run, const char *stage,
                                      double lo, double hi, double start_s)
{
    imp_context *ctx = j->problem->ctx;
    enum imp_status st = IMP_OK;
    const struct imp_film_desc *film = &j->tracer.sensor->film;
    const int margin = j->splat && film->sample_border ? imp__film_border(film) : 0;
    j->run = run;
    j->width = film->crop_w;
    j->channels = j->problem->scene->channels;
    j->shared = j->splat && imp__film_border(film) > 0;
    if (j->shared) j->overlap = imp__overlap_of(film, margin, j->plan.R);
    j->tiles = (struct imp_tiles){.ctx = ctx,
                                  .run = run,
                                  .width = film->crop_w,
                                  .height = film->crop_h,
                                  .margin = margin,
                                  .work = tile_work,
                                  .size = sizeof(struct part) +
                                          result_numbers(j) * sizeof(double),
                                  .add = tile_add,
                                  .take = tile_take,
                                  .payload = j};
    IMP_TRY(imp__tiles_create(&j->tiles));
    j->tracer.swept_only = !j->variate && !j->moved;
    imp__gradient_samples(j);
    j->want_errors = j->totals->wants_errors || imp__gradient_metric(j);
    if (j->variate) IMP_TRY(imp__variate_room(ctx, j->variate, j->parts));
    IMP_TRY(tallies_create(j));
    const struct imp_tiles_pass pass = {.stage = stage,
                                        .rate_unit = "walks",
                                        .units = j->tiles.walks,
                                        .fraction_lo = lo,
                                        .fraction_hi = hi,
                                        .start_s = start_s,
                                        .parts = j->parts};
    if (j->want_gradient && j->totals->many && !j->totals->unit_known)
        IMP_TRY(imp__gradient_unit(j, &pass));
    j->mean = &j->totals->mean;
    j->spread = j->totals->spread.sum ? &j->totals->spread : NULL;
    IMP_TRY(imp__tiles_run(&j->tiles, &pass));
    IMP_TRY(imp__gradient_seen(j));
out:
    job_destroy(j);
    return st;
}

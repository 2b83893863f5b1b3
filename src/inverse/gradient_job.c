/* SPDX-License-Identifier: Apache-2.0 */
#include "gradient_job.h"
#include "adjoint.h"
#include "base/team.h"
#include "film/film_filter.h"
#include "light_gradient.h"
#include <string.h>

/* ---- One pixel's replicate ----------------------------------------------------- */

/* An item's result, and the sum of several. */
struct part {
    double objective, variance;
    double dense[]; /* [2 or 3][n] of few numbers, as of imp__tally_dense; then moments of
                       the variate, if there is one */
};

/* What the walk brings at the parameters of the last evaluation, if there was one and
 * the loss sees this pixel. */
static imp_spec walk_there(const struct imp__gradient_job *j, size_t pixel,
                           const struct imp_walk *walk)
{
    if (!j->there.scene || (j->target->weights && j->target->weights[pixel] == 0))
        return (imp_spec){0};
    return imp__walk_elsewhere(&j->there, walk);
}

/* Replicate b of a pixel, in work item `part`: trace, fold, adjoints, sweep. Returns its
 * loss estimate. */
static double replicate(struct imp__gradient_job *j, struct imp__replicates plan,
                        struct imp_tile_worker *w, int x, int y, int b, int part,
                        double *moments)
{
    if (imp_unlikely(j->light != NULL)) {
        imp__light_replicate(j, w, x, y, b);
        return 0;
    }
    const int n = plan.n, m = plan.m;
    struct imp_tally *tally = &j->tallies[w->index];
    const struct imp_arena_mark mark = imp__arena_mark(&w->arena);
    struct imp_walk *walks = imp__arena_take(&w->arena, (size_t)n, sizeof *walks);
    /* Of sets: means of L, and their adjoints. */
    imp_spec *L = imp__arena_take(&w->arena, (size_t)m, sizeof *L);
    imp_spec *P = imp__arena_take(&w->arena, (size_t)m, sizeof *P);
    imp_spec *H = L;
    double value = 0;
    if (j->variate) H = imp__arena_take(&w->arena, (size_t)m, sizeof *H);
    if (!walks || !L || !P || !H) {
        w->no_memory = true;
        goto out;
    }
    const bool keep = j->target && !j->splat; /* the others' mean is needed first */
    const size_t pixel = (size_t)y * (size_t)j->width + (size_t)x;
    for (int s = 0; s < m; s++) {
        const int first = imp__replicates_set(plan, s);
        const int end = imp__replicates_set(plan, s + 1);
        L[s] = H[s] = (imp_spec){0};
        for (int i = first; i < end; i++) {
            const struct imp_arena_mark one = imp__arena_mark(&w->arena);
            const int64_t sample = imp__replicates_first(plan, b, s) + i - first;
            imp__walk_trace(&j->tracer, &w->arena, x, y, sample, &walks[i]);
            imp__tile_drop(w, walks[i].dropped, x, y, sample);
            L[s] += walks[i].L;
            if (imp_unlikely(j->variate != NULL)) H[s] += walk_there(j, pixel, &walks[i]);
            tally->rays += imp_max(2 * walks[i].n - 1, 1);
            if (keep) continue;
            if (j->splat)
                P[0] = imp__splat_adjoint(j->splat, b, s, walks[i].px, walks[i].py,
                                          walks[i].L);
            else
                for (int c = 0; c < 4; c++)
                    P[0][c] =
                        c < j->channels
                            ? j->seed[pixel * (size_t)j->channels + (size_t)c] / (double)n
                            : 0;
            imp__walk_sweep(&j->tracer, &walks[i], P[0], &tally->sink);
            imp__arena_rewind(&w->arena, one);
        }
        if (end - first > 1) L[s] /= imp__spec(end - first);
        if (end - first > 1 && j->variate) H[s] /= imp__spec(end - first);
    }
    if (keep) {
        value = imp__replicate_adjoints(j->target, j->channels, pixel, m, L, P);
        if (j->variate) {
            imp__variate_replicate(j->variate, j->target, plan, part, pixel, L, H,
                                   j->look ? NULL : moments);
            (void)imp__replicate_adjoints(j->target, j->channels, pixel, m, L, P);
        }
        for (int s = 0; j->want_gradient && s < m; s++) {
            const int first = imp__replicates_set(plan, s);
            const int end = imp__replicates_set(plan, s + 1);
            if (end - first > 1) P[s] /= imp__spec(end - first);
            for (int i = first; i < end; i++)
                imp__walk_sweep(&j->tracer, &walks[i], P[s], &tally->sink);
        }
    }
    imp__tally_batch(tally, b);
out:
    imp__arena_rewind(&w->arena, mark);
    return value;
}

/* ---- Tiles --------------------------------------------------------------------- */

static size_t dense_numbers(const struct imp__gradient_job *j)
{
    const size_t rows = j->shared ? 3 : 2;
    return j->want_gradient && !j->totals->many ? rows * j->problem->n : 0;
}

static size_t moment_numbers(const struct imp__gradient_job *j)
{
    return j->variate ? IMP_VARIATE_MOMENTS : 0;
}

/* The samples of a tile: those of all, or its own. */
static struct imp__replicates plan_of(const struct imp__gradient_job *j, size_t tile)
{
    if (!j->allocation) return j->plan;
    const size_t k = j->first_tile + tile;
    struct imp_run own = *j->run;
    own.spp = j->allocation->spp[k];
    if (own.spp == j->allocation->even[k]) return j->plan;
    return imp__replicates_of(j->problem->scene, j->target, &own);
}

/* Does a pixel have a part in the loss? One of weight 0 has no walks. */
static bool counts(const struct imp__gradient_job *j, int x, int y)
{
    if (!j->target || !j->target->weights || j->splat || j->light) return true;
    return j->target->weights[(size_t)y * (size_t)j->width + (size_t)x] != 0;
}

/* Between pixels: what a tally is full of goes to the sums. */
static void tally_empty(const struct imp__gradient_job *j, struct imp_tally *t,
                        double by_variance)
{
    if (imp_likely(!imp__tally_full(t))) return;
    imp__tally_measure(t);
    imp__tally_flush(t, by_variance, j->overlap.gradient, j->mean, j->spread);
    imp__tally_clear(t);
}

static enum imp_status tile_work(const struct imp_tile *t, struct imp_tile_worker *w,
                                 void *result, void *payload)
{
    struct imp__gradient_job *j = payload;
    struct part *out = result;
    struct imp_tally *tally = &j->tallies[w->index];
    const struct imp__replicates plan = plan_of(j, t->index);
    const bool none = t->part >= (size_t)plan.chunks; /* other tiles have more parts */
    const int b0 = none ? plan.R : imp__replicates_begin(plan, (int)t->part);
    const int b1 = none ? plan.R : imp__replicates_begin(plan, (int)t->part + 1);
    const double R = b1 - b0, all = plan.R;
    const bool paired = plan.R == 1; /* spread from pairs of pixels instead */
    const double by_variance = paired || none ? 0 : R / ((R - 1) * all * all);
    double first = 0;
    int in_pair = 0;

    out->objective = out->variance = 0;
    double *moments = out->dense + dense_numbers(j);
    memset(moments, 0, moment_numbers(j) * sizeof *moments);
    imp__tally_clear(tally);
    tally->measured = tally->rays = 0;
    for (int y = t->y0; y < t->y1 && !none; y++)
        for (int x = t->x0; x < t->x1; x++) {
            double sum = 0, square = 0;
            if (!counts(j, x, y)) continue;
            for (int b = b0; b < b1; b++) {
                const double v = replicate(j, plan, w, x, y, b, (int)t->part, moments);
                sum += v;
                square += v * v;
            }
            w->no_memory |= tally->failed;
            const enum imp_status st = imp__tile_check(w);
            if (st != IMP_OK) return st;
            if (!paired) {
                /* mean over all R replicates; variance R/(R-1) spread / all^2 */
                imp__tally_pixel(tally, R, 1 / all, by_variance);
                tally_empty(j, tally, by_variance);
                out->objective += sum / all;
                out->variance += (square - sum * sum / R) * R / ((R - 1) * all * all);
                continue;
            }
            out->objective += sum;
            if (in_pair++ == 0) {
                first = sum;
                continue;
            }
            imp__tally_pixel(tally, 2, 1, 2);
            tally_empty(j, tally, by_variance);
            out->variance += imp__sqr(first - sum);
            in_pair = 0;
        }
    if (in_pair) {
        imp__tally_pixel(tally, 2, 1, 2);
        out->variance += imp__sqr(first);
    }
    imp__tally_measure(tally);
    if (tally->metric && !j->look)
        imp__allocation_see(j->allocation, j->first_tile + t->index, t->part,
                            (double[]){tally->measured, out->variance, tally->rays});
    if (tally->dense) {
        if (j->shared) imp__tally_tile(tally, by_variance);
        memcpy(out->dense, imp__tally_dense(tally),
               dense_numbers(j) * sizeof *out->dense);
    } else imp__tally_flush(tally, by_variance, j->overlap.gradient, j->mean, j->spread);
    return IMP_OK;
}

static void tile_add(void *into, const void *from, void *payload)
{
    const size_t n = dense_numbers(payload) + moment_numbers(payload);
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

/* ---- Sums of many numbers ------------------------------------------------------- */

#define LOOKS      64 /* one item in so many is run to find the size of terms, */
#define LOOKS_MOST 16 /* at first at most so many items */
#define SPARE_BITS 12 /* terms up to 2^12 times as large fit; else all is redone */

static double terms_most(const struct imp__gradient_job *j)
{
    return (double)imp__tiles_count(&j->tiles) * (double)j->parts *
           (double)j->problem->n_targets;
}

/* Largest terms of mean and spread over some tiles; over more tiles where these have
 * none. Every rank of a team computes this by itself. */
static enum imp_status terms_look(struct imp__gradient_job *j,
                                  const struct imp_tiles_pass *run, double largest[2])
{
    const size_t all = imp__tiles_count(&j->tiles) * run->parts;
    struct imp__team *team = j->problem->ctx->team;
    struct imp_fixed_sum mean = {0}, spread = {0};
    struct imp_tiles_pass pass = *run;
    enum imp_status st = IMP_OK;
    pass.fraction_hi = run->fraction_lo + 0.01 * (run->fraction_hi - run->fraction_lo);
    j->look = true;
    if (team) team->alone++;
    j->mean = &mean;
    j->spread = &spread;
    for (size_t n = imp_clamp(all / LOOKS, (size_t)1, (size_t)LOOKS_MOST);
         mean.bits == 0 && st == IMP_OK; n *= 4) {
        pass.every = imp_max(all / n, (size_t)1);
        st = imp__tiles_run(&j->tiles, &pass);
        if (pass.every == 1) break;
    }
    j->look = false;
    if (team) team->alone--;
    j->tiles.drops = (struct imp_drops){0};
    largest[0] = imp__fixed_largest(&mean);
    largest[1] = imp__fixed_largest(&spread);
    return st;
}

/* The unit of sums in fixed point. A merge of parts takes theirs. */
static enum imp_status unit_find(struct imp__gradient_job *j,
                                 const struct imp_tiles_pass *run)
{
    struct imp__totals *to = j->totals;
    imp_context *ctx = j->problem->ctx;
    const double all = (double)imp__tiles_count(&j->tiles) * (double)run->parts;
    const double terms = fmax(terms_most(j), all);
    double largest[2] = {0, 0};
    bool known = false;
    enum imp_status st = IMP_OK;
    if (imp__team_merges(ctx))
        IMP_TRY(imp__team_keep(ctx, largest, sizeof largest, &known));
    if (!known) IMP_TRY(terms_look(j, run, largest));
    if (imp__team_part(ctx))
        IMP_TRY(imp__team_keep(ctx, largest, sizeof largest, &known));
    if (largest[0] == 0) return IMP_OK;
    imp__fixed_begin(&to->mean, largest[0], SPARE_BITS, terms);
    imp__fixed_begin(&to->spread, largest[1], 2 * SPARE_BITS, terms);
    to->unit_known = true;
out:
    return st;
}

/* ---- A whole estimate ------------------------------------------------------------ */

static void job_destroy(struct imp__gradient_job *j)
{
    imp_context *ctx = j->problem->ctx;
    for (int k = 0; j->tallies && k < ctx->threads; k++)
        imp__tally_destroy(&j->tallies[k]);
    imp__release(ctx, j->tallies);
    j->tallies = NULL;
    if (j->tiles.ctx) imp__tiles_destroy(&j->tiles);
}

/* The tiles of this job in the allocation: sets parts, returns the walks of all. */
static double allocation_take(struct imp__gradient_job *j)
{
    const struct imp_tiles *t = &j->tiles;
    double walks = 0;
    j->first_tile = imp__allocation_take(j->allocation, imp__tiles_count(t));
    for (size_t k = 0; k < imp__tiles_count(t); k++) {
        const struct imp__replicates r = plan_of(j, k);
        const int x0 = (int)(k % (size_t)t->across) * t->side,
                  y0 = (int)(k / (size_t)t->across) * t->side;
        walks += (double)imp_min(t->side, t->width - x0) *
                 imp_min(t->side, t->height - y0) * r.n * r.R;
        j->parts = imp_max(j->parts, (size_t)r.chunks);
    }
    return walks;
}

enum imp_status imp__gradient_job_run(struct imp__gradient_job *j,
                                      const struct imp_run *run, const char *stage,
                                      double lo, double hi, double start_s)
{
    imp_context *ctx = j->problem->ctx;
    enum imp_status st = IMP_OK;
    const struct imp_film_desc *film = &j->tracer.sensor->film;
    j->width = film->crop_w;
    j->channels = j->problem->scene->channels;
    const int margin = j->splat && film->sample_border ? imp__film_border(film) : 0;
    j->shared = j->splat != NULL;
    j->allocation =
        j->target && !j->splat && imp__allocation_allowed(j->target, &j->tracer)
            ? j->problem->allocation
            : NULL;
    const bool measures = j->want_gradient && j->allocation && j->allocation->metric;
    if (j->shared) j->overlap = imp__overlap_of(film, margin, j->plan.R);
    j->run = run;
    j->parts = (size_t)j->plan.chunks;
    double walks = (double)film->crop_w * film->crop_h * j->plan.n * j->plan.R;
    j->tiles = (struct imp_tiles){
        .ctx = ctx,
        .run = run,
        .width = film->crop_w,
        .height = film->crop_h,
        .margin = margin,
        .work = tile_work,
        .size =
            sizeof(struct part) + (dense_numbers(j) + moment_numbers(j)) * sizeof(double),
        .add = tile_add,
        .take = tile_take,
        .payload = j};
    IMP_TRY(imp__tiles_create(&j->tiles));
    if (j->allocation) walks = allocation_take(j);
    size_t in = 0;
    for (int y = 0; y < film->crop_h; y++)
        for (int x = 0; x < film->crop_w; x++) in += counts(j, x, y);
    walks *= (double)imp_max(in, (size_t)1) / ((double)film->crop_w * film->crop_h);
    j->tiles.walks = walks;
    j->tallies = imp__alloc(ctx, (size_t)ctx->threads, sizeof *j->tallies);
    if (!j->tallies) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory"));
    for (int k = 0; k < ctx->threads; k++)
        IMP_TRY(imp__tally_create(ctx, j->want_gradient ? j->tracer.active : &j->nothing,
                                  j->problem->scene->lanes, j->shared ? j->plan.R : 0,
                                  &j->tallies[k]));
    for (int k = 0; measures && k < ctx->threads; k++)
        j->tallies[k].metric = j->allocation->metric;
    const struct imp_tiles_pass pass = {.stage = stage,
                                        .rate_unit = "walks",
                                        .units = walks,
                                        .fraction_lo = lo,
                                        .fraction_hi = hi,
                                        .start_s = start_s,
                                        .parts = j->parts};
    if (j->want_gradient && j->totals->many && !j->totals->unit_known)
        IMP_TRY(unit_find(j, &pass));
    j->mean = &j->totals->mean;
    j->spread = j->totals->spread.sum ? &j->totals->spread : NULL;
    IMP_TRY(imp__tiles_run(&j->tiles, &pass));
    if (measures)
        IMP_TRY(imp__allocation_share(j->allocation, j->first_tile,
                                      imp__tiles_count(&j->tiles)));
out:
    job_destroy(j);
    return st;
}

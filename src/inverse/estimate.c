/* SPDX-License-Identifier: Apache-2.0
 *
 * Loss and gradient from the same walks. The n walks of a replicate are kept in the arena
 * until their adjoints are known (adjoint.c), then swept: the price of one render and a
 * sweep. A fixed adjoint image needs no mean, and no walk is kept. Filters wider than a
 * pixel take two passes with the same random numbers (splat.c). */
#include "estimate.h"
#include "adjoint.h"
#include "film/film_filter.h"
#include "film/film_tiles.h"
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

/* What all targets add to. */
struct totals {
    double objective, variance;
    double *gradient, *gradient_variance; /* [n] of few numbers */
    /* Of many: fixed point, in the place of the caller's arrays. */
    bool many, unit_known;
    struct imp_fixed_sum mean, spread;
    double *own; /* [2 n] of few numbers */
};

struct job {
    const struct imp_problem *problem;
    struct totals *totals;
    struct imp_tracer tracer;
    struct imp__replicates plan;
    const struct imp__target *target; /* NULL: fixed adjoint */
    const float *seed;                /* fixed adjoint image, [h][w][channels] */
    const struct imp__splat *splat;   /* wide filters: pass 2; NULL: box */
    int width, channels;
    bool want_gradient;
    bool look;                           /* at the size of terms alone */
    struct imp_active nothing;           /* what the tally keeps without want_gradient */
    struct imp_fixed_sum *mean, *spread; /* of many numbers; spread NULL: not wanted */
    struct imp_tiles tiles;
    struct imp_tally *tallies; /* [threads] */
};

/* An item's result, and the sum of several. */
struct part {
    double objective, variance;
    double dense[]; /* [2][n] gradient and its variance, of few numbers */
};

/* Replicate b of a pixel: trace, fold, adjoints, sweep. Returns its loss estimate. */
static double replicate(struct job *j, struct imp_tile_worker *w, int x, int y, int b)
{
    const int n = j->plan.n;
    struct imp_tally *tally = &j->tallies[w->index];
    const struct imp_arena_mark mark = imp__arena_mark(&w->arena);
    struct imp_walk *walks = imp__arena_take(&w->arena, (size_t)n, sizeof *walks);
    imp_spec *L = imp__arena_take(&w->arena, (size_t)n, sizeof *L);
    imp_spec *P = imp__arena_take(&w->arena, (size_t)n, sizeof *P);
    double value = 0;
    if (!walks || !L || !P) {
        w->no_memory = true;
        goto out;
    }
    const bool keep = j->target && !j->splat; /* the others' mean is needed first */
    const size_t pixel = (size_t)y * (size_t)j->width + (size_t)x;
    for (int i = 0; i < n; i++) {
        const struct imp_arena_mark one = imp__arena_mark(&w->arena);
        const int64_t sample = (int64_t)b * n + i;
        imp__walk_trace(&j->tracer, &w->arena, x, y, sample, &walks[i]);
        imp__tile_drop(w, walks[i].dropped, x, y, sample);
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
        imp__walk_sweep(&j->tracer, &walks[i], P[0], &tally->sink);
        imp__arena_rewind(&w->arena, one);
    }
    if (keep) {
        value = imp__replicate_adjoints(j->target, j->channels, pixel, n, L, P);
        if (j->want_gradient)
            for (int i = 0; i < n; i++)
                imp__walk_sweep(&j->tracer, &walks[i], P[i], &tally->sink);
    }
    imp__tally_batch(tally);
out:
    imp__arena_rewind(&w->arena, mark);
    return value;
}

/* ---- Tiles --------------------------------------------------------------------- */

static enum imp_status tile_work(const struct imp_tile *t, struct imp_tile_worker *w,
                                 void *result, void *payload)
{
    struct job *j = payload;
    struct part *out = result;
    struct imp_tally *tally = &j->tallies[w->index];
    const int b0 = imp__replicates_begin(j->plan, (int)t->part);
    const int b1 = imp__replicates_begin(j->plan, (int)t->part + 1);
    const double R = b1 - b0, all = j->plan.R;
    const bool paired = j->plan.R == 1; /* pixels two by two stand in for replicates */
    double first = 0;
    int in_pair = 0;

    out->objective = out->variance = 0;
    imp__tally_clear(tally);
    for (int y = t->y0; y < t->y1; y++)
        for (int x = t->x0; x < t->x1; x++) {
            double sum = 0, square = 0;
            for (int b = b0; b < b1; b++) {
                const double v = replicate(j, w, x, y, b);
                sum += v;
                square += v * v;
            }
            w->no_memory |= tally->failed;
            const enum imp_status st = imp__tile_check(w);
            if (st != IMP_OK) return st;
            if (!paired) {
                /* mean over all R replicates; variance R/(R-1) spread / all^2 */
                imp__tally_pixel(tally, R, 1 / all, R / ((R - 1) * all * all));
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
            out->variance += imp__sqr(first - sum);
            in_pair = 0;
        }
    if (in_pair) {
        imp__tally_pixel(tally, 2, 1, 2);
        out->variance += imp__sqr(first);
    }
    if (tally->dense)
        memcpy(out->dense, imp__tally_dense(tally),
               2 * tally->active->n * sizeof *out->dense);
    else imp__tally_flush(tally, j->mean, j->spread);
    return IMP_OK;
}

static size_t dense_numbers(const struct job *j)
{
    return j->want_gradient && !j->totals->many ? 2 * j->problem->n : 0;
}

static void tile_add(void *into, const void *from, void *payload)
{
    const size_t n = dense_numbers(payload);
    struct part *a = into;
    const struct part *b = from;
    a->objective += b->objective;
    a->variance += b->variance;
    for (size_t k = 0; k < n; k++) a->dense[k] += b->dense[k];
}

static enum imp_status tile_take(size_t group, const void *sum, void *payload)
{
    const struct job *j = payload;
    const size_t n = dense_numbers(j) / 2;
    const struct part *in = sum;
    struct totals *to = j->totals;
    (void)group;
    if (j->look) return IMP_OK;
    to->objective += in->objective;
    to->variance += in->variance;
    for (size_t k = 0; k < n; k++) {
        to->gradient[k] += in->dense[k];
        to->gradient_variance[k] += in->dense[n + k];
    }
    return IMP_OK;
}

/* ---- Sums of many numbers ------------------------------------------------------- */

#define LOOKS      64 /* 1 in so many items tells how large terms are, and */
#define LOOKS_MOST 16 /* no more than so many: */
#define SPARE_BITS 12 /* none found is 2^12 times larger, or all is done again */

static double terms_most(const struct job *j)
{
    return (double)imp__tiles_count(&j->tiles) * j->plan.chunks *
           (double)j->problem->n_targets;
}

/* The largest terms of some tiles, of mean and spread; of more tiles where there is none.
 * Every rank of a team looks by itself. */
static enum imp_status terms_look(struct job *j, const struct imp_tiles_pass *run,
                                  double largest[2])
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
static enum imp_status unit_find(struct job *j, const struct imp_tiles_pass *run)
{
    struct totals *to = j->totals;
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

static void job_destroy(struct job *j)
{
    imp_context *ctx = j->problem->ctx;
    for (int k = 0; j->tallies && k < ctx->threads; k++)
        imp__tally_destroy(&j->tallies[k]);
    imp__release(ctx, j->tallies);
    j->tallies = NULL;
    if (j->tiles.ctx) imp__tiles_destroy(&j->tiles);
}

/* Adds objective, variance and gradients of this job to the totals. */
static enum imp_status job_run(struct job *j, const struct imp_run *run,
                               const char *stage, double lo, double hi, double start_s)
{
    imp_context *ctx = j->problem->ctx;
    enum imp_status st = IMP_OK;
    const struct imp_film_desc *film = &j->tracer.sensor->film;
    j->width = film->crop_w;
    j->channels = j->problem->scene->channels;
    const double walks = (double)film->crop_w * film->crop_h * j->plan.n * j->plan.R;
    j->tiles = (struct imp_tiles){
        .ctx = ctx,
        .run = run,
        .walks = walks,
        .width = film->crop_w,
        .height = film->crop_h,
        .margin = j->splat && film->sample_border ? imp__film_border(film) : 0,
        .work = tile_work,
        .size = sizeof(struct part) + dense_numbers(j) * sizeof(double),
        .add = tile_add,
        .take = tile_take,
        .payload = j};
    IMP_TRY(imp__tiles_create(&j->tiles));
    j->tallies = imp__alloc(ctx, (size_t)ctx->threads, sizeof *j->tallies);
    if (!j->tallies) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory"));
    for (int k = 0; k < ctx->threads; k++)
        IMP_TRY(imp__tally_create(ctx, j->want_gradient ? j->tracer.active : &j->nothing,
                                  j->channels, &j->tallies[k]));
    const struct imp_tiles_pass pass = {.stage = stage,
                                        .rate_unit = "walks",
                                        .units = walks,
                                        .fraction_lo = lo,
                                        .fraction_hi = hi,
                                        .start_s = start_s,
                                        .parts = (size_t)j->plan.chunks};
    if (j->want_gradient && j->totals->many && !j->totals->unit_known)
        IMP_TRY(unit_find(j, &pass));
    j->mean = &j->totals->mean;
    j->spread = j->totals->spread.sum ? &j->totals->spread : NULL;
    IMP_TRY(imp__tiles_run(&j->tiles, &pass));
out:
    job_destroy(j);
    return st;
}

/* gradient, gradient_se: where the results go, either may be NULL. Of many numbers they
 * hold the sums in the meantime, unless they are to keep their contents on failure. */
static enum imp_status totals_begin(struct imp_problem *p, bool in_place,
                                    double *gradient, double *gradient_se,
                                    struct totals *t)
{
    const size_t n = p->n;
    *t = (struct totals){.many = n > IMP_TALLY_DENSE};
    if (!t->many || !in_place) {
        const size_t rows = t->many ? !!gradient + !!gradient_se : 2;
        t->own = imp__alloc(p->ctx, rows * n, sizeof *t->own);
        if (!t->own) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for gradients");
    }
    if (!t->many) {
        t->gradient = t->own;
        t->gradient_variance = t->own + n;
        return IMP_OK;
    }
    double *mean = in_place ? gradient : gradient ? t->own : NULL;
    double *spread = in_place      ? gradient_se
                     : gradient_se ? t->own + (gradient ? n : 0)
                                   : NULL;
    t->mean = (struct imp_fixed_sum){.n = n, .sum = (imp_fixed *)mean};
    t->spread = (struct imp_fixed_sum){.n = n, .sum = (imp_fixed *)spread};
    if (spread) {
        t->spread.fine = imp__alloc(p->ctx, n, sizeof *t->spread.fine);
        if (!t->spread.fine)
            return imp__error(p->ctx, IMP_E_NOMEM, "no memory for errors");
    }
    if (mean) memset(mean, 0, n * sizeof *mean);
    if (spread) memset(spread, 0, n * sizeof *spread);
    return IMP_OK;
}

static void totals_free(struct imp_problem *p, struct totals *t)
{
    imp__release(p->ctx, t->own);
    imp__release(p->ctx, t->spread.fine);
}

/* Sums in fixed point are complete when the other ranks' are added. */
static enum imp_status totals_share(struct imp_problem *p, struct totals *t)
{
    enum imp_status st = IMP_OK;
    if (t->many) {
        IMP_TRY(imp__shared_fixed(p->ctx, &t->mean));
        IMP_TRY(imp__shared_fixed(p->ctx, &t->spread));
    }
    if (imp__team_part(p->ctx)) return IMP_PART;
    if (imp__team_merges(p->ctx) && (t->mean.too_large || t->spread.too_large))
        return imp__error(p->ctx, IMP_E_NUMERIC,
                          "a term of the gradient is 4096 times larger than those that "
                          "its parts looked at first: this gradient cannot be merged");
out:
    return st;
}

/* Were terms left out? Then with the unit that the largest asks for, once again. */
static enum imp_status totals_again(struct imp_problem *p, struct totals *t, bool *again)
{
    const double mean = imp__fixed_largest(&t->mean);
    const double spread = imp__fixed_largest(&t->spread);
    *again = t->many && (t->mean.too_large || t->spread.too_large);
    if (t->many && !(isfinite(mean) && isfinite(spread)))
        return imp__error(p->ctx, IMP_E_NUMERIC, "a derivative is not finite");
    if (!*again) return IMP_OK;
    const double terms = t->mean.limit * t->mean.per_unit;
    imp__fixed_begin(&t->mean, mean, 1, ldexp(1, 62) / terms);
    imp__fixed_begin(&t->spread, spread, 1, ldexp(1, 62) / terms);
    t->objective = t->variance = 0;
    return IMP_OK;
}

static void totals_end(struct imp_problem *p, struct totals *t, double *gradient,
                       double *gradient_se)
{
    const size_t bytes = p->n * sizeof(double);
    const void *mean = t->gradient, *spread = t->gradient_variance;
    if (t->many) {
        if (t->mean.sum && t->unit_known) imp__fixed_end(&t->mean);
        if (t->spread.sum && t->unit_known) imp__fixed_end(&t->spread);
        mean = t->mean.sum, spread = t->spread.sum;
    }
    if (gradient && mean != gradient) memcpy(gradient, mean, bytes);
    if (gradient_se && spread != gradient_se) memcpy(gradient_se, spread, bytes);
    for (size_t k = 0; gradient_se && k < p->n; k++)
        gradient_se[k] = sqrt(fmax(gradient_se[k], 0));
}

/* ---- Public -------------------------------------------------------------------- */

/* Pass 1 of a wide filter: the replicates' pictures, and the adjoints of their pixels. */
static enum imp_status splat_prepare(struct job *j, const struct imp_run *run,
                                     struct imp__splat *splat)
{
    imp_context *ctx = j->problem->ctx;
    /* What comes next needs these pictures: each part makes them whole. */
    const bool apart = ctx->team && ctx->team->role != IMP_TEAM_RANK;
    double value[2] = {0, 0};
    bool known = false;
    enum imp_status st = IMP_OK;
    if (imp__team_merges(ctx)) IMP_TRY(imp__team_keep(ctx, value, sizeof value, &known));
    if (!known) {
        if (apart) ctx->team->alone++;
        st = imp__splat_create(j->problem, &j->tracer, j->target, j->seed, j->plan, run,
                               splat);
        if (apart) ctx->team->alone--;
        IMP_TRY(st);
        value[0] = splat->objective;
        value[1] = splat->objective_variance;
        if (imp__team_part(ctx))
            IMP_TRY(imp__team_keep(ctx, value, sizeof value, &known));
    }
    j->splat = splat;
    j->totals->objective += value[0];
    j->totals->variance += value[1];
out:
    return st;
}

static enum imp_status target_estimate(struct imp_problem *p,
                                       const struct imp__target *target,
                                       const struct imp_run *run, double lo, double hi,
                                       double start_s, bool want_gradient,
                                       struct totals *totals)
{
    struct imp_run own = *run;
    struct imp__splat splat = {0};
    struct job j = {
        .problem = p, .totals = totals, .target = target, .want_gradient = want_gradient};
    own.sensor = target->desc.sensor;
    enum imp_status st = imp__problem_tracer(p, &own, &j.tracer);
    if (st != IMP_OK) return st;
    const int spp = own.spp > 0 ? own.spp : j.tracer.sensor->spp;
    /* A loss that is not quadratic has its bias cut by longer batches. */
    const int batch =
        imp__loss_quadratic(target->desc.loss) ? IMP_BATCH_MAX : IMP_REPLICATE_MAX;
    if (!want_gradient) j.tracer.active = NULL;
    j.plan = imp__replicates_plan(spp, batch);
    if (imp__film_border(&j.tracer.sensor->film) > 0) {
        j.plan = imp__splat_plan(spp);
        st = splat_prepare(&j, &own, &splat);
    }
    if (st == IMP_OK && (!j.splat || want_gradient))
        st = job_run(&j, &own, "gradient", lo, hi, start_s);
    imp__splat_destroy(p->ctx, &splat);
    return st;
}

static enum imp_status targets_estimate(struct imp_problem *p, const struct imp_run *run,
                                        bool want_gradient, struct totals *totals)
{
    const double start = imp__now(), n = (double)p->n_targets;
    enum imp_status st = IMP_OK;
    for (size_t t = 0; t < p->n_targets && st == IMP_OK; t++)
        st = target_estimate(p, &p->targets[t], run, (double)t / n, (double)(t + 1) / n,
                             start, want_gradient, totals);
    return st;
}

static int bias_order(const struct imp_problem *p)
{
    int order = 0;
    for (size_t t = 0; t < p->n_targets; t++) {
        const struct imp_target *d = &p->targets[t].desc;
        const bool wide = imp__film_border(&p->scene->sensors[d->sensor]->film) > 0;
        const int here = wide ? 1 : imp__loss_bias_order(d->loss); /* ratio of sums */
        if (here && (!order || here < order)) order = here;
    }
    return order;
}

enum imp_status imp__problem_objective(struct imp_problem *p, const double *x,
                                       const struct imp_run *run, bool in_place,
                                       struct imp_estimate *objective, double *gradient,
                                       double *gradient_se)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = p->ctx;
    IMP_FLOAT_MODE;
    const struct imp__access_held access
        __attribute__((cleanup(imp__access_leave), unused)) =
            x ? imp__access_set(p->scene, &st) : imp__access_read(p->scene);
    if (st != IMP_OK) return st;
    const bool want_gradient = gradient || gradient_se;
    struct totals totals = {0};
    double *at = NULL, prior = 0;
    bool again = false;
    if (x) IMP_TRY(imp_problem_set_x(p, x));
    IMP_TRY(imp__problem_same(p, run, "loss"));
    IMP_TRY(totals_begin(p, in_place, gradient, gradient_se, &totals));
    IMP_TRY(targets_estimate(p, run, want_gradient, &totals));
    IMP_TRY(totals_share(p, &totals));
    IMP_TRY(totals_again(p, &totals, &again));
    if (again) {
        IMP_TRY(targets_estimate(p, run, want_gradient, &totals));
        IMP_TRY(totals_share(p, &totals));
    }
    if (p->n_regularisers > 0) {
        at = imp__alloc(ctx, p->n, sizeof *at);
        if (!at) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for regularisers"));
        imp_problem_get_x(p, at);
    }
    totals_end(p, &totals, gradient, gradient_se);
    if (at) prior = imp__regularise(p, at, gradient);
    if (objective)
        *objective = (struct imp_estimate){.value = totals.objective + prior,
                                           .se = sqrt(fmax(totals.variance, 0)),
                                           .bias_order = bias_order(p)};
out:
    totals_free(p, &totals);
    imp__release(ctx, at);
    return st;
}

enum imp_status imp_problem_objective(imp_problem *p, const double *x,
                                      const struct imp_run *run,
                                      struct imp_estimate *objective, double *gradient,
                                      double *gradient_se)
{
    struct imp_run own;
    IMP_REQUIRE(NULL, p, "problem");
    IMP_RUN(p->ctx, own, run);
    if (p->n_targets == 0)
        return imp__error(p->ctx, IMP_E_ARG, "the problem has no target");
    return imp__problem_objective(p, x, &own, false, objective, gradient, gradient_se);
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
    IMP_REQUIRE(p->ctx, seed_image, "seed_image");
    IMP_REQUIRE(p->ctx, gradient, "gradient");
    IMP_RUN(p->ctx, own, run);
    IMP_FLOAT_MODE;
    IMP_READS(p->scene);
    struct imp__splat splat = {0};
    struct totals totals = {0};
    bool again = false;
    struct job j = {
        .problem = p, .totals = &totals, .seed = seed_image, .want_gradient = true};
    IMP_TRY(imp__problem_same(p, &own, "reverse"));
    IMP_TRY(totals_begin(p, false, gradient, gradient_se, &totals));
    IMP_TRY(imp__problem_tracer(p, &own, &j.tracer));
    IMP_TRY(imp__adjoint_check(p, &j.tracer.sensor->film, seed_image, "seed_image"));
    const int spp = own.spp > 0 ? own.spp : j.tracer.sensor->spp;
    j.plan = imp__replicates_plan(spp, IMP_BATCH_MAX);
    if (imp__film_border(&j.tracer.sensor->film) > 0) {
        j.plan = imp__splat_plan(spp);
        IMP_TRY(splat_prepare(&j, &own, &splat));
    }
    IMP_TRY(job_run(&j, &own, "gradient", 0, 1, imp__now()));
    IMP_TRY(totals_share(p, &totals));
    IMP_TRY(totals_again(p, &totals, &again));
    if (again) {
        IMP_TRY(job_run(&j, &own, "gradient", 0, 1, imp__now()));
        IMP_TRY(totals_share(p, &totals));
    }
    totals_end(p, &totals, gradient, gradient_se);
out:
    imp__splat_destroy(p->ctx, &splat);
    totals_free(p, &totals);
    return st;
}

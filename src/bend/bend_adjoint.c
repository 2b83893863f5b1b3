/* SPDX-License-Identifier: Apache-2.0
 *
 * The exact adjoint of traced rays (docs/bent-rays.md 2.2 - 2.4). Each ray is integrated
 * backwards from its exit state, together with its cotangents lam = dC/dx, mu = dC/dv;
 * each kick adds to the gradient of the field. Memory holds the exits and one gradient
 * for each slice of rays in progress. Only IMP_BEND_STORED needs memory that grows with
 * the number of steps, for the states of the rays in progress. */
#include "bend_adjoint.h"
#include <string.h>

static bool nothing(const struct imp_bend_cotangent *c)
{
    return c->x[0] == 0 && c->x[1] == 0 && c->x[2] == 0 && c->v[0] == 0 && c->v[1] == 0 &&
           c->v[2] == 0 && c->path == 0;
}

static bool wanted(const struct imp__adjoint *job, size_t ray)
{
    const size_t n_taps = (size_t)job->plan->n_taps;
    if (job->exits[ray].flags & IMP_BEND_DROPPED) return false;
    if (job->bars && !nothing(&job->bars[ray])) return true;
    for (size_t k = 0; job->tap_bars && k < n_taps; k++)
        if (!nothing(&job->tap_bars[ray * n_taps + k])) return true;
    return false;
}

static enum imp_status slot_make(struct imp__adjoint *job, struct imp__adjoint_slot *s)
{
    imp_context *ctx = job->plan->ctx;
    if (job->out->theta && !s->partial) {
        const enum imp_status st = imp__partial_take(&job->partials, &s->partial);
        if (st != IMP_OK) return st;
    }
    if (s->track) return IMP_OK;
    if (job->out->surfaces) {
        s->surfaces =
            imp__alloc(ctx, imp_max(job->n_surfaces, (size_t)1), sizeof *s->surfaces);
        if (!s->surfaces) return imp__error(ctx, IMP_E_NOMEM, "no memory for a gradient");
    }
    s->track = imp__alloc(ctx, IMP_LANES, sizeof *s->track);
    return s->track ? IMP_OK : imp__error(ctx, IMP_E_NOMEM, "no memory for trajectories");
}

static enum imp_status work(size_t item, int worker, int slot_index, void *payload)
{
    struct imp__adjoint *job = payload;
    struct imp__adjoint_slot *slot = &job->slots[slot_index];
    const struct imp__plan *p = job->plan;
    struct imp__lane lane[IMP_LANES];
    struct imp__track *free_track[IMP_LANES];
    struct imp__back b;
    size_t next = item * job->slice;
    const size_t last = imp_min(next + job->slice, job->rays->n);
    const bool stored = p->options.way == IMP_BEND_STORED;
    int n = 0;
    (void)worker;

    enum imp_status st = slot_make(job, slot);
    if (st != IMP_OK) return st;
    struct imp__bar at = {0}, *bar = NULL;
    if (slot->partial) {
        at = (struct imp__bar){slot->partial->theta, 0, slot->partial->touched};
        bar = &at;
    }
    for (int i = 0; i < IMP_LANES; i++) free_track[i] = &slot->track[i];

    for (;;) {
        while (n < IMP_LANES && next < last) {
            const size_t ray = next++;
            if (!wanted(job, ray)) continue;
            st = imp__lane_begin(job, slot, ray, free_track[n], &lane[n], &b, n, bar);
            if (st != IMP_OK) return st;
            if (lane[n].taps) imp__lane_taps(job, &lane[n], &b, n, bar);
            n++;
        }
        if (n == 0) break;
        for (int i = 0; i < n;
             i++) { /* lanes at the start of a segment: on to the one before, or done */
            while (lane[i].left == 0 && lane[i].segment > 0) {
                imp__lane_turn(job, slot, &lane[i], &b, i, bar);
                if (lane[i].taps) imp__lane_taps(job, &lane[i], &b, i, bar);
            }
            if (lane[i].left > 0) continue;
            imp__lane_end(job, slot, &lane[i], &b, i, bar);
            struct imp__track *track = free_track[i];
            n--;
            b.x[i] = b.x[n], b.v[i] = b.v[n], b.lam[i] = b.lam[n], b.mu[i] = b.mu[n];
            b.path_bar[i] = b.path_bar[n];
            lane[i] = lane[n];
            free_track[i] = free_track[n]; /* a lane keeps its track when it is moved */
            free_track[n] = track;
            i--;
        }
        if (n == 0) continue;
        const struct imp__state *before[IMP_LANES];
        for (int i = 0; stored && i < n;
             i++) { /* stored states replace the reversed ones */
            const struct imp__state *s =
                lane[i].track->state + lane[i].base + lane[i].left;
            b.x[i] = s->x, b.v[i] = s->v;
            before[i] = s - 1;
        }
        imp__step_adjoint(p->scheme, p->field, p->t, n, &b, stored ? before : NULL, bar);
        for (int i = 0; i < n; i++) {
            lane[i].left--;
            if (lane[i].taps) imp__lane_taps(job, &lane[i], &b, i, bar);
        }
    }
    if (slot->partial) imp__partial_add(&job->partials, item, slot->partial);
    slot->partial = NULL;
    return IMP_OK;
}

static enum imp_status commit(size_t item, int slot_index, void *payload)
{
    struct imp__adjoint *job = payload;
    struct imp__adjoint_slot *s = &job->slots[slot_index];
    (void)item;
    if (s->surfaces) {
        for (size_t i = 0; i < job->n_surfaces; i++)
            for (int k = 0; k < 8; k++) job->out->surfaces[i][k] += s->surfaces[i][k];
        memset(s->surfaces, 0, job->n_surfaces * sizeof *s->surfaces);
    }
    job->reversal += s->reversal;
    job->worst = fmax(job->worst, s->worst);
    s->reversal = 0;
    s->worst = 0;
    return IMP_OK;
}

/* ---- Slices -------------------------------------------------------------------- */

#define SLICES_MAX 128
#define SLICES_MIN 8
#define LOOK_MAX   4096 /* rays sampled to choose the number of slices */

/* Fraction of the field's volume in the bounding box of a slice's starts and exits, as a
 * mean over slices. It estimates what part of the coefficients a slice reaches. */
static double share(const struct imp__adjoint *job, size_t slices)
{
    const imp_field *f = job->plan->field;
    const size_t n = job->rays->n, each = (n + slices - 1) / slices,
                 stride = (n + LOOK_MAX - 1) / LOOK_MAX;
    double sum = 0;
    for (size_t first = 0; first < n; first += each) {
        imp_v3 lo = f->hi, hi = f->lo;
        for (size_t i = first; i < imp_min(first + each, n); i += stride) {
            const struct imp_bend_exit *e = &job->exits[i];
            if (e->flags & IMP_BEND_DROPPED) continue;
            for (int k = 0; k < 3; k++) {
                const double a = job->rays->x[i][k], b = e->x[k];
                lo[k] = fmin(lo[k], fmin(a, b)), hi[k] = fmax(hi[k], fmax(a, b));
            }
        }
        double part = 1;
        for (int k = 0; k < 3; k++) {
            const double a = fmax(lo[k], f->lo[k]), b = fmin(hi[k], f->hi[k]);
            part *= imp_clamp((b - a) / (f->hi[k] - f->lo[k]), 0.0, 1.0);
        }
        sum += part;
    }
    return sum / (double)slices;
}

/* Rays in a slice. Many slices keep many threads busy; but each clears and adds up the
 * coefficients that it reaches, which should cost at most a tenth of tracing its rays
 * (about n_theta^(1/3) steps each). The number depends on the problem and not on the
 * number of threads, so that sums have one order. */
static size_t slice_rays(const struct imp__adjoint *job)
{
    const size_t n = job->rays->n, n_theta = job->plan->field->n_theta;
    const double worth = 2 * (double)n / pow(imp_max((double)n_theta, 1.0), 2.0 / 3);
    const bool bounded =
        imp__is_finite(job->plan->field->lo) && imp__is_finite(job->plan->field->hi);
    size_t slices = SLICES_MAX;
    while (slices > SLICES_MIN &&
           (double)slices * (bounded ? share(job, slices) : 1) > worth)
        slices = imp_max(slices - slices / 4, (size_t)SLICES_MIN);
    return imp_max((n + slices - 1) / slices, (size_t)4 * IMP_LANES);
}

/* The tracer writes finite exits, except for dropped rays. */
static enum imp_status exits_check(imp_context *ctx, const struct imp_bend_exit *exits,
                                   size_t n)
{
    for (size_t i = 0; i < n; i++) {
        const struct imp_bend_exit *e = &exits[i];
        double sum = fabs(e->path) + fabs(e->tau) + fabs(e->norm2);
        for (int k = 0; k < 3; k++) sum += fabs(e->x[k]) + fabs(e->v[k]);
        if (!(e->flags & IMP_BEND_DROPPED) && !isfinite(sum))
            return imp__error(ctx, IMP_E_ARG,
                              "imp_bend_adjoint: exits[%zu] is not finite", i);
    }
    return IMP_OK;
}

static enum imp_status bars_check(imp_context *ctx, const char *name,
                                  const struct imp_bend_cotangent *bars, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        double sum = bars[i].path;
        for (int k = 0; k < 3; k++) sum += fabs(bars[i].x[k]) + fabs(bars[i].v[k]);
        if (!isfinite(sum))
            return imp__error(ctx, IMP_E_ARG, "imp_bend_adjoint: %s[%zu] is not finite",
                              name, i);
    }
    return IMP_OK;
}

enum imp_status
imp_bend_adjoint(const imp_field *field, const struct imp_bend_options *options,
                 const struct imp_bend_rays *rays, const struct imp_bend_exit *exits,
                 const struct imp_bend_exit *taps, const struct imp_bend_cotangent *bars,
                 const struct imp_bend_cotangent *tap_bars,
                 struct imp_bend_gradient *gradient, struct imp_bend_stats *stats)
{
    IMP_REQUIRE(NULL, field, "field");
    IMP_REQUIRE(field->ctx, rays, "rays");
    struct imp_bend_rays own_rays = IMP_BEND_RAYS_INIT;
    IMP_OPTIONS(field->ctx, own_rays, rays, "rays");
    rays = &own_rays;
    IMP_REQUIRE(field->ctx, exits, "exits");
    IMP_REQUIRE(field->ctx, bars, "bars");
    IMP_REQUIRE(field->ctx, gradient, "out");
    if (stats) IMP_SIZED(field->ctx, stats, "stats");
    struct imp_bend_gradient arrays = IMP_BEND_GRADIENT_INIT, *const out = &arrays;
    IMP_OPTIONS(field->ctx, arrays, gradient, "out");
    struct imp_bend_options own;
    IMP_CHECKED(imp__bend_options_take(field->ctx, __func__, "options", options, &own));
    IMP_CHECKED(exits_check(field->ctx, exits, rays->n));
    IMP_CHECKED(bars_check(field->ctx, "bars", bars, rays->n));
    IMP_FLOAT_MODE;
    struct imp__plan plan;
    enum imp_status st = imp__plan_create(field, &own, rays, &plan);
    if (st != IMP_OK) return st;
    imp_context *ctx = plan.ctx;
    const int n_slots = imp__pool_slots(ctx);
    struct imp_bend_gradient sum = *out;
    struct imp__adjoint job = {.plan = &plan,
                               .rays = rays,
                               .exits = exits,
                               .taps = taps,
                               .bars = bars,
                               .tap_bars = plan.n_taps > 0 ? tap_bars : NULL,
                               .out = &sum,
                               .n_surfaces = own.n_surfaces};
    double(*surfaces)[8] = NULL;
    imp__partials_init(&job.partials, ctx, field->n_theta);
    job.slice = slice_rays(&job);

    if (plan.scheme->index_form && plan.options.way == IMP_BEND_REVERSE)
        IMP_TRY(imp__error(
            ctx, IMP_E_BIAS,
            "rays of scheme arc-index cannot be run backwards without bias: use "
            "stored trajectories, or choose the pseudo-reverse by name"));
    if (plan.options.way == IMP_BEND_PSEUDO && !plan.scheme->index_form)
        IMP_TRY(imp__error(ctx, IMP_E_ARG, "pseudo-reverse belongs to scheme arc-index"));
    if (job.tap_bars)
        IMP_TRY(bars_check(ctx, "tap_bars", tap_bars, rays->n * (size_t)plan.n_taps));
    if (job.tap_bars && !taps)
        IMP_TRY(imp__error(ctx, IMP_E_ARG, "cotangents of taps without the taps"));
    job.slots = imp__alloc(ctx, (size_t)n_slots, sizeof *job.slots);
    surfaces = imp__alloc(ctx, job.n_surfaces + 1, sizeof *surfaces);
    if (!job.slots || !surfaces)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a gradient"));
    sum.surfaces = out->surfaces && job.n_surfaces > 0 ? surfaces : NULL;
    if (sum.x) memset(sum.x, 0, rays->n * sizeof *sum.x);
    if (sum.d) memset(sum.d, 0, rays->n * sizeof *sum.d);
    if (sum.energy) memset(sum.energy, 0, rays->n * sizeof *sum.energy);

    const struct imp_loop loop = {.n_items = (rays->n + job.slice - 1) / job.slice,
                                  .work = work,
                                  .commit = commit,
                                  .payload = &job,
                                  .progress = plan.options.progress,
                                  .progress_payload = plan.options.progress_payload,
                                  .stage = "adjoint",
                                  .rate_unit = "rays",
                                  .units = (double)rays->n};
    IMP_TRY(imp__parallel(ctx, &loop, NULL));
    struct imp_bend_stats counts;
    IMP_TRY(imp__count(&plan, rays->n, exits, taps, stats ? &counts : NULL));
    if (out->theta) IMP_TRY(imp__partials_sum(&job.partials, out->theta));
    if (sum.surfaces) memcpy(out->surfaces, surfaces, job.n_surfaces * sizeof *surfaces);
    if (stats) {
        counts.reversal = job.reversal;
        counts.worst_reversal = job.worst;
        IMP_TRY(imp__info_give(ctx, __func__, "stats", stats, &counts, sizeof counts));
    }
out:
    for (int i = 0; job.slots && i < n_slots; i++) {
        imp__partial_drop(&job.partials, job.slots[i].partial);
        imp__release(ctx, job.slots[i].surfaces);
        for (int k = 0; job.slots[i].track && k < IMP_LANES; k++)
            imp__track_free(&job.slots[i].track[k]);
        imp__release(ctx, job.slots[i].track);
    }
    imp__release(ctx, job.slots);
    imp__partials_free(&job.partials);
    imp__release(ctx, surfaces);
    imp__plan_destroy(&plan);
    return st;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * The objective of a problem with its gradient, and gradients of linear functions of
 * pictures: jobs over the targets (gradient_job.c), added up. */
#include "objective_gradient.h"
#include "allocation.h"
#include "base/team.h"
#include "film/film_filter.h"
#include "gradient_job.h"
#include "inverse/estimate/moved_gradient.h"
#include "inverse/estimate/problem_tracer.h"
#include "inverse/estimate/replicates.h"
#include "inverse/problem/loss.h"
#include "light_gradient.h"
#include "walk/kept/store.h"
#include "walk/rules/features.h"
#include "walk/run/run.h"
#include <math.h>
#include <string.h>

/* Pass 1 of a wide filter: the replicates' pictures, and the adjoints of their pixels. */
static enum imp_status splat_prepare(struct imp__gradient_job *j,
                                     const struct imp_run *run, struct imp__splat *splat)
{
    imp_context *ctx = j->problem->ctx;
    /* The second pass needs these pictures, so each part computes all of them. */
    const bool apart = imp__team_apart(ctx);
    double value[2] = {0, 0};
    bool known = false;
    enum imp_status st = IMP_OK;
    if (imp__team_merges(ctx)) IMP_TRY(imp__team_keep(ctx, value, sizeof value, &known));
    if (!known) {
        if (apart) ctx->team->alone++;
        /* Walks that nothing is made of but their radiance. */
        struct imp_tracer plain = j->tracer;
        plain.value_only = true;
        if (j->moved) plain.active = NULL;
        st = imp__splat_create(j->problem, &plain, j->target, j->seed, j->plan, run,
                               splat);
        if (apart) ctx->team->alone--;
        IMP_TRY(st);
        value[0] = splat->objective;
        value[1] = splat->objective_variance;
        if (imp__team_part(ctx))
            IMP_TRY(imp__team_keep(ctx, value, sizeof value, &known));
    }
    j->splat = splat;
    j->splat_made = true;
    j->totals->objective += value[0];
    j->totals->variance += value[1];
out:
    return st;
}

/* Variance [n] of what all jobs so far have brought. */
static void variance_read(const struct imp__totals *t, size_t n, double *out)
{
    for (size_t k = 0; k < n; k++)
        out[k] = !t->many        ? t->gradient_variance[k]
                 : t->spread.sum ? imp__fixed_value(&t->spread, k)
                                 : 0;
}

/* Adds what the noise of adjoints brings to it; own [n] is the variance that this job brought. */
static void variance_add(struct imp__totals *t, size_t n, const double *more)
{
    for (size_t k = 0; k < n; k++)
        if (!t->many) t->gradient_variance[k] += more[k];
        else if (t->spread.sum && more[k] != 0) imp__fixed_add(&t->spread, k, more[k]);
}

/* One pass makes the pictures and sweeps the walks, which are kept for so long: a pixel's samples are
 * its own, and few. Teams share pictures out in another way. */
static bool goes_once(const struct imp__gradient_job *j)
{
    const int n = j->plan.m < j->plan.n ? (j->plan.n - 1) / j->plan.m + 1 : j->plan.n;
    return imp__film_border(&j->tracer.sensor->film) == 0 && n <= IMP_SPLAT_SET &&
           !j->tracer.kept && !j->problem->ctx->team && !j->totals->many;
}

/* Where it does, all walks; their pictures are made of them. */
static enum imp_status once_prepare(struct imp__gradient_job *j, struct imp__splat *splat)
{
    IMP_CHECKED(imp__splat_begin(j->problem, &j->tracer, j->target, j->plan, splat));
    j->splat = splat;
    return IMP_OK;
}

/* The gradient of a target by poses too: adjoints from the pictures, and errors from
 * contrasts (moved_adjoint.h). Of few numbers walks come before draws, whose adjoints are those of all
 * walks. */
static enum imp_status moved_estimate(struct imp__gradient_job *j,
                                      struct imp__moved_gradient *moved,
                                      struct imp__splat *splat, const struct imp_run *run,
                                      double lo, double hi, double start_s)
{
    const double half = (lo + hi) / 2;
    enum imp_status st = IMP_OK;
    imp_context *ctx = j->problem->ctx;
    const size_t n = j->problem->n;
    const bool errors = j->totals->many && j->totals->wants_errors;
    double *before = imp__alloc(ctx, 3 * n, sizeof *before), *own = before + n,
           *more = own + n;
    if (!before) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for errors"));
    variance_read(j->totals, n, before);
    IMP_TRY(imp__moved_adjoint_loss(ctx, &j->tracer.sensor->film,
                                    j->problem->scene->channels, j->plan.R,
                                    errors            ? IMP_CONTRASTS_MANY
                                    : j->totals->many ? 0
                                                      : IMP_CONTRASTS,
                                    &moved->adjoint));
    if (!j->totals->many || errors) {
        j->contrasts = imp__alloc(ctx, imp__moved_contrasts(moved), sizeof *j->contrasts);
        if (!j->contrasts) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for errors"));
        memset(j->contrasts, 0, imp__moved_contrasts(moved) * sizeof *j->contrasts);
    }
    if (!j->totals->many) {
        j->of = IMP_JOB_OF_WALKS;
        IMP_TRY(imp__gradient_job_run(j, run, "gradient", lo, half, start_s));
        j->of = IMP_JOB_OF_DRAWS;
        lo = half;
    }
    if (!j->splat_made) {
        imp__splat_end(splat, j->plan);
        j->splat_made = true;
        j->totals->objective += splat->objective;
        j->totals->variance += splat->objective_variance;
    }
    imp__moved_adjoint_read(&moved->adjoint, splat);
    IMP_TRY(imp__moved_learn(moved, run->spp));
    imp__moved_share(moved);
    IMP_TRY(imp__gradient_job_run(j, run, "gradient", lo, hi, start_s));
    if (j->totals->many && !errors) goto out;
    variance_read(j->totals, n, own);
    for (size_t k = 0; k < n; k++) own[k] -= before[k];
    IMP_TRY(imp__moved_variance(moved, j->tracer.active, j->contrasts, own, more));
    variance_add(j->totals, n, more);
out:
    imp__release(ctx, j->contrasts);
    imp__release(ctx, before);
    return st;
}

static enum imp_status moved_begin(struct imp__gradient_job *j, size_t target,
                                   struct imp__moved_gradient *moved)
{
    const struct imp_problem *p = j->problem;
    if (j->totals->many && j->totals->wants_errors &&
        (imp__team_ranks(p->ctx) || imp__team_apart(p->ctx)))
        return imp__error(
            p->ctx, IMP_E_UNSUPPORTED,
            "the errors of a gradient of a loss by more than %d numbers, some of "
            "geometry, are computed in one process",
            IMP_TALLY_DENSE);
    IMP_CHECKED(imp__moved_begin(p, &j->tracer, moved));
    moved->first = imp__moved_first(target);
    if (moved->moves.n > 0) j->moved = moved;
    return IMP_OK;
}

static enum imp_status target_estimate(struct imp_problem *p,
                                       const struct imp__target *target, size_t number,
                                       int part, const struct imp_run *run, double lo,
                                       double hi, double start_s, bool want_gradient,
                                       struct imp__totals *totals)
{
    struct imp_run own = *run;
    struct imp__splat splat = {0};
    struct imp__moved_gradient moved = {0};
    struct imp__gradient_job j = {
        .problem = p, .totals = totals, .target = target, .want_gradient = want_gradient};
    p->edge_terms = true;
    enum imp_status st = imp__target_tracer(p, target, part, &own, &j.tracer);
    p->edge_terms = false;
    if (st != IMP_OK) return st;
    struct imp_job job = imp__job(p->scene, j.tracer.sensor, &own, &p->active);
    const struct imp_bearer dense = {.number = IMP_TALLY_DENSE};
    imp__job_state(&job, IMP_HAS_LOSS, NULL);
    imp__job_state(&job, IMP_HAS_EDGE_TERMS, NULL);
    if (want_gradient && totals->many)
        imp__job_state(&job, IMP_HAS_MANY_PARAMETERS, &dense);
    IMP_CHECKED(imp__job_allowed(&job));
    if (j.tracer.integrator->from_lights)
        return imp__light_objective(
            p, target, &j.tracer, &own, &totals->objective, &totals->variance,
            want_gradient ? totals->gradient : NULL, totals->gradient_variance);
    if (!want_gradient) j.tracer.active = NULL;
    j.plan = imp__replicates_loss(p, target, &own);
    st = imp__replicates_kept(&j.tracer, j.plan);
    if (st == IMP_OK && j.tracer.kept && j.tracer.kept->stratified)
        st =
            imp__error(p->ctx, IMP_E_ARG,
                       "these walks were kept for pictures, with stratified wavelengths; "
                       "a loss needs independent ones: keep them with `losses`");
    if (st != IMP_OK) return st;
    if (p->variate && want_gradient)
        j.variate = imp__variate_use(p->variate, target, &j.tracer, &j.there);
    const bool moves = imp__problem_moves(p);
    if (moves && want_gradient) st = moved_begin(&j, number, &moved);
    if (st == IMP_OK && j.moved && goes_once(&j)) st = once_prepare(&j, &splat);
    else if (st == IMP_OK && (moves || imp__film_border(&j.tracer.sensor->film) > 0))
        st = splat_prepare(&j, &own, &splat);
    if (st == IMP_OK && j.moved)
        st = moved_estimate(&j, &moved, &splat, &own, lo, hi, start_s);
    else if (st == IMP_OK && (!j.splat || want_gradient))
        st = imp__gradient_job_run(&j, &own, "gradient", lo, hi, start_s);
    imp__moved_end(&moved);
    imp__splat_destroy(p->ctx, &splat);
    return st;
}

static enum imp_status targets_estimate(struct imp_problem *p, const struct imp_run *run,
                                        bool want_gradient, struct imp__totals *totals)
{
    const double start = imp__now(), n = (double)p->n_targets;
    enum imp_status st = IMP_OK;
    if (p->variate) imp__variate_begin(p->variate);
    if (p->allocation) p->allocation->next = 0;
    for (size_t t = 0; t < p->n_targets; t++) {
        const int parts = imp__target_parts(&p->targets[t]);
        for (int k = 0; k < parts && st == IMP_OK; k++)
            st = target_estimate(p, imp__target_part(&p->targets[t], k), t, k, run,
                                 ((double)t + (double)k / parts) / n,
                                 ((double)t + (double)(k + 1) / parts) / n, start,
                                 want_gradient, totals);
    }
    return st;
}

static int bias_order(const struct imp_problem *p)
{
    int order = 0;
    for (size_t t = 0; t < p->n_targets; t++) {
        const struct imp_target *d = &p->targets[t].desc;
        const bool wide = imp__film_border(&p->scene->sensors[d->sensor]->film) > 0;
        const int own = imp__loss_bias_order(d->loss);
        /* A ratio of sums; adjoints of two passes without the jackknife. */
        const int here = wide ? 1 : imp__problem_moves(p) ? imp_min(own, 1) : own;
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
    IMP_FLOAT_MODE;
    const struct imp__access_held access
        __attribute__((cleanup(imp__access_leave), unused)) =
            x ? imp__access_set(p->scene, &st) : imp__access_read(p->scene);
    if (st != IMP_OK) return st;
    const bool want_gradient = gradient || gradient_se;
    struct imp__totals totals = {0};
    bool again = false;
    if (x) IMP_TRY(imp_problem_set_x(p, x));
    IMP_TRY(imp__problem_same(p, run, "loss"));
    IMP_TRY(imp__totals_begin(p, in_place, gradient, gradient_se, &totals));
    IMP_TRY(targets_estimate(p, run, want_gradient, &totals));
    IMP_TRY(imp__totals_share(p, &totals));
    IMP_TRY(imp__totals_again(p, &totals, &again));
    if (again) {
        IMP_TRY(targets_estimate(p, run, want_gradient, &totals));
        IMP_TRY(imp__totals_share(p, &totals));
    }
    if (p->variate) IMP_TRY(imp__variate_end(p->variate, p));
    imp__totals_end(p, &totals, gradient, gradient_se);
    const double prior = imp__regularise(p, NULL, gradient);
    if (objective)
        *objective = (struct imp_estimate){.value = totals.objective + prior,
                                           .se = sqrt(fmax(totals.variance, 0)),
                                           .bias_order = bias_order(p)};
out:
    imp__totals_free(p, &totals);
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
    imp__points_of_losses(p, &own);
    return imp__problem_objective(p, x, &own, false, objective, gradient, gradient_se);
}

double imp_problem_nlopt(unsigned n, const double *x, double *gradient, void *problem)
{
    imp_problem *p = problem;
    struct imp_estimate e;
    IMP_REQUIRE_OR(NULL, p, "problem", HUGE_VAL);
    IMP_REQUIRE_OR(p->ctx, x || n == 0, "x", HUGE_VAL);
    if (n != p->n) {
        imp__error(p->ctx, IMP_E_ARG, "n is %u, but %zu numbers are active", n, p->n);
        return HUGE_VAL;
    }
    const enum imp_status st = imp_problem_objective(p, x, &p->run, &e, gradient, NULL);
    return st == IMP_OK && isfinite(e.value) ? e.value : HUGE_VAL;
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
    struct imp__totals totals = {0};
    struct imp__moved_gradient moved = {0};
    bool again = false;
    struct imp__gradient_job j = {
        .problem = p, .totals = &totals, .seed = seed_image, .want_gradient = true};
    IMP_TRY(imp__problem_same(p, &own, "reverse"));
    IMP_TRY(imp__totals_begin(p, false, gradient, gradient_se, &totals));
    p->edge_terms = true;
    st = imp__problem_tracer_of_any_end(p, &own, NULL, &j.tracer);
    p->edge_terms = false;
    IMP_TRY(st);
    IMP_TRY(imp__adjoint_check(p, &j.tracer.sensor->film, seed_image, "seed_image"));
    if (imp__problem_moves(p)) {
        IMP_TRY(imp__moved_begin(p, &j.tracer, &moved));
        IMP_TRY(imp__moved_adjoint_fixed(p->ctx, &j.tracer.sensor->film,
                                         p->scene->channels, seed_image, &moved.adjoint));
        IMP_TRY(imp__moved_learn(&moved, own.spp));
        if (moved.moves.n > 0) j.moved = &moved;
    }
    if (j.tracer.integrator->from_lights) {
        IMP_TRY(imp__light_reverse(p, &j.tracer, seed_image, &own, &totals));
        IMP_TRY(imp__totals_share(p, &totals));
        IMP_TRY(imp__totals_again(p, &totals, &again));
        if (again) {
            IMP_TRY(imp__light_reverse(p, &j.tracer, seed_image, &own, &totals));
            IMP_TRY(imp__totals_share(p, &totals));
        }
        imp__totals_end(p, &totals, gradient, gradient_se);
        goto out;
    }
    j.plan = imp__replicates_of(p->scene, NULL, &own);
    IMP_TRY(imp__replicates_kept(&j.tracer, j.plan));
    if (imp__film_border(&j.tracer.sensor->film) > 0)
        IMP_TRY(splat_prepare(&j, &own, &splat));
    /* With a fixed adjoint the walks of a replicate may depend on each other: standard
     * errors come from the spread between replicates. */
    if (!j.tracer.points) {
        if (own.wavelengths != IMP_WAVELENGTHS_INDEPENDENT) j.tracer.set = j.plan.n;
        j.tracer.period = j.plan.n;
    }
    IMP_TRY(imp__gradient_job_run(&j, &own, "gradient", 0, 1, imp__now()));
    IMP_TRY(imp__totals_share(p, &totals));
    IMP_TRY(imp__totals_again(p, &totals, &again));
    if (again) {
        IMP_TRY(imp__gradient_job_run(&j, &own, "gradient", 0, 1, imp__now()));
        IMP_TRY(imp__totals_share(p, &totals));
    }
    imp__totals_end(p, &totals, gradient, gradient_se);
out:
    imp__moved_end(&moved);
    imp__splat_destroy(p->ctx, &splat);
    imp__totals_free(p, &totals);
    return st;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * J^T W J and J^T W r without bias (docs/estimators.md 15). The samples of a pixel are put
 * together to M units, with X_k the mean of dL/dx_k over a unit and r that of L, less the
 * target. Over all pairs of different units a, b of a pixel and channel,
 *
 *     (J^T J)_kl ~ w sum_a!=b X_k,a X_l,b / (M (M-1))
 *     (J^T r)_k  ~ sum_a<b h_ab / (M (M-1)/2),      h_ab = w/2 (r_a X_b + r_b X_a)
 *
 * and the covariance of the second is that of a U-statistic, with h summed over channels
 * (pair_noise.h has the formulas). The same-sample matrix, the naive product of mean
 * pictures, is computed too, for damping. Losses that are not quadratic enter with Gauss
 * and Newton's w at the mean, and with the jackknife's gradient over units (adjoint.c):
 * r = l'/w at the mean of a few walks would have the bias that the jackknife removes.
 *
 * The noise of the targets gives the gradient the covariance sum w^2 sigma^2 J^T J. Where
 * sigma is not given, the squared residual replaces sigma^2, pixel by pixel, which
 * holds however the noise differs between pixels (White, Econometrica 48, 1980); residual
 * and J^T J come from different halves of the units, so that their own noise is not
 * correlated. Channels of a pixel share their noise, in a rendered picture nearly all of it:
 * sigma^2 J^T J is a sum over pairs of channels, with the product of their residuals, or with
 * the given sigmas times the correlation of residuals. */
#include "gauss_newton.h"
#include "base/arguments.h"
#include "film/film_filter.h"
#include "film/parts.h"
#include "inverse/estimate/adjoint.h"
#include "inverse/estimate/moved_gradient.h"
#include "inverse/estimate/problem_tracer.h"
#include "inverse/problem/loss.h"
#include "normal_tiles.h"
#include "search/excess.h"
#include "walk/rules/features.h"

#define GAUSS_NEWTON_MAX 256

static enum imp_status workers_create(struct imp__normal_job *j, imp_context *ctx)
{
    const size_t K = j->K, S = 3, units = IMP_NORMAL_UNITS;
    const size_t rows = S + units * S + 3 + IMP_NORMAL_PAIRS + units + 1;
    for (int k = 0; k < ctx->threads; k++) {
        struct imp__normal_worker *w = &j->workers[k];
        w->x = imp__alloc(ctx, K * rows + 3 * K * K, sizeof(double));
        if (!w->x) return imp__error(ctx, IMP_E_NOMEM, "no memory for derivatives");
        w->X = w->x + S * K;
        w->h = w->X + units * S * K;
        w->e = w->h + IMP_NORMAL_PAIRS * K;
        w->total = w->e + units * K;
        w->sum = w->total + K;
        w->sum_xx = w->sum + K;
        w->sum1 = w->sum_xx + K * K;
        w->sum1_xx = w->sum1 + K;
        w->own = w->sum1_xx + K * K;
        w->touched = imp__alloc(ctx, K, sizeof *w->touched);
        if (!w->touched) return imp__error(ctx, IMP_E_NOMEM, "no memory for derivatives");
    }
    return IMP_OK;
}

/* Does a walk have a part in several pixels? */
static bool shares_walks(const struct imp_tracer *tracer)
{
    return imp__film_border(&tracer->sensor->film) > 0 || tracer->integrator->from_lights;
}

/* From pictures of replicates. Draws of one target are not those of another. */
static enum imp_status pictures_add(struct imp__normal_job *j, const struct imp_run *run,
                                    size_t number, int rounds, double lo, double hi)
{
    const struct imp_problem *p = j->problem;
    enum imp_status st = IMP_OK;
    struct imp__normal_sums total = imp__normal_at(j, j->total);
    struct imp__moved_gradient moved = {0};
    if (imp__problem_moves(p)) {
        IMP_TRY(imp__moved_begin(p, &j->tracer, &moved));
        IMP_TRY(imp__moved_learn(&moved, IMP_MOVED_PILOT));
        moved.first = imp__moved_first(number);
    }
    IMP_TRY(imp__gauss_newton_wide(p, &j->tracer, moved.moves.n > 0 ? &moved : NULL,
                                   j->target, run, rounds, j->pairs, lo, hi, &total));
out:
    imp__moved_end(&moved);
    return st;
}

static enum imp_status target_add(struct imp__normal_job *j,
                                  const struct imp__target *target, size_t number,
                                  int part, const struct imp_run *run, int rounds,
                                  double lo, double hi, double start)
{
    const struct imp_problem *p = j->problem;
    struct imp_run own = *run;
    j->target = target;
    enum imp_status st = imp__target_tracer(p, target, part, &own, &j->tracer);
    if (st != IMP_OK) return st;
    const struct imp_film_desc *film = &j->tracer.sensor->film;
    struct imp_job job = imp__job(p->scene, j->tracer.sensor, &own, &p->active);
    imp__job_state(&job, IMP_HAS_GAUSS_NEWTON, NULL);
    imp__job_state(&job, IMP_HAS_EDGE_TERMS, NULL);
    if (!imp__loss_quadratic(target->desc.loss))
        imp__job_state(&job, IMP_HAS_NOT_QUADRATIC, NULL);
    IMP_CHECKED(imp__job_allowed(&job));
    if (shares_walks(&j->tracer) || imp__problem_moves(p))
        return pictures_add(j, &own, number, rounds, lo, hi);
    j->width = film->crop_w;
    j->plan = imp__replicates_normal(p->scene, target, &own, rounds);
    const double walks = (double)film->crop_w * film->crop_h * j->plan.n * j->plan.R;
    j->tiles = (struct imp_tiles){.ctx = p->ctx,
                                  .run = &own,
                                  .walks = walks,
                                  .width = film->crop_w,
                                  .height = film->crop_h,
                                  .work = imp__normal_work,
                                  .size = imp__normal_count(j) * sizeof(double),
                                  .add = imp__normal_add,
                                  .take = imp__normal_take,
                                  .payload = j};
    const struct imp_tiles_pass pass = {.stage = "gauss-newton",
                                        .rate_unit = "walks",
                                        .units = walks,
                                        .fraction_lo = lo,
                                        .fraction_hi = hi,
                                        .start_s = start,
                                        .parts = (size_t)j->plan.chunks};
    st = imp__tiles_create(&j->tiles);
    if (st == IMP_OK) st = imp__tiles_run(&j->tiles, &pass);
    imp__tiles_destroy(&j->tiles);
    return st;
}

static void matrix_copy(double *to, const double *lower, size_t K)
{
    if (!to) return;
    for (size_t k = 0; k < K; k++)
        for (size_t m = 0; m <= k; m++) to[k * K + m] = to[m * K + k] = lower[k * K + m];
}

static enum imp_status data_term(struct imp_problem *p, const struct imp_run *run,
                                 struct imp_estimate *out)
{
    double *x = imp__alloc(p->ctx, p->n, sizeof *x);
    if (!x) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for %zu variables", p->n);
    imp_problem_get_x(p, x);
    const enum imp_status st = imp_problem_objective(p, NULL, run, out, NULL, NULL);
    if (st == IMP_OK) out->value -= imp__regularise(p, x, NULL);
    imp__release(p->ctx, x);
    return st;
}

enum imp_status imp__gauss_newton(struct imp_problem *p, const double *x,
                                  const struct imp_run *run,
                                  struct imp__gauss_newton *out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = p->ctx;
    struct imp_run own = IMP_RUN_INIT;
    if (run) own = *run;
    struct imp__normal_job j = {.problem = p,
                                .K = p->n,
                                .channels = p->scene->channels,
                                .deviate = out->deviations != NULL};
    const int rounds = imp_max(out->rounds, 1);
    double residuals = 0;
    int bias_order = 0;
    bool wide = false;
    if (p->n == 0 || p->n > GAUSS_NEWTON_MAX)
        IMP_TRY(imp__error(ctx, IMP_E_ARG,
                           "%zu numbers are active; Gauss-Newton takes 1 to %d", p->n,
                           GAUSS_NEWTON_MAX));
    if (x) IMP_TRY(imp_problem_set_x(p, x));
    imp__team_state(p->scene, &own);
    p->edge_terms = true;
    out->n_pixels = imp__normal_pixel_count(p);
    if (out->n_pixels < IMP_PIXELS_A_VALUE * (double)p->n) out->n_pixels = 0;
    j.pairs = out->n_pixels > 0;
    for (size_t t = 0; t < p->n_targets; t++)
        j.cross |= j.pairs && p->targets[t].noise_se && p->targets[t].desc.channels > 1;
    j.workers = imp__alloc(ctx, (size_t)ctx->threads, sizeof *j.workers);
    j.total = imp__alloc(ctx, imp__normal_count(&j), sizeof *j.total);
    if (!j.workers || !j.total)
        IMP_TRY(
            imp__error(ctx, IMP_E_NOMEM, "no memory for %zu x %zu matrices", j.K, j.K));
    IMP_TRY(workers_create(&j, ctx));

    const double start = imp__now(), targets = (double)p->n_targets;
    for (size_t t = 0; t < p->n_targets; t++) {
        const int parts = imp__target_parts(&p->targets[t]);
        for (int k = 0; k < parts; k++)
            IMP_TRY(target_add(&j, imp__target_part(&p->targets[t], k), t, k, &own,
                               rounds, ((double)t + (double)k / parts) / targets,
                               ((double)t + (double)(k + 1) / parts) / targets, start));
        residuals += imp__normal_residual_count(&p->targets[t]);
        const int bias = imp__loss_bias_order(p->targets[t].desc.loss);
        if (bias && (!bias_order || bias < bias_order)) bias_order = bias;
        wide |= shares_walks(&j.tracer) || imp__problem_moves(p);
    }
    /* Where pixels share walks, the same estimate as that of trial steps from the same walks. */
    struct imp__normal_sums total = imp__normal_at(&j, j.total);
    imp__normal_cross(&j, &total);
    struct imp_estimate objective = {
        .value = total.scalars[IMP_NORMAL_OBJECTIVE],
        .se = sqrt(fmax(0, total.scalars[IMP_NORMAL_VARIANCE])),
        .bias_order = bias_order};
    if (wide) IMP_TRY(data_term(p, &own, &objective));
    matrix_copy(out->H, total.H, j.K);
    matrix_copy(out->H_same, total.H_same, j.K);
    matrix_copy(out->H_meas, total.H_meas, j.K);
    matrix_copy(out->cov_g, total.cov_g, j.K);
    matrix_copy(out->cov_excess, total.cov_excess, j.K);
    for (size_t g = 0; out->deviations && g < IMP_DEVIATIONS; g++)
        matrix_copy(out->deviations + g * j.K * j.K, total.deviations + g * j.K * j.K,
                    j.K);
    for (size_t k = 0; k < j.K; k++) {
        if (out->g) out->g[k] = total.g[k];
        const size_t kk = k * j.K + k;
        if (out->g_se)
            out->g_se[k] = sqrt(fmax(0, total.cov_g[kk] - total.cov_excess[kk]));
    }
    out->objective = objective;
    out->chi2 = total.scalars[IMP_NORMAL_CHI2];
    double variance = total.scalars[IMP_NORMAL_CHI2_VARIANCE];
    IMP_TRY(
        imp__excess_take(p->ctx, 1, &variance, &total.scalars[IMP_NORMAL_CHI2_EXCESS]));
    out->chi2_se = sqrt(fmax(0, variance));
    out->n_residuals = residuals;
out:
    p->edge_terms = false;
    for (int k = 0; j.workers && k < ctx->threads; k++) {
        imp__release(ctx, j.workers[k].x);
        imp__release(ctx, j.workers[k].touched);
    }
    imp__release(ctx, j.workers);
    imp__release(ctx, j.total);
    return st;
}

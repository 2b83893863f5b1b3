/* SPDX-License-Identifier: Apache-2.0
 *
 * Losses and gradients by light tracing: pictures of sets A and B, adjoints of one swept along the
 * walks of the other (light_gradient.h). */
#include "light_gradient.h"
#include "base/team.h"
#include "gradient_job.h"
#include "inverse/estimate/influence.h"
#include "inverse/problem/loss.h"
#include "inverse/problem/target_channels.h"
#include <math.h>
#include <string.h>

struct imp__light_plan imp__light_plan_of(const struct imp_sensor *sensor, int spp)
{
    if (spp <= 0) spp = sensor->spp;
    const int groups = imp_clamp(spp / 4, 2, IMP_LIGHT_GROUPS);
    return (struct imp__light_plan){groups, imp_max(1, (spp - 1) / (2 * groups) + 1)};
}

/* ---- Sweeps ----------------------------------------------------------------------- */

imp_spec imp__light_adjoint_at(const struct imp__light_adjoints *a, const double *image,
                               double px, double py)
{
    struct imp_splat_taps taps;
    const size_t C = (size_t)a->channels;
    imp_spec P = {0};
    imp__splat_taps(a->film, a->scale, px, py, &taps);
    for (int j = 0; j < taps.down.n; j++)
        for (int i = 0; i < taps.across.n; i++) {
            const double *from =
                image + ((size_t)(taps.down.first + j) * (size_t)a->film->crop_w +
                         (size_t)(taps.across.first + i)) *
                            C;
            const double w = taps.down.w[j] * taps.across.w[i];
            for (size_t c = 0; c < C; c++) P[c] += w * from[c];
        }
    return P;
}

void imp__light_replicate(struct imp__gradient_job *job, struct imp_tile_worker *worker,
                          int x, int y, int b)
{
    const struct imp__light_adjoints *a = job->light;
    const struct imp_film_desc *film = a->film;
    const int64_t pixels = (int64_t)film->crop_w * film->crop_h;
    const int64_t pixel = (int64_t)y * film->crop_w + x;
    const double *image = a->image[b % a->n_images];
    struct imp_tally *tally = &job->tallies[worker->index];
    for (int i = 0; i < job->plan.n; i++) {
        const struct imp_arena_mark mark = imp__arena_mark(&worker->arena);
        const int64_t index = a->first + ((int64_t)b * job->plan.n + i) * pixels + pixel;
        struct imp_light_walk walk;
        imp__light_walk_trace(&job->tracer, &worker->arena, index, &walk);
        imp__tile_drop(worker, walk.walk.dropped, -1, -1, index);
        imp_spec *P =
            imp__arena_take(&worker->arena, (size_t)walk.n_reach + 1, sizeof *P);
        size_t k = 0;
        for (const struct imp_reach *r = P ? walk.reach : NULL; r; r = r->next)
            P[k++] = imp__walk_lanes(&walk.walk,
                                     imp__light_adjoint_at(a, image, r->px, r->py));
        if (!P || !imp__light_walk_sweep(&job->tracer, &worker->arena, &walk, P,
                                         1 / ((double)job->plan.n * (double)pixels),
                                         &tally->sink)) {
            worker->no_memory = true;
            return;
        }
        imp__arena_rewind(&worker->arena, mark);
    }
    imp__tally_batch(tally, b);
}

/* All sweeps of the plan, into totals that the caller shares between ranks and ends. */
static enum imp_status sweep_all(struct imp_problem *p, const struct imp_tracer *tracer,
                                 const struct imp__light_adjoints *adjoints,
                                 struct imp__replicates plan, const struct imp_run *run,
                                 double lo, double hi, struct imp__totals *totals)
{
    struct imp__gradient_job j = {.problem = p,
                                  .totals = totals,
                                  .tracer = *tracer,
                                  .plan = plan,
                                  .light = adjoints,
                                  .want_gradient = true};
    return imp__gradient_job_run(&j, run, "gradient", lo, hi, imp__now());
}

enum imp_status imp__light_reverse(struct imp_problem *p, const struct imp_tracer *tracer,
                                   const float *adjoint, const struct imp_run *run,
                                   struct imp__totals *totals)
{
    enum imp_status st = IMP_OK;
    const struct imp_film_desc *film = &tracer->sensor->film;
    const size_t n =
        (size_t)film->crop_w * (size_t)film->crop_h * (size_t)p->scene->channels;
    struct imp_splat_scale scale = {0};
    double *image = imp__alloc(p->ctx, n, sizeof *image);
    if (!image) IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for an adjoint"));
    for (size_t k = 0; k < n; k++) image[k] = adjoint[k];
    IMP_TRY(imp__splat_scale_create(p->ctx, film, &scale));
    const struct imp__light_adjoints a = {.film = film,
                                          .channels = p->scene->channels,
                                          .scale = &scale,
                                          .n_images = 1,
                                          .image = {image}};
    const int spp = run->spp > 0 ? run->spp : tracer->sensor->spp;
    IMP_TRY(sweep_all(p, tracer, &a, imp__replicates_plan(imp_max(spp, 4), IMP_BATCH_MAX),
                      run, 0, 1, totals));
out:
    imp__splat_scale_destroy(p->ctx, &scale);
    imp__release(p->ctx, image);
    return st;
}

/* ---- Functionals ------------------------------------------------------------------ */

struct functional {
    const struct imp__functional *f;
    struct imp_splat_scale scale;
};

/* value [1 + groups] of a walk: sums over the pixels that it reaches. */
static void walk_value(const void *payload, const struct imp_light_walk *walk,
                       double *value)
{
    const struct functional *own = payload;
    const struct imp__functional *f = own->f;
    const size_t C = (size_t)f->channels, K = f->derivatives ? f->tracer.active->n : 0;
    double L[3], *row = K ? imp__arena_take(walk->arena, (K + 1) * C, sizeof *row) : L;
    value[0] = row ? 0 : NAN; /* NAN: no memory */
    for (size_t k = 0; k < K; k++) value[1 + f->group[k]] = 0;
    for (const struct imp_reach *r = row ? walk->reach : NULL; r; r = r->next) {
        struct imp_splat_taps taps;
        imp__splat_taps(f->film, &own->scale, r->px, r->py, &taps);
        if (K) imp__light_row(&f->tracer, walk, r, row);
        for (size_t c = 0; !K && c < C; c++) row[c] = r->L[c];
        for (int j = 0; j < taps.down.n; j++)
            for (int i = 0; i < taps.across.n; i++) {
                const float *a = f->adjoint + ((size_t)(taps.down.first + j) *
                                                   (size_t)f->film->crop_w +
                                               (size_t)(taps.across.first + i)) *
                                                  C;
                const double w = taps.down.w[j] * taps.across.w[i] / f->norm;
                for (size_t c = 0; c < C; c++) value[0] += w * a[c] * row[c];
                for (size_t k = 0; k < K; k++)
                    for (size_t c = 0; c < C; c++)
                        value[1 + f->group[k]] += w * a[c] * row[(k + 1) * C + c];
            }
    }
}

enum imp_status imp__light_functional(const struct imp__functional *f,
                                      const struct imp_run *run, double *mean, double *se)
{
    enum imp_status st = IMP_OK;
    struct functional own = {.f = f};
    struct imp_tracer tracer = f->tracer;
    if (!f->derivatives) {
        tracer.active = NULL;
        tracer.value_only = true;
    }
    const struct imp_light_picture picture = {
        .tracer = &tracer,
        .run = run,
        .stage = f->derivatives ? "errors" : "picture",
        .n = 1 + (f->derivatives ? f->n_groups : 0),
        .whole = walk_value,
        .payload = &own,
        .walks = imp__light_walks_of(run, tracer.sensor)};
    IMP_TRY(imp__splat_scale_create(tracer.scene->ctx, f->film, &own.scale));
    IMP_TRY(imp__light_picture_make(&picture, mean, se, NULL));
out:
    imp__splat_scale_destroy(tracer.scene->ctx, &own.scale);
    return st;
}

/* ---- Losses ----------------------------------------------------------------------- */

static void reach_channels(const void *payload, const struct imp_light_walk *walk,
                           const struct imp_reach *reach, double *value)
{
    const struct imp_scene *scene = payload;
    (void)walk;
    for (int c = 0; c < scene->channels; c++) value[c] = reach->L[c];
}

struct sets {
    const struct imp__target *target;
    int channels;
    size_t pixels;
    double *image[2];   /* of the two sets */
    double *adjoint[2]; /* for the walks of each: by the other's picture */
};

/* The loss of a group; sets the adjoints. */
static double group_loss(struct sets *s)
{
    const struct imp_target *t = &s->target->desc;
    const int n = s->channels;
    const bool luminance = imp__sees_luminance(s->target, n);
    double sum = 0;
    for (size_t p = 0; p < s->pixels; p++) {
        double bar[2][3] = {{0}};
        for (int c = 0; c < t->channels; c++) {
            const double T = s->target->pixels[p * (size_t)t->channels + (size_t)c];
            const double scale = imp__target_weight(s->target, p, c);
            double I[2];
            struct imp__loss_at at;
            for (int k = 0; k < 2; k++)
                I[k] = imp__seen(luminance, s->image[k] + p * (size_t)n, c);
            for (int k = 0; k < 2; k++) {
                imp__loss_eval(t->loss, scale, t->epsilon, I[k], T, &at);
                bar[1 - k][c] = at.d1;
            }
            if (imp__loss_quadratic(t->loss)) {
                const double w = imp__loss_weight(t->loss, scale, t->epsilon, T);
                sum += 0.5 * w * (I[0] - T) * (I[1] - T);
            } else {
                imp__loss_eval(t->loss, scale, t->epsilon, 0.5 * (I[0] + I[1]), T, &at);
                sum += at.value;
            }
        }
        for (int k = 0; k < 2; k++) {
            const imp_spec P = imp__seen_bar(luminance, t->channels, bar[k]);
            for (int c = 0; c < n; c++) s->adjoint[k][p * (size_t)n + (size_t)c] = P[c];
        }
    }
    return sum;
}

/* Gradient of a group, into g [n]. */
static enum imp_status
group_gradient(struct imp_problem *p, const struct imp_tracer *tracer,
               const struct sets *s, const struct imp_splat_scale *scale, int64_t first,
               int n, const struct imp_run *run, double lo, double hi, double *g)
{
    enum imp_status st = IMP_OK;
    struct imp__totals totals = {0};
    bool again = false;
    const struct imp__light_adjoints a = {.film = &tracer->sensor->film,
                                          .channels = s->channels,
                                          .scale = scale,
                                          .first = first,
                                          .n_images = 2,
                                          .image = {s->adjoint[0], s->adjoint[1]}};
    const struct imp__replicates plan = {.n = n, .R = 2, .chunks = 1};
    IMP_TRY(imp__totals_begin(p, false, g, NULL, &totals));
    IMP_TRY(sweep_all(p, tracer, &a, plan, run, lo, hi, &totals));
    IMP_TRY(imp__totals_share(p, &totals));
    IMP_TRY(imp__totals_again(p, &totals, &again));
    if (again) {
        IMP_TRY(sweep_all(p, tracer, &a, plan, run, lo, hi, &totals));
        IMP_TRY(imp__totals_share(p, &totals));
    }
    imp__totals_end(p, &totals, g, NULL);
out:
    imp__totals_free(p, &totals);
    return st;
}

enum imp_status imp__light_objective(struct imp_problem *p,
                                     const struct imp__target *target,
                                     const struct imp_tracer *tracer,
                                     const struct imp_run *run, double *objective,
                                     double *variance, double *gradient,
                                     double *gradient_variance)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = p->ctx;
    struct imp_tracer plain = *tracer;
    struct imp_splat_scale scale = {0};
    struct sets s = {.target = target, .channels = p->scene->channels};
    double *g = NULL, *sum = NULL, *square = NULL, value = 0, value2 = 0;
    const struct imp_film_desc *film = &tracer->sensor->film;
    const struct imp__light_plan plan = imp__light_plan_of(tracer->sensor, run->spp);
    s.pixels = (size_t)film->crop_w * (size_t)film->crop_h;
    const size_t values = s.pixels * (size_t)s.channels;
    const int64_t walks = (int64_t)plan.n * (int64_t)s.pixels;
    plain.active = NULL;
    plain.value_only = true;
    IMP_TRY(imp__splat_scale_create(ctx, film, &scale));
    s.image[0] = imp__alloc(ctx, 4 * values, sizeof(double));
    if (!s.image[0]) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for pictures"));
    s.image[1] = s.image[0] + values;
    s.adjoint[0] = s.image[1] + values;
    s.adjoint[1] = s.adjoint[0] + values;
    if (gradient) {
        g = imp__alloc(ctx, 3 * p->n, sizeof *g);
        if (!g) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for gradients"));
        sum = g + p->n;
        square = sum + p->n;
    }
    for (int r = 0; r < plan.groups; r++) {
        const double part = 1. / plan.groups;
        for (int k = 0; k < 2; k++) {
            const struct imp_light_picture picture = {.tracer = &plain,
                                                      .run = run,
                                                      .stage = "picture",
                                                      .n = s.channels,
                                                      .values = reach_channels,
                                                      .payload = p->scene,
                                                      .first = (2 * r + k) * walks,
                                                      .walks = walks,
                                                      .lo = (r + 0.2 * k) * part,
                                                      .hi = (r + 0.2 * (k + 1)) * part};
            IMP_TRY(imp__light_picture_make(&picture, s.image[k], NULL, NULL));
        }
        const double loss = group_loss(&s);
        value += loss;
        value2 += loss * loss;
        if (!gradient) continue;
        IMP_TRY(group_gradient(p, tracer, &s, &scale, 2 * r * walks, plan.n, run,
                               (r + 0.4) * part, (r + 1) * part, g));
        for (size_t k = 0; k < p->n; k++) {
            sum[k] += g[k];
            square[k] += g[k] * g[k];
        }
    }
    const double G = plan.groups;
    *objective += value / G;
    *variance += fmax(0, value2 - value * value / G) / (G * (G - 1));
    for (size_t k = 0; gradient && k < p->n; k++) {
        gradient[k] += sum[k] / G;
        gradient_variance[k] += fmax(0, square[k] - sum[k] * sum[k] / G) / (G * (G - 1));
    }
out:
    imp__release(ctx, g);
    imp__release(ctx, s.image[0]);
    imp__splat_scale_destroy(ctx, &scale);
    return st;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * The pictures of one difference share their random numbers, in batches whose spread is
 * the standard error: walks that do not depend on the parameter cancel (common random
 * numbers, docs/estimators.md 13 B).
 *
 * F is linear in emission: one central difference with a large step. Elsewhere two steps
 * and Richardson's combination (4 D(h/2) - D(h))/3, whose error is O(h^4); at a bound,
 * one-sided differences D of third order, (8 D(h/2) - D(h))/7. */
#include "check_difference.h"
#include "film/film_picture.h"
#include "scene/pose.h"
#include <math.h>

/* Steps as fractions of the distance to the bounds, or of the value's scale where that is
 * smaller. They are large because noise falls with 1/step. F is exactly linear in
 * emission. Elsewhere the error of Richardson's combination is 0.3^4 = 0.8 % of the term
 * of fifth order. */
#define STEP           IMP_FRESH_STEP
#define STEP_LINEAR    0.8
#define FLOAT_ROUNDING 1e-7 /* of a picture's mean: 2^-24, and some for its sums */

/* The sample of a picture: radiance, or its derivative along x_dot. */
struct sampled {
    struct imp_tracer tracer;
    const double *x_dot; /* NULL: radiance */
};

static void sample(const void *payload, struct imp_sample *out)
{
    const struct sampled *s = payload;
    struct imp_walk walk;
    imp__sample_walk(out, &s->tracer, &walk);
    const imp_spec v = s->x_dot ? imp__walk_tangent(&s->tracer, &walk, s->x_dot) : walk.L;
    for (int c = 0; c < s->tracer.scene->channels; c++) out->value[c] = v[c];
}

enum imp_status imp__fresh_begin(struct imp__fresh *f, struct imp__check *c)
{
    const struct imp_film_desc *film = &c->tracer.sensor->film;
    const size_t w = (size_t)film->crop_w, h = (size_t)film->crop_h,
                 C = (size_t)c->problem->scene->channels;
    *f = (struct imp__fresh){.check = c, .channels = (int)C, .more = 1};
    f->pattern = imp__alloc(c->ctx, w * h * C, sizeof *f->pattern);
    if (!f->pattern) return imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check");
    for (size_t i = 0; i < w * h * C; i++) {
        const double x = (double)(i / C % w) / (double)w,
                     y = (double)(i / C / w) / (double)h;
        f->pattern[i] =
            (float)((1 + 0.5 * cos(5 * x + 3 * y + (double)(i % C))) / (double)(w * h));
    }
    return IMP_OK;
}

void imp__fresh_end(struct imp__fresh *f)
{
    if (f->check) imp__release(f->check->ctx, f->pattern);
}

uint64_t imp__fresh_seed(struct imp__fresh *f)
{
    return imp__mix64(f->check->outer.seed ^
                      (0xf7e5u + ++f->next_seed * 0x9e3779b97f4a7c15u));
}

int imp__fresh_batch(const struct imp__fresh *f)
{
    const struct imp__check *c = f->check;
    const double spp = c->run.spp > 0 ? c->run.spp : c->tracer.sensor->spp;
    return (int)fmin(ceil(spp * f->more / IMP_CHECK_BATCHES), 1 << 24);
}

/* The same by light tracing. */
static enum imp_status functional_of_lights(struct imp__fresh *f, const double *x_dot,
                                            uint64_t seed, double *value)
{
    struct imp_problem *p = f->check->problem;
    struct imp_run run = f->check->run;
    struct imp_estimate F = {0};
    double *g = x_dot ? imp__alloc(p->ctx, p->n, sizeof *g) : NULL;
    if (x_dot && !g) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for a check");
    run.spp = imp__fresh_batch(f);
    run.seed = seed;
    const enum imp_status st =
        imp_problem_functional(p, f->pattern, &run, x_dot ? NULL : &F, g, NULL);
    *value = F.value;
    for (size_t k = 0; g && k < p->n; k++) *value += x_dot[k] * g[k];
    imp__release(p->ctx, g);
    return st;
}

/* F, or its derivative along x_dot, with the random numbers of `seed`. */
static enum imp_status functional(struct imp__fresh *f, const double *x_dot,
                                  uint64_t seed, double *value)
{
    const struct imp_sensor *sensor = f->check->tracer.sensor;
    struct imp_run run = f->check->run;
    struct sampled t = {f->check->tracer, x_dot};
    if (!x_dot) t.tracer.active = NULL, t.tracer.value_only = true;
    const struct imp_picture picture = {.sensor = sensor,
                                        .stage = "check",
                                        .walks = imp__bundle_use(&t.tracer),
                                        .names = f->channels == 3 ? "R,G,B" : "Y",
                                        .n = f->channels,
                                        .sample = sample,
                                        .payload = &t};
    imp_film *film = NULL;
    if (t.tracer.integrator->from_lights)
        return functional_of_lights(f, x_dot, seed, value);
    run.spp = imp__fresh_batch(f);
    run.seed = t.tracer.seed = seed;
    const enum imp_status st = imp__picture_make(f->check->ctx, &picture, &run, &film);
    if (st == IMP_OK) {
        *value = 0;
        for (size_t i = 0; i < imp__film_values(film); i++)
            *value += f->pattern[i] * film->mean[i];
    }
    imp_film_destroy(film);
    return st;
}

/* Mean of batches and its standard error, from sums over them. */
static struct imp_estimate batches_mean(int n, double sum, double square)
{
    const double mean = sum / n;
    const double variance = fmax(square / n - mean * mean, 0) / (n - 1);
    return (struct imp_estimate){.value = mean, .se = sqrt(variance)};
}

static enum imp_status batches(struct imp__fresh *f, const double *x_dot, int n,
                               struct imp_estimate *out)
{
    enum imp_status st = IMP_OK;
    double sum = 0, square = 0;
    for (int b = 0; b < n; b++) {
        double value;
        IMP_TRY(functional(f, x_dot, imp__fresh_seed(f), &value));
        sum += value;
        square += value * value;
    }
    *out = batches_mean(n, sum, square);
    st = imp__check_progress(f->check, f->more);
out:
    return st;
}

enum imp_status imp__fresh_slope(struct imp__fresh *f, const double *x_dot,
                                 struct imp_estimate *out)
{
    return batches(f, x_dot, IMP_CHECK_BATCHES, out);
}

enum imp_status imp__fresh_value(struct imp__fresh *f, struct imp_estimate *out)
{
    return batches(f, NULL, IMP_CHECK_BATCHES / 2, out);
}

/* ---- Differences --------------------------------------------------------------- */

/* F where the parameter has moved by `step`, for each seed. It is set once for all seeds:
 * a table that depends on it (a rough coat's) may take longer than a picture. */
static enum imp_status at(struct imp__fresh *f, const struct imp__motion *m, double step,
                          const uint64_t seed[IMP_CHECK_BATCHES],
                          double value[IMP_CHECK_BATCHES])
{
    enum imp_status st = IMP_OK;
    struct imp_param p = *m->param;
    for (size_t e = 0; e < p.info.count; e++)
        if (m->weight[e] != 0) imp__param_set(&p, e, m->old[e] + step * m->weight[e]);
    imp__theta_announce(f->check->problem->scene);
    IMP_TRY(imp__poses_settle(f->check->problem->scene));
    for (int b = 0; b < IMP_CHECK_BATCHES; b++)
        IMP_TRY(functional(f, NULL, seed[b], &value[b]));
out:
    for (size_t e = 0; e < p.info.count; e++) imp__param_set(&p, e, m->old[e]);
    imp__theta_announce(f->check->problem->scene);
    const enum imp_status back = imp__poses_settle(f->check->problem->scene);
    return st == IMP_OK ? back : st;
}

#define PLACES 6

/* Combine values at n places with factors: sum factor F(place), batch by batch. `other`:
 * factors of lower order, or NULL. */
static enum imp_status combine(struct imp__fresh *f, const struct imp__motion *m, int n,
                               const double *place, const double *factor,
                               const double *other, struct imp__quotient *out)
{
    enum imp_status st = IMP_OK;
    double value[PLACES][IMP_CHECK_BATCHES];
    double sum = 0, square = 0, coarse = 0, largest = 0, factors = 0;
    uint64_t seed[IMP_CHECK_BATCHES];
    for (int b = 0; b < IMP_CHECK_BATCHES; b++) seed[b] = imp__fresh_seed(f);
    for (int i = 0; i < n; i++) {
        IMP_TRY(at(f, m, place[i], seed, value[i]));
        factors += fabs(factor[i]);
    }
    for (int b = 0; b < IMP_CHECK_BATCHES; b++) {
        double difference = 0;
        for (int i = 0; i < n; i++) {
            difference += factor[i] * value[i][b];
            if (other) coarse += other[i] * value[i][b] / IMP_CHECK_BATCHES;
            largest = fmax(largest, fabs(value[i][b]));
        }
        sum += difference;
        square += difference * difference;
    }
    out->mean = batches_mean(IMP_CHECK_BATCHES, sum, square);
    out->coarse = other ? coarse : out->mean.value;
    out->rounding = FLOAT_ROUNDING * largest * factors;
    st = imp__check_progress(f->check, (double)n * f->more);
out:
    return st;
}

/* Room of all moving values below and above, in units of their weights. */
static void room(const struct imp__motion *m, double *below, double *above)
{
    *below = *above = INFINITY;
    for (size_t e = 0; e < m->param->info.count; e++) {
        const double w = m->weight[e], down = m->old[e] - m->param->info.lo,
                     up = m->param->info.hi - m->old[e];
        if (w == 0) continue;
        *below = fmin(*below, (w > 0 ? down : up) / fabs(w));
        *above = fmin(*above, (w > 0 ? up : down) / fabs(w));
    }
}

enum imp_status imp__fresh_difference(struct imp__fresh *f, const struct imp__motion *m,
                                      bool linear, double *step,
                                      struct imp__quotient *out)
{
    double below, above, scale = m->scale;
    room(m, &below, &above);
    for (size_t e = 0; e < m->param->info.count; e++)
        if (m->weight[e] != 0 && m->scale == 0)
            scale = fmax(scale, imp__check_scale(m->param, e));
    const double least = 1e-3 * scale, part = linear ? STEP_LINEAR : STEP;
    const double both = fmin(fmin(below, above), scale);
    if (both > least) {
        const double h = *step = part * both;
        const double place[4] = {h, -h, h / 2, -h / 2};
        const double one[2] = {0.5 / h, -0.5 / h};
        const double two[4] = {-1 / (6 * h), 1 / (6 * h), 4 / (3 * h), -4 / (3 * h)};
        const double half[4] = {0, 0, 1 / h, -1 / h};
        return combine(f, m, linear ? 2 : 4, place, linear ? one : two,
                       linear ? NULL : half, out);
    }
    /* At a bound, D(h) = (-11 F(0) + 18 F(h) - 9 F(2h) + 2 F(3h)) / 6h towards the
     * farther bound, and the same with h/2. */
    const double side = above >= below ? 1 : -1;
    const double h = *step =
        side * 0.15 * part * fmin(fmax(below, above), fmax(scale, 1e-3));
    const double place[PLACES] = {0, h / 2, h, 3 * h / 2, 2 * h, 3 * h};
    const double half[PLACES] = {-11 / (3 * h), 6 / h, -3 / h, 2 / (3 * h), 0, 0};
    const double full[PLACES] = {-11 / (6 * h), 0, 3 / h, 0, -1.5 / h, 1 / (3 * h)};
    double factor[PLACES];
    for (int i = 0; i < PLACES; i++) factor[i] = (8 * half[i] - full[i]) / 7;
    return combine(f, m, PLACES, place, factor, half, out);
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Gradients against differences of pictures that share no random number with them: what a
 * frozen walk cannot see (wrong densities, missing terms) shows here as z. The pictures
 * of one difference share theirs, in batches whose spread is the standard error: walks
 * that do not feel the parameter then cancel (common random numbers,
 * docs/estimators.md 13 B).
 *
 * The functional is F = sum_pc s_pc I_pc with a smooth positive pattern s of mean
 * 1/pixels. F is linear in emission: one central difference with a large step. Elsewhere
 * two steps and Richardson's combination (4 D(h/2) - D(h))/3, whose error is O(h^4); at a
 * bound, one-sided differences D of third order, (8 D(h/2) - D(h))/7. What this changes
 * is an estimate of the error that is left: nothing smaller is held against the gradient,
 * and where it is large (a kink within the step) nothing is decided. */
#include "check.h"
#include "walk/picture.h"
#include <math.h>
#include <string.h>

#define Z_LIMIT        4
#define STEP           0.3 /* of the room a number has */
#define STEP_LINEAR    0.8
#define BATCHES        16   /* independent differences behind an SE */
#define FLOAT_ROUNDING 1e-7 /* of a picture's mean */
#define KINK           7 /* D(h) - D(h/2) over what it changes in their combination, at most */
#define RESOLVED       0.2 /* an SE larger than this part of the value decides nothing */

struct fresh {
    struct imp__check *check;
    float *pattern; /* [height][width][channels] */
    uint64_t next_seed;
    double *gradient, *gradient_se; /* [n] */
    int channels;
};

/* What pictures are made of: radiance, or its derivative along x_dot. */
struct sampled {
    struct imp_tracer tracer;
    const double *x_dot; /* NULL: radiance */
    bool *no_memory;
};

static bool sample(const void *payload, struct imp_arena *arena, int x, int y,
                   int64_t index, double *value, double *px, double *py)
{
    const struct sampled *s = payload;
    struct imp_walk walk;
    imp__walk_trace(&s->tracer, arena, x, y, index, &walk);
    const imp_spec v = s->x_dot ? imp__walk_tangent(&s->tracer, &walk, s->x_dot) : walk.L;
    for (int c = 0; c < s->tracer.scene->channels; c++) value[c] = v[c];
    *px = walk.px;
    *py = walk.py;
    if (walk.dropped == IMP_DROP_MEMORY)
        __atomic_store_n(s->no_memory, true, __ATOMIC_RELAXED);
    return walk.dropped == IMP_DROP_NONE;
}

static uint64_t seed_of(struct fresh *f)
{
    return imp__mix64(f->check->outer.seed ^
                      (0xf7e5u + ++f->next_seed * 0x9e3779b97f4a7c15u));
}

/* Samples of one batch. */
static int batch_spp(const struct fresh *f)
{
    const int spp =
        f->check->run.spp > 0 ? f->check->run.spp : f->check->tracer.sensor->spp;
    return imp_max((spp + BATCHES - 1) / BATCHES, 1);
}

/* F, or its derivative along x_dot, with the random numbers of `seed`. */
static enum imp_status functional(struct fresh *f, const double *x_dot, uint64_t seed,
                                  double *value)
{
    const struct imp_sensor *sensor = f->check->tracer.sensor;
    struct imp_run run = f->check->run;
    bool no_memory = false;
    struct sampled t = {f->check->tracer, x_dot, &no_memory};
    struct imp_picture picture = {
        sensor, "check", f->channels == 3 ? "R,G,B" : "Y", f->channels, sample, &t, NULL};
    imp_film *film = NULL;
    if (!x_dot) t.tracer.active = NULL;
    run.spp = batch_spp(f);
    run.seed = t.tracer.seed = seed;
    enum imp_status st = imp__picture_make(f->check->ctx, &picture, &run, &film);
    if (no_memory && st == IMP_E_PATHS)
        st = imp__error(f->check->ctx, IMP_E_NOMEM, "no memory to record a walk");
    if (st == IMP_OK) {
        *value = 0;
        for (size_t i = 0; i < imp__film_values(film); i++)
            *value += f->pattern[i] * film->mean[i];
    }
    imp_film_destroy(film);
    return st;
}

/* Mean of batches and its standard error, from sums over them. */
static struct imp_estimate batches_mean(double sum, double square)
{
    const double mean = sum / BATCHES;
    const double variance = fmax(square / BATCHES - mean * mean, 0) / (BATCHES - 1);
    return (struct imp_estimate){mean, sqrt(variance), 0};
}

/* The derivative of F along x_dot. */
static enum imp_status slope(struct fresh *f, const double *x_dot,
                             struct imp_estimate *out)
{
    enum imp_status st = IMP_OK;
    double sum = 0, square = 0;
    for (int b = 0; b < BATCHES; b++) {
        double value;
        IMP_TRY(functional(f, x_dot, seed_of(f), &value));
        sum += value;
        square += value * value;
    }
    *out = batches_mean(sum, square);
    st = imp__check_progress(f->check, 1);
out:
    return st;
}

/* ---- Differences --------------------------------------------------------------- */

/* A parameter moved by step * weight[e]. */
struct motion {
    const struct imp_param *param;
    const double *old, *weight; /* [count] */
};

static enum imp_status at(struct fresh *f, const struct motion *m, double step,
                          uint64_t seed, double *value)
{
    struct imp_param p = *m->param;
    for (size_t e = 0; e < p.info.count; e++)
        if (m->weight[e] != 0) imp__param_set(&p, e, m->old[e] + step * m->weight[e]);
    const enum imp_status st = functional(f, NULL, seed, value);
    for (size_t e = 0; e < p.info.count; e++) imp__param_set(&p, e, m->old[e]);
    return st;
}

struct quotient {
    struct imp_estimate mean;
    double truncation; /* how far a formula of lower order is from it */
    double rounding;   /* of the pictures' floats */
};

/* Combine values at places with factors: sum factor F(place), batch by batch. `other`:
 * factors of lower order, or NULL. */
static enum imp_status combine(struct fresh *f, const struct motion *m, int n,
                               const double *place, const double *factor,
                               const double *other, struct quotient *out)
{
    enum imp_status st = IMP_OK;
    double sum = 0, square = 0, coarse = 0, largest = 0, factors = 0;
    for (int i = 0; i < n; i++) factors += fabs(factor[i]);
    for (int b = 0; b < BATCHES; b++) {
        const uint64_t seed = seed_of(f);
        double difference = 0;
        for (int i = 0; i < n; i++) {
            double value;
            IMP_TRY(at(f, m, place[i], seed, &value));
            difference += factor[i] * value;
            if (other) coarse += other[i] * value / BATCHES;
            largest = fmax(largest, fabs(value));
        }
        sum += difference;
        square += difference * difference;
    }
    out->mean = batches_mean(sum, square);
    out->truncation = other ? fabs(coarse - out->mean.value) : 0;
    out->rounding = FLOAT_ROUNDING * largest * factors;
    st = imp__check_progress(f->check, n);
out:
    return st;
}

/* Room of all moving numbers below and above, in units of their weights. */
static void room(const struct motion *m, double *below, double *above)
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

static enum imp_status difference(struct fresh *f, const struct motion *m, bool linear,
                                  double *step, struct quotient *out)
{
    double below, above, scale = 0;
    room(m, &below, &above);
    for (size_t e = 0; e < m->param->info.count; e++)
        if (m->weight[e] != 0) scale = fmax(scale, imp__check_scale(m->param, e));
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
    /* At a bound, to the side where there is room: D(h) = (-11 F(0) + 18 F(h) - 9 F(2h) +
     * 2 F(3h)) / 6h, and h/2. */
    const double side = above >= below ? 1 : -1;
    const double h = *step =
        side * 0.15 * part * fmin(fmax(below, above), fmax(scale, 1e-3));
    const double place[6] = {0, h / 2, h, 3 * h / 2, 2 * h, 3 * h};
    const double half[6] = {-11 / (3 * h), 6 / h, -3 / h, 2 / (3 * h), 0, 0};
    const double full[6] = {-11 / (6 * h), 0, 3 / h, 0, -1.5 / h, 1 / (3 * h)};
    double factor[6];
    for (int i = 0; i < 6; i++) factor[i] = (8 * half[i] - full[i]) / 7;
    return combine(f, m, 6, place, factor, half, out);
}

static enum imp_status compare(struct fresh *f, const struct motion *m, int64_t element,
                               bool linear, struct imp_estimate mine)
{
    struct quotient q;
    struct imp_check_row row = {.limit = Z_LIMIT};
    const enum imp_status st = difference(f, m, linear, &row.step, &q);
    if (st != IMP_OK) return st;
    const struct imp_estimate fd = q.mean;
    row.value = mine.value;
    row.reference = fd.value;
    row.se = sqrt(mine.se * mine.se + fd.se * fd.se);
    const double off = fabs(mine.value - fd.value);
    /* Without any noise (a furnace) the difference is rounding of the pictures' floats.
     */
    const double rounding =
        1e-6 * fmax(fabs(mine.value), fabs(fd.value)) + q.rounding + q.truncation;
    row.error = !isfinite(off)    ? INFINITY
                : row.se > 0      ? fmax(off - rounding, 0) / row.se
                : off <= rounding ? 0
                                  : INFINITY;
    const double size = fmax(fabs(mine.value), fabs(fd.value));
    row.ok = !(row.error <= row.limit)                       ? 0
             : row.se <= RESOLVED * size || size <= rounding ? 1
                                                             : -1;
    if (!row.ok && KINK * q.truncation > RESOLVED * size) row.ok = -1;
    return imp__check_row(f->check, "fresh", m->param->info.name, element, &row);
}

/* Does F depend on this parameter through emission alone? */
static bool is_emission(const struct imp_scene *s, size_t param)
{
    bool emission = false, other = false;
    for (int i = 0; i < s->n_emitters; i++)
        for (int j = 0; j < s->emitters[i]->n_in; j++)
            if (s->emitters[i]->input[j]->param == (int)param &&
                !s->emitters[i]->input[j]->texture) {
                if (s->emitters[i]->ops->inputs[j].role == IMP_EMISSION) emission = true;
                else other = true;
            }
    for (int i = 0; i < s->n_bsdfs; i++)
        for (int j = 0; j < s->bsdfs[i]->n_own; j++)
            if (s->bsdfs[i]->input[j]->param == (int)param &&
                !s->bsdfs[i]->input[j]->texture) {
                if (s->bsdfs[i]->ops->inputs[j].role == IMP_EMISSION) emission = true;
                else other = true;
            }
    return emission && !other;
}

static enum imp_status check_param(struct fresh *f, size_t param)
{
    enum imp_status st = IMP_OK;
    const struct imp_problem *p = f->check->problem;
    const struct imp_param *q = &p->scene->params[param];
    const size_t count = q->info.count, base = (size_t)p->active.base[param];
    const bool linear = is_emission(p->scene, param);
    double *buffer = imp__alloc(f->check->ctx, 2 * count + p->n, sizeof *buffer);
    if (!buffer) return imp__error(f->check->ctx, IMP_E_NOMEM, "no memory for a check");
    double *old = buffer, *weight = buffer + count, *x_dot = buffer + 2 * count;
    for (size_t e = 0; e < count; e++) old[e] = imp__param_get(q, e);
    const struct motion m = {q, old, weight};
    for (size_t e = 0; count <= 3 && e < count; e++) {
        memset(weight, 0, count * sizeof *weight);
        weight[e] = 1;
        const struct imp_estimate g = {f->gradient[base + e], f->gradient_se[base + e],
                                       0};
        IMP_TRY(compare(f, &m, count > 1 ? (int64_t)e : -1, linear, g));
    }
    if (count > 3) { /* one direction through all of them */
        struct imp_estimate g;
        for (size_t e = 0; e < count; e++) { /* each to the side where it has more room:
                                                texels may be at both bounds */
            const double w = 0.5 + imp__u01(imp__key(9, 9, 9), (uint32_t)e);
            const bool down = old[e] - q->info.lo > q->info.hi - old[e];
            weight[e] = x_dot[base + e] = down ? -w : w;
        }
        IMP_TRY(slope(f, x_dot, &g));
        IMP_TRY(compare(f, &m, -1, linear, g));
    }
out:
    imp__release(f->check->ctx, buffer);
    return st;
}

enum imp_status imp__check_fresh(struct imp__check *c)
{
    enum imp_status st = IMP_OK;
    const struct imp_problem *p = c->problem;
    const struct imp_film_desc *film = &c->tracer.sensor->film;
    const size_t w = (size_t)film->crop_w, h = (size_t)film->crop_h;
    struct fresh f = {.check = c, .channels = p->scene->channels};
    const size_t C = (size_t)f.channels;

    f.pattern = imp__alloc(c->ctx, w * h * C, sizeof *f.pattern);
    f.gradient = imp__alloc(c->ctx, 2 * p->n, sizeof *f.gradient);
    if (!f.pattern || !f.gradient)
        IMP_TRY(imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check"));
    f.gradient_se = f.gradient + p->n;
    for (size_t i = 0; i < w * h * C; i++) {
        const double x = (double)(i / C % w) / (double)w,
                     y = (double)(i / C / w) / (double)h;
        f.pattern[i] =
            (float)((1 + 0.5 * cos(5 * x + 3 * y + (double)(i % C))) / (double)(w * h));
    }
    c->done = 0;
    c->total = 1;
    for (size_t k = 0; k < p->scene->n_params; k++)
        if (p->active.base[k] >= 0)
            c->total += 4 * (double)imp_min(p->scene->params[k].info.count, (size_t)3);
    struct imp_run run = c->run;
    run.seed = seed_of(&f);
    IMP_TRY(imp_problem_reverse(c->problem, f.pattern, &run, f.gradient, f.gradient_se));
    IMP_TRY(imp__check_progress(c, 1));
    for (size_t k = 0; k < p->scene->n_params; k++)
        if (p->active.base[k] >= 0) IMP_TRY(check_param(&f, k));
out:
    imp__release(c->ctx, f.pattern);
    imp__release(c->ctx, f.gradient);
    return st;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Adam for many variables: moments, steps, windows and the average, in floats. */
#include "adam_many.h"
#include <math.h>
#include <string.h>

/* Numbers of a variable, in units of its scale: MEAN_G and ROOT_V the moments of the gradient, v
 * as its root, since squares leave the range of floats; NET the motion in this window,
 * SUM_NET the sum of NET over its steps. Not in these units: AVERAGE of the iterates, and
 * START. */
enum { MEAN_G, ROOT_V, NET, SUM_NET, AVERAGE, START, ARRAYS };
enum {
    COUNT,
    LARGEST,
    LOSS,
    LOSS_VAR,
    OLD_LOSS,
    OLD_VAR,
    AGE,                           /* steps in the moments */
    PACE,                          /* windows that wandered */
    WAY,                           /* sum over variables and steps of |step| */
    UNIT,                          /* of the moments, a power of two; 0: not known yet */
    AVERAGED = IMP_SEARCH_AVERAGED /* 0: the search has not wandered yet */
};

typedef float __attribute__((may_alias)) packed; /* stored in arrays of doubles */

static packed *floats(const struct imp__search *s, int k)
{
    return (packed *)s->array[k];
}

static double scale_of(const struct imp__search *s, const struct imp__span *a, size_t k)
{
    return a->by_start ? fmax(a->scale, fabsf(floats(s, START)[k])) : a->scale;
}

double imp__adam_many_start(const struct imp__search *s, size_t k)
{
    return floats(s, START)[k];
}
double imp__adam_many_answer(const struct imp__search *s, size_t k)
{
    return s->scalar[AVERAGED] > 0 ? floats(s, AVERAGE)[k] : s->x[k];
}

void imp__adam_many_settle(struct imp__search *s)
{
    for (size_t k = 0; k < s->n; k++) s->x[k] = imp__adam_many_answer(s, k);
    s->scalar[AVERAGED] = 0;
    for (int k = 0; k < START; k++) {
        imp__release(s->ctx, s->array[k]);
        s->array[k] = NULL;
        s->array_n[k] = s->array_cap[k] = 0;
    }
}

static void window_begin(struct imp__search *s)
{
    memset(floats(s, NET), 0, s->n * sizeof(float));
    memset(floats(s, SUM_NET), 0, s->n * sizeof(float));
    s->scalar[COUNT] = s->scalar[LARGEST] = s->scalar[WAY] = 0;
    s->scalar[LOSS] = s->scalar[LOSS_VAR] = 0;
}

enum imp_status imp__adam_many_init(struct imp__search *s)
{
    enum imp_status st = IMP_OK;
    for (int k = 0; k < ARRAYS; k++) IMP_TRY(imp__search_exact(s, k, (s->n + 1) / 2));
    for (size_t k = 0; k < s->n; k++) floats(s, START)[k] = (float)s->x[k];
    s->scalar[OLD_LOSS] = INFINITY;
    window_begin(s);
out:
    return st;
}

/* A power of two near the largest derivative. */
static double unit_of(const struct imp__goal *goal, const struct imp__search *s,
                      const double *g)
{
    double largest = 0;
    int exponent;
    for (size_t i = 0, k = 0; i < goal->n_spans; i++)
        for (; k < goal->spans[i].end; k++)
            largest = fmax(largest, fabs(g[k]) * scale_of(s, &goal->spans[i], k));
    if (!(largest > 0) || !isfinite(largest)) return 0;
    frexp(largest, &exponent);
    return ldexp(1, imp_clamp(exponent, -1000, 1000));
}

/* Moments from the gradient; returns the mean of v. */
static double moments(const struct imp__goal *goal,
                      const struct imp__opt_options *options, struct imp__search *s,
                      const double *g)
{
    packed *m = floats(s, MEAN_G), *r = floats(s, ROOT_V);
    double mean_v = 0;
    for (size_t i = 0, k = 0; i < goal->n_spans; i++) {
        const struct imp__span *a = &goal->spans[i];
        const double b1 = imp__adam_momentum(options, options->quiet && a->settles);
        for (; k < a->end; k++) {
            const double d = g[k] * (scale_of(s, a, k) / s->scalar[UNIT]);
            const double v =
                IMP_ADAM_BETA2 * ((double)r[k] * r[k]) + (1 - IMP_ADAM_BETA2) * d * d;
            m[k] = (float)(b1 * m[k] + (1 - b1) * d);
            r[k] = (float)sqrt(v);
            mean_v += v / (double)s->n;
        }
    }
    return mean_v;
}

/* ---- Steps ------------------------------------------------------------------------- */

/* The largest r of a smooth span, which all its numbers have; 0: of another one. */
static double joint_root(const struct imp__span *a, const packed *r, size_t first)
{
    packed most = 0;
    for (size_t k = first; a->smooth && k < a->end; k++) most = imp_max(r[k], most);
    return most;
}

/* The step wanted, in scales of each variable, to d. */
static void steps_want(const struct imp__goal *goal,
                       const struct imp__opt_options *options, struct imp__search *s,
                       double mean_v, double *d)
{
    const packed *m = floats(s, MEAN_G), *r = floats(s, ROOT_V);
    const double age = s->scalar[AGE], c2 = 1 - pow(IMP_ADAM_BETA2, age);
    const double all =
        options->learning_rate * pow(1 + s->scalar[PACE], -IMP_ADAM_COOLING);
    /* Relative to the mean of v, whatever the objective's unit: variables that never had
     * a gradient stay at rest. */
    const double tiny = 1e-8 * sqrt(mean_v / c2) + 1e-300;
    for (size_t i = 0, k = 0; i < goal->n_spans; i++) {
        const struct imp__span *a = &goal->spans[i];
        const bool settles = options->quiet && a->settles;
        const double rate = all * imp__adam_fall(s->iteration, settles);
        const double c1 = 1 - pow(imp__adam_momentum(options, settles), age);
        const double joint = joint_root(a, r, k);
        for (; k < a->end; k++)
            d[k] = rate * (m[k] / c1) / ((a->smooth ? joint : r[k]) / sqrt(c2) + tiny);
    }
    if (goal->smooth) goal->smooth(d, true, goal->payload);
}

/* The steps d against the gradient, which become those taken. */
static void steps_take(const struct imp__goal *goal, struct imp__search *s, double *d)
{
    for (size_t i = 0, k = 0; i < goal->n_spans; i++) {
        const struct imp__span *a = &goal->spans[i];
        for (; k < a->end; k++) {
            const double old = s->x[k], scale = scale_of(s, a, k);
            s->x[k] = imp_clamp(old - scale * d[k], a->lo, a->hi);
            d[k] = (s->x[k] - old) / scale;
        }
    }
}

/* Steps d that were taken are halved while the objective cannot be evaluated there, and taken back at
 * last. */
static void steps_back(const struct imp__goal *goal, struct imp__search *s, double *d)
{
    for (int h = 0; goal->possible && h <= IMP_ADAM_HALVES; h++) {
        if (goal->possible(s->x, goal->payload)) return;
        const double back = h < IMP_ADAM_HALVES ? 0.5 : 1;
        for (size_t i = 0, k = 0; i < goal->n_spans; i++) {
            const struct imp__span *a = &goal->spans[i];
            for (; k < a->end; k++) {
                s->x[k] -= back * scale_of(s, a, k) * d[k];
                d[k] *= 1 - back;
            }
        }
    }
}

/* g is destroyed. */
static void step(const struct imp__goal *goal, const struct imp__opt_options *options,
                 struct imp__search *s, double *g)
{
    packed *m = floats(s, MEAN_G), *net = floats(s, NET), *sum = floats(s, SUM_NET);
    if (goal->smooth) goal->smooth(g, false, goal->payload);
    if (s->scalar[UNIT] == 0) s->scalar[UNIT] = unit_of(goal, s, g);
    s->scalar[COUNT]++;
    if (s->scalar[UNIT] == 0) return; /* nothing has a derivative yet */
    s->scalar[AGE]++;
    steps_want(goal, options, s, moments(goal, options, s, g), g);
    steps_take(goal, s, g);
    steps_back(goal, s, g);
    for (size_t i = 0, k = 0; i < goal->n_spans; i++) {
        const struct imp__span *a = &goal->spans[i];
        for (; k < a->end; k++) {
            s->scalar[LARGEST] = fmax(s->scalar[LARGEST], fabs(g[k]));
            s->scalar[WAY] += fabs(g[k]);
            net[k] = (float)(net[k] + g[k]);
            sum[k] += net[k];
            /* Momentum into a bound would delay leaving it. */
            if ((s->x[k] <= a->lo && m[k] > 0) || (s->x[k] >= a->hi && m[k] < 0))
                m[k] = 0;
        }
    }
}

/* To the window's mean. */
static void to_mean(const struct imp__goal *goal, struct imp__search *s)
{
    for (size_t i = 0, k = 0; i < goal->n_spans; i++) {
        const struct imp__span *a = &goal->spans[i];
        for (; k < a->end; k++) {
            const double back =
                floats(s, SUM_NET)[k] / (IMP_ADAM_WINDOW + 1.) - floats(s, NET)[k];
            s->x[k] = imp_clamp(s->x[k] + scale_of(s, a, k) * back, a->lo, a->hi);
        }
    }
}

/* Slower, from the window's mean: many variables have no average in many dimensions to go
 * by, so the rate is halved. work [n]. */
static void cool(const struct imp__goal *goal, struct imp__search *s, double *work)
{
    s->scalar[PACE] = pow(2, 1 / IMP_ADAM_COOLING) * (1 + s->scalar[PACE]) - 1;
    memcpy(work, s->x, s->n * sizeof *work);
    to_mean(goal, s);
    if (goal->possible && !goal->possible(s->x, goal->payload))
        memcpy(s->x, work, s->n * sizeof *work);
}

static void window_end(const struct imp__goal *goal,
                       const struct imp__opt_options *options, struct imp__search *s,
                       double *work)
{
    double net = 0;
    for (size_t k = 0; k < s->n; k++) net += fabsf(floats(s, NET)[k]);
    const double loss = s->scalar[LOSS] / IMP_ADAM_WINDOW;
    const double var = s->scalar[LOSS_VAR] / (IMP_ADAM_WINDOW * IMP_ADAM_WINDOW);
    const double fall = s->scalar[OLD_LOSS] - loss, se = sqrt(var + s->scalar[OLD_VAR]);
    const bool fell = fall > IMP_ADAM_FELL * se;
    const bool wandered = net <= IMP_ADAM_STALLED * s->scalar[WAY];

    if (s->scalar[LARGEST] < options->tolerance) imp__search_finish(s, IMP_FINISH_STEPS);
    if (wandered && !fell) cool(goal, s, work);
    if (fall > IMP_ADAM_FAR * se) s->scalar[AVERAGED] = 0;
    if (wandered && !fell && s->scalar[AVERAGED] == 0) {
        for (size_t k = 0; k < s->n; k++) floats(s, AVERAGE)[k] = (float)s->x[k];
        s->scalar[AVERAGED] = 1;
    }
    s->scalar[OLD_LOSS] = loss;
    s->scalar[OLD_VAR] = var;
    window_begin(s);
}

/* Once the search wanders, the average of the iterates with weights 1, 2, 3, ...; it begins anew where
 * it cannot be evaluated. work [n]. */
static void average(const struct imp__goal *goal, struct imp__search *s, double *work)
{
    packed *mean = floats(s, AVERAGE);
    const double n = s->scalar[AVERAGED];
    if (n == 0) return;
    s->scalar[AVERAGED]++;
    for (size_t k = 0; k < s->n; k++)
        mean[k] = (float)(mean[k] + (s->x[k] - mean[k]) * 2 / (n + 1));
    if (!goal->possible) return;
    for (size_t k = 0; k < s->n; k++) work[k] = mean[k];
    if (!goal->possible(work, goal->payload)) s->scalar[AVERAGED] = 0;
}

/* ---- The noise of a step ---------------------------------------------------------- */

/* The step of variable k is m/sqrt(v), so that noise of the gradient counts by 1/v, where v is
 * at least a part of the mean of its parameter. */
struct noise {
    const struct imp__goal *goal;
    const struct imp__search *s;
    double *least; /* [n_spans] */
};

static double noise_weight(size_t k, const void *payload)
{
    const struct noise *a = payload;
    const struct imp__goal *goal = a->goal;
    size_t i = 0, end = goal->n_spans - 1;
    while (i < end) {
        const size_t middle = (i + end) / 2;
        if (k < goal->spans[middle].end) end = middle;
        else i = middle + 1;
    }
    const double r = floats(a->s, ROOT_V)[k], scale = scale_of(a->s, &goal->spans[i], k);
    const double v = fmax(r * r, a->least[i]);
    return v > 0 ? scale * scale / v : 0;
}

static void noise_begin(struct noise *a)
{
    const packed *r = floats(a->s, ROOT_V);
    for (size_t i = 0, k = 0; i < a->goal->n_spans; i++) {
        const size_t first = k;
        double sum = 0;
        for (; k < a->goal->spans[i].end; k++) sum += (double)r[k] * r[k];
        a->least[i] = k > first ? IMP_ADAM_LEAST * sum / (double)(k - first) : 0;
    }
}

enum imp_status imp__adam_many_run(const struct imp__goal *goal,
                                   const struct imp__opt_options *options,
                                   struct imp__search *s)
{
    enum imp_status st = IMP_OK;
    double *g = imp__alloc_raw(goal->ctx, goal->n, sizeof *g);
    struct noise noise = {goal, s, imp__alloc(goal->ctx, goal->n_spans, sizeof(double))};
    const struct imp__metric metric = {.weight = noise_weight, .payload = &noise};
    if (!g || !noise.least)
        IMP_TRY(imp__error(goal->ctx, IMP_E_NOMEM, "no memory for a gradient"));
    while (!s->finished && s->iteration < options->max_iterations) {
        struct imp_estimate f;
        if (goal->measure && s->scalar[AGE] >= IMP_ADAM_KNOWN) {
            noise_begin(&noise);
            goal->measure(&metric, goal->payload);
        }
        IMP_TRY(goal->eval(s->x, imp__search_seed(goal, s->iteration, 0), &f, g, NULL,
                           goal->payload));
        IMP_TRY(imp__search_log(s, f, s->x));
        s->scalar[LOSS] += f.value;
        s->scalar[LOSS_VAR] += f.se * f.se;
        step(goal, options, s, g);
        if (s->scalar[COUNT] == IMP_ADAM_WINDOW) window_end(goal, options, s, g);
        average(goal, s, g);
        IMP_TRY(imp__search_iterated(goal, s));
    }
out:
    imp__release(goal->ctx, g);
    imp__release(goal->ctx, noise.least);
    return st;
}

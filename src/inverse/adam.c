/* SPDX-License-Identifier: Apache-2.0
 *
 * Adam (Kingma and Ba 2015) with bounds, for objectives that are only known with noise:
 * fresh random numbers every iteration, steps in units of each variable's scale,
 * projection on the bounds. The learning rate is halved when a window of iterations
 * brought neither a significantly lower loss nor a net motion: then the steps are noise
 * (or oscillation), and the search goes on from the window's average, whose noise is
 * smaller (Polyak and Juditsky 1992). */
#include "optimize.h"
#include <math.h>

#define BETA1  0.9
#define BETA2  0.99
#define WINDOW 20
#define STALLED                                                                          \
    0.5 /* net motion / length of the way, below which a window only wandered */

enum { FIRST, SECOND, HERE, ORIGIN, SUM }; /* arrays, [n] each */
enum {
    RATE,
    COUNT,
    WAY,
    LARGEST,
    LOSS,
    LOSS_VAR,
    OLD_LOSS,
    OLD_VAR,
    WANDERS
}; /* scalars */

static void window_begin(struct imp__search *s)
{
    for (size_t k = 0; k < s->n; k++) {
        s->array[ORIGIN][k] = s->array[HERE][k];
        s->array[SUM][k] = s->array[HERE][k];
    }
    s->scalar[COUNT] = s->scalar[WAY] = s->scalar[LARGEST] = 0;
    s->scalar[LOSS] = s->scalar[LOSS_VAR] = 0;
}

static enum imp_status init(const struct imp__goal *goal,
                            const struct imp__opt_options *options, struct imp__search *s)
{
    enum imp_status st = IMP_OK;
    for (int k = 0; k < IMP_SEARCH_ARRAYS; k++) IMP_TRY(imp__search_array(s, k, goal->n));
    for (size_t k = 0; k < goal->n; k++) s->array[HERE][k] = s->x[k];
    s->scalar[RATE] = options->learning_rate;
    s->scalar[OLD_LOSS] = INFINITY;
    window_begin(s);
out:
    return st;
}

/* One step from HERE with gradient g. */
static void step(const struct imp__goal *goal, struct imp__search *s, const double *g)
{
    double *m = s->array[FIRST], *v = s->array[SECOND], *x = s->array[HERE];
    const double c1 = 1 - pow(BETA1, s->iteration + 1),
                 c2 = 1 - pow(BETA2, s->iteration + 1);
    double mean_v = 0;
    for (size_t k = 0; k < s->n; k++) {
        const double gk = g[k] * goal->scale[k];
        m[k] = BETA1 * m[k] + (1 - BETA1) * gk;
        v[k] = BETA2 * v[k] + (1 - BETA2) * gk * gk;
        mean_v += v[k] / (double)s->n;
    }
    /* Keeps what was never seen at rest, whatever the objective's unit. */
    const double tiny = 1e-8 * sqrt(mean_v / c2) + 1e-300;
    for (size_t k = 0; k < s->n; k++) {
        const double move = s->scalar[RATE] * (m[k] / c1) / (sqrt(v[k] / c2) + tiny);
        const double old = x[k];
        x[k] = imp__into_bounds(goal, k, old - goal->scale[k] * move);
        const int wall = imp__at_bound(goal, x, k);
        if ((wall < 0 && m[k] > 0) || (wall > 0 && m[k] < 0))
            m[k] = 0; /* free to leave */
        const double moved = fabs(x[k] - old) / goal->scale[k];
        s->scalar[WAY] += moved;
        s->scalar[LARGEST] = fmax(s->scalar[LARGEST], moved);
        s->array[SUM][k] += x[k];
    }
    s->scalar[COUNT]++;
}

static void window_end(const struct imp__goal *goal,
                       const struct imp__opt_options *options, struct imp__search *s)
{
    double net = 0;
    for (size_t k = 0; k < s->n; k++)
        net += fabs(s->array[HERE][k] - s->array[ORIGIN][k]) / goal->scale[k];
    const double loss = s->scalar[LOSS] / WINDOW;
    const double var = s->scalar[LOSS_VAR] / (WINDOW * WINDOW);
    const bool fell = s->scalar[OLD_LOSS] - loss > 2 * sqrt(var + s->scalar[OLD_VAR]);
    const bool wandered = net <= STALLED * s->scalar[WAY];

    if (s->scalar[LARGEST] < options->tolerance) {
        s->finished = true;
        s->reason = "steps stay below the tolerance";
    }
    s->scalar[WANDERS] = wandered && !fell;
    if (s->scalar[WANDERS]) {
        s->scalar[RATE] /= 2;
        for (size_t k = 0; k < s->n; k++)
            s->array[HERE][k] =
                imp__into_bounds(goal, k, s->array[SUM][k] / (WINDOW + 1));
    }
    s->scalar[OLD_LOSS] = loss;
    s->scalar[OLD_VAR] = var;
    window_begin(s);
}

static enum imp_status run(const struct imp__goal *goal,
                           const struct imp__opt_options *options, struct imp__search *s)
{
    enum imp_status st = IMP_OK;
    double *g = imp__alloc(goal->ctx, imp_max(goal->n, (size_t)1), sizeof *g);
    if (!g) IMP_TRY(imp__error(goal->ctx, IMP_E_NOMEM, "no memory for a gradient"));

    while (!s->finished && s->iteration < options->max_iterations) {
        struct imp_estimate f;
        IMP_TRY(goal->eval(s->array[HERE], imp__search_seed(goal, s->iteration, 0), &f, g,
                           NULL, goal->payload));
        IMP_TRY(imp__search_log(s, f));
        s->scalar[LOSS] += f.value;
        s->scalar[LOSS_VAR] += f.se * f.se;
        step(goal, s, g);
        if (s->scalar[COUNT] == WINDOW) window_end(goal, options, s);
        const double n = s->scalar[COUNT] + 1;
        for (size_t k = 0; k < s->n; k++)
            s->x[k] = s->scalar[WANDERS] ? imp__into_bounds(goal, k, s->array[SUM][k] / n)
                                         : s->array[HERE][k];
        IMP_TRY(imp__search_iterated(goal, s));
    }
out:
    imp__release(goal->ctx, g);
    return st;
}

const struct imp__opt_kind imp__opt_adam = {init, run};

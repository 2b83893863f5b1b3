/* SPDX-License-Identifier: Apache-2.0
 *
 * NLopt's gradient methods under common random numbers: with one seed the objective is a
 * fixed function of x, up to the jumps where a walk's decisions change. Where the goal
 * draws walks for several evaluations, the function is that of one draw; when the best x
 * has moved too far for it, the method begins anew there, with a new draw.
 *
 * NLopt cannot be stopped and continued. Its evaluations are kept instead: a continued
 * search starts again at the first x of the draw and is given the recorded answers, which
 * brings the method into the state it had, to the last bit. */
#include "optimize.h"
#include <math.h>
#include <nlopt.h>

#define RECORD_MAX 200000 /* most variables whose evaluations are kept */
#define SLSQP_MAX  1000   /* it is O(n^3) per step */
#define FIRST_STEP 0.1

/* Arrays: rows of (f, se, g[n]); where the last draw was made, empty: the start. */
enum { RECORD, BASE };
/* Scalars: the lowest objective, iterations before the last draw, and whether the best x
 * needs a new one. */
enum { BEST, BEFORE, STALE };

struct call {
    const struct imp__goal *goal;
    struct imp__search *s;
    nlopt_opt opt;
    double *x;          /* [n] in the goal's units */
    double *g;          /* [n] */
    double unit;        /* of the objective: the first steps are FIRST_STEP scales long */
    size_t calls;       /* so far, replayed ones included */
    enum imp_status st; /* why the goal stopped the search */
};

static enum imp_status init(const struct imp__goal *goal,
                            const struct imp__opt_options *options, struct imp__search *s)
{
    (void)options;
    if (s->kind == IMP_SLSQP && goal->n > SLSQP_MAX)
        return imp__error(
            goal->ctx, IMP_E_ARG,
            "SLSQP is for at most %d variables, here are %zu: use Adam, MMA or "
            "L-BFGS",
            SLSQP_MAX, goal->n);
    s->scalar[BEST] = INFINITY;
    return IMP_OK;
}

static enum imp_status evaluate(struct call *c, struct imp_estimate *f)
{
    enum imp_status st = IMP_OK;
    const struct imp__goal *goal = c->goal;
    struct imp__search *s = c->s;
    const size_t row = goal->n + 2, at = s->array_n[RECORD];

    IMP_TRY(goal->eval(c->x, imp__search_seed(goal, 0, 0), f, c->g, NULL, goal->payload));
    if (goal->n <= RECORD_MAX) {
        IMP_TRY(imp__search_array(s, RECORD, at + row));
        s->array[RECORD][at] = f->value;
        s->array[RECORD][at + 1] = f->se;
        for (size_t k = 0; k < goal->n; k++) s->array[RECORD][at + 2 + k] = c->g[k];
    }
    IMP_TRY(imp__search_log(s, *f, c->x));
    if (f->value < s->scalar[BEST]) {
        s->scalar[BEST] = f->value;
        for (size_t k = 0; k < goal->n; k++) s->x[k] = c->x[k];
        s->scalar[STALE] = goal->is_stale && goal->is_stale(goal->payload);
    }
    st = imp__search_iterated(goal, s);
out:
    return st;
}

static double objective(unsigned n, const double *y, double *gradient, void *payload)
{
    struct call *c = payload;
    const struct imp__goal *goal = c->goal;
    const struct imp__search *s = c->s;
    const size_t row = (size_t)n + 2, at = c->calls * row;
    struct imp_estimate f;

    /* After a forced stop some methods still finish a line search. */
    if (c->st != IMP_OK || s->scalar[STALE] != 0) return HUGE_VAL;
    if (at + row <= s->array_n[RECORD]) { /* replayed */
        f = (struct imp_estimate){.value = s->array[RECORD][at],
                                  .se = s->array[RECORD][at + 1]};
        for (size_t k = 0; k < n; k++) c->g[k] = s->array[RECORD][at + 2 + k];
    } else {
        for (size_t k = 0; k < n; k++)
            c->x[k] = imp__into_bounds(goal, k, y[k] * goal->scale[k]);
        c->st = evaluate(c, &f);
        if (c->st != IMP_OK || s->scalar[STALE] != 0) nlopt_force_stop(c->opt);
        if (c->st != IMP_OK) return HUGE_VAL;
    }
    /* The methods begin with a step of the length of the gradient. */
    if (c->calls++ == 0) {
        double square = 0;
        for (size_t k = 0; k < n; k++)
            square += c->g[k] * goal->scale[k] * c->g[k] * goal->scale[k];
        c->unit = square > 0 && isfinite(square) ? FIRST_STEP / sqrt(square) : 1;
    }
    for (size_t k = 0; gradient && k < n; k++)
        gradient[k] = c->unit * c->g[k] * goal->scale[k];
    return c->unit * f.value;
}

static nlopt_algorithm algorithm(enum imp_optimizer kind)
{
    return kind == IMP_MMA     ? NLOPT_LD_MMA
           : kind == IMP_SLSQP ? NLOPT_LD_SLSQP
                               : NLOPT_LD_LBFGS;
}

/* The method from the last draw on. */
static enum imp_status run_draw(const struct imp__goal *goal,
                                const struct imp__opt_options *options,
                                struct imp__search *s, double *work)
{
    enum imp_status st = IMP_OK;
    const size_t n = goal->n;
    struct call c = {.goal = goal, .s = s, .x = work, .g = work + n};
    double *y = work + 2 * n, *lo = work + 3 * n, *hi = work + 4 * n;
    const double *base = s->array_n[BASE] ? s->array[BASE] : s->start;
    double value;

    c.opt = nlopt_create(algorithm(s->kind), (unsigned)n);
    if (!c.opt || n > 0x7fffffff)
        IMP_TRY(imp__error(goal->ctx, IMP_E_NOMEM, "no memory for %zu variables", n));
    const bool replay = s->array_n[RECORD] > 0 || s->iteration == (int)s->scalar[BEFORE];
    for (size_t k = 0; k < n; k++) {
        c.x[k] = (replay ? base : s->x)[k];
        y[k] = c.x[k] / goal->scale[k];
        lo[k] = goal->lo[k] / goal->scale[k];
        hi[k] = goal->hi[k] / goal->scale[k];
        y[k] = imp_clamp(y[k], lo[k], hi[k]);
    }
    if (goal->draw) IMP_TRY(goal->draw(c.x, imp__search_seed(goal, 0, 0), goal->payload));
    const int done = replay ? (int)s->scalar[BEFORE] : s->iteration;
    if (nlopt_set_min_objective(c.opt, objective, &c) < 0 ||
        nlopt_set_lower_bounds(c.opt, lo) < 0 || nlopt_set_upper_bounds(c.opt, hi) < 0 ||
        nlopt_set_xtol_abs1(c.opt, options->tolerance) < 0 ||
        nlopt_set_maxeval(c.opt, imp_max(options->max_iterations - done, 1)) < 0)
        IMP_TRY(imp__error(goal->ctx, IMP_E_NUMERIC, "NLopt refuses the problem"));
    const nlopt_result r = nlopt_optimize(c.opt, y, &value);
    if (c.st != IMP_OK) IMP_TRY(c.st);
    if (r == NLOPT_OUT_OF_MEMORY)
        IMP_TRY(
            imp__error(goal->ctx, IMP_E_NOMEM, "NLopt: no memory for %zu variables", n));
    if (r == NLOPT_INVALID_ARGS)
        IMP_TRY(imp__error(goal->ctx, IMP_E_NUMERIC, "NLopt refuses the problem"));
    if (r == NLOPT_MAXEVAL_REACHED || s->scalar[STALE] != 0) goto out;
    imp__search_finish(s, r == NLOPT_XTOL_REACHED || r == NLOPT_SUCCESS ||
                                  r == NLOPT_FTOL_REACHED
                              ? IMP_FINISH_STEPS
                              : IMP_FINISH_LOWEST);
out:
    if (c.opt) nlopt_destroy(c.opt);
    return st;
}

static enum imp_status run(const struct imp__goal *goal,
                           const struct imp__opt_options *options, struct imp__search *s)
{
    enum imp_status st = IMP_OK;
    double *work = imp__alloc(goal->ctx, 5 * goal->n + 1, sizeof *work);
    if (!work)
        return imp__error(goal->ctx, IMP_E_NOMEM, "no memory for %zu variables", goal->n);
    for (;;) {
        if (s->scalar[STALE] == 0) IMP_TRY(run_draw(goal, options, s, work));
        if (s->scalar[STALE] == 0 || s->iteration >= options->max_iterations) break;
        IMP_TRY(imp__search_array(s, BASE, goal->n));
        for (size_t k = 0; k < goal->n; k++) s->array[BASE][k] = s->x[k];
        s->array_n[RECORD] = 0;
        s->scalar[BEFORE] = s->iteration;
        s->scalar[BEST] = INFINITY; /* a new draw is a new function */
        s->scalar[STALE] = 0;
    }
out:
    imp__release(goal->ctx, work);
    return st;
}

const struct imp__opt_kind imp__opt_nlopt = {init, run, NULL};

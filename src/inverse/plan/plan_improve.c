/* SPDX-License-Identifier: Apache-2.0
 *
 * A camera's place improved along the derivative of the gain: on the sphere around what it looks at,
 * by central differences along two tangents e_1, e_2 of length h (radians),
 *
 *     dgain/de_i ~ (gain(+h e_i) - gain(-h e_i))/(2 h)
 *
 * whose errors are those of the gains. The place moves by 2 h uphill; where that has not raised the
 * gain it goes back, and h is halved. The search ends where the derivative is within two of its
 * errors. The gain of the answer is of random numbers of its own, since the best of several noisy
 * gains is too large. */
#include "base/arguments.h"
#include "math/rng.h"
#include "math/vec.h"
#include "planning.h"
#include "walk/run/run.h"
#include <string.h>

#define STEP     0.1 /* radians */
#define LEAST    0.01
#define AROUND   5 /* the place, and four around it */
#define MAX_MOVE 200

struct improve {
    struct imp_problem *p;
    struct imp_plan_options options;
    struct imp_run run;
    struct imp_plan_candidate *c; /* [n_have + AROUND] */
    size_t n_have;
    imp_v3 target;
    double radius;
};

static void place(const struct improve *m, size_t k, imp_v3 direction)
{
    struct imp_plan_candidate *c = &m->c[m->n_have + k];
    const imp_v3 o = m->target + imp__normalize(direction) * m->radius;
    for (int i = 0; i < 3; i++) c->origin[i] = o[i];
}

/* gains of the first `count` places, with the random numbers of round r. */
static enum imp_status gains(const struct improve *m, size_t count, int r,
                             struct imp_estimate *out)
{
    const struct imp_plan_result *result;
    struct imp_run run = m->run;
    run.seed = imp__mix64(m->run.seed ^ imp__mix64(0x17e0 + (uint64_t)r));
    IMP_CHECKED(imp_plan(m->p, m->c, m->n_have + count, &m->options, &run, &result));
    for (size_t i = 0; i < result->n_rows; i++)
        out[result->rows[i].candidate - m->n_have] = result->rows[i].gain;
    return IMP_OK;
}

/* Two tangents of the sphere at a direction. */
static void tangents(imp_v3 d, imp_v3 e[2])
{
    const imp_v3 a = fabs(d[0]) < 0.6 ? imp__v3(1, 0, 0) : imp__v3(0, 1, 0);
    e[0] = imp__normalize(imp__cross(a, d));
    e[1] = imp__cross(d, e[0]);
}

static enum imp_status climb(const struct improve *m, int rounds, imp_v3 *direction)
{
    imp_v3 at = *direction, best = at, e[2];
    double h = STEP, best_gain = -INFINITY;
    for (int r = 0; r < rounds && h >= LEAST; r++) {
        struct imp_estimate g[AROUND];
        tangents(at, e);
        place(m, 0, at);
        for (size_t i = 0; i < 2; i++) {
            place(m, 1 + 2 * i, at + e[i] * h);
            place(m, 2 + 2 * i, at - e[i] * h);
        }
        IMP_CHECKED(gains(m, AROUND, r, g));
        if (g[0].value <= best_gain) { /* the step was too long */
            at = best;
            h *= 0.5;
            continue;
        }
        best = at;
        best_gain = g[0].value;
        double slope[2], square = 0, variance = 0;
        for (size_t i = 0; i < 2; i++) {
            slope[i] = (g[1 + 2 * i].value - g[2 + 2 * i].value) / (2 * h);
            square += slope[i] * slope[i];
            variance +=
                (imp__sqr(g[1 + 2 * i].se) + imp__sqr(g[2 + 2 * i].se)) / (4 * h * h);
        }
        if (square <= 4 * variance) break;
        const double by = 2 * h / sqrt(square);
        at = imp__normalize(at + e[0] * (by * slope[0]) + e[1] * (by * slope[1]));
    }
    *direction = best;
    return IMP_OK;
}

enum imp_status imp_plan_improve(imp_problem *problem,
                                 const struct imp_plan_candidate *candidates, size_t n,
                                 const struct imp_plan_options *options,
                                 const struct imp_run *run, int rounds, double origin[3],
                                 struct imp_estimate *gain)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, problem, "problem");
    imp_context *ctx = problem->ctx;
    struct improve m = {.p = problem};
    struct imp_plan_candidate one = IMP_PLAN_CANDIDATE_INIT;
    IMP_REQUIRE(ctx, candidates, "candidates");
    IMP_REQUIRE(ctx, origin, "origin");
    IMP_REQUIRE(ctx, gain, "gain");
    IMP_RUN(ctx, m.run, run);
    IMP_CHECKED(imp__problem_no_parts(problem, "a search for a place"));
    m.options = (struct imp_plan_options)IMP_PLAN_OPTIONS_INIT;
    IMP_OPTIONS(ctx, m.options, options, "options");
    IMP_FINITE(ctx, m.options.budget, "options: budget");
    m.options.take = 1;
    m.options.budget = 0;
    if (n == 0 || rounds < 1 || rounds > MAX_MOVE)
        return imp__error(ctx, IMP_E_ARG,
                          "%zu candidates, %d rounds: at least one, and 1 to %d", n,
                          rounds, MAX_MOVE);
    m.c = imp__alloc(ctx, n + AROUND, sizeof *m.c);
    if (!m.c) return imp__error(ctx, IMP_E_NOMEM, "no memory for a plan");
    bool found = false;
    for (size_t i = 0; i < n; i++) {
        struct imp_plan_candidate c = IMP_PLAN_CANDIDATE_INIT;
        IMP_TRY(
            imp__element_take(ctx, __func__, "candidates", candidates, i, &c, sizeof c));
        if (c.have) m.c[m.n_have++] = c;
        else if (!found) one = c, found = true;
    }
    if (!found || !one.placed)
        IMP_TRY(
            imp__error(ctx, IMP_E_ARG,
                       "candidates: the first that has not been taken is to be placed"));
    m.target = imp__v3(one.target[0], one.target[1], one.target[2]);
    imp_v3 d = imp__v3(one.origin[0], one.origin[1], one.origin[2]) - m.target;
    m.radius = imp__length(d);
    if (!(m.radius > 0) || !isfinite(m.radius))
        IMP_TRY(imp__error(ctx, IMP_E_ARG,
                           "candidates: origin and target are equal, or not finite"));
    d = d / imp__v3(m.radius, m.radius, m.radius);
    for (size_t k = 0; k < AROUND; k++) m.c[m.n_have + k] = one;
    IMP_TRY(climb(&m, rounds, &d));
    struct imp_estimate last;
    place(&m, 0, d);
    IMP_TRY(gains(&m, 1, -1, &last));
    memcpy(origin, m.c[m.n_have].origin, sizeof one.origin);
    *gain = last;
out:
    imp__release(ctx, m.c);
    return st;
}

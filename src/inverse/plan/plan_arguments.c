/* SPDX-License-Identifier: Apache-2.0
 *
 * Candidates and options of a plan: defaults, and what is refused by name. */
#include "plan_arguments.h"
#include "base/arguments.h"
#include <math.h>
#include <stdio.h>

#define CANDIDATES_MAX 4096

static enum imp_status not_negative(imp_context *ctx, const char *of, const char *name,
                                    double value)
{
    if (value >= 0 && isfinite(value)) return IMP_OK;
    return imp__error(ctx, IMP_E_ARG, "%s: %s = %g is not a number >= 0", of, name,
                      value);
}

enum imp_status imp__plan_options_take(const struct imp_problem *p, const char *function,
                                       const struct imp_plan_options *options,
                                       struct imp_plan_options *own)
{
    imp_context *ctx = p->ctx;
    *own = (struct imp_plan_options)IMP_PLAN_OPTIONS_INIT;
    IMP_CHECKED(imp__options_take(ctx, function, "options", options, own, sizeof *own));
    if (p->n == 0 || p->n > IMP_DENSE_MAX)
        return imp__error(ctx, IMP_E_ARG, "%zu numbers are active; a plan takes 1 to %d",
                          p->n, IMP_DENSE_MAX);
    if ((unsigned)own->criterion > IMP_PLAN_A)
        return imp__error(ctx, IMP_E_ARG, "criterion %d does not exist",
                          (int)own->criterion);
    IMP_CHECKED(not_negative(ctx, "options", "read", own->read));
    IMP_CHECKED(not_negative(ctx, "options", "shot", own->shot));
    IMP_CHECKED(not_negative(ctx, "options", "relative", own->relative));
    IMP_CHECKED(not_negative(ctx, "options", "white", own->white));
    IMP_CHECKED(not_negative(ctx, "options", "budget", own->budget));
    if (own->n_of > 0 && !own->of)
        return imp__error(ctx, IMP_E_ARG, "options: of is NULL, and n_of is %zu",
                          own->n_of);
    if (own->n_of > p->n)
        return imp__error(ctx, IMP_E_ARG,
                          "options: n_of is %zu, and %zu numbers are active", own->n_of,
                          p->n);
    for (size_t i = 0; i < own->n_of; i++) {
        if (own->of[i] >= p->n)
            return imp__error(ctx, IMP_E_ARG,
                              "options: of[%zu] = %zu; %zu numbers are active", i,
                              own->of[i], p->n);
        for (size_t j = 0; j < i; j++)
            if (own->of[j] == own->of[i])
                return imp__error(ctx, IMP_E_ARG, "options: of has number %zu twice",
                                  own->of[i]);
    }
    for (size_t k = 0; own->prior && k < p->n; k++) {
        char name[32];
        snprintf(name, sizeof name, "prior[%zu]", k);
        IMP_CHECKED(not_negative(ctx, "options", name, own->prior[k]));
    }
    return IMP_OK;
}

enum imp_status imp__plan_take_check(const struct imp_problem *p,
                                     struct imp_plan_options *own, size_t n_open)
{
    if (n_open == 0)
        return imp__error(p->ctx, IMP_E_ARG,
                          "candidates: there is none to be ranked (have: all are taken)");
    if (own->take > n_open)
        return imp__error(p->ctx, IMP_E_ARG, "%zu of %zu candidates cannot be chosen",
                          own->take, n_open);
    if (own->take == 0) own->take = own->budget > 0 ? n_open : 1;
    return IMP_OK;
}

static enum imp_status candidate_check(const struct imp_problem *p, size_t i,
                                       struct imp_plan_candidate *c)
{
    imp_context *ctx = p->ctx;
    char of[300];
    if (c->sensor < 0 || c->sensor >= p->scene->n_sensors)
        return imp__error(ctx, IMP_E_ARG,
                          "candidates[%zu]: there is no sensor %d; the scene has %d", i,
                          c->sensor, p->scene->n_sensors);
    snprintf(of, sizeof of, "candidates[%zu] (%.200s)", i, imp__plan_name(p->scene, c));
    IMP_CHECKED(not_negative(ctx, of, "time", c->time));
    IMP_CHECKED(not_negative(ctx, of, "cost", c->cost));
    if (c->time == 0) c->time = 1;
    if (c->cost == 0) c->cost = 1;
    for (int k = 0; k < 3; k++)
        if (!isfinite(c->origin[k]) || !isfinite(c->target[k]) || !isfinite(c->up[k]))
            return imp__error(ctx, IMP_E_ARG, "%s: origin, target or up is not finite",
                              of);
    return IMP_OK;
}

enum imp_status imp__plan_candidates_take(const struct imp_problem *p,
                                          const char *function, const char *name,
                                          const struct imp_plan_candidate *candidates,
                                          size_t n, struct imp_plan_candidate **out)
{
    imp_context *ctx = p->ctx;
    if (n == 0 || n > CANDIDATES_MAX)
        return imp__error(ctx, IMP_E_ARG, "%zu candidates; a plan takes 1 to %d", n,
                          CANDIDATES_MAX);
    struct imp_plan_candidate *own = imp__alloc(ctx, n, sizeof *own);
    if (!own) return imp__error(ctx, IMP_E_NOMEM, "no memory for %zu candidates", n);
    enum imp_status st = IMP_OK;
    for (size_t i = 0; i < n; i++) {
        own[i] = (struct imp_plan_candidate)IMP_PLAN_CANDIDATE_INIT;
        IMP_TRY(imp__element_take(ctx, function, name, candidates, i, &own[i],
                                  sizeof own[i]));
        IMP_TRY(candidate_check(p, i, &own[i]));
    }
    *out = own;
    own = NULL;
out:
    imp__release(ctx, own);
    return st;
}

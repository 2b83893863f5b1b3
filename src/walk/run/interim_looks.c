/* SPDX-License-Identifier: Apache-2.0
 *
 * Looks at growing numbers of samples: when the next one is due, and when they end
 * (interim_looks.h). */
#include "interim_looks.h"
#include "base/pool.h"
#include "base/team.h"
#include "math/rng.h"
#include "math/stat.h"
#include "walk/rules/features.h"
#include <math.h>

#define RELATIVE 0.05
#define RISK     0.05
#define FIRST    16
#define MOST     65536

/* A look's own progress, as that of all looks so far: the last half is the last look's, as
 * it takes half of the samples. */
static int progress(const struct imp_progress *p, void *payload)
{
    const struct imp__looks *l = payload;
    struct imp_progress own = *p;
    const double begin = l->before / (double)l->end.spp;
    own.fraction = begin + (1 - begin) * p->fraction;
    own.elapsed_s = imp__now() - l->start_s;
    return l->outer->progress(&own, l->outer->progress_payload);
}

enum imp_status imp__looks_begin(imp_context *ctx, const char *function,
                                 const struct imp_run *run,
                                 const struct imp_until_options *options,
                                 struct imp__looks *out)
{
    struct imp__looks l = {.options = IMP_UNTIL_OPTIONS_INIT,
                           .run = *run,
                           .outer = run,
                           .start_s = imp__now(),
                           .end = IMP_UNTIL_END_INIT};
    struct imp_until_options *o = &l.options;
    IMP_CHECKED(imp__options_take(ctx, function, "options", options, o, sizeof *o));
    if (!(o->relative >= 0) || !isfinite(o->relative))
        return imp__error(ctx, IMP_E_ARG, "%s: options->relative %g is not a number >= 0",
                          function, o->relative);
    if (!(o->risk >= 0 && o->risk < 1))
        return imp__error(ctx, IMP_E_ARG, "%s: options->risk %g is outside [0, 1)",
                          function, o->risk);
    if (o->most_spp < 0)
        return imp__error(ctx, IMP_E_ARG, "%s: options->most_spp %d is negative",
                          function, o->most_spp);
    if ((unsigned)o->allocation > IMP_ALLOCATION_VARIANCE)
        return imp__error(ctx, IMP_E_ARG, "%s: allocation %d does not exist", function,
                          (int)o->allocation);
    struct imp_job job = {.ctx = ctx, .run = run, .call = function};
    imp__job_state(&job, IMP_HAS_UNTIL, NULL);
    IMP_CHECKED(imp__job_allowed(&job));
    IMP_CHECKED(imp__run_traces(ctx, function, run));
    if (o->relative == 0) o->relative = RELATIVE;
    if (o->risk == 0) o->risk = RISK;
    if (o->most_spp == 0) o->most_spp = MOST;
    l.end.relative = INFINITY;
    *out = l;
    if (out->run.progress) {
        out->run.progress = progress;
        out->run.progress_payload = out;
    }
    return IMP_OK;
}

bool imp__looks_next(struct imp__looks *l)
{
    const int64_t most = l->options.most_spp, so_far = l->end.spp;
    /* One sample has no spread, and so no error. */
    const int first = l->outer->spp > 0 ? imp_max(l->outer->spp, 2) : FIRST;
    const double elapsed = imp__now() - l->start_s, limit = l->outer->time_limit_s;
    if (l->end.looks > 0) {
        if (l->end.reached || most - so_far < 2 || (limit > 0 && 2 * elapsed > limit))
            return false;
        l->run.time_limit_s = 0;
        l->run.seed =
            imp__mix64(l->outer->seed + 0x9e3779b97f4a7c15u * (uint64_t)l->end.looks);
    }
    l->run.spp = (int)imp_min(so_far > 0 ? so_far : (int64_t)first, most - so_far);
    l->before = (double)so_far;
    l->end.spp = so_far + l->run.spp;
    l->end.looks++;
    return true;
}

double imp__looks_weight(const struct imp__looks *l)
{
    return 1 - l->before / (double)l->end.spp;
}

double imp__looks_risk(const struct imp__looks *l)
{
    const double k = l->end.looks;
    return l->options.risk / (k * (k + 1));
}

double imp__looks_z(const struct imp__looks *l)
{
    return -imp__normal_quantile(imp__looks_risk(l) / 2);
}

void imp__looks_bound(struct imp__looks *l, double relative)
{
    l->end.relative = relative;
    l->end.reached = relative <= l->options.relative;
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "adjoint.h"
#include "estimate.h"
#include "film/film_filter.h"
#include "loss.h"
#include "walk/run.h"

struct imp__replicates imp__replicates_plan(int spp, int batch_max)
{
    struct imp__replicates r;
    spp = imp_max(spp, 2);
    r.n = spp < 4 ? spp : imp_min(spp / 2, batch_max);
    r.R = (spp - 1) / r.n + 1;
    r.chunks = imp_max(1, r.R / IMP_BATCHES_PER_ITEM);
    return r;
}

/* Of pictures, which filters wider than a pixel need. */
static struct imp__replicates wide_plan(int spp)
{
    struct imp__replicates r = {.R = spp >= 16 ? 4 : 2, .chunks = 1};
    r.n = imp_max(2, (spp - 1) / r.R + 1);
    return r;
}

struct imp__replicates imp__replicates_of(const struct imp_sensor *sensor,
                                          const struct imp__target *target, int spp)
{
    if (spp <= 0) spp = sensor->spp;
    if (imp__film_border(&sensor->film) > 0) return wide_plan(spp);
    /* A loss that is not quadratic has its bias cut by longer batches. */
    const bool longer = target && !imp__loss_quadratic(target->desc.loss);
    return imp__replicates_plan(spp, longer ? IMP_REPLICATE_MAX : IMP_BATCH_MAX);
}

struct imp__replicates imp__replicates_normal(const struct imp_sensor *sensor, int spp)
{
    spp = imp_max(spp > 0 ? spp : sensor->spp, 4);
    if (imp__film_border(&sensor->film) == 0)
        return imp__replicates_plan(spp, IMP_BATCH_MAX);
    struct imp__replicates r = {.R = spp < 32 ? 4 : IMP_WIDE_REPLICATES, .chunks = 1};
    r.n = (spp - 1) / r.R + 1;
    return r;
}

enum imp_status imp_problem_spp(const imp_problem *p, int target,
                                const struct imp_run *run, int *spp)
{
    struct imp_run own;
    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, spp, "spp");
    IMP_RUN(p->ctx, own, run);
    if (target < -1 || target >= (int)p->n_targets)
        return imp__error(p->ctx, IMP_E_ARG, "there is no target %d; the problem has %zu",
                          target, p->n_targets);
    const struct imp__target *t = target < 0 ? NULL : &p->targets[target];
    const int sensor = t ? t->desc.sensor : own.sensor;
    if (sensor < 0 || sensor >= p->scene->n_sensors || own.spp < 0)
        return imp__error(p->ctx, IMP_E_ARG, "run: there is no sensor %d, or spp %d < 0",
                          sensor, own.spp);
    const struct imp__replicates r =
        imp__replicates_of(p->scene->sensors[sensor], t, own.spp);
    *spp = r.n * r.R;
    return IMP_OK;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * The mean of the picture and its derivatives by walks from both ends, which share
 * neither a random number nor a density: R = R_A (docs/adjoint-photons.md). What one end
 * cannot find, however many walks it follows, is not compared: light that a mirror or
 * clear glass sends into a camera, or that comes from a point by such a material. */
#include "check.h"
#include "walk/light_walk.h"
#include <math.h>

#define Z_LIMIT 4.5 /* of many rows, with few batches behind a standard error */
/* With a standard error above this part of its own value an end decides nothing: what few
 * walks bring is not normal, and where it is too low its standard error is, too. */
#define RESOLVED 0.2
#define BATCHES  16 /* of a direction through many numbers */

static bool has_point_lights(const struct imp_scene *scene)
{
    for (int i = 0; i < scene->n_emitters; i++)
        if (scene->emitters[i]->ops->flags & (IMP_EMITTER_DELTA | IMP_EMITTER_FAR))
            return true;
    return false;
}

/* May walks begin at either end, and meet the same light? */
static bool both_ends(const struct imp__check *c)
{
    const struct imp_walk_integrator *from[2],
        *own = imp__walk_integrator(c->problem->scene);
    const struct imp_scene *scene = c->problem->scene;
    if (!own->other_end) return false;
    if (imp__walks_from(scene, own, IMP_FROM_SENSOR, &from[0]) != IMP_OK ||
        imp__walks_from(scene, own, IMP_FROM_LIGHTS, &from[1]) != IMP_OK)
        return false;
    if (imp__delta_bsdf(scene) && (!c->tracer.sensor->shape || has_point_lights(scene)))
        return false;
    return imp__light_walks_allowed(scene, c->tracer.sensor, from[1],
                                    &c->problem->active) == IMP_OK;
}

struct end {
    struct imp_estimate reading;
    double *g, *se; /* [n] */
};

static enum imp_status row_add(struct imp__check *c, const char *param, int64_t element,
                               struct imp_estimate lights, struct imp_estimate sensor)
{
    struct imp_check_row row = {.value = lights.value,
                                .reference = sensor.value,
                                .se = hypot(lights.se, sensor.se)};
    const double off = fabs(lights.value - sensor.value);
    const double size = fmax(fabs(lights.value), fabs(sensor.value));
    if (row.se > 0) {
        row.error = isfinite(off) ? off / row.se : INFINITY;
        row.limit = Z_LIMIT + 1e-6 * size / row.se;
    } else {
        row.error = off == 0 ? 0 : isfinite(off) ? off / size : INFINITY;
        row.limit = 1e-6;
    }
    /* An end whose walks have found nothing has no error to go by: a small sensor before a
     * large lamp. */
    const bool unseen =
        (lights.value == 0 && lights.se == 0) != (sensor.value == 0 && sensor.se == 0);
    const bool noisy = unseen || row.se > RESOLVED * size ||
                       lights.se > RESOLVED * fabs(lights.value) ||
                       sensor.se > RESOLVED * fabs(sensor.value);
    row.ok = noisy ? -1 : row.error <= row.limit;
    return imp__check_row(c, "ends", param, element, &row);
}

static enum imp_status end_measure(struct imp__check *c, enum imp_from from,
                                   struct end *e)
{
    struct imp_run run = c->run;
    run.from = from;
    run.seed = c->run.seed + 2 * (uint64_t)from + 1;
    enum imp_status st =
        imp_problem_functional(c->problem, NULL, &run, &e->reading, e->g, e->se);
    return st == IMP_OK ? imp__check_progress(c, 2) : st;
}

/* The derivative along w [count] of the numbers from `base` on, by batches. */
static enum imp_status direction_measure(struct imp__check *c, enum imp_from from,
                                         size_t base, size_t count, double *scratch,
                                         struct imp_estimate *out)
{
    struct imp_run run = c->run;
    double sum = 0, square = 0;
    run.from = from;
    run.spp = imp_max((run.spp > 0 ? run.spp : c->tracer.sensor->spp) / BATCHES, 4);
    for (int b = 0; b < BATCHES; b++) {
        double slope = 0;
        run.seed = c->run.seed + 100 * (uint64_t)from + 7 + (uint64_t)b;
        const enum imp_status st =
            imp_problem_functional(c->problem, NULL, &run, NULL, scratch, NULL);
        if (st != IMP_OK) return st;
        for (size_t e = 0; e < count; e++)
            slope += (0.5 + imp__u01(imp__key(9, 9, 9), (uint32_t)e)) * scratch[base + e];
        sum += slope;
        square += slope * slope;
    }
    const double mean = sum / BATCHES;
    *out = (struct imp_estimate){
        mean, sqrt(fmax(square / BATCHES - mean * mean, 0) / (BATCHES - 1)), 0};
    return imp__check_progress(c, 1);
}

/* Three numbers at most one by one, more of them along one direction. */
static enum imp_status parameter_rows(struct imp__check *c, size_t k,
                                      const struct end e[2], double *scratch)
{
    enum imp_status st = IMP_OK;
    const struct imp_param *q = &c->problem->scene->params[k];
    const size_t count = q->info.count, base = (size_t)c->problem->active.base[k];
    struct imp_estimate d[2];
    for (size_t j = 0; count <= 3 && j < count; j++) {
        for (int i = 0; i < 2; i++)
            d[i] = (struct imp_estimate){e[i].g[base + j], e[i].se[base + j], 0};
        IMP_TRY(row_add(c, q->info.name, count > 1 ? (int64_t)j : -1, d[1], d[0]));
    }
    if (count > 3) {
        IMP_TRY(direction_measure(c, IMP_FROM_SENSOR, base, count, scratch, &d[0]));
        IMP_TRY(direction_measure(c, IMP_FROM_LIGHTS, base, count, scratch, &d[1]));
        IMP_TRY(row_add(c, q->info.name, -1, d[1], d[0]));
    }
out:
    return st;
}

enum imp_status imp__check_ends(struct imp__check *c)
{
    enum imp_status st = IMP_OK;
    const struct imp_problem *p = c->problem;
    double *room = NULL;
    if (!both_ends(c)) return IMP_OK;
    room = imp__alloc(c->ctx, 5 * p->n, sizeof *room);
    if (!room) return imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check");
    struct end e[2];
    for (int i = 0; i < 2; i++) {
        e[i] = (struct end){.g = room + (size_t)(2 * i) * p->n,
                            .se = room + (size_t)(2 * i + 1) * p->n};
        IMP_TRY(end_measure(c, i ? IMP_FROM_LIGHTS : IMP_FROM_SENSOR, &e[i]));
    }
    IMP_TRY(row_add(c, "reading", -1, e[1].reading, e[0].reading));
    for (size_t k = 0; k < p->scene->n_params; k++)
        if (p->active.base[k] >= 0) IMP_TRY(parameter_rows(c, k, e, room + 4 * p->n));
out:
    imp__release(c->ctx, room);
    return st;
}

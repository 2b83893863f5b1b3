/* SPDX-License-Identifier: Apache-2.0
 *
 * What the checkpoint of a fit belongs to: scene, targets, active values and options. */
#include "bend/inside.h"
#include "fit.h"
#include "inverse/estimate/replicates.h"
#include "math/hash.h"
#include "scene/fingerprint.h"
#include <string.h>

/* Raised with what is hashed, and with whatever makes other numbers from the same hash: what
 * Levenberg-Marquardt estimates from its samples, what control variates keep, steps with
 * them, how walks are drawn that are kept (fit_kept.c). */
#define VERSION 4

/* With an active value, the index of a medium differs from start to start. */
static bool medium_active(const struct imp_body *m, const int64_t *base)
{
    for (int k = 0; k < m->n_numbers; k++)
        if (m->numbers[k].param >= 0 && base[m->numbers[k].param] >= 0) return true;
    return false;
}

/* What does not apply is 0. */
static uint64_t options_hash(const struct imp__fit *f)
{
    const struct imp_problem *p = f->problem;
    const struct imp_sensor *sensor = p->scene->sensors[p->targets[0].desc.sensor];
    const bool keeps = imp__fit_keeps(f);
    const double number[] = {f->options.optimizer,
                             f->options.learning_rate,
                             f->options.tolerance,
                             f->options.momentum,
                             f->run.spp > 0 ? f->run.spp : sensor->spp,
                             keeps ? (double)f->options.memory : 0,
                             keeps && f->options.headroom > 1 ? f->options.headroom : 0};
    int how[] = {VERSION,
                 (int)f->outer.from,
                 f->options.optimizer == IMP_LM ? imp__fit_coarse_spp(f) : 0,
                 keeps,
                 f->variate != NULL,
                 0,
                 0,
                 0};
    if (imp__points_of(sensor, &f->outer) == IMP_POINTS_SOBOL) {
        const struct imp__replicates plan =
            imp__replicates_loss(p, &p->targets[0], &f->outer);
        how[5] = plan.n;
        how[6] = plan.m;
        how[7] = IMP_SET_POINTS;
    }
    const uint64_t numbers =
        f->allocation.n > 0 ? imp__allocation_numbers(&f->allocation) : 0;
    uint64_t h = imp__hash(f->outer.seed, number, sizeof number);
    h = imp__hash(h, how, sizeof how);
    if (f->n_meshes > 0)
        h = imp__hash(h, &f->options.mesh_lambda, sizeof f->options.mesh_lambda);
    return imp__hash(h, &numbers, sizeof numbers);
}

void imp__fit_fingerprint(struct imp__fit *f)
{
    const struct imp_problem *p = f->problem;
    struct imp__fingerprint *h = &f->fingerprint;

    h->scene = imp__fingerprint_objects(p->scene);
    const uint64_t integrator = imp__walk_integrator_hash(imp__walk_integrator(p->scene));
    h->scene = imp__hash(h->scene, &integrator, sizeof integrator);
    for (size_t i = 0; i < p->n_targets; i++) {
        const uint64_t sensor =
            imp__fingerprint_sensor(p->scene->sensors[p->targets[i].desc.sensor]);
        h->scene = imp__hash(h->scene, &sensor, sizeof sensor);
    }
    for (size_t k = 0; k < p->scene->n_params; k++) {
        const struct imp_param *q = &p->scene->params[k];
        const size_t n = q->info.count;
        if (p->active.base[k] >= 0) {
            h->parameters = imp__hash(h->parameters, q->info.name, strlen(q->info.name));
            h->parameters = imp__hash(h->parameters, &n, sizeof n);
        } else if (q->store == IMP_STORE_BULK) {
            h->scene = imp__hash_array(h->scene, q->bulk, n * sizeof *q->bulk);
        } else {
            for (size_t e = 0; e < n; e++) {
                const double value = imp__param_get(q, e);
                h->scene = imp__hash(h->scene, &value, sizeof value);
            }
        }
    }
    for (int m = 0; m < p->scene->n_bodies; m++)
        if (!medium_active(p->scene->bodies[m], p->active.base))
            h->scene = imp__graded_hash(h->scene, p->scene->bodies[m]);
    h->parameters = imp__ties_hash(p, h->parameters);
    h->targets = imp__problem_targets_hash(p);
    h->options = options_hash(f);
}

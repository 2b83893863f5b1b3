/* SPDX-License-Identifier: Apache-2.0
 *
 * What the checkpoint of a fit belongs to: scene, targets, active numbers and options. */
#include "bend/inside.h"
#include "fit.h"
#include "inverse/estimate/replicates.h"
#include "math/hash.h"
#include "scene/fingerprint.h"
#include <string.h>

#define PAIRS_VERSION   3 /* of what Levenberg-Marquardt estimates from its samples */
#define VARIATE_VERSION 3 /* of what control variates keep, and of steps with them */
#define KEPT_VERSION    2 /* of how walks are drawn that are kept (fit_kept.c) */

/* With an active number, the index of a medium differs from start to start. */
static bool medium_active(const struct imp_body *m, const int64_t *base)
{
    for (int k = 0; k < m->n_numbers; k++)
        if (m->numbers[k].param >= 0 && base[m->numbers[k].param] >= 0) return true;
    return false;
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
    if (p->n_ties > 0) h->parameters = imp__ties_hash(p, h->parameters);
    h->targets = imp__problem_targets_hash(p);
    const struct imp_sensor *sensor = p->scene->sensors[p->targets[0].desc.sensor];
    const double number[4] = {f->options.optimizer, f->options.learning_rate,
                              f->options.tolerance,
                              f->run.spp > 0 ? f->run.spp : sensor->spp};
    h->options = imp__hash(f->outer.seed, number, sizeof number);
    if (f->options.momentum != IMP_ADAM_MOMENTUM)
        h->options =
            imp__hash(h->options, &f->options.momentum, sizeof f->options.momentum);
    if (f->outer.from != IMP_FROM_SCENE)
        h->options = imp__hash(h->options, &f->outer.from, sizeof f->outer.from);
    if (f->options.optimizer == IMP_LM) {
        const int version[2] = {PAIRS_VERSION, imp__fit_coarse_spp(f)};
        h->options = imp__hash(h->options, version, sizeof version);
    }
    if (f->allocation.n > 0) {
        const uint64_t numbers = imp__allocation_numbers(&f->allocation);
        h->options = imp__hash(h->options, &numbers, sizeof numbers);
    }
    if (imp__fit_keeps(f)) {
        const double kept[2] = {(double)f->options.memory, KEPT_VERSION};
        h->options = imp__hash(h->options, kept, sizeof kept);
    }
    if (imp__fit_keeps(f) && f->options.headroom > 1)
        h->options =
            imp__hash(h->options, &f->options.headroom, sizeof f->options.headroom);
    if (f->variate) {
        const int version = VARIATE_VERSION;
        h->options = imp__hash(h->options, &version, sizeof version);
    }
    if (imp__points_of(sensor, &f->outer) == IMP_POINTS_SOBOL) {
        const struct imp__replicates plan =
            imp__replicates_loss(p, &p->targets[0], &f->outer);
        const int sets[3] = {plan.n, plan.m, IMP_SET_POINTS};
        h->options = imp__hash(h->options, sets, sizeof sets);
    }
}

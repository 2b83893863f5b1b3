/* SPDX-License-Identifier: Apache-2.0
 *
 * Comparison of a problem with that of the parts, or of the other ranks of a team. */
#include "film/parts.h"
#include "math/hash.h"
#include "problem.h"
#include "scene/fingerprint.h"
#include "walk/rules/features.h"

uint64_t imp__problem_targets_hash(const struct imp_problem *p)
{
    uint64_t hash = 0;
    for (size_t i = 0; i < p->n_targets; i++) {
        const struct imp__target *t = &p->targets[i];
        const size_t n = (size_t)t->desc.width * (size_t)t->desc.height;
        const size_t c = n * (size_t)t->desc.channels * sizeof(float);
        const double number[9] = {
            t->desc.sensor,   t->desc.width,      t->desc.height,
            t->desc.channels, t->desc.loss,       t->desc.epsilon,
            t->desc.scale,    t->weights != NULL, t->noise_se != NULL};
        hash = imp__hash(hash, number, sizeof number);
        hash = imp__hash(hash, t->pixels, c);
        hash = imp__hash(hash, t->weights, t->weights ? n * sizeof(float) : 0);
        hash = imp__hash(hash, t->noise_se, t->noise_se ? c : 0);
    }
    for (size_t i = 0; i < p->n_regularisers; i++) {
        const struct imp__regulariser *r = &p->regularisers[i];
        const double number[3] = {r->kind, r->weight, r->origin != NULL};
        hash = imp__hash(hash, number, sizeof number);
        hash = imp__hash(hash, r->on, p->scene->n_params);
        hash = imp__hash(hash, r->origin,
                         r->origin ? p->scene->n_theta * sizeof *r->origin : 0);
    }
    return hash;
}

enum imp_status imp__problem_same(struct imp_problem *p, const struct imp_run *run,
                                  const char *call)
{
    struct imp_same same[IMP_SAME_MAX];
    if (!imp__team_shares(p->ctx)) return IMP_OK;
    if (run->sensor < 0 || run->sensor >= p->scene->n_sensors)
        return imp__error(p->ctx, IMP_E_ARG, "there is no sensor %d; the scene has %d",
                          run->sensor, p->scene->n_sensors);
    imp__team_state(p->scene, run);
    if (!imp__team_apart(p->ctx) && p->same_known) return IMP_OK;
    int n = imp__same_run(p->scene, run, call, same);
    uint64_t what = imp__ties_hash(p, imp__hash(0, p->chosen, p->scene->n_params));
    for (size_t i = 0; i < p->n_targets; i++) {
        const uint64_t sensor =
            imp__fingerprint_sensor(p->scene->sensors[p->targets[i].desc.sensor]);
        what = imp__hash(what, &sensor, sizeof sensor);
    }
    same[n++] = (struct imp_same){"choice of parameters or sensors", what};
    same[n++] = (struct imp_same){"target", imp__problem_targets_hash(p)};
    const enum imp_status st = imp__team_same(p->ctx, same, n);
    p->same_known = st == IMP_OK;
    return st;
}

enum imp_status imp__problem_no_parts(const struct imp_problem *p, const char *call)
{
    struct imp_job job = {.ctx = p->ctx, .call = call};
    imp__job_state(&job, IMP_HAS_SEQUENTIAL, NULL);
    return imp__job_allowed(&job);
}

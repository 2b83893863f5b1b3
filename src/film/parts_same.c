/* SPDX-License-Identifier: Apache-2.0
 *
 * Hashes of scene, parameters and run, compared between ranks and between parts before sums are
 * added. */
#include "math/hash.h"
#include "parts.h"
#include "parts_file.h"
#include "scene/fingerprint.h"
#include "walk/core/walk.h"

struct comparing {
    const struct imp_same *same;
    int n, differs; /* index of the first that does; n: none */
    int rank;
};

static void compare(void *receiver, int rank, const void *message, size_t bytes)
{
    struct comparing *c = receiver;
    uint64_t theirs[IMP_SAME_MAX];
    if (c->differs < c->n) return;
    c->rank = rank;
    if (bytes != (size_t)c->n * sizeof *theirs) {
        c->differs = 0;
        return;
    }
    memcpy(theirs, message, bytes);
    for (c->differs = 0;
         c->differs < c->n && theirs[c->differs] == c->same[c->differs].hash;)
        c->differs++;
}

enum imp_status imp__team_same(imp_context *ctx, const struct imp_same *same, int n)
{
    struct comparing c = {.same = same, .n = n, .differs = n};
    uint64_t own[IMP_SAME_MAX];
    if (!imp__team_shares(ctx)) return IMP_OK;
    const struct imp__team *team = ctx->team;
    for (int k = 0; k < n; k++) own[k] = same[k].hash;
    const enum imp_status st =
        team->host.gather(own, (size_t)n * sizeof *own, compare, &c, team->host.payload);
    if (st != IMP_OK || c.differs == n) return st;
    if (team->role == IMP_TEAM_RANK)
        return imp__error(ctx, IMP_E_ARG,
                          "the %s of rank %d differs from that of rank %d",
                          same[c.differs].name, c.rank, team->host.rank);
    if (team->role == IMP_TEAM_VERIFY)
        return imp__error(ctx, IMP_E_ARG, "the result was made with another %s",
                          same[c.differs].name);
    const struct imp_parts *p = team->host.payload;
    return imp__error(ctx, IMP_E_ARG, "part %u of %u was made with another %s",
                      p->sources[c.rank].index, p->sources[c.rank].count,
                      same[c.differs].name);
}

static uint64_t theta_hash(const struct imp_scene *scene)
{
    uint64_t theta = 0;
    for (size_t k = 0; k < scene->n_params; k++) {
        const struct imp_param *q = &scene->params[k];
        if (q->store == IMP_STORE_BULK) {
            theta = imp__hash_array(theta, q->bulk, q->info.count * sizeof *q->bulk);
            continue;
        }
        for (size_t e = 0; e < q->info.count; e++) {
            const double value = imp__param_get(q, e);
            theta = imp__hash(theta, &value, sizeof value);
        }
    }
    return theta;
}

void imp__team_state(const struct imp_scene *scene, const struct imp_run *run)
{
    struct imp__team *team = scene->ctx->team;
    if (!team || team->role != IMP_TEAM_RANK) return;
    const uint64_t state[3] = {theta_hash(scene), run->seed, (uint64_t)run->spp};
    team->state = imp__hash(0, state, sizeof state);
}

int imp__same_run(const struct imp_scene *scene, const struct imp_run *run,
                  const char *call, struct imp_same same[IMP_SAME_MAX])
{
    const struct imp_sensor *sensor = scene->sensors[run->sensor];
    const uint64_t theta[2] = {imp__fingerprint_rays(scene), theta_hash(scene)};
    const uint64_t how[3] = {run->seed, (uint64_t)(run->spp > 0 ? run->spp : sensor->spp),
                             (uint64_t)(run->guide != NULL) | (uint64_t)run->from << 1};
    struct imp_walk_integrator own;
    int n = 0;
    same[n++] = (struct imp_same){"call", imp__hash_text(0, call)};
    same[n++] = (struct imp_same){"scene", imp__fingerprint_objects(scene)};
    same[n++] = (struct imp_same){"integrator",
                                  imp__walk_integrator_hash(imp__walks_read(
                                      scene, sensor, imp__walk_integrator(scene), &own))};
    same[n++] = (struct imp_same){"sensor", imp__fingerprint_sensor(sensor)};
    same[n++] =
        (struct imp_same){"set of parameter values", imp__hash(0, theta, sizeof theta)};
    same[n++] =
        (struct imp_same){"seed or number of samples", imp__hash(0, how, sizeof how)};
    same[n++] = (struct imp_same){
        "kind of points", (uint64_t)(imp__points_of(sensor, run) == IMP_POINTS_SOBOL) |
                              (uint64_t)(run->points == IMP_POINTS_WHOLE) << 1};
    return n;
}

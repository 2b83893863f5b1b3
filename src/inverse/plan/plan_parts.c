/* SPDX-License-Identifier: Apache-2.0
 *
 * A plan in parts: each part has some of the candidates, whole, and keeps their informations; a merge reads
 * those of all, and ranks them. Candidate i of n is of the part I of N with
 *
 *     (I - 1)/N <= i/n < I/N
 *
 * so that parts of different cuts go together where their borders meet. */
#include "base/arguments.h"
#include "base/team.h"
#include "math/hash.h"
#include "planning.h"
#include <string.h>

/* A candidate's message is its index, `lit` and its matrices. */
static size_t message_numbers(size_t n) { return 2 + (1 + IMP_DEVIATIONS) * n * n; }

bool imp__plan_part_has(const imp_context *ctx, size_t candidate, size_t n_all)
{
    if (imp__team_merges(ctx)) return false;
    if (!imp__team_part(ctx)) return true;
    const uint64_t I = (uint64_t)ctx->team->host.rank,
                   N = (uint64_t)ctx->team->host.ranks;
    const uint64_t at = candidate * N;
    return at >= I * n_all && at < (I + 1) * n_all;
}

struct imp__team *imp__plan_part_alone(imp_context *ctx)
{
    struct imp__team *team = imp__team_apart(ctx) ? ctx->team : NULL;
    if (team) ctx->team = NULL;
    return team;
}

/* What candidates' informations depend on besides the scene and the run. */
static uint64_t candidates_hash(const struct imp_scene *scene,
                                const struct imp_plan_candidate *c, size_t n_all,
                                const struct imp_plan_options *o, const double *width,
                                size_t n)
{
    const double noise[4] = {o->read, o->shot, o->relative, o->white};
    uint64_t hash =
        imp__hash(imp__hash(0, noise, sizeof noise), width, n * sizeof *width);
    for (size_t i = 0; i < n_all; i++) {
        const double number[4] = {c[i].sensor, c[i].placed, c[i].time, c[i].have};
        hash = imp__hash(hash, number, sizeof number);
        hash = imp__hash(hash, c[i].origin, sizeof c[i].origin);
        hash = imp__hash(hash, c[i].target, sizeof c[i].target);
        hash = imp__hash(hash, c[i].up, sizeof c[i].up);
        hash = imp__hash_text(hash, c[i].lamps);
        hash = imp__hash_text(hash, imp__plan_name(scene, &c[i]));
    }
    return hash;
}

enum imp_status imp__plan_parts_same(struct imp_problem *p,
                                     const struct imp_plan_candidate *c, size_t n_all,
                                     const struct imp_plan_options *options,
                                     const double *width, const struct imp_run *run)
{
    struct imp_run own = *run;
    const uint64_t hash = candidates_hash(p->scene, c, n_all, options, width, p->n);
    uint64_t theirs = hash;
    bool known = false;
    if (!imp__team_apart(p->ctx)) return IMP_OK;
    own.sensor = c->sensor;
    IMP_CHECKED(imp__problem_same(p, &own, "plan"));
    IMP_CHECKED(imp__team_keep(p->ctx, &theirs, sizeof theirs, &known));
    if (theirs != hash)
        return imp__error(p->ctx, IMP_E_ARG,
                          "the parts were made with other candidates, noise or priors");
    return IMP_OK;
}

static enum imp_status parts_keep(imp_context *ctx, const struct imp__plan_data *data,
                                  size_t n_all, size_t n)
{
    const struct imp_team *host = &ctx->team->host;
    const size_t each = message_numbers(n);
    size_t own = 0;
    for (size_t i = 0; i < n_all; i++) own += imp__plan_part_has(ctx, i, n_all);
    double *message = imp__alloc(ctx, own * each + 1, sizeof *message), *to = message;
    if (!message) return imp__error(ctx, IMP_E_NOMEM, "no memory for a part");
    for (size_t i = 0; i < n_all; i++) {
        if (!imp__plan_part_has(ctx, i, n_all)) continue;
        to[0] = (double)i;
        to[1] = data[i].lit;
        memcpy(to + 2, data[i].H, (each - 2) * sizeof *to);
        to += each;
    }
    const enum imp_status st =
        host->gather(message, own * each * sizeof *message, NULL, NULL, host->payload);
    imp__release(ctx, message);
    return st;
}

struct reading {
    struct imp__plan_data *data;
    size_t n_all, each, read;
    bool *seen, strange;
};

static void candidates_receive(void *receiver, int rank, const void *message,
                               size_t bytes)
{
    struct reading *r = receiver;
    const size_t size = r->each * sizeof(double);
    (void)rank;
    r->strange |= bytes % size != 0;
    for (size_t at = 0; !r->strange && at < bytes; at += size) {
        const char *from = (const char *)message + at;
        double head[2];
        memcpy(head, from, sizeof head);
        const size_t i = head[0] >= 0 && head[0] < (double)r->n_all ? (size_t)head[0] : 0;
        r->strange = head[0] != (double)i || r->seen[i];
        if (r->strange) return;
        r->seen[i] = true;
        r->read++;
        r->data[i].lit = head[1];
        memcpy(r->data[i].H, from + sizeof head, size - sizeof head);
    }
}

static enum imp_status parts_read(imp_context *ctx, struct imp__plan_data *data,
                                  size_t n_all, size_t n)
{
    const struct imp_team *host = &ctx->team->host;
    struct reading r = {.data = data, .n_all = n_all, .each = message_numbers(n)};
    r.seen = imp__alloc(ctx, n_all, sizeof *r.seen);
    if (!r.seen) return imp__error(ctx, IMP_E_NOMEM, "no memory for parts");
    const enum imp_status st =
        host->gather(NULL, 0, candidates_receive, &r, host->payload);
    imp__release(ctx, r.seen);
    if (st != IMP_OK) return st;
    return !r.strange && r.read == n_all
               ? IMP_OK
               : imp__error(ctx, IMP_E_ARG, "the parts are of different runs");
}

enum imp_status imp__plan_parts_share(imp_context *ctx, struct imp__plan_data *data,
                                      size_t n_all, size_t n)
{
    if (imp__team_part(ctx)) {
        const enum imp_status st = parts_keep(ctx, data, n_all, n);
        return st == IMP_OK ? IMP_PART : st;
    }
    return imp__team_merges(ctx) ? parts_read(ctx, data, n_all, n) : IMP_OK;
}

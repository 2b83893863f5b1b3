/* SPDX-License-Identifier: Apache-2.0
 *
 * Variance and cost of each tile over the evaluations of a search, and the samples per pixel that
 * follow by Neyman's rule (allocation.h). */
#include "allocation.h"
#include "base/team.h"
#include "film/film_filter.h"
#include "film/film_tiles.h"
#include "inverse/problem/loss.h"
#include "walk/core/walk_integrator.h"
#include <math.h>
#include <string.h>

#define LEAST  4    /* samples of a pixel: two sets, or two replicates, of two */
#define FLOOR  0.25 /* of the given samples */
#define CAP    16
#define MEMORY 0.8 /* weight of earlier estimates; the noise of one is 20 to 50 % */
/* Weight of the loss's variance beside the gradient's: searches go by how it falls. */
#define LOSS   0.1
#define LEVELS 48
#define HALVES 50 /* of an interval of 2^40 */

/* ---- Which tiles there are ------------------------------------------------------- */

static bool allowed(const struct imp__target *target, const struct imp_sensor *sensor,
                    const struct imp_walk_integrator *integrator)
{
    return integrator && !integrator->from_lights &&
           imp__film_border(&sensor->film) == 0 && imp__loss_quadratic(target->desc.loss);
}

bool imp__allocation_allowed(const struct imp__target *target,
                             const struct imp_tracer *tracer)
{
    return !tracer->kept && allowed(target, tracer->sensor, tracer->integrator);
}

/* Adds the tiles of a part of a target; to `even` if it is there. */
static void part_add(const struct imp_problem *p, const struct imp__target *target,
                     const struct imp_run *run, struct imp__allocation *a)
{
    const struct imp_sensor *sensor = p->scene->sensors[target->desc.sensor];
    const struct imp_walk_integrator *integrator = imp__walk_integrator(p->scene);
    struct imp_run most = *run;
    integrator = imp__walks_from(integrator, run->from);
    if (!integrator || !allowed(target, sensor, integrator))
        return; /* the evaluation reports the error */
    const struct imp_film_desc *film = &sensor->film;
    const size_t side = IMP_TILE_SIDE, across = ((size_t)film->crop_w + side - 1) / side,
                 down = ((size_t)film->crop_h + side - 1) / side;
    const struct imp__replicates r = imp__replicates_loss(p, target, run);
    for (size_t k = 0; a->even && k < across * down; k++) a->even[a->n + k] = r.n * r.R;
    a->n += across * down;
    most.spp = (int)fmin((double)CAP * r.n * r.R, INT32_MAX);
    a->parts = imp_max(a->parts, imp__replicates_loss(p, target, &most).chunks);
}

static void targets_add(const struct imp_problem *p, const struct imp_run *run,
                        struct imp__allocation *a)
{
    a->n = 0;
    for (size_t t = 0; t < p->n_targets; t++)
        for (int k = 0; k < imp__target_parts(&p->targets[t]); k++)
            part_add(p, imp__target_part(&p->targets[t], k), run, a);
}

/* Statistics of a tile. */
static size_t each(const struct imp__allocation *a)
{
    return IMP_ALLOCATION_SEES * (size_t)a->parts;
}

enum imp_status imp__allocation_create(struct imp_problem *p, const struct imp_run *run,
                                       struct imp__allocation *a)
{
    enum imp_status st = IMP_OK;
    *a = (struct imp__allocation){.ctx = p->ctx, .parts = 1};
    if (run->walks) return IMP_OK;
    targets_add(p, run, a);
    if (a->n == 0) return IMP_OK;
    a->even = imp__alloc(p->ctx, 2 * a->n, sizeof *a->even);
    a->state = imp__alloc(p->ctx, imp__allocation_numbers(a), sizeof *a->state);
    a->seen = imp__alloc(p->ctx, a->n * each(a), sizeof *a->seen);
    if (!a->even || !a->state || !a->seen)
        IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for the samples of tiles"));
    a->spp = a->even + a->n;
    targets_add(p, run, a);
    imp__allocation_place(a);
out:
    if (st != IMP_OK) imp__allocation_destroy(a);
    return st;
}

enum imp_status imp__allocation_again(struct imp_problem *p, const struct imp_run *run,
                                      struct imp__allocation *a)
{
    struct imp__allocation next;
    const enum imp_status st = imp__allocation_create(p, run, &next);
    if (st != IMP_OK) return st;
    if (a->n == next.n && a->n > 0) {
        memcpy(next.state, a->state, imp__allocation_numbers(a) * sizeof *a->state);
        imp__allocation_place(&next);
    }
    imp__allocation_destroy(a);
    *a = next;
    return IMP_OK;
}

void imp__allocation_destroy(struct imp__allocation *a)
{
    if (!a->ctx) return;
    imp__release(a->ctx, a->even);
    imp__release(a->ctx, a->state);
    imp__release(a->ctx, a->seen);
    *a = (struct imp__allocation){0};
}

/* ---- An evaluation ---------------------------------------------------------------- */

size_t imp__allocation_take(struct imp__allocation *a, size_t tiles)
{
    const size_t first = a->next;
    a->next += tiles;
    if (a->metric)
        memset(a->seen + first * each(a), 0, tiles * each(a) * sizeof *a->seen);
    return first;
}

void imp__allocation_see(struct imp__allocation *a, size_t tile, size_t part,
                         const double seen[IMP_ALLOCATION_SEES])
{
    memcpy(a->seen + tile * each(a) + part * IMP_ALLOCATION_SEES, seen,
           IMP_ALLOCATION_SEES * sizeof *seen);
}

/* Each item was seen by one rank: sums of the bits are its bits. */
enum imp_status imp__allocation_share(struct imp__allocation *a, size_t first,
                                      size_t tiles)
{
    struct imp_fixed_sum all = {
        .n = tiles * each(a), .sum = a->seen + first * each(a), .unit = 1};
    a->measured = true;
    return imp__shared_fixed(a->ctx, &all);
}

/* ---- Samples ------------------------------------------------------------------------ */

/* Samples per pixel that a tile may have: 2^k and 3 2^k, which sets of points are best at, and
 * the given number. */
static int levels_of(int even, int level[LEVELS])
{
    const int floor = imp_max(imp_min(LEAST, even), (int)ceil(FLOOR * even));
    int n = 0;
    for (int64_t power = LEAST; power <= (int64_t)CAP * even && n < LEVELS - 3;
         power *= 2)
        for (int64_t s = power; s <= power * 3 / 2; s += power / 2) {
            const bool beside = n == 0 || level[n - 1] < even;
            if (beside && s >= even) level[n++] = even;
            /* Below the given number not 6, whose sets have three points. */
            if (s > even ? s <= (int64_t)CAP * even : s >= floor && s != even && s != 6)
                level[n++] = (int)s;
        }
    if (n == 0 || level[n - 1] < even) level[n++] = even;
    return n;
}

/* The level next to `wanted`, by ratio: where v/n + n/wanted^2 v is least. */
static int nearest(const int *level, int n, double wanted)
{
    int k = 0;
    while (k + 1 < n && wanted * wanted > (double)level[k] * level[k + 1]) k++;
    return level[k];
}

struct placing {
    const struct imp__allocation *a;
    const double *share, *cost;
    int even, n_level, level[LEVELS]; /* of the tile looked at last */
};

static int samples_of(struct placing *p, size_t tile, double factor)
{
    if (p->even != p->a->even[tile]) {
        p->even = p->a->even[tile];
        p->n_level = levels_of(p->even, p->level);
    }
    if (!(p->cost[tile] > 0)) return p->even; /* no walk is made there */
    return nearest(p->level, p->n_level, factor * sqrt(p->share[tile] / p->cost[tile]));
}

static double cost_of(struct placing *p, double factor)
{
    double sum = 0;
    for (size_t k = 0; k < p->a->n; k++) sum += p->cost[k] * samples_of(p, k, factor);
    return sum;
}

void imp__allocation_place(struct imp__allocation *a)
{
    const size_t n = a->n;
    struct placing p = {.a = a, .share = a->state, .cost = a->state + n};
    double budget = 0, wanted = 0;
    memcpy(a->spp, a->even, n * sizeof *a->spp);
    for (size_t k = 0; k < n; k++) {
        budget += p.cost[k] * a->even[k];
        wanted += sqrt(p.share[k] * p.cost[k]);
    }
    if (!(wanted > 0 && isfinite(wanted) && isfinite(budget))) return;
    double lo = -20, hi = 20; /* log2 of the factor, over that without levels */
    if (cost_of(&p, ldexp(budget / wanted, -20)) > budget) return;
    for (int i = 0; i < HALVES; i++) {
        const double middle = (lo + hi) / 2;
        if (cost_of(&p, budget / wanted * exp2(middle)) <= budget) lo = middle;
        else hi = middle;
    }
    double left = budget - cost_of(&p, budget / wanted * exp2(lo));
    for (size_t k = 0; k < n; k++) {
        const int low = samples_of(&p, k, budget / wanted * exp2(lo)),
                  high = samples_of(&p, k, budget / wanted * exp2(hi));
        const double more = p.cost[k] * (high - low);
        a->spp[k] = more <= left ? high : low;
        if (more <= left) left -= more;
    }
}

/* What an evaluation has seen of a tile, at one sample a pixel. */
static void look(const struct imp__allocation *a, size_t tile,
                 double sum[IMP_ALLOCATION_SEES])
{
    memset(sum, 0, IMP_ALLOCATION_SEES * sizeof *sum);
    for (size_t i = 0; i < each(a); i++) {
        double item;
        memcpy(&item, &a->seen[tile * each(a) + i], sizeof item);
        sum[i % IMP_ALLOCATION_SEES] += item;
    }
    sum[0] = imp_max(sum[0], 0.0) * a->spp[tile];
    sum[1] = imp_max(sum[1], 0.0) * a->spp[tile];
    sum[2] /= a->spp[tile];
}

void imp__allocation_update(struct imp__allocation *a)
{
    double *share = a->state, *cost = a->state + a->n, *looks = a->state + 2 * a->n;
    double all[2] = {0, 0}, tile[IMP_ALLOCATION_SEES];
    if (!a->measured) return;
    a->measured = false;
    for (size_t k = 0; k < a->n; k++) {
        look(a, k, tile);
        all[0] += tile[0];
        all[1] += tile[1];
    }
    if (!(all[0] > 0) || !isfinite(all[0] + all[1])) return;
    const double old = *looks > 0 ? fmin(MEMORY, *looks / (*looks + 1)) : 0;
    const double by_loss = all[1] > 0 ? LOSS / all[1] : 0;
    for (size_t k = 0; k < a->n; k++) {
        look(a, k, tile);
        const double now = tile[0] / all[0] + tile[1] * by_loss;
        share[k] = old * share[k] + (1 - old) * now;
        cost[k] = old * cost[k] + (1 - old) * tile[2];
    }
    ++*looks;
    imp__allocation_place(a);
}

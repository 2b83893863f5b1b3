/* SPDX-License-Identifier: Apache-2.0
 *
 * The unit in which a job sums gradients of many values in fixed point: a few of its
 * items are run first, to find the size of their terms. */
#include "gradient_job.h"

#define LOOKS      64 /* one item in so many is run to find the size of terms, */
#define LOOKS_MOST 16 /* at first at most so many items */
#define SPARE_BITS 12 /* terms up to 2^12 times as large fit; else all is redone */

static double terms_most(const struct imp__gradient_job *j)
{
    return (double)imp__tiles_count(&j->tiles) * (double)j->parts *
           (double)j->problem->n_targets;
}

/* Largest terms of mean and spread over some tiles; over more tiles where these have
 * none. Every rank of a team computes this by itself. */
static enum imp_status terms_look(struct imp__gradient_job *j,
                                  const struct imp_tiles_pass *run, double largest[2])
{
    const size_t all = imp__tiles_count(&j->tiles) * run->parts;
    struct imp__team *team = j->problem->ctx->team;
    struct imp_fixed_sum mean = {0}, spread = {0};
    struct imp_tiles_pass pass = *run;
    enum imp_status st = IMP_OK;
    pass.fraction_hi = run->fraction_lo + 0.01 * (run->fraction_hi - run->fraction_lo);
    j->look = true;
    if (team) team->alone++;
    j->mean = &mean;
    j->spread = &spread;
    for (size_t n = imp_clamp(all / LOOKS, (size_t)1, (size_t)LOOKS_MOST);
         mean.bits == 0 && st == IMP_OK; n *= 4) {
        pass.every = imp_max(all / n, (size_t)1);
        st = imp__tiles_run(&j->tiles, &pass);
        if (pass.every == 1) break;
    }
    j->look = false;
    if (team) team->alone--;
    j->tiles.drops = (struct imp_drops){0};
    largest[0] = imp__fixed_largest(&mean);
    largest[1] = imp__fixed_largest(&spread);
    return st;
}

/* A merge of parts takes their unit. */
enum imp_status imp__gradient_unit(struct imp__gradient_job *j,
                                   const struct imp_tiles_pass *run)
{
    struct imp__totals *to = j->totals;
    imp_context *ctx = j->problem->ctx;
    const double all = (double)imp__tiles_count(&j->tiles) * (double)run->parts;
    const double terms = fmax(terms_most(j), all);
    double largest[2] = {0, 0};
    bool known = false;
    enum imp_status st = IMP_OK;
    if (imp__team_merges(ctx))
        IMP_TRY(imp__team_keep(ctx, largest, sizeof largest, &known));
    if (!known) IMP_TRY(terms_look(j, run, largest));
    if (imp__team_part(ctx))
        IMP_TRY(imp__team_keep(ctx, largest, sizeof largest, &known));
    if (largest[0] == 0) return IMP_OK;
    imp__fixed_begin(&to->mean, largest[0], SPARE_BITS, terms);
    imp__fixed_begin(&to->spread, largest[1], 2 * SPARE_BITS, terms);
    to->unit_known = true;
out:
    return st;
}

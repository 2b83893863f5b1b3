/* SPDX-License-Identifier: Apache-2.0
 *
 * The samples of each tile of a job: the same everywhere, or those of an allocation. */
#include "allocation.h"
#include "gradient_job.h"

/* May the job's tiles differ, and has the problem an allocation? */
static struct imp__allocation *allocation_of(const struct imp__gradient_job *j)
{
    return j->target && !j->splat && imp__allocation_allowed(j->target, &j->tracer)
               ? j->problem->allocation
               : NULL;
}

struct imp__replicates imp__gradient_plan(const struct imp__gradient_job *j, size_t tile)
{
    if (!j->allocation) return j->plan;
    const size_t k = j->first_tile + tile;
    struct imp_run own = *j->run;
    own.spp = j->allocation->spp[k];
    if (own.spp == j->allocation->even[k]) return j->plan;
    return imp__replicates_loss(j->problem, j->target, &own);
}

/* The share of pixels that have walks. */
static double counted(const struct imp__gradient_job *j)
{
    const struct imp_tiles *t = &j->tiles;
    size_t in = 0;
    for (int y = 0; y < t->height; y++)
        for (int x = 0; x < t->width; x++) in += imp__gradient_counts(j, x, y);
    return (double)imp_max(in, (size_t)1) / ((double)t->width * t->height);
}

void imp__gradient_samples(struct imp__gradient_job *j)
{
    struct imp_tiles *t = &j->tiles;
    double walks = (double)t->width * t->height * j->plan.n * j->plan.R;
    j->parts = (size_t)j->plan.chunks;
    j->allocation = allocation_of(j);
    if (j->allocation) {
        walks = 0;
        j->first_tile = imp__allocation_take(j->allocation, imp__tiles_count(t));
        for (size_t k = 0; k < imp__tiles_count(t); k++) {
            const struct imp__replicates r = imp__gradient_plan(j, k);
            const int x0 = (int)(k % (size_t)t->across) * t->side,
                      y0 = (int)(k / (size_t)t->across) * t->side;
            walks += (double)imp_min(t->side, t->width - x0) *
                     imp_min(t->side, t->height - y0) * r.n * r.R;
            j->parts = imp_max(j->parts, (size_t)r.chunks);
        }
    }
    t->walks = walks * counted(j);
}

const struct imp__metric *imp__gradient_metric(const struct imp__gradient_job *j)
{
    return j->want_gradient && j->allocation ? j->allocation->metric : NULL;
}

void imp__gradient_see(const struct imp__gradient_job *j, const struct imp_tile *tile,
                       const struct imp_tally *tally, double loss_variance)
{
    if (!imp__gradient_metric(j) || j->look) return;
    imp__allocation_see(j->allocation, j->first_tile + tile->index, tile->part,
                        (double[]){tally->measured, loss_variance, tally->rays});
}

enum imp_status imp__gradient_seen(const struct imp__gradient_job *j)
{
    if (!imp__gradient_metric(j)) return IMP_OK;
    return imp__allocation_share(j->allocation, j->first_tile,
                                 imp__tiles_count(&j->tiles));
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * A picture by walks from the lights with its derivative pictures, as Gauss-Newton matrices
 * need them. What a walk adds to a pixel has a derivative of its own: each reach of a walk
 * is swept by itself, over the vertices up to the one it comes from. */
#include "lanes.h"
#include "light_gradient.h"
#include <string.h>

struct rows {
    const struct imp_tracer *tracer;
    int channels;
};

static void reach_row(const void *payload, const struct imp_light_walk *walk,
                      const struct imp_reach *reach, double *value)
{
    const struct rows *r = payload;
    const size_t C = (size_t)r->channels, n = (size_t)reach->number + 1;
    struct imp_entry few[16], *entry = few;
    memset(few, 0, sizeof few);
    for (size_t k = 0; k < (r->tracer->active->n + 1) * C; k++) value[k] = 0;
    for (size_t c = 0; c < C; c++) value[c] = reach->L[c];
    if (n > imp_count(few)) entry = imp__alloc(r->tracer->scene->ctx, n, sizeof *entry);
    if (!entry) { /* said by a number that is none */
        value[0] = NAN;
        return;
    }
    if (reach->met) entry[n - 1].e = imp__spec(1);
    else entry[n - 1].b = imp__spec(1);
    struct imp_walk own = walk->walk;
    struct imp_vertex *const rest = reach->vertex->next;
    reach->vertex->next = NULL;
    own.last = reach->vertex;
    own.n = (int)n;
    own.entry = entry;
    imp__walk_fold(&own);
    imp__lanes_sweep(r->tracer, &own, value + C);
    reach->vertex->next = rest;
    if (entry != few) imp__release(r->tracer->scene->ctx, entry);
}

enum imp_status imp__light_rows(const struct imp_tracer *tracer,
                                const struct imp_run *run, int64_t first, int64_t walks,
                                double lo, double hi, double *mean)
{
    const struct rows rows = {tracer, tracer->scene->channels};
    const size_t n = (tracer->active->n + 1) * (size_t)rows.channels;
    const struct imp_light_picture picture = {.tracer = tracer,
                                              .run = run,
                                              .stage = "gauss-newton",
                                              .n = (int)n,
                                              .values = reach_row,
                                              .payload = &rows,
                                              .first = first,
                                              .walks = walks,
                                              .lo = lo,
                                              .hi = hi};
    return imp__light_picture_make(&picture, mean, NULL, NULL);
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures by light walks, or bidirectional walks, with their derivative pictures. Each
 * contribution of a walk to a pixel has a derivative of its own: it is swept by itself,
 * over the vertices up to the one it comes from. In a bidirectional sample the
 * contribution of the walk from the sensor is swept with all its connections. */
#include "film/film_picture.h"
#include "inverse/estimate/channel_sink.h"
#include "light_gradient.h"
#include "walk/both/both.h"
#include <string.h>

struct rows {
    const struct imp_tracer *tracer;
    int channels;
    const double *x_dot; /* forward mode: the direction; NULL: all values */
};

/* The one reach with an adjoint, which is 1 in every lane. NULL: no memory. */
static imp_spec *adjoint_of(const struct imp_tracer *tracer,
                            const struct imp_light_walk *walk,
                            const struct imp_reach *reach)
{
    imp_spec *P = imp__arena_array(walk->arena, (size_t)walk->n_reach, sizeof *P);
    size_t k = 0;
    if (!P) return NULL;
    for (const struct imp_reach *other = walk->reach; other != reach; other = other->next)
        k++;
    P[k] = imp__lanes_one(tracer, &walk->walk);
    return P;
}

/* Row of the walk from the sensor: x [active->n][channels]. */
static bool eye_row(const struct imp_tracer *tracer, const struct imp_light_walk *walk,
                    const struct imp_reach *reach, double *x)
{
    struct imp_light_walk own = *walk;
    struct imp_lanes lanes = imp__lanes_into(tracer, &walk->walk, x);
    const imp_spec *P = adjoint_of(tracer, walk, reach);
    return P && imp__light_walk_sweep(tracer, walk->arena, &own, P, 1, &lanes.sink);
}

static bool light_row(const struct imp_tracer *tracer, const struct imp_light_walk *walk,
                      const struct imp_reach *reach, double *x)
{
    const size_t n = (size_t)reach->number + 1;
    struct imp_entry *entry = imp__arena_array(walk->arena, n, sizeof *entry);
    if (!entry) return false;
    if (reach->met) entry[n - 1].e = imp__spec(1);
    else entry[n - 1].b = imp__spec(1);
    struct imp_walk own = walk->walk;
    struct imp_vertex *const rest = reach->vertex->next;
    reach->vertex->next = NULL;
    own.last = reach->vertex;
    own.n = (int)n;
    own.entry = entry;
    imp__walk_fold(&own);
    imp__lanes_sweep(tracer, &own, x);
    reach->vertex->next = rest;
    return true;
}

void imp__light_row(const struct imp_tracer *tracer, const struct imp_light_walk *walk,
                    const struct imp_reach *reach, double *value)
{
    const size_t C = (size_t)tracer->scene->channels;
    for (size_t k = 0; k < (tracer->active->n + 1) * C; k++) value[k] = 0;
    for (size_t c = 0; c < C; c++) value[c] = reach->L[c];
    const bool done = reach->vertex ? light_row(tracer, walk, reach, value + C)
                                    : eye_row(tracer, walk, reach, value + C);
    if (!done) value[0] = NAN; /* NAN: no memory */
}

static void reach_row(const void *payload, const struct imp_light_walk *walk,
                      const struct imp_reach *reach, double *value)
{
    const struct rows *r = payload;
    imp__light_row(r->tracer, walk, reach, value);
}

/* value [channels]: the derivative along x_dot. */
static void reach_tangent(const void *payload, const struct imp_light_walk *walk,
                          const struct imp_reach *reach, double *value)
{
    const struct rows *r = payload;
    struct imp_light_walk own = *walk;
    imp_spec L_dot = {0};
    const imp_spec *P = adjoint_of(r->tracer, walk, reach);
    const bool done =
        P && imp__light_walk_tangent(r->tracer, walk->arena, &own, P, r->x_dot, &L_dot);
    const imp_spec seen = imp__walk_seen(&walk->walk, L_dot);
    for (int c = 0; c < r->channels; c++) value[c] = done ? seen[c] : NAN;
}

static struct imp_light_picture picture_of(const struct rows *rows, const char *stage,
                                           const struct imp_run *run)
{
    const size_t n = (rows->tracer->active->n + 1) * (size_t)rows->channels;
    return (struct imp_light_picture){.tracer = rows->tracer,
                                      .run = run,
                                      .stage = stage,
                                      .n = (int)n,
                                      .values = reach_row,
                                      .payload = rows,
                                      .walks =
                                          imp__light_walks_of(run, rows->tracer->sensor)};
}

enum imp_status imp__light_rows(const struct imp_tracer *tracer,
                                const struct imp_run *run, int64_t first, int64_t walks,
                                double lo, double hi, double *mean)
{
    const struct rows rows = {tracer, tracer->scene->channels, NULL};
    struct imp_light_picture picture = picture_of(&rows, "gauss-newton", run);
    picture.first = first;
    picture.walks = walks;
    picture.lo = lo;
    picture.hi = hi;
    return imp__light_picture_make(&picture, mean, NULL, NULL);
}

static const char *names_of(const struct rows *r)
{
    return r->channels == 3 ? "R,G,B" : "Y";
}

enum imp_status imp__light_jacobian(const struct imp_tracer *tracer,
                                    const struct imp_run *run, imp_film **out)
{
    const struct rows rows = {tracer, tracer->scene->channels, NULL};
    const struct imp_light_picture picture = picture_of(&rows, "jacobian", run);
    return imp__light_films_make(&picture, names_of(&rows), (int)tracer->active->n + 1,
                                 out);
}

enum imp_status imp__light_forward(const struct imp_tracer *tracer, const double *x_dot,
                                   const struct imp_run *run, imp_film **out)
{
    const struct rows rows = {tracer, tracer->scene->channels, x_dot};
    struct imp_light_picture picture = picture_of(&rows, "derivative", run);
    picture.n = rows.channels;
    picture.values = reach_tangent;
    return imp__light_films_make(&picture, names_of(&rows), 1, out);
}

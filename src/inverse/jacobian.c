/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivative pictures: in one direction (tangent along each walk), or one for every
 * active number from the same walks (sweep with adjoint 1, channels kept apart). */
#include "estimate.h"
#include "film/film_picture.h"
#include "lanes.h"
#include "walk/run.h"
#include <stdio.h>
#include <string.h>

#define JACOBIAN_MAX 256

struct forward {
    struct imp_tracer tracer;
    const double *x_dot;
    int channels;
};

static bool sample_tangent(const void *payload, struct imp_arena *arena, int x, int y,
                           int64_t sample, double *value, double *px, double *py)
{
    const struct forward *f = payload;
    struct imp_walk walk;
    imp__walk_trace(&f->tracer, arena, x, y, sample, &walk);
    const imp_spec L_dot = imp__walk_tangent(&f->tracer, &walk, f->x_dot);
    for (int c = 0; c < f->channels; c++) value[c] = L_dot[c];
    *px = walk.px;
    *py = walk.py;
    return walk.dropped == IMP_DROP_NONE;
}

enum imp_status imp_problem_forward(imp_problem *p, const double *x_dot,
                                    const struct imp_run *run, imp_film **out)
{
    struct imp_run own;
    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, x_dot, "x_dot");
    IMP_REQUIRE(p->ctx, out, "out");
    IMP_RUN(p->ctx, own, run);
    IMP_FINITE_ALL(p->ctx, x_dot, p->n, "x_dot");
    IMP_FLOAT_MODE;
    IMP_READS(p->scene);
    struct forward f = {.x_dot = x_dot, .channels = p->scene->channels};
    const enum imp_status st = imp__problem_tracer(p, &own, &f.tracer);
    if (st != IMP_OK) return st;
    const struct imp_picture picture = {f.tracer.sensor,
                                        "derivative",
                                        f.channels == 3 ? "R,G,B" : "Y",
                                        f.channels,
                                        sample_tangent,
                                        &f,
                                        NULL};
    return imp__picture_make(p->ctx, &picture, &own, out);
}

struct jacobian {
    struct imp_tracer tracer;
    int channels;
};

/* value: the radiance, then [n][channels]. */
static bool sample_jacobian(const void *payload, struct imp_arena *arena, int x, int y,
                            int64_t sample, double *value, double *px, double *py)
{
    const struct jacobian *j = payload;
    return imp__lanes_sample(&j->tracer, arena, x, y, sample, j->channels, value, px, py);
}

/* Channels [first, first + n) of a wide film, as a film of its own. */
static enum imp_status film_slice(imp_context *ctx, const imp_film *from, size_t first,
                                  int n, imp_film **out)
{
    imp_film *film;
    const enum imp_status st = imp__film_create(ctx, from->width, from->height,
                                                n == 3 ? "R,G,B" : "Y", true, &film);
    if (st != IMP_OK) return st;
    film->spp = from->spp;
    film->dropped = from->dropped;
    for (size_t p = 0; p < (size_t)from->width * (size_t)from->height; p++) {
        const size_t at = p * (size_t)from->channels + first;
        memcpy(film->mean + p * (size_t)n, from->mean + at,
               (size_t)n * sizeof *film->mean);
        memcpy(film->se + p * (size_t)n, from->se + at, (size_t)n * sizeof *film->se);
    }
    *out = film;
    return IMP_OK;
}

enum imp_status imp_problem_jacobian(imp_problem *p, const struct imp_run *run,
                                     imp_film **primal, imp_film **films)
{
    struct imp_run own;
    IMP_REQUIRE(NULL, p, "problem");
    if (p->n > 0) IMP_REQUIRE(p->ctx, films, "films");
    if (!films) IMP_REQUIRE(p->ctx, primal, "primal");
    IMP_RUN(p->ctx, own, run);
    if ((p->n == 0 && films) || p->n > JACOBIAN_MAX)
        return imp__error(
            p->ctx, IMP_E_ARG,
            "%zu numbers are active; derivative pictures are made of 1 to %d", p->n,
            JACOBIAN_MAX);
    enum imp_status st = IMP_OK;
    imp_context *ctx = p->ctx;
    IMP_FLOAT_MODE;
    IMP_READS(p->scene);
    const size_t C = (size_t)p->scene->channels;
    struct jacobian j = {.channels = p->scene->channels};
    imp_film *all = NULL, *first = NULL;
    imp_film **made = imp__alloc(ctx, p->n + 1, sizeof *made);
    char *names = imp__alloc(ctx, (p->n + 1) * C, 12);
    if (!made || !names) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory"));
    for (size_t k = 0, used = 0; k < (p->n + 1) * C; k++)
        used += (size_t)snprintf(names + used, 12, "%s%zu", k ? "," : "", k);
    IMP_TRY(imp__problem_tracer(p, &own, &j.tracer));
    const struct imp_picture picture = {
        j.tracer.sensor, "jacobian", names, (int)((p->n + 1) * C),
        sample_jacobian, &j,         NULL};
    st = imp__picture_make(ctx, &picture, &own, &all);
    if (st != IMP_OK && st != IMP_CANCELLED) goto out;
    const enum imp_status ended = st;
    for (size_t k = 0; k < p->n; k++)
        IMP_TRY(film_slice(ctx, all, (k + 1) * C, (int)C, &made[k]));
    IMP_TRY(film_slice(ctx, all, 0, (int)C, &first));
    if (films) memcpy(films, made, p->n * sizeof *made);
    memset(made, 0, p->n * sizeof *made);
    if (primal) {
        *primal = first;
        first = NULL;
    }
    st = ended;
out:
    for (size_t k = 0; made && k < p->n; k++) imp_film_destroy(made[k]);
    imp_film_destroy(first);
    imp_film_destroy(all);
    imp__release(ctx, made);
    imp__release(ctx, names);
    return st;
}

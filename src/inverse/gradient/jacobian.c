/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivative pictures: in one direction (tangent along each walk), or one for every
 * active value from the same walks (sweep with adjoint 1, channels kept apart). */
#include "film/film_picture.h"
#include "inverse/estimate/channel_sink.h"
#include "inverse/estimate/problem_tracer.h"
#include "inverse/estimate/replicates.h"
#include "light_gradient.h"
#include "walk/run/run.h"
#include <string.h>

#define JACOBIAN_MAX 256

struct forward {
    struct imp_tracer tracer;
    const double *x_dot;
    int channels;
};

static void sample_tangent(const void *payload, struct imp_sample *s)
{
    const struct forward *f = payload;
    struct imp_walk walk;
    imp__sample_walk(s, &f->tracer, &walk);
    const imp_spec L_dot = imp__walk_tangent(&f->tracer, &walk, f->x_dot);
    for (int c = 0; c < f->channels; c++) s->value[c] = L_dot[c];
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
    enum imp_status st = imp__problem_same(p, &own, "forward");
    if (st == IMP_OK) st = imp__problem_tracer_of_any_end(p, &own, NULL, &f.tracer);
    if (st != IMP_OK) return st;
    imp__problem_tell(p, &f.tracer);
    if (f.tracer.integrator->from_lights)
        return imp__light_forward(&f.tracer, x_dot, &own, out);
    const struct imp_picture picture = {
        .sensor = f.tracer.sensor,
        .stage = "derivative",
        .names = f.channels == 3 ? "R,G,B" : "Y",
        .n = f.channels,
        .sample = sample_tangent,
        .payload = &f,
        .set = imp__tracer_set(&f.tracer, imp__walks_of(&own, f.tracer.sensor)),
        .nets = f.tracer.points != NULL};
    return imp__picture_make(p->ctx, &picture, &own, out);
}

/* value: the radiance, then [n][channels]. */
static void sample_jacobian(const void *payload, struct imp_sample *s)
{
    imp__lanes_sample(payload, s);
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
    const int C = p->scene->channels, n = (int)p->n + 1;
    struct imp_tracer tracer;
    imp_film **made = imp__alloc(ctx, (size_t)n, sizeof *made);
    if (!made) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory"));
    IMP_TRY(imp__problem_same(p, &own, "jacobian"));
    IMP_TRY(imp__problem_tracer_of_any_end(p, &own, NULL, &tracer));
    imp__problem_tell(p, &tracer);
    const struct imp_picture picture = {
        .sensor = tracer.sensor,
        .stage = "jacobian",
        .names = C == 3 ? "R,G,B" : "Y",
        .n = n * C,
        .sample = sample_jacobian,
        .payload = &tracer,
        .n_films = n,
        .set = imp__tracer_set(&tracer, imp__walks_of(&own, tracer.sensor)),
        .nets = tracer.points != NULL};
    st = tracer.integrator->from_lights ? imp__light_jacobian(&tracer, &own, made)
                                        : imp__picture_make(ctx, &picture, &own, made);
    if (st != IMP_OK && st != IMP_CANCELLED) goto out;
    if (films) memcpy(films, made + 1, p->n * sizeof *made);
    if (primal) *primal = made[0];
    else imp_film_destroy(made[0]);
out:
    imp__release(ctx, made);
    return st;
}

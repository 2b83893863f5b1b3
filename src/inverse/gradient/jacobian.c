/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivative pictures: in one direction (tangent along each walk), or one for every
 * active value from the same walks (sweep with adjoint 1, channels kept apart). */
#include "film/film_picture.h"
#include "inverse/estimate/moved_pictures.h"
#include "inverse/estimate/problem_tracer.h"
#include "inverse/estimate/replicates.h"
#include "light_gradient.h"
#include "walk/run/run.h"
#include <string.h>

#define JACOBIAN_MAX 256

struct forward {
    struct imp_tracer tracer;
    const struct imp__moved_gradient *moved; /* NULL: no pose is active */
    const double *x_dot;
    int channels;
};

/* What poses need beside the walks; moved->tracer is NULL where none is active. */
static enum imp_status poses_begin(const struct imp_problem *p, struct forward *f,
                                   struct imp__moved_gradient *moved)
{
    if (!imp__problem_moves(p)) return IMP_OK;
    IMP_CHECKED(imp__moved_begin(p, &f->tracer, moved));
    IMP_CHECKED(imp__moved_learn(moved, IMP_MOVED_PILOT));
    if (moved->moves.n > 0) f->moved = moved;
    return IMP_OK;
}

/* The draws from edges of n pictures of numbers, or of one along f->x_dot: added to films, as many
 * for each pixel as these have samples. films NULL: a part. */
static enum imp_status poses_add(const struct forward *f, const struct imp_run *run,
                                 size_t n, imp_film *const *films)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = f->tracer.scene->ctx;
    const struct imp_film_desc *film = &f->tracer.sensor->film;
    if (!f->moved) return IMP_OK;
    const size_t values =
        (size_t)film->crop_w * (size_t)film->crop_h * n * (size_t)f->channels;
    double *mean = imp__alloc(ctx, 2 * values, sizeof *mean);
    if (!mean) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for derivative pictures"));
    struct imp_run own = *run;
    own.progress = NULL; /* films that were interrupted get their draws, too */
    const struct imp__moved_run r = {
        &own, "edges", 0, films ? films[0]->spp : imp__walks_of(run, f->tracer.sensor)};
    if (r.spp > 0)
        IMP_TRY(imp__moved_pictures(f->moved, &r, f->x_dot, mean, mean + values));
    for (size_t k = 0; films && r.spp > 0 && k < n; k++)
        imp__moved_film_add(films[k], 0, f->channels, k, n, mean, mean + values);
out:
    imp__release(ctx, mean);
    return st;
}

/* The films of a picture, the last n of which get what poses have at edges. As imp__picture_make. */
static enum imp_status picture_and_poses(const struct forward *f,
                                         const struct imp_picture *picture,
                                         const struct imp_run *run, size_t n,
                                         imp_film **out)
{
    imp_context *ctx = f->tracer.scene->ctx;
    const size_t all = (size_t)imp_max(picture->n_films, 1);
    const enum imp_status made = imp__picture_make(ctx, picture, run, out);
    if (made != IMP_OK && made != IMP_CANCELLED && made != IMP_PART) return made;
    if (made == IMP_CANCELLED && !out[0]) return made;
    const enum imp_status st =
        poses_add(f, run, n, made == IMP_PART ? NULL : out + (all - n));
    if (st == IMP_OK) return made;
    for (size_t k = 0; k < all && made != IMP_PART; k++) {
        imp_film_destroy(out[k]);
        out[k] = NULL;
    }
    return st;
}

static void sample_tangent(const void *payload, struct imp_sample *s)
{
    const struct forward *f = payload;
    struct imp_walk walk;
    imp__sample_walk(s, &f->tracer, &walk);
    const imp_spec L_dot = imp__walk_tangent(&f->tracer, &walk, f->x_dot);
    for (int c = 0; c < f->channels; c++) s->value[c] = L_dot[c];
    if (imp_likely(!f->moved) || s->dropped != IMP_DROP_NONE) return;
    const size_t K = f->tracer.active->n, C = (size_t)f->channels;
    double *row = imp__arena_array(s->arena, K * C, sizeof *row);
    if (!row || !imp__moved_rows(f->moved, s->arena, &walk, row))
        s->dropped = IMP_DROP_MEMORY;
    for (size_t k = 0; row && k < K; k++)
        for (size_t c = 0; c < C; c++) s->value[c] += f->x_dot[k] * row[k * C + c];
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
    struct imp__moved_gradient moved = {0};
    imp_film *made = NULL;
    enum imp_status st = imp__problem_same(p, &own, "forward");
    p->edge_terms = true;
    if (st == IMP_OK) st = imp__problem_tracer_of_any_end(p, &own, NULL, &f.tracer);
    p->edge_terms = false;
    if (st == IMP_OK) st = poses_begin(p, &f, &moved);
    IMP_TRY(st);
    imp__problem_tell(p, &f.tracer);
    if (f.tracer.integrator->from_lights) {
        st = imp__light_forward(&f.tracer, x_dot, &own, out);
        goto out;
    }
    const struct imp_picture picture = {
        .sensor = f.tracer.sensor,
        .stage = "derivative",
        .walks = imp__bundle_use(&f.tracer),
        .names = f.channels == 3 ? "R,G,B" : "Y",
        .n = f.channels,
        .sample = sample_tangent,
        .payload = &f,
        .set = imp__tracer_set(&f.tracer, imp__walks_of(&own, f.tracer.sensor)),
        .points = imp__tracer_sets(&f.tracer)};
    st = picture_and_poses(&f, &picture, &own, 1, &made);
    if (made) *out = made;
out:
    imp__moved_end(&moved);
    return st;
}

/* value: the radiance, then [n][channels]. */
static void sample_jacobian(const void *payload, struct imp_sample *s)
{
    const struct forward *f = payload;
    imp__moved_sample(f->moved, &f->tracer, s);
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
    struct forward f = {.channels = C};
    struct imp__moved_gradient moved = {0};
    imp_film **made = imp__alloc(ctx, (size_t)n, sizeof *made);
    if (!made) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory"));
    IMP_TRY(imp__problem_same(p, &own, "jacobian"));
    p->edge_terms = true;
    st = imp__problem_tracer_of_any_end(p, &own, NULL, &f.tracer);
    p->edge_terms = false;
    IMP_TRY(st);
    IMP_TRY(poses_begin(p, &f, &moved));
    const struct imp_tracer *tracer = &f.tracer;
    imp__problem_tell(p, tracer);
    const struct imp_picture picture = {
        .sensor = tracer->sensor,
        .stage = "jacobian",
        .walks = imp__bundle_use(tracer),
        .names = C == 3 ? "R,G,B" : "Y",
        .n = n * C,
        .sample = sample_jacobian,
        .payload = &f,
        .n_films = n,
        .set = imp__tracer_set(tracer, imp__walks_of(&own, tracer->sensor)),
        .points = imp__tracer_sets(tracer)};
    st = tracer->integrator->from_lights
             ? imp__light_jacobian(tracer, &own, made)
             : picture_and_poses(&f, &picture, &own, p->n, made);
    if (st != IMP_OK && st != IMP_CANCELLED) goto out;
    if (films) memcpy(films, made + 1, p->n * sizeof *made);
    if (primal) *primal = made[0];
    else imp_film_destroy(made[0]);
out:
    imp__moved_end(&moved);
    imp__release(ctx, made);
    return st;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Gradients by poses, inside walks and at edges (moved_gradient.h). */
#include "moved_gradient.h"
#include "base/arguments.h"
#include "inverse/problem/problem.h"
#include "scene/pose.h"
#include <string.h>

static const struct imp_pose *next_active(const struct imp_problem *p,
                                          const struct imp_pose *from)
{
    while (from && p->active.base[from->param] < 0) from = from->next;
    return from;
}

bool imp__moved_wanted(const struct imp_problem *p)
{
    return next_active(p, p->scene->poses) != NULL;
}

/* A mover for each active pose, about where the object's centre is now. */
static enum imp_status movers_add(const struct imp_problem *p,
                                  struct imp__moved_gradient *m)
{
    const struct imp_sensor *sensor = m->tracer->sensor;
    int n = 0;
    for (const struct imp_pose *q = p->scene->poses; q; q = q->next) n++;
    m->pose = imp__alloc(p->ctx, (size_t)n, sizeof *m->pose);
    if (!m->pose) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for poses");
    for (const struct imp_pose *q = next_active(p, p->scene->poses); q;
         q = next_active(p, q->next)) {
        if (q->sensor && q->sensor != sensor) continue; /* it is not looked through */
        IMP_CHECKED(imp__moves_add_pose(&m->moves, q));
        m->pose[m->moves.n_movers - 1] = q;
    }
    return IMP_OK;
}

/* What the adjoint image makes of light at a film position. */
static double adjoint_at(const void *payload, const struct imp__flux *f)
{
    const struct imp__moved_gradient *m = payload;
    const struct imp_film_desc *film = &m->tracer->sensor->film;
    const size_t C = (size_t)m->tracer->scene->channels;
    struct imp_splat_taps taps;
    double sum = 0;
    imp__splat_taps(film, &m->scale, f->px, f->py, &taps);
    for (int j = 0; j < taps.down.n; j++)
        for (int i = 0; i < taps.across.n; i++) {
            const float *from =
                m->seed + ((size_t)(taps.down.first + j) * (size_t)film->crop_w +
                           (size_t)(taps.across.first + i)) *
                              C;
            double here = 0;
            for (size_t c = 0; c < C; c++) here += (double)from[c] * f->L[c];
            sum += taps.down.w[j] * taps.across.w[i] * here;
        }
    return sum;
}

enum imp_status imp__moved_begin(const struct imp_problem *p,
                                 const struct imp_tracer *tracer, const float *seed,
                                 int spp, struct imp__moved_gradient *out)
{
    const struct imp_film_desc *film = &tracer->sensor->film;
    enum imp_status st = IMP_OK;
    *out = (struct imp__moved_gradient){.tracer = tracer, .seed = seed};
    out->moves = imp__moves_begin(p->scene, tracer->sensor);
    IMP_TRY(imp__moved_allowed(tracer));
    IMP_TRY(movers_add(p, out));
    IMP_TRY(imp__edges_build(p->scene, &out->edges));
    IMP_TRY(imp__boundary_begin(tracer, &out->moves, &out->edges, &out->boundary));
    IMP_TRY(imp__splat_scale_create(p->ctx, film, &out->scale));
    IMP_TRY(imp__boundary_learn(
        &out->boundary, (int64_t)film->crop_w * film->crop_h * spp, adjoint_at, out));
out:
    return st;
}

void imp__moved_end(struct imp__moved_gradient *m)
{
    if (!m->tracer) return;
    imp_context *ctx = m->tracer->scene->ctx;
    imp__splat_scale_destroy(ctx, &m->scale);
    imp__boundary_free(&m->boundary);
    if (m->edges.ctx) imp__edges_free(&m->edges);
    imp__moves_free(&m->moves);
    imp__release(ctx, m->pose);
    *m = (struct imp__moved_gradient){0};
}

/* From adjoints of velocities, which it overwrites, to the numbers of parameters. */
static void numbers_add(const struct imp__moved_gradient *m, double *bar,
                        struct imp_sink *sink)
{
    for (int k = 0; k < m->moves.n_movers; k++) {
        const struct imp_pose *pose = m->pose[k];
        double *own = bar + m->moves.mover[k].first;
        imp__pose_numbers_bar(pose, own);
        for (size_t e = 0; e < pose->n; e++) {
            const imp_spec lanes = {own[e], 0, 0, 0};
            if (own[e] != 0) sink->add(sink, pose->param, e, 1, &lanes);
        }
    }
}

bool imp__moved_walk(const struct imp__moved_gradient *m, struct imp_arena *arena,
                     const struct imp_walk *walk, imp_spec adjoint, struct imp_sink *sink)
{
    double *bar = imp__arena_array(arena, m->moves.n, sizeof *bar);
    if (!bar || !imp__moved_sweep(m->tracer, arena, &m->moves, walk, adjoint, bar))
        return false;
    numbers_add(m, bar, sink);
    return true;
}

bool imp__moved_draws(const struct imp__moved_gradient *m, struct imp_arena *arena,
                      struct imp__replicates plan, int x, int y, int b,
                      struct imp_sink *sink)
{
    static const int times[IMP_BOUNDARY_KINDS] = {
        [IMP_BOUNDARY_FILM] = 1, [IMP_BOUNDARY_LIGHT] = 1, [IMP_BOUNDARY_SCATTER] = 4};
    const struct imp_film_desc *film = &m->tracer->sensor->film;
    const int margin = m->scale.margin, width = film->crop_w + 2 * margin;
    const int64_t pixels = (int64_t)width * (film->crop_h + 2 * margin);
    const int64_t pixel = (int64_t)(y + margin) * width + x + margin;
    bool no_memory = false, any = false;
    double *bar = imp__arena_array(arena, m->moves.n, sizeof *bar);
    if (!bar) return false;
    for (int kind = 0; kind < IMP_BOUNDARY_KINDS; kind++) {
        const int n = plan.n * times[kind];
        for (int i = 0; i < n && !no_memory; i++) {
            const struct imp_arena_mark mark = imp__arena_mark(arena);
            const int64_t index = ((int64_t)b * n + i) * pixels + pixel;
            for (const struct imp__flux *f = imp__boundary_draw(
                     &m->boundary, arena, (enum imp__boundary_kind)kind, index, pixels,
                     &no_memory);
                 f; f = f->next) {
                imp__flux_bar(&m->moves, f,
                              adjoint_at(m, f) / ((double)n * (double)pixels), bar);
                any = true;
            }
            imp__arena_rewind(arena, mark);
        }
    }
    if (any) numbers_add(m, bar, sink);
    return !no_memory;
}

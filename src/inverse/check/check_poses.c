/* SPDX-License-Identifier: Apache-2.0
 *
 * Poses: recorded walks whose vertices move with the objects they lie on, film positions and
 * scattered directions held, against the derivative inside of walks; one row for each pose, scale, and
 * place or direction of a light, its worst walk and number. Places are moved by these numbers
 * themselves, in double, and not by velocities. Other numbers of geometry have fresh rows alone.
 * What jumps at edges is not in it: fresh rows have that. */
#include "check_moved.h"
#include "inverse/estimate/moved_gradient.h"
#include "kind/emitter/from_point.h"
#include "kind/emitter/ies.h"
#include <math.h>

#define FROZEN_LIMIT 1e-6
/* Where media vary: grids have kinks, and steps that pass none are so small that rounding is more. */
#define KINKS_LIMIT 1e-5
#define TINY                                                                             \
    1e-3 /* of a walk's value per scale of a number: smaller slopes are rounding */
#define N_STEPS                                                                          \
    5 /* the last ones for vertices that slide fast, seen at a grazing angle */
static const double steps[N_STEPS] = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6};

static bool is_of_kind(const struct imp_pose *p)
{
    if (p->emitter && p->emitter->ops->flags & IMP_EMITTER_ENVIRONMENT) return false;
    if (p->group >= 0) return false; /* several instances move by the same numbers */
    return imp__pose_is_rigid(p->kind) || p->kind == IMP_POSE_SCALE ||
           p->kind == IMP_POSE_POSITION || p->kind == IMP_POSE_DIRECTION;
}

/* Has it light of a spot or ies light, whose intensity changes with the direction? */
static bool has_spots(const struct imp_scene *scene, const struct imp_walk *walk)
{
    for (const struct imp_vertex *v = walk->first; v; v = v->next) {
        if (v->d.scatterer != IMP_AT_SKY && v->d.met.emitter >= 0 &&
            scene->emitters[v->d.met.emitter]->ops == &imp__ies_area)
            return true;
        if (v->d.connection != IMP_CONNECTED) continue;
        const struct imp_emitter_ops *ops = scene->emitters[v->d.light.emitter]->ops;
        if (imp__light_frame_of(scene->emitters[v->d.light.emitter]) ||
            ops == &imp__ies_light || ops == &imp__ies_area)
            return true;
    }
    return false;
}

/* A walk's slopes along the numbers against differences, each at its best step; *worst: the row of
 * the largest error so far. */
static void compare(struct imp__moved_by *m, const struct imp_walk *walk, imp_spec P,
                    const double slope[6], struct imp_check_row *worst)
{
    static const double places[4] = {1, -1, 2, -2};
    imp__move_by(m, 0, 0);
    const double still = fabs(imp__frozen_walk(m, walk, P));
    for (size_t e = 0; e < m->pose->n; e++) {
        const double scale = 0.1 * imp__pose_large(m->pose, e);
        struct imp_check_row best = {.error = INFINITY};
        for (int s = 0; s < N_STEPS; s++) {
            const double h = steps[s] * scale;
            double f[4];
            for (int i = 0; i < 4; i++) {
                imp__move_by(m, e, places[i] * h);
                f[i] = imp__frozen_walk(m, walk, P);
            }
            const double d = (8 * (f[0] - f[1]) - (f[2] - f[3])) / (12 * h);
            const double least = fmax(fabs(slope[e]), TINY * still / scale);
            const double error = d == slope[e] ? 0 : fabs(d - slope[e]) / least;
            if (error < best.error)
                best = (struct imp_check_row){
                    .step = h, .value = slope[e], .reference = d, .error = error};
        }
        if (!(best.error <= worst->error) || worst->step == 0) *worst = best;
    }
}

/* The numbers' slopes of a walk, six at most: the part of bar that belongs to the pose. */
struct six {
    struct imp_sink sink; /* first */
    int param;
    double number[6];
};
static void six_add(struct imp_sink *sink, int param, size_t element, int channels,
                    const imp_spec *bar)
{
    struct six *s = (struct six *)sink;
    (void)channels;
    if (param == s->param) s->number[element] += (*bar)[0];
}

static enum imp_status pose_check(struct imp__check *c, struct imp__moved_gradient *g,
                                  struct imp_arena *arena, int mover)
{
    const struct imp_film_desc *film = &c->tracer.sensor->film;
    const uint64_t pixels = (uint64_t)film->crop_w * (uint64_t)film->crop_h;
    struct imp__moved_by m = {.c = c,
                              .pose = g->pose[mover],
                              .shape = g->moves.mover[mover].shape,
                              .from = g->moves.mover[mover].centre};
    struct imp_check_row worst = {0};
    for (int t = 0; t < c->options.paths; t++) {
        const uint64_t pixel = imp__mix64((uint64_t)t + 0x51ed270b) % pixels;
        const struct imp_arena_mark mark = imp__arena_mark(arena);
        struct imp_walk walk;
        imp__walk_trace(&c->tracer, arena, (int)(pixel % (uint64_t)film->crop_w),
                        (int)(pixel / (uint64_t)film->crop_w), t, &walk);
        double *bar = imp__arena_array(arena, g->moves.n, sizeof *bar);
        const imp_spec channels = {1, 0.7, 0.4, 0};
        if (!bar || walk.dropped == IMP_DROP_MEMORY ||
            !imp__moved_walk(g, arena, &walk, channels, bar))
            return imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check");
        struct six six = {{six_add, false}, m.pose->param, {0}};
        imp__moved_numbers(g, bar, (imp_spec){1, 0, 0, 0}, &six.sink);
        if (walk.dropped == IMP_DROP_NONE && walk.valid &&
            !has_spots(c->problem->scene, &walk))
            compare(&m, &walk, imp__walk_values(&c->tracer, &walk, channels), six.number,
                    &worst);
        imp__arena_rewind(arena, mark);
    }
    worst.limit = g->moves.borders.varies ? KINKS_LIMIT : FROZEN_LIMIT;
    worst.ok = worst.error <= worst.limit;
    return imp__check_row(c, "frozen", c->problem->scene->params[m.pose->param].info.name,
                          -1, &worst);
}

enum imp_status imp__check_poses(struct imp__check *c)
{
    enum imp_status st = IMP_OK;
    struct imp__moved_gradient g = {0};
    struct imp_arena arena;
    imp__arena_init(&arena, c->ctx);
    IMP_TRY(imp__moved_begin(c->problem, &c->tracer, &g));
    for (int k = 0; k < g.moves.n_movers; k++) {
        if (is_of_kind(g.pose[k])) IMP_TRY(pose_check(c, &g, &arena, k));
        IMP_TRY(imp__check_progress(c, 0));
    }
out:
    imp__moved_end(&g);
    imp__arena_free(&arena);
    return st;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers of geometry that a design may move: by name, within bounds, to values. */
#include "base/arguments.h"
#include "design_moving.h"
#include "math/vec.h"
#include "scene/pose.h"
#include <math.h>
#include <string.h>

static enum imp_status arrays_take(struct imp__moving *v)
{
    struct imp_arena *arena = v->m->arena;
    v->param = imp__arena_array(arena, 3 * v->n + 1, sizeof *v->param);
    v->first = imp__arena_array(arena, 6 * v->n + 1, sizeof *v->first);
    if (!v->param || !v->first)
        return imp__error(v->m->ctx, IMP_E_NOMEM, "no memory for what moves");
    v->component = v->param + v->n;
    v->lamp = v->param + 2 * v->n;
    double **array[] = {&v->lo, &v->hi, &v->at, &v->p, &v->trial};
    for (size_t k = 0; k < imp_count(array); k++) *array[k] = v->first + (k + 1) * v->n;
    return IMP_OK;
}

static enum imp_status value_of(const struct imp__moving *v, size_t i, double *out)
{
    const struct imp_scene *scene = v->m->scene;
    double value[6];
    const enum imp_status st = imp_scene_get_values(scene, v->param[i], value);
    if (st == IMP_OK) *out = value[v->component[i]];
    return st;
}

static enum imp_status move_of(const struct imp__moving *v,
                               const struct imp_design_move *moves, size_t i,
                               struct imp_design_move *out)
{
    imp_context *ctx = v->m->ctx;
    *out = (struct imp_design_move)IMP_DESIGN_MOVE_INIT;
    IMP_CHECKED(
        imp__element_take(ctx, "imp_design_move", "moves", moves, i, out, sizeof *out));
    IMP_REQUIRE(ctx, out->name, "moves: name");
    IMP_FINITE(ctx, out->lo, "moves: lo");
    IMP_FINITE(ctx, out->hi, "moves: hi");
    return IMP_OK;
}

enum imp_status imp__moving_check(const struct imp__moving *v,
                                  const struct imp_design_move *moves)
{
    struct imp_design_move own;
    for (size_t i = 0; i < v->n; i++) IMP_CHECKED(move_of(v, moves, i, &own));
    return IMP_OK;
}

enum imp_status imp__moving_names(struct imp__moving *v,
                                  const struct imp_design_move *moves)
{
    imp_context *ctx = v->m->ctx;
    struct imp_scene *scene = v->m->scene;
    IMP_CHECKED(arrays_take(v));
    for (size_t i = 0; i < v->n; i++) {
        struct imp_design_move own;
        struct imp_param_info info = {.size = sizeof info};
        IMP_CHECKED(move_of(v, moves, i, &own));
        IMP_CHECKED(imp_scene_add_geometry(scene, own.name));
        IMP_CHECKED(imp_scene_find_param(scene, own.name, &v->param[i]));
        IMP_CHECKED(imp_scene_get_param(scene, v->param[i], &info));
        const struct imp_pose *pose = imp__pose_of(scene, v->param[i]);
        if (!pose || (pose->kind != IMP_POSE_RIGID && pose->kind != IMP_POSE_POSITION &&
                      pose->kind != IMP_POSE_DIRECTION))
            return imp__error(ctx, IMP_E_ARG,
                              "moves[%zu]: '%s' is none of position, direction and pose",
                              i, own.name);
        if (own.component < 0 || (size_t)own.component >= info.count)
            return imp__error(ctx, IMP_E_ARG,
                              "moves[%zu]: '%s' has no component %d; it has %zu numbers",
                              i, own.name, own.component, info.count);
        v->component[i] = (size_t)own.component;
        for (size_t k = 0; k < i; k++)
            if (v->param[k] == v->param[i] && v->component[k] == v->component[i])
                return imp__error(ctx, IMP_E_ARG, "moves[%zu]: '%s', component %d, twice",
                                  i, own.name, own.component);
        IMP_CHECKED(value_of(v, i, &v->first[i]));
        v->at[i] = v->p[i] = v->first[i];
    }
    return IMP_OK;
}

/* Places stay in the box of all shapes less the clearance, directions within the unit cube, turns
 * within half a radian of where they are. */
static void default_bounds(struct imp__moving *v, size_t i, double clearance)
{
    const struct imp_scene *scene = v->m->scene;
    const struct imp_pose *pose = imp__pose_of(scene, v->param[i]);
    const size_t k = v->component[i];
    imp_v3 lo, hi;
    if (pose->kind == IMP_POSE_DIRECTION) {
        const double reach = fmax(1, fabs(v->first[i]));
        v->lo[i] = -reach;
        v->hi[i] = reach;
    } else if (pose->kind == IMP_POSE_POSITION) {
        v->lo[i] = scene->lo[k] + clearance;
        v->hi[i] = scene->hi[k] - clearance;
    } else if (k < 3 && imp__pose_box(pose, &lo, &hi)) {
        v->lo[i] = v->first[i] + scene->lo[k] + clearance - lo[k];
        v->hi[i] = v->first[i] + scene->hi[k] - clearance - hi[k];
    } else {
        v->lo[i] = v->first[i] - 0.5;
        v->hi[i] = v->first[i] + 0.5;
    }
}

enum imp_status imp__moving_bounds(struct imp__moving *v,
                                   const struct imp_design_move *moves, double clearance)
{
    const struct imp__design_model *m = v->m;
    for (size_t i = 0; i < v->n; i++) {
        const struct imp_pose *pose = imp__pose_of(m->scene, v->param[i]);
        struct imp_design_move own;
        IMP_CHECKED(move_of(v, moves, i, &own));
        v->lamp[i] = m->n;
        for (size_t j = 0; j < m->n; j++)
            if (pose->emitter && m->scene->emitters[m->emitter[j]] == pose->emitter)
                v->lamp[i] = j;
        v->lo[i] = own.lo;
        v->hi[i] = own.hi;
        if (own.lo == 0 && own.hi == 0) default_bounds(v, i, clearance);
        if (!(v->lo[i] < v->hi[i]))
            return imp__error(
                m->ctx, IMP_E_ARG,
                "moves[%zu]: '%s', component %zu: from %g to %g there is no "
                "room",
                i, own.name, v->component[i], v->lo[i], v->hi[i]);
        if (!(v->first[i] >= v->lo[i] && v->first[i] <= v->hi[i]))
            return imp__error(
                m->ctx, IMP_E_ARG,
                "moves[%zu]: '%s', component %zu: its value %g is not within "
                "%g and %g",
                i, own.name, v->component[i], v->first[i], v->lo[i], v->hi[i]);
    }
    return IMP_OK;
}

enum imp_status imp__moving_rows(struct imp__moving *v)
{
    const struct imp__design_model *m = v->m;
    v->width = m->n + v->n + 1;
    v->x = imp__arena_array(m->arena, 3 * m->n, sizeof *v->x);
    v->used = imp__arena_array(m->arena, 2 * m->n, sizeof *v->used);
    v->g = imp__arena_array(m->arena, 4 * m->n_rows, sizeof *v->g);
    v->slope = imp__arena_array(m->arena, m->n_rows * v->width, sizeof *v->slope);
    v->step = imp__arena_array(m->arena, 4 * v->width, sizeof *v->step);
    v->kept = imp__arena_array(m->arena, m->n, sizeof *v->kept);
    if (!v->kept || !v->x || !v->used || !v->g || !v->slope || !v->step)
        return imp__error(m->ctx, IMP_E_NOMEM, "no memory for what moves");
    v->turn = v->x + 2 * m->n;
    v->before = v->x + m->n;
    v->again = v->used + m->n;
    v->side[0] = v->g + m->n_rows;
    v->side[1] = v->g + 2 * m->n_rows;
    v->scale = v->g + 3 * m->n_rows;
    v->cost = v->step + v->width;
    v->least = v->step + 2 * v->width;
    v->most = v->step + 3 * v->width;
    return IMP_OK;
}

enum imp_status imp__moving_place(struct imp__moving *v, const double *p)
{
    struct imp_scene *scene = v->m->scene;
    for (size_t i = 0; i < v->n; i++) {
        struct imp_param_info info = {.size = sizeof info};
        double value[6];
        if (p[i] == v->at[i]) continue;
        IMP_CHECKED(imp_scene_get_param(scene, v->param[i], &info));
        IMP_CHECKED(imp_scene_get_values(scene, v->param[i], value));
        for (size_t k = i; k < v->n; k++) /* all numbers of one object at once */
            if (v->param[k] == v->param[i]) value[v->component[k]] = v->at[k] = p[k];
        IMP_CHECKED(imp_scene_set_values(scene, v->param[i], info.count, value));
    }
    return IMP_OK;
}

struct imp__moving_readings imp__moving_keep(const struct imp__moving *v)
{
    const struct imp__design_model *m = v->m;
    struct imp__moving_readings k = {.base = m->base,
                                     .source = m->source,
                                     .direct = m->direct,
                                     .base_source = m->base_source,
                                     .base_direct = m->base_direct};
    for (size_t j = 0; j < m->n; j++) v->kept[j] = m->with[j];
    return k;
}

void imp__moving_restore(struct imp__moving *v, const struct imp__moving_readings *kept)
{
    struct imp__design_model *m = v->m;
    for (size_t j = 0; j < m->n; j++) m->with[j] = v->kept[j];
    m->base = kept->base;
    m->source = kept->source;
    m->direct = kept->direct;
    m->base_source = kept->base_source;
    m->base_direct = kept->base_direct;
}

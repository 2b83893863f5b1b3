/* SPDX-License-Identifier: Apache-2.0
 *
 * Volumes as objects that move (pose.h): rays stay where they are, and look up other values. */
#include "base/arguments.h"
#include "instances.h"
#include "kind/texture/placed.h"
#include "majorants.h"
#include "pose.h"
#include <math.h>
#include <string.h>

const char *imp__volume_why(const struct imp_scene *scene, const struct imp_texture *t,
                            enum imp_pose_kind kind)
{
    const struct imp_texcoord nowhere = {.prim = -1};
    imp_spec slope[3];
    if (kind != IMP_POSE_RIGID && kind != IMP_POSE_SCALE && kind != IMP_POSE_WORLD)
        return "it is a volume";
    if (!t->ops->place) return "it is no gridvolume";
    if (!t->ops->gradient(t, &nowhere, true, slope))
        return "its values jump from cell to cell (filter_type trilinear)";
    for (int k = 0; k < scene->n_textures; k++)
        if (scene->textures[k] != t && strcmp(scene->textures[k]->name, t->name) == 0)
            return "another texture has its name (give it an id)";
    return NULL;
}

struct imp_texture *imp__volume_find(const struct imp_scene *scene, const char *name)
{
    for (int k = 0; k < scene->n_textures; k++)
        if (scene->textures[k]->ops->place && strcmp(scene->textures[k]->name, name) == 0)
            return scene->textures[k];
    return NULL;
}

/* As the file has it: the object's first number keeps it. */
static struct imp_mat4 world_at_rest(const struct imp_pose *p)
{
    return imp__mat4_of_rows(p->object->rest);
}

static imp_v3 middle_of_box(const struct imp_texture *t)
{
    double to_unit[12];
    int cells[3];
    struct imp_mat4 world;
    t->ops->extent(t, to_unit, cells);
    const struct imp_mat4 unit = imp__mat4_of_rows(to_unit);
    imp__mat4_inverse(&unit, &world);
    return imp__point(&world, imp__v3(0.5, 0.5, 0.5));
}

bool imp__volume_box(const struct imp_texture *t, imp_v3 *lo, imp_v3 *hi)
{
    double to_unit[12];
    int cells[3];
    struct imp_mat4 world;
    t->ops->extent(t, to_unit, cells);
    const struct imp_mat4 unit = imp__mat4_of_rows(to_unit);
    imp__mat4_inverse(&unit, &world);
    *lo = imp__v3(INFINITY, INFINITY, INFINITY);
    *hi = -*lo;
    for (int k = 0; k < 8; k++) {
        const imp_v3 p = imp__point(&world, imp__v3(k & 1, k >> 1 & 1, k >> 2));
        *lo = imp__lesser(*lo, p);
        *hi = imp__greater(*hi, p);
    }
    return true;
}

enum imp_status imp__volume_keep(struct imp_scene *scene, struct imp_pose *p)
{
    struct imp_placed *placed = imp__arena_array(&scene->arena, 1, sizeof *placed);
    p->rest = imp__arena_array(&scene->arena, 12, sizeof(double));
    if (!placed || !p->rest)
        return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a pose");
    p->texture->ops->place(p->texture, p->rest, false);
    p->centre = middle_of_box(p->texture);
    p->texture->placed = placed;
    return IMP_OK;
}

static bool looked_up(const struct imp_input *in, const struct imp_texture *t)
{
    if (in->texture == t) return true;
    for (int j = 0; in->texture && j < in->texture->n_in; j++)
        if (looked_up(in->texture->input[j], t)) return true;
    return false;
}

static bool is_extinction(const struct imp_medium *m, const struct imp_texture *t)
{
    for (int j = 0; j < m->n_own; j++)
        if (m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION && looked_up(m->input[j], t))
            return true;
    return false;
}

void imp__volume_added(struct imp_scene *scene, struct imp_pose *p)
{
    struct imp_placed *placed = (struct imp_placed *)(uintptr_t)p->texture->placed;
    placed->by[placed->n++] =
        (struct imp_placed_by){p->param, p->kind == IMP_POSE_RIGID   ? IMP_PLACED_POSE
                                         : p->kind == IMP_POSE_SCALE ? IMP_PLACED_SCALE
                                                                     : IMP_PLACED_MAP};
    scene->params[p->param].probed =
        true; /* values of frozen walks look up other cells */
    imp__pose_changed(p);
}

enum imp_status imp__volume_apply(const struct imp_pose *p, const struct imp_map *by)
{
    const struct imp_pose *rigid = imp__pose_beside(p, IMP_POSE_RIGID),
                          *scale = imp__pose_beside(p, IMP_POSE_SCALE),
                          *world = imp__pose_beside(p, IMP_POSE_WORLD);
    struct imp_placed *placed = (struct imp_placed *)(uintptr_t)p->texture->placed;
    const struct imp_mat4 rest = world_at_rest(p);
    struct imp_mat4 to;
    if (world) {
        to = imp__mat4_of_rows(world->number);
        if (!imp__mat4_is_finite(&to) || !imp__mat4_inverse(&to, &placed->from_world))
            return imp__error(p->scene->ctx, IMP_E_NUMERIC, "%s %s",
                              p->scene->params[world->param].info.name,
                              imp__mat4_is_finite(&to)
                                  ? "is singular: it flattens the volume"
                                  : "is not finite");
    } else {
        const struct imp_mat4 moved = imp__mat4_of_rows(by->m);
        to = imp__mat4_multiply(&moved, &rest);
    }
    placed->scale = scale ? scale->number[0] : 1;
    placed->middle = p->object->centre;
    for (int i = 0; rigid && i < 3; i++) placed->middle[i] += rigid->number[i];
    for (int i = 0; rigid && i < 3; i++) {
        double row[3] = {0};
        imp__rotation_bar(rigid->number + 3, imp__v3(i == 0, i == 1, i == 2), row);
        for (int k = 0; k < 3; k++) placed->turn[k][i] = row[k];
    }
    p->texture->ops->place(p->texture, to.m, true);
    for (int k = 0; k < p->scene->n_media; k++)
        if (is_extinction(p->scene->media[k], p->texture))
            imp__majorants_renew(p->scene->media[k]->majorants);
    return IMP_OK;
}

/* ---- Where a moved volume ends ------------------------------------------------------- */

/* Is a medium there, by the boxes of the shapes that bound it? */
static bool may_reach(const struct imp_scene *scene, const struct imp_medium *m, imp_v3 p)
{
    const double near = 1e-6 * imp__length(scene->hi - scene->lo);
    for (int k = 0; k < scene->n_sensors; k++)
        if (scene->sensors[k]->medium == m) return true;
    for (int k = 0; k < scene->n_all_shapes; k++) {
        const struct imp_shape *s = scene->shapes[k];
        bool in = true;
        if (s->exterior == m) return true;
        if (s->interior != m) continue;
        if (k >= imp__shapes_outside(scene)) return true;
        for (int i = 0; i < 3; i++)
            in &= p[i] > s->lo[i] - near && p[i] < s->hi[i] + near;
        if (in) return true;
    }
    return false;
}

static bool ends_dark(const struct imp_scene *scene, const struct imp_medium *m)
{
    const struct imp_majorants *g = m->majorants;
    const struct imp_param_info *info = &scene->params[g->box->param].info;
    const int n[3] = {(int)info->dims[2], (int)info->dims[1], (int)info->dims[0]};
    for (int side = 0; side < 6; side++) {
        const int axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (int i = 0; i <= n[u]; i++)
            for (int j = 0; j <= n[v]; j++) {
                imp_v3 x = {0};
                imp_spec in[IMP_INPUTS_MAX];
                struct imp_coefficients c;
                /* The middles of cells, and the border of the side. */
                x[axis] = side % 2;
                x[u] = i == n[u] ? 1 : (i + 0.5) / n[u];
                x[v] = j == n[v] ? 1 : (j + 0.5) / n[v];
                const imp_v3 p = imp__point(&g->to_world, x);
                const struct imp_texcoord at = {.p = p};
                imp__inputs_eval(m->input, m->n_own, &at, in);
                m->ops->eval(m, in, &c);
                if (!imp__is_zero(c.extinction) && may_reach(scene, m, p)) return false;
            }
    }
    return true;
}

const struct imp_medium *imp__volume_jumps(const struct imp_scene *scene,
                                           const struct imp_pose *p)
{
    for (int k = 0; k < scene->n_media; k++) {
        const struct imp_medium *m = scene->media[k];
        if (m->majorants && m->majorants->box == p->texture && !ends_dark(scene, m))
            return m;
    }
    return NULL;
}

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
    if (t->param < 0 || scene->params[t->param].info.n_dims < 3)
        return "its cells are no parameter";
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

/* Places of shapes are float. */
#define NEAR 1e-6   /* of the scene's diagonal */
#define ULPS 2.5e-7 /* of the largest coordinate */
#define RIM  1e-5   /* of the box, of hits */
static double near_of(const struct imp_scene *scene)
{
    double most = 0;
    for (int a = 0; a < 3; a++)
        most = imp_max(most, imp_max(fabs(scene->lo[a]), fabs(scene->hi[a])));
    return imp_max(NEAR * imp__length(scene->hi - scene->lo), ULPS * most);
}

/* Within `near` of a side, of the box. */
static double near_side(const struct imp_majorants *g, double near, int axis)
{
    imp_v3 edge = {0};
    edge[axis] = 1;
    return near / imp__length(imp__vector(&g->to_world, edge));
}

bool imp__medium_reaches(const struct imp_scene *scene, const struct imp_medium *m,
                         imp_v3 p)
{
    if (!m->majorants) return true;
    const imp_v3 u = imp__point(&m->majorants->to_unit, p);
    const double near = near_of(scene);
    for (int a = 0; a < 3; a++) {
        const double by = imp_max(RIM, near_side(m->majorants, 2 * near, a));
        if (!(u[a] >= -by && u[a] <= 1 + by)) return false;
    }
    return true;
}

struct border {
    const struct imp_scene *scene;
    const struct imp_medium *medium;
    int n[3], channels; /* of the volume's cells */
    bool changes;       /* do they but those that are held? */
    const uint8_t *held;
    bool everywhere; /* rays of the medium begin or go anywhere */
    double near;
    imp_v3 lo, hi; /* of all shapes that bound it from within */
};

/* Where a medium is, by the boxes of the shapes that bound it. */
static struct border border_of(const struct imp_scene *scene, const struct imp_medium *m)
{
    const struct imp_param_info *info = &scene->params[m->majorants->box->param].info;
    struct border b = {.scene = scene,
                       .medium = m,
                       .near = near_of(scene),
                       .lo = imp__v3(INFINITY, INFINITY, INFINITY),
                       .hi = -imp__v3(INFINITY, INFINITY, INFINITY)};
    imp__grid_cells(info, b.n);
    b.channels = (int)(info->count / ((size_t)b.n[0] * b.n[1] * b.n[2]));
    for (int k = 0; k < scene->n_sensors; k++)
        b.everywhere |= scene->sensors[k]->medium == m;
    for (int k = 0; k < scene->n_all_shapes; k++) {
        const struct imp_shape *s = scene->shapes[k];
        b.everywhere |=
            s->exterior == m || (s->interior == m && k >= imp__shapes_outside(scene));
        if (s->interior != m) continue;
        b.lo = imp__lesser(b.lo, s->lo);
        b.hi = imp__greater(b.hi, s->hi);
    }
    return b;
}

static bool boxes_meet(imp_v3 lo, imp_v3 hi, imp_v3 from, imp_v3 to, double near)
{
    bool meet = true;
    for (int i = 0; i < 3; i++) meet &= hi[i] > from[i] - near && lo[i] < to[i] + near;
    return meet;
}

static bool may_reach(const struct border *b, imp_v3 lo, imp_v3 hi)
{
    if (b->everywhere) return true;
    if (!boxes_meet(lo, hi, b->lo, b->hi, b->near)) return false;
    for (int k = 0; k < b->scene->n_all_shapes; k++) {
        const struct imp_shape *s = b->scene->shapes[k];
        if (s->interior == b->medium && boxes_meet(lo, hi, s->lo, s->hi, b->near))
            return true;
    }
    return false;
}

/* At this place of the box, in the unit cube. */
static bool is_dark(const struct border *b, imp_v3 x)
{
    imp_spec in[IMP_INPUTS_MAX];
    struct imp_coefficients c;
    const struct imp_medium *m = b->medium;
    const struct imp_texcoord at = {.p = imp__point(&m->majorants->to_world, x)};
    size_t cell = 0;
    for (int a = 3; a-- > 0;)
        cell =
            cell * (size_t)b->n[a] + (size_t)imp_min((int)(x[a] * b->n[a]), b->n[a] - 1);
    for (int k = 0; b->changes && k < b->channels; k++)
        if (!b->held || !b->held[cell * (size_t)b->channels + (size_t)k]) return false;
    imp__inputs_eval(m->input, m->n_own, &at, in);
    m->ops->eval(m, in, &c);
    return imp__is_zero(c.extinction);
}

/* The middle of a cell along an axis; -1 and n are the borders of the side. */
static double middle_of(int i, int n) { return i < 0 ? 0 : i == n ? 1 : (i + 0.5) / n; }

/* Each sample of a side of the box counts to the middles of its neighbours. */
static bool side_is_dark(const struct border *b, int side)
{
    const int axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int i = -1; i <= b->n[u]; i++)
        for (int j = -1; j <= b->n[v]; j++) {
            imp_v3 x = {0}, lo = imp__v3(INFINITY, INFINITY, INFINITY), hi = -lo;
            x[axis] = side % 2;
            for (int k = 0; k < 4; k++) {
                x[u] = imp_clamp((i + (k & 1 ? 1.5 : -0.5)) / b->n[u], 0., 1.);
                x[v] = imp_clamp((j + (k & 2 ? 1.5 : -0.5)) / b->n[v], 0., 1.);
                const imp_v3 corner = imp__point(&b->medium->majorants->to_world, x);
                lo = imp__lesser(lo, corner);
                hi = imp__greater(hi, corner);
            }
            x[u] = middle_of(i, b->n[u]);
            x[v] = middle_of(j, b->n[v]);
            if (may_reach(b, lo, hi) && !is_dark(b, x)) return false;
        }
    return true;
}

/* Lie all shapes that bound the medium from within on this side, or before it? In their own way (`moves`)
 * they may not touch it. */
static bool side_is_behind(const struct border *b, int side, bool moves)
{
    const int axis = side / 2;
    const struct imp_majorants *g = b->medium->majorants;
    const double near = (moves ? -1 : 1) * near_side(g, b->near, axis);
    double most = -INFINITY;
    if (b->everywhere) return false;
    for (int k = 0; k < b->scene->n_all_shapes; k++) {
        const struct imp_shape *s = b->scene->shapes[k];
        const struct imp_triangles *t = &s->triangles;
        const bool mesh = s->geometry == IMP_TRIANGLES;
        const size_t n = mesh ? t->n_vertices : 8;
        if (s->interior != b->medium) continue;
        for (size_t i = 0; i < n; i++) {
            imp_v3 p;
            for (int a = 0; a < 3; a++)
                p[a] = mesh ? (double)t->positions[3 * i + (size_t)a]
                            : (i >> a & 1 ? s->hi : s->lo)[a];
            p[3] = 0;
            const double u = imp__point(&g->to_unit, p)[axis];
            most = imp_max(most, side % 2 ? u - 1 : -u);
        }
    }
    return most <= near;
}

bool imp__medium_ends_bright(const struct imp_scene *scene, const struct imp_medium *m,
                             bool outside, bool moves)
{
    if (!m->majorants) return false;
    if (!m->majorants->box) return true;
    struct border b = border_of(scene, m);
    b.everywhere = outside;
    for (int side = 0; side < 6; side++)
        if (!side_is_behind(&b, side, moves) && !side_is_dark(&b, side)) return true;
    return false;
}

static const struct imp_medium *bright_end(const struct imp_scene *scene,
                                           const struct imp_pose *p, bool changes,
                                           const uint8_t *held)
{
    for (int k = 0; k < scene->n_media; k++) {
        const struct imp_medium *m = scene->media[k];
        if (!m->majorants || m->majorants->box != p->texture) continue;
        struct border b = border_of(scene, m);
        b.changes = changes;
        b.held = held;
        for (int side = 0; side < 6; side++)
            if (!side_is_dark(&b, side)) return m;
    }
    return NULL;
}

const struct imp_medium *imp__volume_jumps(const struct imp_scene *scene,
                                           const struct imp_pose *p)
{
    return bright_end(scene, p, false, NULL);
}

const struct imp_medium *imp__volume_may_jump(const struct imp_scene *scene,
                                              const struct imp_pose *p,
                                              const uint8_t *held)
{
    return bright_end(scene, p, true, held);
}

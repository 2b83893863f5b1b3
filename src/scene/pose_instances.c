/* SPDX-License-Identifier: Apache-2.0
 *
 * Instances of the scene as objects that move (pose.h): with all that is in their groups. */
#include "base/arguments.h"
#include "instances.h"
#include "kind/build.h"
#include "pose.h"
#include <stdio.h>
#include <string.h>

int imp__pose_instances(const struct imp_scene *scene)
{
    return scene->world ? scene->world->n_instances : 0;
}

int imp__pose_instances_listed(const struct imp_scene *scene)
{
    const int n = imp__pose_instances(scene);
    return n <= IMP_POSE_INSTANCES_LISTED ? n : 0;
}

void imp__instance_name(const struct imp_scene *scene, int k, char out[200])
{
    const char *id = scene->world->instance[k].name;
    if (id) snprintf(out, 200, "%s", id);
    else snprintf(out, 200, "instance%d", k);
}

const char *imp__instance_why(const struct imp_scene *scene, int k,
                              enum imp_pose_kind kind)
{
    const struct imp_instance *p = &scene->world->instance[k];
    if (kind > IMP_POSE_WORLD) return "it is an instance";
    if (kind == IMP_POSE_RIGID_END && !p->motion)
        return "it is no instance that moves in time (to_world_end)";
    if (!imp__pose_is_rigid(kind) && p->motion)
        return "it moves in time, and has a pose and a pose_end";
    if (p->motion && !imp__motion_is_rigid(p->motion))
        return "its to_world_end stretches it otherwise than its to_world";
    if (scene->n_bodies > 0) return "there are media of graded index";
    if (scene->priorities) return "shapes have priorities";
    for (int i = 0; i < p->group->n_within; i++)
        if (scene->shapes[p->group->within[i]]->interior)
            return "a shape in it bounds a medium";
    if (!imp__pose_is_rigid(kind) && p->raised)
        return "the heights of its bump maps are made for its size";
    return kind == IMP_POSE_WORLD ? imp__world_instance_why(scene, k) : NULL;
}

bool imp__instance_find(const struct imp_scene *scene, const char *name,
                        struct imp_pose *p)
{
    char own[200];
    for (int k = 0; k < imp__pose_instances(scene); k++) {
        imp__instance_name(scene, k, own);
        if (strcmp(own, name) != 0) continue;
        const struct imp_instance *there = &scene->world->instance[k];
        struct imp_map room[2] = {there->to_world, there->to_local};
        p->instance = k;
        if (there->motion)
            imp__motion_at(there->motion,
                           p->kind == IMP_POSE_RIGID_END ? there->motion->end
                                                         : there->motion->start,
                           &room[0], &room[1]);
        p->centre = imp__map_point(&room[0], (there->group->lo + there->group->hi) * 0.5);
        p->rest_size = sizeof *there;
        return true;
    }
    return false;
}

bool imp__pose_box(const struct imp_pose *p, imp_v3 *lo, imp_v3 *hi)
{
    if (p->instance >= 0)
        imp__instance_box(&p->scene->world->instance[p->instance], lo, hi);
    if (p->group >= 0) {
        *lo = imp__v3(INFINITY, INFINITY, INFINITY);
        *hi = -*lo;
        for (int k = 0; k < imp__pose_instances(p->scene); k++) {
            imp_v3 box[2];
            if (!imp__group_has(p, k)) continue;
            imp__instance_box(&p->scene->world->instance[k], &box[0], &box[1]);
            for (int i = 0; i < 3; i++) {
                (*lo)[i] = imp_min((*lo)[i], box[0][i]);
                (*hi)[i] = imp_max((*hi)[i], box[1][i]);
            }
        }
    }
    if (p->shape >= 0) {
        *lo = p->scene->shapes[p->shape]->lo;
        *hi = p->scene->shapes[p->shape]->hi;
    }
    return p->instance >= 0 || p->group >= 0 || p->shape >= 0;
}

/* Sets the motion of what moves in time, from where the file has both ends, and where it is at first. */
static enum imp_status motion_place(const struct imp_pose *p, struct imp_instance *there)
{
    const struct imp_instance *rest = p->object->rest;
    struct imp_motion *m = (struct imp_motion *)(uintptr_t)there->motion;
    struct imp_map inverse;
    bool moved = false;
    if (m == rest->motion) m = imp__arena_array(&p->scene->arena, 1, sizeof *m);
    if (!m) return imp__error(p->scene->ctx, IMP_E_NOMEM, "no memory for a pose");
    *m = *rest->motion;
    for (int side = 0; side < 2; side++) {
        const struct imp_pose *q =
            imp__pose_beside(p, side ? IMP_POSE_RIGID_END : IMP_POSE_RIGID);
        const double *a = q ? q->number : NULL;
        double R[9];
        if (!a || !(a[0] || a[1] || a[2] || a[3] || a[4] || a[5])) continue;
        const imp_v3 r = m->shift[side] - q->centre;
        imp_v3 shift = q->centre + imp__v3(a[0], a[1], a[2]);
        imp__rotation_of(a + 3, R);
        for (int i = 0; i < 3; i++)
            shift[i] += R[3 * i] * r[0] + R[3 * i + 1] * r[1] + R[3 * i + 2] * r[2];
        imp__motion_turn(m, side, a + 3, shift);
        moved = true;
    }
    there->motion = m;
    there->to_world = rest->to_world;
    if (moved) imp__motion_at(m, m->start, &there->to_world, &inverse);
    return IMP_OK;
}

enum imp_status imp__instance_place(const struct imp_pose *p, int instance,
                                    const struct imp_map *to_world)
{
    struct imp_instance *there = &p->scene->world->instance[instance];
    imp_v3 lo, hi;
    if (there->motion) IMP_CHECKED(motion_place(p, there));
    else there->to_world = *to_world;
    bool fits = imp__map_inverse(&there->to_world, &there->to_local);
    imp__instance_box(there, &lo, &hi);
    for (int k = 0; k < 3; k++) fits &= lo[k] > -IMP_REACH_MAX && hi[k] < IMP_REACH_MAX;
    return fits ? IMP_OK
                : imp__error(p->scene->ctx, IMP_E_NUMERIC,
                             "%s moves the instance beyond what numbers hold",
                             p->scene->params[p->param].info.name);
}

enum imp_status imp__instance_apply(const struct imp_pose *p, const struct imp_map *by)
{
    const struct imp_instance *rest = p->object->rest;
    const struct imp_map to_world = imp__map_product(by, &rest->to_world);
    return imp__instance_place(p, p->instance, &to_world);
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Groups as objects that move (pose.h): by numbers in the group's own space, about the middle of its
 * box there, and with them all of its instances, each of which stands where
 *
 *     to_world = (that of the file) (the group's motion). */
#include "base/arguments.h"
#include "instances.h"
#include "pose.h"
#include <math.h>
#include <string.h>

#define EVEN                                                                             \
    1e-6 /* columns of a placement differ in length, per length, or are not at right angles */

static bool turns_and_scales(const struct imp_map *map)
{
    double square[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            square[i][j] = 0;
            for (int k = 0; k < 3; k++)
                square[i][j] += map->m[4 * k + i] * map->m[4 * k + j];
        }
    const double size = square[0][0] + square[1][1] + square[2][2];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            if (!(fabs(square[i][j] - (i == j ? size / 3 : 0)) <= EVEN * size))
                return false;
    return true;
}

static bool is_nested(const struct imp_scene *scene, const struct imp_group *g)
{
    for (int k = 0; k < scene->n_groups; k++)
        for (int i = 0; i < scene->groups[k]->n_instances; i++)
            if (scene->groups[k] != scene->world &&
                scene->groups[k]->instance[i].group == g)
                return true;
    return false;
}

const char *imp__group_why(const struct imp_scene *scene, int k, enum imp_pose_kind kind)
{
    const struct imp_group *g = scene->groups[k];
    int n = 0;
    if (kind != IMP_POSE_RIGID && kind != IMP_POSE_SCALE) return "it is a group";
    for (int i = 0; i < imp__pose_instances(scene); i++) {
        const struct imp_instance *p = &scene->world->instance[i];
        if (p->group != g) continue;
        const char *why = imp__instance_why(scene, i, kind);
        if (why) return why;
        if (p->motion) return "an instance of it moves in time";
        if (!turns_and_scales(&p->to_world)) return "an instance stretches it";
        n++;
    }
    for (int j = 0; j < scene->n_groups; j++)
        if (j != k && scene->groups[j]->name && g->name &&
            strcmp(scene->groups[j]->name, g->name) == 0)
            return "another group has its name (give it an id)";
    if (is_nested(scene, g)) return "an instance of it is in another group";
    if (n > IMP_POSE_INSTANCES_LISTED) return "it has more than 1,024 instances";
    return n > 0 ? NULL : "it has no instance";
}

bool imp__group_find(const struct imp_scene *scene, const char *name, struct imp_pose *p)
{
    for (int k = 0; k < scene->n_groups; k++) {
        const struct imp_group *g = scene->groups[k];
        if (!g->name || strcmp(g->name, name) != 0) continue;
        p->group = k;
        p->centre = (g->lo + g->hi) * 0.5;
        p->rest_size =
            (size_t)imp__pose_instances(scene) * sizeof *scene->world->instance;
        return true;
    }
    return false;
}

bool imp__group_has(const struct imp_pose *p, int instance)
{
    const struct imp_scene *scene = p->scene;
    return p->group >= 0 &&
           scene->world->instance[instance].group == scene->groups[p->group];
}

double imp__group_size(const struct imp_pose *p)
{
    const struct imp_instance *rest = p->object->rest;
    int k = 0;
    while (!imp__group_has(p, k)) k++;
    const double *m = rest[k].to_world.m;
    return sqrt(m[0] * m[0] + m[4] * m[4] + m[8] * m[8]);
}

enum imp_status imp__group_apply(const struct imp_pose *p, const struct imp_map *by)
{
    const struct imp_instance *rest = p->object->rest;
    for (int k = 0; k < imp__pose_instances(p->scene); k++) {
        if (!imp__group_has(p, k)) continue;
        const struct imp_map to_world = imp__map_product(&rest[k].to_world, by);
        IMP_CHECKED(imp__instance_place(p, k, &to_world));
    }
    return IMP_OK;
}

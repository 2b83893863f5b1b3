/* SPDX-License-Identifier: Apache-2.0
 *
 * The names of all numbers of geometry that a scene may have (pose.h), one after the other. */
#include "access.h"
#include "base/arguments.h"
#include "instances.h"
#include "pose.h"
#include <stdio.h>
#include <string.h>

/* Object k: shapes, then sensors, then lights without a shape, instances, groups and volumes; may it have such a
 * number? */
static const char *object_name(const struct imp_scene *scene, int k,
                               enum imp_pose_kind kind, char own[200])
{
    imp_v3 centre;
    if (k < scene->n_shapes) {
        const struct imp_shape *s = scene->shapes[k];
        return imp__pose_shape_why(scene, s, kind) ? NULL : s->name;
    }
    k -= scene->n_shapes;
    if (k < scene->n_sensors) {
        struct imp_sensor *s = scene->sensors[k];
        return imp__pose_sensor_why(s, kind, &centre) ? NULL : s->name;
    }
    k -= scene->n_sensors;
    if (k >= scene->n_emitters) {
        k -= scene->n_emitters;
        if (k >= imp__pose_instances_listed(scene)) {
            k -= imp__pose_instances_listed(scene);
            if (k >= scene->n_groups) {
                const struct imp_texture *t = scene->textures[k - scene->n_groups];
                return imp__volume_why(scene, t, kind) ? NULL : t->name;
            }
            return imp__group_why(scene, k, kind) ? NULL : scene->groups[k]->name;
        }
        imp__instance_name(scene, k, own);
        return imp__instance_why(scene, k, kind) ? NULL : own;
    }
    const struct imp_emitter *e = scene->emitters[k];
    return e->shape || imp__pose_light_why(scene, e, kind) ? NULL : e->name;
}

bool imp__geometry_next(const struct imp_scene *scene, struct imp_geometry_walk *at)
{
    if (!scene->committed || scene->rayless) return false;
    const int n = scene->n_shapes + scene->n_sensors + scene->n_emitters +
                  imp__pose_instances_listed(scene) + scene->n_groups + scene->n_textures;
    char own[200];
    for (; at->next < n * IMP_POSE_KINDS; at->next++) {
        const enum imp_pose_kind kind = (enum imp_pose_kind)(at->next % IMP_POSE_KINDS);
        const char *name = object_name(scene, at->next / IMP_POSE_KINDS, kind, own);
        if (!name) continue;
        snprintf(at->name, sizeof at->name, "%s.%s", name, imp__pose_tail(kind));
        at->next++;
        return true;
    }
    return false;
}

enum imp_status imp_scene_geometry_name(const imp_scene *scene, size_t index, size_t size,
                                        char *name)
{
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, name, "name");
    IMP_READS(scene);
    struct imp_geometry_walk at = {0};
    size_t k = 0;
    while (imp__geometry_next(scene, &at))
        if (k++ == index) {
            if (size <= strlen(at.name))
                return imp__error(scene->ctx, IMP_E_ARG,
                                  "%zu characters are too few for '%s'", size, at.name);
            memcpy(name, at.name, strlen(at.name) + 1);
            return IMP_OK;
        }
    return imp__error(scene->ctx, IMP_E_ARG,
                      "there is no number of geometry %zu (there are %zu)", index, k);
}

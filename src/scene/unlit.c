/* SPDX-License-Identifier: Apache-2.0
 *
 * The error of a scene without light: whether any shape, medium, map or point emits. */
#include "unlit.h"

const struct imp_node *imp__node_of(const struct imp_node *at, const void *object)
{
    const struct imp_node *found = at->object == object ? at : NULL;
    for (size_t k = 0; k < at->n_children && !found; k++)
        if (at->children[k].node && !at->children[k].ref)
            found = imp__node_of(at->children[k].node, object);
    return found;
}

/* A light of radiance 0 counts: the derivative with respect to it is not 0. */
static bool is_unlit(const struct imp_scene *scene)
{
    if (scene->n_emitters > 0) return false;
    for (int b = 0; b < scene->n_bsdfs; b++)
        if (scene->bsdfs[b]->flags & IMP_BSDF_EMIT) return false;
    for (int m = 0; m < scene->n_media; m++)
        if (scene->media[m]->emits) return false;
    return true;
}

enum imp_status imp__sensor_lit(const struct imp_scene *scene,
                                const struct imp_sensor *sensor)
{
    if (!is_unlit(scene)) return IMP_OK;
    const struct imp_node *node = imp__node_of(scene->root, sensor);
    return imp__node_error(scene->ctx, node ? node : scene->root, IMP_E_SCENE,
                           "nothing in the scene emits light, and none can reach it");
}

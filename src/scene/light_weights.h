/* SPDX-License-Identifier: Apache-2.0
 *
 * Sampling weights of lights that have changed, as where lamps are at other levels for a while. */
#ifndef IMP_SCENE_LIGHT_WEIGHTS_H
#define IMP_SCENE_LIGHT_WEIGHTS_H

struct imp_scene;

/* The tree of lights, if the scene has one, takes them. */
void imp__light_tree_weigh(struct imp_scene *scene);

#endif

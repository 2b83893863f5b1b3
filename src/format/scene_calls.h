/* SPDX-License-Identifier: Apache-2.0
 *
 * Scenes built by calls: what each call of a build begins and ends with. */
#ifndef IMP_FORMAT_SCENE_CALLS_H
#define IMP_FORMAT_SCENE_CALLS_H

#include "tree.h"

/* May the build go on? If not, the message is that of the first failure. */
bool imp__calls_ready(struct imp_scene *scene);
/* The first failure is kept. */
void imp__calls_keep(struct imp_scene *scene, enum imp_status st);
/* What a call of a build returns: its own failure, or the first one before it. */
enum imp_status imp__calls_outcome(const struct imp_scene *scene);
/* The object that is open. */
static inline struct imp_node *imp__calls_top(const struct imp_scene *scene)
{
    return scene->stack[scene->n_stack - 1];
}

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Scenes in which nothing emits: every reading is 0, without any walk. */
#ifndef IMP_SCENE_UNLIT_H
#define IMP_SCENE_UNLIT_H

#include "scene.h"

/* The node that an object was made from, in or below `at`; NULL: it has none. */
const struct imp_node *imp__node_of(const struct imp_node *at, const void *object);

/* Is there anything from which light could come to this sensor? If not, IMP_E_SCENE with
 * the sensor's place. */
enum imp_status imp__sensor_lit(const struct imp_scene *scene,
                                const struct imp_sensor *sensor);

#endif

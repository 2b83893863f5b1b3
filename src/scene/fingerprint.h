/* SPDX-License-Identifier: Apache-2.0
 *
 * Identity of the scene that a file was made with: hashes of the scene, part by part, so
 * that a refusal can name the difference. None depends on theta but the last. */
#ifndef IMP_SCENE_FINGERPRINT_H
#define IMP_SCENE_FINGERPRINT_H

#include "scene.h"

/* Objects: kinds, names, properties that are no parameters, geometry, what lights do with
 * direction, names and sizes of parameters. */
uint64_t imp__fingerprint_objects(const struct imp_scene *scene);
/* Film, filter, and the rays of the camera. */
uint64_t imp__fingerprint_sensor(const struct imp_sensor *sensor);
/* Values of parameters that move or bend rays: those without a derivative, and those of
 * media. */
uint64_t imp__fingerprint_rays(const struct imp_scene *scene);
/* What walks are evaluated with: materials, lights and media in their order, what lights do
 * with direction, wavelengths, parameters and which of them have a derivative; but no
 * geometry. */
uint64_t imp__fingerprint_evaluated(const struct imp_scene *scene);

#endif

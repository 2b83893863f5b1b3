/* SPDX-License-Identifier: Apache-2.0
 *
 * What was found as a scene file: scene.xml in -o DIR, which includes the scene that was loaded
 * and sets the values that were found. */
#ifndef IMP_CLI_FIT_SCENE_H
#define IMP_CLI_FIT_SCENE_H

#include <stddef.h>

/* 0, or an exit code with the reason printed, as the next one. */
int fit_scene_writable(void);
/* After recovered.txt. large [n]: parameters that are not in it, whose values the scene has;
 * they are written as textures.txt. */
int fit_scene_write(const char *const *large, size_t n);

#endif

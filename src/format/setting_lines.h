/* SPDX-License-Identifier: Apache-2.0
 *
 * Values of parameters as text: of --set, of lists of settings, and of <set> in scene files. */
#ifndef IMP_FORMAT_SETTING_LINES_H
#define IMP_FORMAT_SETTING_LINES_H

#include "scene/scene.h"

/* A <set> of a scene file, applied when the scene is made. */
struct imp_setting {
    struct imp_setting *next;
    const char *text, *place; /* lines; and where they are, for messages */
    size_t length;
    bool in_scene; /* one line of the scene file at `place`; else a file of this name */
};

#define IMP_SETTINGS_BYTES_MAX ((size_t)256 << 20) /* ten million numbers of 17 digits */

enum imp_status imp__settings_apply(struct imp_scene *scene,
                                    const struct imp_setting *settings);

#endif

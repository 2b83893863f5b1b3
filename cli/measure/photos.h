/* SPDX-License-Identifier: Apache-2.0
 *
 * Photographs of a measurement: which files there are, which sensor each is of, and their pixels. */
#ifndef IMP_CLI_PHOTOS_H
#define IMP_CLI_PHOTOS_H

#include "shared/command.h"
#include <importon/measure.h>

extern const struct arg_option options_photos[];

struct photos {
    size_t n;
    struct imp_photo *photo; /* [n] with pixels, owned */
    char **path;             /* [n] as messages have them */
    char **spec;             /* [n] as targets: FILE@N */
};

/* The scene file among the operands: the first, or the one .xml file of a folder that stands
 * alone. *path is to be freed. 0, or an exit code with the reason printed. */
int photos_scene(int n, char **operand, char **path);
/* The photographs of cli.scene among the operands behind it, in folders, and of --photo. Adds
 * each to problem_options.targets as FILE@N. 0, or an exit code with the reason printed. */
int photos_read(int n, char **operand, struct photos *out);
void photos_free(struct photos *p);

#endif

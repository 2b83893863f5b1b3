/* SPDX-License-Identifier: Apache-2.0
 *
 * Glare ratings of a grid of observers. */
#ifndef IMP_CLI_GLARE_H
#define IMP_CLI_GLARE_H

#include "text/json.h"
#include <importon/rooms.h>

/* Read and print the ratings at the points of run->sensor. 0, or an exit code with the reason
 * printed. */
int glare_read(struct json *j, const struct imp_run *run);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Text files that appear whole or not at all: what is written goes to a temporary file
 * beside them, which takes their name when everything is on the disk. */
#ifndef IMP_CLI_OUTPUT_H
#define IMP_CLI_OUTPUT_H

#include "overwrite.h"
#include <stdio.h>

struct output {
    FILE *file;
    const char *path; /* as given, for messages; must outlive this */
    char *target;     /* where links lead; NULL: no temporary file */
    char *temporary;
};

/* "-" is standard output, and what is not a regular file (/dev/stdout) is written to as
 * it is. A file that is there must be one of this kind (overwrite.h). 0, or an exit code
 * with the reason printed. */
int output_open(struct output *o, const char *path, enum output_kind kind);
/* Flush, and rename if `rc` is 0; else what was there before stays. Returns rc, or
 * EXIT_RUN with the reason printed. */
int output_close(struct output *o, int rc);

#endif

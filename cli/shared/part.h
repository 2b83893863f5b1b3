/* SPDX-License-Identifier: Apache-2.0
 *
 * --part I/N: a command that computes its part of a run, to be merged later. */
#ifndef IMP_CLI_PART_H
#define IMP_CLI_PART_H

#include "command.h"

/* Read --part, and take -o for the part's file. 0, or an exit code. */
int part_begin(void);
/* Set the part of the context that was just made. 0, or an exit code. */
int part_open(void);
/* The part is computed: write it. EXIT_STOP, or an exit code. */
int part_end(void);

#endif

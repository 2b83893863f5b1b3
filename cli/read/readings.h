/* SPDX-License-Identifier: Apache-2.0
 *
 * The numbers of one sensor, means over its film: with derivatives, from both ends, or with what
 * each lamp and material has to do with them. */
#ifndef IMP_CLI_READINGS_H
#define IMP_CLI_READINGS_H

#include "shared/blocks.h"
#include "text/json.h"

#include <importon/rooms.h>

#define ENDS_APART 5 /* standard errors between the ends that chance does not explain */

struct findings {
    int ends;  /* is each number read from both? */
    int apart; /* do they differ? */
    int lit;   /* has light reached the present sensor? */
};

/* All numbers of run.sensor, with derivatives by n_blocks blocks of parameters. */
int sensor_read(imp_problem *problem, struct json *j, struct imp_run run,
                const struct block *blocks, size_t n_blocks, struct findings *found);
/* The reading of a sensor, and the rows of lamps and materials. */
int shares_read(struct json *j, const struct imp_run *run, struct findings *found);
/* A warning for sensors to which no walk brought light. */
void unlit_tell(struct json *j, const int *sensor, int n);

#endif

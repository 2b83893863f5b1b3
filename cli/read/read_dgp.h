/* SPDX-License-Identifier: Apache-2.0
 *
 * Daylight glare probability of a grid of observers. */
#ifndef IMP_CLI_READ_DGP_H
#define IMP_CLI_READ_DGP_H

#include "text/args.h"
#include "text/json.h"
#include <importon/rooms.h>

struct dgp_wanted {
    int on;
    double threshold;
    int cells;
};
extern struct dgp_wanted dgp_wanted;
extern const struct arg_option options_dgp[];

/* Read and print the probabilities at the points of run->sensor. 0, or an exit code with the
 * reason printed. */
int dgp_read(struct json *j, const struct imp_run *run);

#endif

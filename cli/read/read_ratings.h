/* SPDX-License-Identifier: Apache-2.0
 *
 * Glare ratings of a grid of observers: by luminaires (--ugr) and by daylight (--dgp). */
#ifndef IMP_CLI_READ_RATINGS_H
#define IMP_CLI_READ_RATINGS_H

#include "text/args.h"
#include "text/json.h"
#include <importon/rooms.h>

struct ratings_wanted {
    int ugr, dgp;
    double threshold; /* of sources of daylight glare */
    int cells;        /* of the view */
};
extern struct ratings_wanted ratings_wanted;
extern const struct arg_option options_ratings[];

/* Read and print the ratings at the points of run->sensor, and write them as a table and a plan
 * (NULL: not). 0, or an exit code with the reason printed. */
int ratings_read(struct json *j, const struct imp_run *run, const char *csv,
                 const char *svg);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Daylight of a year at the points of a grid. */
#ifndef IMP_CLI_YEAR_H
#define IMP_CLI_YEAR_H

#include "text/args.h"
#include "text/json.h"
#include <importon/rooms.h>

struct year_wanted {
    const char *weather; /* file; NULL: no year is wanted */
    int hours[2];        /* of use */
    double lux;
};
extern struct year_wanted year_wanted;
extern const struct arg_option options_year[];

/* Read and print the year at the points of run->sensor; csv, svg: files, or NULL. 0, or an exit
 * code with the reason printed. */
int year_read(struct json *j, const struct imp_run *run, const char *csv,
              const char *svg);

#endif

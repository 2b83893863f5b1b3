/* SPDX-License-Identifier: Apache-2.0
 *
 * --map: which pixels of the best candidate tell of which number. */
#ifndef IMP_CLI_PLAN_MAPS_H
#define IMP_CLI_PLAN_MAPS_H

#include "plan_answer.h"

/* May PREFIX-NUMBER.exr, one for each number, and PREFIX-criterion.exr be written? */
int plan_map_writable(const char *prefix, const struct plan_numbers *numbers);
int plan_map_write(const char *prefix, imp_problem *problem, const struct plan_answer *a);

#endif

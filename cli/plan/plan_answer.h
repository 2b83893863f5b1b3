/* SPDX-License-Identifier: Apache-2.0
 *
 * What a plan prints: the ranking, the numbers' half-widths, the chosen set, what stays open. */
#ifndef IMP_CLI_PLAN_ANSWER_H
#define IMP_CLI_PLAN_ANSWER_H

#include "plan_candidates.h"
#include "plan_numbers.h"

struct plan_answer {
    const struct candidates *candidates;
    const struct plan_numbers *numbers;
    const struct imp_plan_options *options;
    const struct imp_plan_result *result;
    const struct imp_run *run;
    int improved; /* the best camera, at another place */
    double origin[3];
    struct imp_estimate gain;
};
void plan_answer_print(const struct plan_answer *a);
void plan_answer_json(const struct plan_answer *a);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * What a fit has found, as it is printed and as it is written into -o DIR. */
#ifndef IMP_CLI_FIT_ANSWER_H
#define IMP_CLI_FIT_ANSWER_H

#include "cmd_problem.h"

struct fit_answer {
    imp_problem *problem; /* which has just been fitted */
    const struct imp_fit_result *result;
    const struct block *blocks;
    size_t n_blocks;
    const char *optimizer;
    int no_intervals; /* they were not asked for */
};
/* 0, or an exit code with the reason printed. */
int fit_answer_give(const struct fit_answer *a);

/* Number i of the fit. */
struct imp_fit_variable fit_variable(const imp_problem *problem, size_t i);

#endif

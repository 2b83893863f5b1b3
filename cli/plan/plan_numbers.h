/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers of a plan by their names: those that are wanted (--of), and what is known of them
 * (--prior). */
#ifndef IMP_CLI_PLAN_NUMBERS_H
#define IMP_CLI_PLAN_NUMBERS_H

#include "shared/blocks.h"
#include "shared/problem_options.h"
#include <importon/plan.h>

extern const struct arg_option options_numbers[];

struct plan_numbers {
    const imp_problem *problem;
    struct block *blocks; /* owned */
    size_t n_blocks, n;   /* n: of x */
    size_t *of;           /* [n_of] owned */
    size_t n_of;
    double *prior; /* [n] owned */
};
/* 0, or an exit code with the reason printed. */
int plan_numbers_make(const imp_problem *problem, struct plan_numbers *out);
void plan_numbers_free(struct plan_numbers *p);
/* "name[element]" of number i, as a fit prints it. */
const char *plan_number_name(const struct plan_numbers *p, size_t i, char *text,
                             size_t size);
const struct block *plan_number_block(const struct plan_numbers *p, size_t i);

#endif

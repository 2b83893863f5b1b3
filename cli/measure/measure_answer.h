/* SPDX-License-Identifier: Apache-2.0
 *
 * What a measurement has found: printed, and written into -o DIR. */
#ifndef IMP_CLI_MEASURE_ANSWER_H
#define IMP_CLI_MEASURE_ANSWER_H

#include "photos.h"
#include "shared/problem_options.h"
#include <importon/plan.h>

/* The plan for the next photograph (measure_plan.c). */
struct next_photo {
    size_t n;
    struct imp_plan_candidate *c;         /* [n] owned; the first are the photographs */
    char **name;                          /* [n] owned */
    const struct imp_plan_result *result; /* the problem's; NULL: there is none */
};
/* Ranks sensors without a photograph, and photographs taken once more. 0, or an exit code with
 * the reason printed. */
int next_photo_find(imp_problem *problem, const struct photos *photos,
                    const struct imp_measure_result *r, struct next_photo *out);
void next_photo_free(struct next_photo *next);

struct measure_answer {
    imp_problem *problem;
    const struct photos *photos;
    const struct imp_measure_result *result;
    const struct next_photo *next;
};
/* May the files of -o be written? 0, or an exit code with the reason printed, as the next. */
int measure_answer_writable(void);
int measure_answer_give(const struct measure_answer *a);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * What a fit has found, as it is printed and as it is written into -o DIR. */
#ifndef IMP_CLI_FIT_ANSWER_H
#define IMP_CLI_FIT_ANSWER_H

#include "shared/blocks.h"
#include "shared/problem_options.h"

struct fit_answer {
    imp_problem *problem; /* which has just been fitted */
    const struct imp_fit_result *result;
    const struct block *blocks;
    size_t n_blocks;
    const char *optimizer;
    int no_intervals;                  /* they were not computed */
    const struct imp_missing *missing; /* [n_missing] values that may be wrong */
    size_t n_missing;
    int looked;              /* they were searched for */
    const char *const *more; /* [n_more] parameters that were found, and are not in it */
    size_t n_more;
};
/* Print it, and write it into -o DIR. 0, or an exit code with the reason printed, as the
 * next two. */
int fit_answer_give(const struct fit_answer *a);
/* Write it: all but what sensors see. */
int fit_answer_write(const struct fit_answer *a);
/* Its table alone. */
void fit_answer_print(const struct fit_answer *a);
/* May that, and the pictures of a fit, be written? */
int fit_answer_writable(const struct block *blocks, size_t n_blocks);
/* The members of its JSON. paths [n_blocks]: files of large blocks; NULL: none. */
void fit_answer_json(struct json *j, const struct fit_answer *a, char **paths);

/* "clipped":{..}, where targets have levels */
void fit_clipped_json(struct json *j, const imp_problem *problem);

/* fit_missing.c: sets missing, n_missing and looked, if they are to be searched for. 0,
 * or an exit code with the reason printed. */
void fit_missing_find(struct fit_answer *a);
/* "missing":[..] */
void fit_missing_json(struct json *j, const struct fit_answer *a);
void fit_missing_print(const struct fit_answer *a);

/* Losses [n], their errors and where they were [n][n_numbers]; these may be NULL. */
struct fit_history {
    size_t n, n_numbers;
    const double *loss, *se, *x;
};
/* "history":{..} */
void fit_history_json(struct json *j, const struct fit_history *h,
                      const struct block *blocks, size_t n_blocks);

/* Value i of the fit. */
struct imp_fit_variable fit_variable(const imp_problem *problem, size_t i);

#endif

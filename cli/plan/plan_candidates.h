/* SPDX-License-Identifier: Apache-2.0
 *
 * Candidates of a plan: the scene's sensors, or cameras on a sphere or along a path, each with every
 * lighting and every exposure. */
#ifndef IMP_CLI_PLAN_CANDIDATES_H
#define IMP_CLI_PLAN_CANDIDATES_H

#include "shared/command.h"
#include <importon/plan.h>

extern const struct arg_option options_candidates[];

struct candidates {
    size_t n, n_have;             /* those that have been taken are the first */
    struct imp_plan_candidate *c; /* [n] */
    char **text;                  /* [n_text] names and lamps, owned */
    size_t n_text;
};
/* 0, or an exit code with the reason printed. */
int candidates_make(struct candidates *out);
void candidates_free(struct candidates *c);

/* Numbers with commas between them, at most `most`: how many, or -1. */
int numbers_read(const char *text, double *out, int most);

#endif

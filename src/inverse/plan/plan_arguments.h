/* SPDX-License-Identifier: Apache-2.0
 *
 * What a plan is given, checked. */
#ifndef IMP_INVERSE_PLAN_ARGUMENTS_H
#define IMP_INVERSE_PLAN_ARGUMENTS_H

#include "planning.h"

/* For messages: `function`, and the `name` of its argument. options may be NULL; lists are the
 * caller's. */
enum imp_status imp__plan_options_take(const struct imp_problem *p, const char *function,
                                       const struct imp_plan_options *options,
                                       struct imp_plan_options *own);
/* Sets take where it is 0, from how many candidates are to be ranked. */
enum imp_status imp__plan_take_check(const struct imp_problem *p,
                                     struct imp_plan_options *own, size_t n_open);
/* *out [n] with defaults filled in, to be released; strings are the caller's. */
enum imp_status imp__plan_candidates_take(const struct imp_problem *p,
                                          const char *function, const char *name,
                                          const struct imp_plan_candidate *candidates,
                                          size_t n, struct imp_plan_candidate **out);

#endif

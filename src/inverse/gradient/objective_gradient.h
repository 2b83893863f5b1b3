/* SPDX-License-Identifier: Apache-2.0
 *
 * Loss and gradient of a problem, for the searches of fits. */
#ifndef IMP_INVERSE_OBJECTIVE_GRADIENT_H
#define IMP_INVERSE_OBJECTIVE_GRADIENT_H

#include "inverse/problem/problem.h"

/* imp_problem_objective; `in_place`: sums of many values are made in gradient and
 * gradient_se, which a failure then leaves undefined. */
enum imp_status imp__problem_objective(struct imp_problem *p, const double *x,
                                       const struct imp_run *run, bool in_place,
                                       struct imp_estimate *objective, double *gradient,
                                       double *gradient_se);
/* Are all numbers of an adjoint image finite? `name` is the argument's. */
enum imp_status imp__adjoint_check(const struct imp_problem *problem,
                                   const struct imp_film_desc *film, const float *adjoint,
                                   const char *name);

#endif

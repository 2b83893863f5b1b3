/* SPDX-License-Identifier: Apache-2.0
 *
 * The tracer of a problem: what walks are made with where derivatives of the problem's
 * parameters are wanted. */
#ifndef IMP_INVERSE_PROBLEM_TRACER_H
#define IMP_INVERSE_PROBLEM_TRACER_H

#include "inverse/problem/problem.h"
#include "walk/rules/features.h"

/* The tracer of a sensor for this problem, with every reason to refuse checked. waves
 * [IMP_WAVES_DRAWN]: wavelengths and responses in place of the sensor's; or NULL. */
enum imp_status imp__problem_tracer(const struct imp_problem *p,
                                    const struct imp_run *run,
                                    const struct imp_wavelengths *waves,
                                    struct imp_tracer *out);
/* The same for an integrator whose walks may begin at the lights. The caller traces those
 * itself, and derivatives with respect to extinctions are those of frozen collisions. */
enum imp_status imp__problem_tracer_of_any_end(const struct imp_problem *p,
                                               const struct imp_run *run,
                                               const struct imp_wavelengths *waves,
                                               struct imp_tracer *out);
/* Warn, once, of light that its walks do not bring. */
void imp__problem_tell(struct imp_problem *p, const struct imp_tracer *tracer);
/* The tracer of one part of a target (struct imp__target), of any end. `run` becomes the part's
 * run. */
enum imp_status imp__target_tracer(const struct imp_problem *p,
                                   const struct imp__target *target, int part,
                                   struct imp_run *run, struct imp_tracer *out);

/* The job of a run of the problem: with its active parameters. Refused where the scene's
 * integrator has no derivative. */
enum imp_status imp__problem_job(const struct imp_problem *problem,
                                 const struct imp_run *run, struct imp_job *job);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * imp_run, as a host gives it. */
#ifndef IMP_WALK_RUN_H
#define IMP_WALK_RUN_H

#include "base/arguments.h"

/* run NULL: the defaults. IMP_E_ARG, in the name of `function`, for a size or a number
 * out of its range. Which sensors there are is not looked at. */
enum imp_status imp__run_take(imp_context *ctx, const char *function,
                              const struct imp_run *run, struct imp_run *own);
/* The same of a picture, whose pixels may be one set of points each (IMP_POINTS_WHOLE). */
enum imp_status imp__run_take_picture(imp_context *ctx, const char *function,
                                      const struct imp_run *run, struct imp_run *own);
/* IMP_E_ARG if recorded walks are to be evaluated by a function that traces. */
enum imp_status imp__run_traces(imp_context *ctx, const char *function,
                                const struct imp_run *run);
#define IMP_RUN(ctx, own, run) IMP_CHECKED(imp__run_take(ctx, __func__, run, &(own)))
#define IMP_RUN_PICTURE(ctx, own, run)                                                   \
    IMP_CHECKED(imp__run_take_picture(ctx, __func__, run, &(own)))

#endif

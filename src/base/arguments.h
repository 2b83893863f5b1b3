/* SPDX-License-Identifier: Apache-2.0
 *
 * What every public function does first: required arguments, structs with a size, and
 * numbers. A message names the function and the argument as the header does:
 *
 *     struct imp_run own = IMP_RUN_INIT;
 *     IMP_REQUIRE(NULL, p, "problem");
 *     IMP_REQUIRE(p->ctx, out, "out");
 *     IMP_OPTIONS(p->ctx, own, run, "run");
 *
 * A sized struct may be older or newer than this library. The fields of an
 * older one are taken and the others keep their defaults; a newer one may not use what this
 * version does not have: those bytes must be 0. */
#ifndef IMP_BASE_ARGUMENTS_H
#define IMP_BASE_ARGUMENTS_H

#include "context.h"
#include "float_mode.h"

/* Return from the calling function unless the status is IMP_OK: before anything is owned,
 * so without a label. */
#define IMP_CHECKED(call)                                                                \
    do {                                                                                 \
        const enum imp_status checked_ = (call);                                         \
        if (checked_ != IMP_OK) return checked_;                                         \
    } while (0)

#define IMP_REQUIRE(ctx, argument, name) IMP_REQUIRE_OR(ctx, argument, name, IMP_E_ARG)
/* `result` is what the function returns instead; empty in a function without one. */
#define IMP_REQUIRE_OR(ctx, argument, name, result)                                      \
    do {                                                                                 \
        if (!(argument)) {                                                               \
            imp__argument_missing(ctx, __func__, name);                                  \
            return result;                                                               \
        }                                                                                \
    } while (0)
/* `own` holds the defaults; `in` may be NULL. */
#define IMP_OPTIONS(ctx, own, in, name)                                                  \
    IMP_CHECKED(imp__options_take(ctx, __func__, name, in, &(own), sizeof(own)))
/* Can `out` (its size is set) be given? Before the work, where giving it comes after. */
#define IMP_SIZED(ctx, out, name)                                                        \
    IMP_CHECKED(imp__size_check(ctx, __func__, name, (out)->size, sizeof *(out)))
/* Give as much of `all` as `out` has room for; out->size becomes what was given. */
#define IMP_GIVE(ctx, out, all, name)                                                    \
    IMP_CHECKED(imp__info_give(ctx, __func__, name, out, &(all), sizeof(all)))
#define IMP_FINITE(ctx, value, name)                                                     \
    IMP_CHECKED(imp__finite_check(ctx, __func__, name, &(double){value}, 1))
#define IMP_FINITE_ALL(ctx, values, n, name)                                             \
    IMP_CHECKED(imp__finite_check(ctx, __func__, name, values, n))

IMP_COLD enum imp_status imp__argument_missing(imp_context *ctx, const char *function,
                                               const char *name);
enum imp_status imp__size_check(imp_context *ctx, const char *function, const char *name,
                                size_t size, size_t known);
enum imp_status imp__options_take(imp_context *ctx, const char *function,
                                  const char *name, const void *in, void *own,
                                  size_t known);
/* Element i of an array of sized structs; all have the size of the first, which is the
 * distance between them. */
enum imp_status imp__element_take(imp_context *ctx, const char *function,
                                  const char *name, const void *array, size_t i,
                                  void *own, size_t known);
enum imp_status imp__info_give(imp_context *ctx, const char *function, const char *name,
                               void *out, const void *all, size_t known);
/* values [n]; the message has the index if n > 1. */
enum imp_status imp__finite_check(imp_context *ctx, const char *function,
                                  const char *name, const double *values, size_t n);

#endif

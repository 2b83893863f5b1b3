/* SPDX-License-Identifier: Apache-2.0
 *
 * Checks that the argument macros expand to: sized structs from older and newer
 * callers, and numbers that must be finite. */
#include "arguments.h"
#include <math.h>
#include <string.h>

/* A struct that is this much larger than ours has not been initialised. */
#define SIZE_AHEAD_MAX 512

enum imp_status imp__argument_missing(imp_context *ctx, const char *function,
                                      const char *name)
{
    return imp__error(ctx, IMP_E_ARG, "%s: %s is NULL", function, name);
}

/* Whole words only: then no number or pointer of the struct is cut in two. */
enum imp_status imp__size_check(imp_context *ctx, const char *function, const char *name,
                                size_t size, size_t known)
{
    if (size >= sizeof size && size % sizeof size == 0 && size <= known + SIZE_AHEAD_MAX)
        return IMP_OK;
    return imp__error(ctx, IMP_E_ARG,
                      "%s: size %zu of %s is not the size of that struct (%zu here); use "
                      "its initialiser",
                      function, size, name, known);
}

enum imp_status imp__options_take(imp_context *ctx, const char *function,
                                  const char *name, const void *in, void *own,
                                  size_t known)
{
    size_t size;
    if (!in) return IMP_OK;
    memcpy(&size, in, sizeof size);
    IMP_CHECKED(imp__size_check(ctx, function, name, size, known));
    for (size_t i = known; i < size; i++)
        if (((const unsigned char *)in)[i] != 0)
            return imp__error(ctx, IMP_E_ARG,
                              "%s: %s uses a field that version %s does not have",
                              function, name, IMP_VERSION_STRING);
    memcpy(own, in, imp_min(size, known));
    memcpy(own, &known, sizeof known);
    return IMP_OK;
}

enum imp_status imp__element_take(imp_context *ctx, const char *function,
                                  const char *name, const void *array, size_t i,
                                  void *own, size_t known)
{
    size_t stride, size;
    memcpy(&stride, array, sizeof stride);
    IMP_CHECKED(imp__size_check(ctx, function, name, stride, known));
    const char *in = (const char *)array + i * stride;
    memcpy(&size, in, sizeof size);
    if (size != stride)
        return imp__error(ctx, IMP_E_ARG, "%s: size %zu of %s[%zu] is not that of %s[0]",
                          function, size, name, i, name);
    return imp__options_take(ctx, function, name, in, own, known);
}

enum imp_status imp__info_give(imp_context *ctx, const char *function, const char *name,
                               void *out, const void *all, size_t known)
{
    size_t size;
    memcpy(&size, out, sizeof size);
    IMP_CHECKED(imp__size_check(ctx, function, name, size, known));
    const size_t given = imp_min(size, known);
    memcpy(out, all, given);
    memcpy(out, &given, sizeof given);
    return IMP_OK;
}

enum imp_status imp__finite_check(imp_context *ctx, const char *function,
                                  const char *name, const double *values, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        if (isfinite(values[i])) continue;
        return n > 1 ? imp__error(ctx, IMP_E_ARG, "%s: %s[%zu] is %g", function, name, i,
                                  values[i])
                     : imp__error(ctx, IMP_E_ARG, "%s: %s is %g", function, name,
                                  values[i]);
    }
    return IMP_OK;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Curves in space, in Mitsuba's format: one control point per line, x, y, z and radius;
 * empty lines separate curves. */
#ifndef IMP_FORMAT_CURVE_FILE_H
#define IMP_FORMAT_CURVE_FILE_H

#include "base/file.h"
#include "base/props.h"

#define IMP_CURVE_BYTES_MAX  ((size_t)1 << 36)
#define IMP_CURVE_POINTS_MAX ((size_t)INT32_MAX)

/* The curves in `text`; `name` is for messages, what is kept goes to the arena. Every number
 * is finite as a float, no radius is negative, and there is at least one curve.
 * @return IMP_E_SCENE with file and line; IMP_E_NOMEM. */
enum imp_status imp__curve_parse(imp_context *ctx, struct imp_arena *keep,
                                 const char *name, const struct imp_bytes *text,
                                 struct imp_curve_data *out);

#endif

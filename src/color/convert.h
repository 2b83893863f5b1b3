/* SPDX-License-Identifier: Apache-2.0
 *
 * From a colour as written to the numbers of a parameter. What a colour turns into
 * depends on how it was written and on what it is for (docs/scene-format.md 2.1); how
 * many numbers the parameter has depends on both too (12.2). */
#ifndef IMP_COLOR_CONVERT_H
#define IMP_COLOR_CONVERT_H

#include "spectrum.h"

#include "base/props.h"
#include <importon/kinds.h>

/* *value in all lanes; *count 1: one number, the same in all lanes, or 3: r, g, b. Of a
 * spectrum *kept becomes a copy in the arena, as it was written; else it stays.
 * `scalar` inputs get one number of a colour: the mean of the three in rgb mode, the
 * luminance in mono mode. @return IMP_OK, or IMP_E_SCENE with the place: not a colour,
 * not finite, a reflectance outside [0,1], negative light. */
enum imp_status imp__color_convert(imp_context *ctx, const struct imp_node *node,
                                   const struct imp_prop *prop, enum imp_role role,
                                   bool scalar, enum imp_color_mode mode, imp_spec *value,
                                   int *count, struct imp_arena *arena,
                                   const struct imp_spectrum **kept);

/* Value of an absent property. */
void imp__color_default(double fallback, enum imp_role role, enum imp_color_mode mode,
                        imp_spec *value, int *count);

/* Is this node a colour that is written as an object (uniform, srgb, d65, ...)? */
bool imp__color_is_object(const struct imp_node *node);
/* The same for such a node (docs/scene-format.md 2.4). Reads and checks all its
 * properties; *key is the name of its parameter under the object. */
enum imp_status imp__color_object(imp_context *ctx, struct imp_node *node,
                                  enum imp_role role, bool scalar,
                                  enum imp_color_mode mode, imp_spec *value, int *count,
                                  const char **key, struct imp_arena *arena,
                                  const struct imp_spectrum **kept);

#endif

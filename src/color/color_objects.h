/* SPDX-License-Identifier: Apache-2.0
 *
 * Shared by the files that read colours written as objects: color_objects.c and
 * color_named.c. */
#ifndef IMP_COLOR_OBJECTS_H
#define IMP_COLOR_OBJECTS_H

#include "color_set.h"

/* IMP_E_SCENE unless the property is written. */
enum imp_status imp__color_require(imp_context *ctx, struct imp_node *node,
                                   const char *name);
/* Numbers separated by commas and blanks; *list is released by the caller. */
enum imp_status imp__color_list(imp_context *ctx, struct imp_node *node, const char *name,
                                double **list, size_t *n);

/* `scale` times a named light, whose luminance is 1. */
enum imp_status imp__color_illuminant(const struct imp__color_ask *ask,
                                      struct imp_node *node, struct imp__color *out);
/* The index of a named glass. */
enum imp_status imp__color_glass(const struct imp__color_ask *ask, struct imp_node *node,
                                 struct imp__color *out);
/* `scale` times the optical depth of clear air, straight up from sea level, by a named
 * law. */
enum imp_status imp__color_rayleigh(const struct imp__color_ask *ask,
                                    struct imp_node *node, struct imp__color *out);
/* An index by the formula of Sellmeier, or of Cauchy. */
enum imp_status imp__color_formula(const struct imp__color_ask *ask,
                                   struct imp_node *node, bool cauchy,
                                   struct imp__color *out);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Reconstruction filters: separable, not normalised (the film divides by the weights). */
#ifndef IMP_KIND_FILTER_H
#define IMP_KIND_FILTER_H

#include "kind/build.h"

/* Pixels; a sample is added to (2 r)^2 of them. */
#define IMP_FILTER_RADIUS_MAX 64.0

/* Read a length in pixels, in (0, limit]. */
enum imp_status imp__filter_size(const struct imp_build *b, const char *name,
                                 double fallback, double limit, double *out);

/* The filter that a node describes; NULL: the default gaussian. b->node is not
 * used. Unused properties of the node are errors. */
enum imp_status imp__filter_build(const struct imp_build *b, struct imp_node *node,
                                  struct imp_filter *out);

#endif

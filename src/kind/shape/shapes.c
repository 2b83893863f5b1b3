/* SPDX-License-Identifier: Apache-2.0
 *
 * The shapes: one line a kind. */
#include "kind/build.h"

#define SHAPES(X)                                                                        \
    X(imp__rectangle)                                                                    \
    X(imp__disk)                                                                         \
    X(imp__sphere)                                                                       \
    X(imp__cylinder)                                                                     \
    X(imp__cube)                                                                         \
    X(imp__mesh)                                                                         \
    X(imp__obj)                                                                          \
    X(imp__ply)                                                                          \
    X(imp__serialized)                                                                   \
    X(imp__bsplinecurve)                                                                 \
    X(imp__linearcurve)

#define DECLARE(kind) extern const struct imp_shape_ops kind;
SHAPES(DECLARE)
#define ADDRESS(kind) &kind,
const struct imp_shape_ops *const imp__shape_kinds[] = {SHAPES(ADDRESS) NULL};

/* SPDX-License-Identifier: Apache-2.0
 *
 * The media: one line a kind. */
#include "kind/build.h"

#define MEDIA(X)                                                                         \
    X(imp__heterogeneous)                                                                \
    X(imp__homogeneous)

#define DECLARE(kind) extern const struct imp_medium_ops kind;
MEDIA(DECLARE)
#define ADDRESS(kind) &kind,
const struct imp_medium_ops *const imp__medium_kinds[] = {MEDIA(ADDRESS) NULL};

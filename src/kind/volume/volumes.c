/* SPDX-License-Identifier: Apache-2.0
 *
 * The volumes: one line a kind. */
#include "kind/build.h"

#define VOLUMES(X)                                                                       \
    X(imp__constvolume)                                                                  \
    X(imp__expvolume)                                                                    \
    X(imp__gridvolume)

#define DECLARE(kind) extern const struct imp_texture_ops kind;
VOLUMES(DECLARE)
#define ADDRESS(kind) &kind,
const struct imp_texture_ops *const imp__volume_kinds[] = {VOLUMES(ADDRESS) NULL};

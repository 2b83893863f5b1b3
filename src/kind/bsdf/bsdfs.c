/* SPDX-License-Identifier: Apache-2.0
 *
 * The materials: one line a kind (docs/kinds.md). */
#include "kind/build.h"

#define BSDFS(X)                                                                           \
    X(imp__conductor)                                                                      \
    X(imp__dielectric)                                                                     \
    X(imp__diffuse)                                                                        \
    X(imp__roughconductor)                                                                 \
    X(imp__stam_m2)                                                                        \
    X(imp__stam_m3)                                                                        \
    X(imp__twosided)

#define DECLARE(kind) extern const struct imp_bsdf_ops kind;
BSDFS(DECLARE)
#define ADDRESS(kind) &kind,
const struct imp_bsdf_ops *const imp__bsdf_kinds[] = {BSDFS(ADDRESS) NULL};

/* SPDX-License-Identifier: Apache-2.0
 *
 * The textures: one line a kind. */
#include "kind/build.h"

#define TEXTURES(X)                                                                      \
    X(imp__attribute_data)                                                               \
    X(imp__bitmap)                                                                       \
    X(imp__checkerboard)                                                                 \
    X(imp__d65)                                                                          \
    X(imp__mesh_attribute)                                                               \
    X(imp__volume_texture)

#define DECLARE(kind) extern const struct imp_texture_ops kind;
TEXTURES(DECLARE)
#define ADDRESS(kind) &kind,
const struct imp_texture_ops *const imp__texture_kinds[] = {TEXTURES(ADDRESS) NULL};

/* SPDX-License-Identifier: Apache-2.0
 *
 * Where a volume is: the unit cube under an affine map. */
#ifndef IMP_KIND_VOLUME_BOX_H
#define IMP_KIND_VOLUME_BOX_H

#include "kind/build.h"
#include "math/transform.h"

/* Reads to_world. */
static inline enum imp_status imp__box_read(const struct imp_build *b,
                                            struct imp_mat4 *to_unit)
{
    enum imp_status st = IMP_OK;
    struct imp_mat4 to_world;
    IMP_TRY(imp_build_transform(b, "to_world", to_world.m));
    if (!imp__mat4_is_finite(&to_world) || !imp__mat4_is_affine(&to_world))
        IMP_TRY(imp_build_error(b, "to_world", IMP_E_SCENE,
                                "to_world is not an affine map of finite numbers"));
    if (!imp__mat4_inverse(&to_world, to_unit))
        IMP_TRY(imp_build_error(b, "to_world", IMP_E_SCENE,
                                "to_world is singular: it flattens the volume"));
out:
    return st;
}

#endif

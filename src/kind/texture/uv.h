/* SPDX-License-Identifier: Apache-2.0
 *
 * The `to_uv` property: a plane affine map before the lookup
 * (docs/scene-format.md 6.1). */
#ifndef IMP_KIND_TEXTURE_UV_H
#define IMP_KIND_TEXTURE_UV_H

#include "kind/build.h"
#include <math.h>

struct imp__to_uv {
    double m[2][3];
};

/* The upper left part of the 4x4 matrix and its translation. */
static inline enum imp_status imp__to_uv_read(const struct imp_build *b,
                                              struct imp__to_uv *t)
{
    double m[16];
    const enum imp_status st = imp_build_transform(b, "to_uv", m);
    if (st != IMP_OK) return st;
    const struct imp__to_uv r = {{{m[0], m[1], m[3]}, {m[4], m[5], m[7]}}};
    for (int k = 0; k < 6; k++)
        if (!isfinite(r.m[k / 3][k % 3]))
            return imp_build_error(b, NULL, IMP_E_SCENE, "'to_uv' is not finite");
    *t = r;
    return IMP_OK;
}
static inline void imp__to_uv_apply(const struct imp__to_uv *t, const double uv[2],
                                    double out[2])
{
    for (int k = 0; k < 2; k++)
        out[k] = t->m[k][0] * uv[0] + t->m[k][1] * uv[1] + t->m[k][2];
}

#endif

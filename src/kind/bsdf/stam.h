/* SPDX-License-Identifier: Apache-2.0
 *
 * What Stam's materials share: the ambient term and the absorption probability. */
#ifndef IMP_KIND_BSDF_STAM_H
#define IMP_KIND_BSDF_STAM_H

#include "kind/build.h"

#define IMP_STAM_AMBIENT                                                                 \
    {                                                                                    \
        .name = "ambient", .role = IMP_EMISSION, .fallback = 0, .unit = "W m^-2 sr^-1"   \
    }

/* 0 (absent): not given. 1 is refused: nothing would ever be scattered. */
static inline enum imp_status imp__stam_absorb_read(const struct imp_build *b,
                                                    double *absorb)
{
    double a;
    const enum imp_status st = imp__props_float(b->ctx, b->node, "absorb", 0, &a);
    if (st != IMP_OK) return st;
    if (!(a >= 0 && a < 1))
        return imp__prop_error(b->ctx, b->node, imp__node_prop(b->node, "absorb"),
                               IMP_E_SCENE, "'absorb' = %g is outside [0, 1)", a);
    *absorb = a;
    return IMP_OK;
}

#endif

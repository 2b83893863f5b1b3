/* SPDX-License-Identifier: Apache-2.0
 *
 * What Stam's materials share: the ambient term and the absorption probability. */
#ifndef IMP_KIND_BSDF_STAM_H
#define IMP_KIND_BSDF_STAM_H

#include "kind/build.h"
#include "math/vec.h"

enum { IMP_AMBIENT }; /* the first input of each */
#define IMP_STAM_AMBIENT                                                                 \
    {                                                                                    \
        .name = "ambient", .role = IMP_EMISSION, .fallback = 0, .unit = "W m^-2 sr^-1"   \
    }

/* 0 (absent): not given. 1 is refused: nothing would ever be scattered. */
static inline enum imp_status imp__stam_absorb_read(const struct imp_build *b,
                                                    double *absorb)
{
    double a;
    const enum imp_status st = imp_build_float(b, "absorb", 0, &a);
    if (st != IMP_OK) return st;
    if (!(a >= 0 && a < 1))
        return imp_build_error(b, "absorb", IMP_E_SCENE,
                               "'absorb' = %g is outside [0, 1)", a);
    *absorb = a;
    return IMP_OK;
}

/* The ambient term is radiance of the front. */
static inline void imp__stam_emit(const struct imp_bsdf *b, const imp_spec *in,
                                  const imp_v3 *wo, imp_spec *e)
{
    (void)b;
    *e = (*wo)[2] > 0 ? in[IMP_AMBIENT] : imp__spec(0);
}
static inline void imp__stam_emit_d(const struct imp_bsdf *b, const imp_spec *in,
                                    const imp_v3 *wo, imp_spec *de)
{
    (void)in;
    for (int j = 0; j < b->n_in; j++) de[j] = imp__spec(0);
    de[IMP_AMBIENT] = imp__spec((*wo)[2] > 0);
}

#endif

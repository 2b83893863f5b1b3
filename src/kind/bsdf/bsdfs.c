/* SPDX-License-Identifier: Apache-2.0
 *
 * The materials: one line a kind (docs/kinds.md). */
#include "kind/build.h"
#include "math/vec.h"

#define BSDFS(X)                                                                         \
    X(imp__blendbsdf)                                                                    \
    X(imp__bumpmap)                                                                      \
    X(imp__conductor)                                                                    \
    X(imp__dielectric)                                                                   \
    X(imp__diffuse)                                                                      \
    X(imp__hair)                                                                         \
    X(imp__mask)                                                                         \
    X(imp__normalmap)                                                                    \
    X(imp__measured)                                                                     \
    X(imp__merl)                                                                         \
    X(imp__null)                                                                         \
    X(imp__phong)                                                                        \
    X(imp__plastic)                                                                      \
    X(imp__principled)                                                                   \
    X(imp__principledthin)                                                               \
    X(imp__roughconductor)                                                               \
    X(imp__roughdielectric)                                                              \
    X(imp__roughplastic)                                                                 \
    X(imp__stam_m2)                                                                      \
    X(imp__stam_m3)                                                                      \
    X(imp__thindielectric)                                                               \
    X(imp__twosided)

#define DECLARE(kind) extern const struct imp_bsdf_ops kind;
BSDFS(DECLARE)
#define ADDRESS(kind) &kind,
const struct imp_bsdf_ops *const imp__bsdf_kinds[] = {BSDFS(ADDRESS) NULL};

const struct imp_bsdf *imp__bsdf_without_directions_d(const struct imp_bsdf *b)
{
    if (!b->ops->eval_directions_d || b->flags & IMP_BSDF_STEPS) return b;
    for (int k = 0; k < b->n_child; k++) {
        const struct imp_bsdf *c = imp__bsdf_without_directions_d(b->child[k]);
        if (c) return c;
    }
    return NULL;
}

void imp__bsdf_albedo(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                      imp_spec *albedo)
{
    const struct imp_dirs dirs = {*wo, imp__v3(0, 0, 1), IMP_SMOOTH, 0};
    *albedo = imp__spec(0);
    if (b->ops->albedo) {
        b->ops->albedo(b, in, wo, albedo);
    } else if (b->flags & IMP_BSDF_SMOOTH) {
        b->ops->eval(b, in, &dirs, albedo);
        *albedo *= IMP_PI;
    }
}

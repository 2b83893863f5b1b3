/* SPDX-License-Identifier: Apache-2.0
 *
 * Which materials have forms in lanes. */
#include "bsdf_lanes.h"

extern const struct imp_bsdf_ops imp__conductor, imp__dielectric, imp__diffuse,
    imp__plastic, imp__principled, imp__roughconductor, imp__roughdielectric,
    imp__roughplastic, imp__twosided;

static const struct {
    const struct imp_bsdf_ops *ops;
    const struct imp_bsdf_lanes *lanes;
} list[] = {{&imp__diffuse, &imp__diffuse_lanes},
            {&imp__roughconductor, &imp__roughconductor_lanes},
            {&imp__twosided, &imp__twosided_lanes},
            {&imp__dielectric, &imp__dielectric_lanes},
            {&imp__conductor, &imp__conductor_lanes},
            {&imp__plastic, &imp__plastic_lanes},
            {&imp__roughplastic, &imp__roughplastic_lanes},
            {&imp__roughdielectric, &imp__roughdielectric_lanes},
            {&imp__principled, &imp__principled_lanes},
            {&imp__principled, &imp__principled_clear_lanes}};

const struct imp_bsdf_lanes *imp__bsdf_lanes(const struct imp_bsdf *b)
{
    for (size_t k = 0; k < imp_count(list); k++) {
        const struct imp_bsdf_lanes *l = list[k].lanes;
        if (b->ops == list[k].ops && (!l->covers || l->covers(b))) return l;
    }
    return NULL;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * A point in a medium as a scatterer, in the form of a BSDF whose frame has the axes of
 * the world. Its value is a phase function, without a cosine, times the albedo; its
 * emission is that of the medium there, per collision. */
#ifndef IMP_SCENE_IN_MEDIUM_H
#define IMP_SCENE_IN_MEDIUM_H

#include <importon/kinds.h>

/* self: the struct imp_medium; inputs: all of it. The second has albedo 1 and does not
 * emit. */
extern const struct imp_bsdf_ops imp__in_medium, imp__in_pure_medium;

static inline bool imp__is_in_medium(const struct imp_bsdf *b)
{
    return b->ops == &imp__in_medium || b->ops == &imp__in_pure_medium;
}
/* Does the albedo not depend on how large the extinction is? Of scattering and absorption it
 * does, and where both are 0 it is not known. */
bool imp__in_medium_has_albedo(const struct imp_medium *m);
/* Input j as the medium or its phase function declares it. */
const struct imp_input_desc *imp__in_medium_input(const struct imp_bsdf *b, int j);

#endif

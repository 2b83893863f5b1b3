/* SPDX-License-Identifier: Apache-2.0
 *
 * A derivative with respect to both directions, as a sum over the lobes of a material. */
#ifndef IMP_BY_DIRECTIONS_H
#define IMP_BY_DIRECTIONS_H

#include <importon/kinds.h>

struct imp__by_directions {
    imp_spec wo[3], wi[3];
};
static inline void imp__by_directions_add(struct imp__by_directions *t, imp_spec factor,
                                          imp_v3 by_wo, imp_v3 by_wi)
{
    for (int k = 0; k < 3; k++) {
        t->wo[k] += factor * by_wo[k];
        t->wi[k] += factor * by_wi[k];
    }
}

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Lights chosen by the tree at several places, whose importances are made in lanes. */
#ifndef IMP_SCENE_LIGHT_LANES_H
#define IMP_SCENE_LIGHT_LANES_H

#include "light_tree.h"
#include "math/wide_real.h"

/* Importances of nodes that are remembered: the last ones of each of so many. */
enum { IMP_LIGHT_NODES = 128 };

struct imp_light_lanes {
    imp_wide3 p, n;
    bool faces; /* what arrives from behind n counts for nothing */
    int32_t node[IMP_LIGHT_NODES];
    unsigned near[IMP_LIGHT_NODES];
    imp_wide importance[IMP_LIGHT_NODES];
};

struct imp_lights_chosen {
    int light[IMP_WIDE_LANES];
    int prim[IMP_WIDE_LANES]; /* a triangle of it; -1: all of it */
    imp_wide chance;
};
/* imp__light_tree_choose for places p that light reaches from before n alone, or, with n NULL, from
 * everywhere, in the lanes with bits. A bit for each lane that has a light. */
unsigned imp__light_lanes_choose(const struct imp_light_tree *t, const imp_wide3 *p,
                                 const imp_wide3 *n, unsigned bits, imp_wide *u,
                                 struct imp_lights_chosen *out);

#endif

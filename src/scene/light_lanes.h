/* SPDX-License-Identifier: Apache-2.0
 *
 * Lights chosen by the tree at several places, whose importances are made in lanes. */
#ifndef IMP_SCENE_LIGHT_LANES_H
#define IMP_SCENE_LIGHT_LANES_H

#include "light_tree.h"
#include "math/wide_real.h"

/* Nodes that are remembered: all of a tree of 64 lights, the last ones of a larger tree. */
enum { IMP_LIGHT_NODES = 128 };

struct imp_light_lanes {
    imp_wide3 p, n; /* places that are faced by lights before them alone */
    int32_t node[IMP_LIGHT_NODES];
    unsigned near[IMP_LIGHT_NODES];
    imp_wide importance[IMP_LIGHT_NODES];
};
void imp__light_lanes_begin(const imp_wide3 *p, const imp_wide3 *n,
                            struct imp_light_lanes *out);
/* imp__light_tree_choose for one of the places. */
int imp__light_lanes_choose(const struct imp_light_tree *t, struct imp_light_lanes *lanes,
                            int lane, double *u, int *prim, double *chance);

#endif

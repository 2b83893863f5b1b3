/* SPDX-License-Identifier: Apache-2.0
 *
 * All kinds of integrators, and those that belong to this room: depth, aov and moment
 * measure first hits and the radiance of nested integrators. */
#ifndef IMP_FILM_INTEGRATOR_H
#define IMP_FILM_INTEGRATOR_H

#include "scene/integrator.h"

extern const struct imp_integrator_ops
    *const imp__integrator_kinds[]; /* ends with NULL */

enum imp_aov_type {
    IMP_AOV_ALBEDO,
    IMP_AOV_DEPTH,
    IMP_AOV_POSITION,
    IMP_AOV_UV,
    IMP_AOV_GEO_NORMAL,
    IMP_AOV_SH_NORMAL,
    IMP_AOV_DP_DU,
    IMP_AOV_DP_DV,
    IMP_AOV_DUV_DX,
    IMP_AOV_DUV_DY,
    IMP_AOV_PRIM_INDEX,
    IMP_AOV_SHAPE_INDEX
};

/* What aov and moment add to the channels of the first integrator in them. */
struct imp_channels {
    /* True: first and second moments of each integrator; false: its radiance and the aovs. */
    bool moments;
    int n_aovs;
    struct imp_aov {
        const char *name;
        enum imp_aov_type type;
    } * aovs;
};
/* NULL: not one that contains others. */
static inline const struct imp_channels *imp__channels_of(const struct imp_integrator *i)
{
    return i->ops->flags & IMP_INTEGRATOR_CONTAINS ? i->self : NULL;
}

/* The names of an aov's channels; NULL behind the last. */
extern const char *const imp__aov_channels[][3]; /* [enum imp_aov_type] */

#endif

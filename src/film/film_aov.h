/* SPDX-License-Identifier: Apache-2.0
 *
 * What a picture shows of the first surface that a sample meets: albedo, depth, position, normals,
 * texture coordinates and their slopes. */
#ifndef IMP_FILM_AOV_H
#define IMP_FILM_AOV_H

#include "film_integrator.h"
#include "film_measure.h"

/* Channels of one of them. */
int imp__aov_count(enum imp_aov_type type);
/* All that `top` names, of the ray that walk w began with; how many values. 0 where there is no
 * surface. */
int imp__aov_values(const struct imp_measure *m, const struct imp_channels *top,
                    const struct imp_walk *w, double *value);

#endif

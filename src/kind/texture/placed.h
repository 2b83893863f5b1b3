/* SPDX-License-Identifier: Apache-2.0
 *
 * A volume that is placed by numbers, and the derivative of its values by these: at a place p that
 * stays, what is there moves with a velocity V, and
 *
 *     value' = -grad value . V(p). */
#ifndef IMP_KIND_TEXTURE_PLACED_H
#define IMP_KIND_TEXTURE_PLACED_H

#include "kind/build.h"
#include "math/transform.h"

enum imp_placed_how { IMP_PLACED_POSE, IMP_PLACED_SCALE, IMP_PLACED_MAP };

struct imp_placed {
    int n;
    struct imp_placed_by {
        int param;
        enum imp_placed_how how;
    } by[2];
    imp_v3 middle;  /* of a pose and a scale, where it is now */
    imp_v3 turn[3]; /* of a pose: how it turns by each number of its rotation vector */
    double scale;
    struct imp_mat4 from_world; /* of a map: its inverse */
};

/* The velocity at p for each of its numbers; how many there are. */
int imp__placed_velocities(const struct imp_placed *placed, enum imp_placed_how how,
                           imp_v3 p, imp_v3 velocity[12]);
/* As imp_texture_ops.scatter and tangent, of these numbers. *value_dot is added to. */
void imp__placed_scatter(const struct imp_texture *t, const struct imp_texcoord *at,
                         bool scalar, const imp_spec *bar, struct imp_sink *sink);
void imp__placed_tangent(const struct imp_texture *t, const struct imp_texcoord *at,
                         bool scalar, imp_dot_fn *dot, const void *x_dot,
                         imp_spec *value_dot);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * How the kernel K = f |cos| of a vertex changes where something moves. K is a function of
 * wo and wi in the frame of the surface; where the frame turns by the rotation vector O, with
 * wo' and wi' the velocities of the directions in the world,
 *
 *     dK = dK/dwo.(wo' - O x wo) + dK/dwi.(wi' - O x wi),  O = n x n' + n (turn about n)
 *
 * from imp_bsdf_ops.eval_directions_d. The density of a direction that was drawn is a constant:
 * directions are held in the world, and with them their density. A vertex that slides over its
 * surface, by v' - V, looks up other values of textures: dK = sum_j dK/din_j (d_u in_j grad u +
 * d_v in_j grad v).(v' - V), from imp_texture_ops.slope. */
#ifndef IMP_WALK_MOVED_KERNEL_H
#define IMP_WALK_MOVED_KERNEL_H

#include "walk/core/walk.h"

/* An adjoint of ln K times its derivatives. */
struct imp__kernel_bar {
    imp_v3 n;      /* of the normal's velocity */
    imp_v3 wo, wi; /* of those of the directions, world, across them */
    double turn;   /* of the frame about its normal */
    imp_v3 slide;  /* of v' - V, in the surface */
};

/* Derivatives of the logarithm of a kernel, by lanes; 0 where the kernel is. */
struct imp__kernel_d {
    struct imp_frame frame;
    imp_v3 wo, wi;             /* world */
    imp_spec d_wo[3], d_wi[3]; /* local */
    imp_spec d_uv[2];
    imp_v3 grad[2]; /* of u and v, in the surface; 0: no texture */
};

/* Is it Lambertian: K = rho cos/pi on the front, or on both sides? And without textures? */
bool imp__is_lambertian(const struct imp_bsdf *b);
bool imp__is_textured(const struct imp_bsdf *b);
static inline bool imp__is_plain(const struct imp_bsdf *b)
{
    return imp__is_lambertian(b) && !imp__is_textured(b);
}
/* Gradients of u and v in a surface. */
void imp__surface_grad(const struct imp_surface *at, imp_v3 grad[2]);
/* Why the kernel has no such derivative, in words that follow the material's name; NULL: it
 * has one. round: of a shape whose frame turns from place to place. */
const char *imp__kernel_without_d(const struct imp_bsdf *b, bool round);
/* The same of its textures. */
const char *imp__textures_without_d(const struct imp_bsdf *b, const struct imp_shape *s);

/* For these local directions, in the frame of `at`. Logarithms, because K is recorded of directions that
 * are rounded. */
void imp__kernel_derive(const struct imp_vertex *v, const struct imp_surface *at,
                        const struct imp_dirs *dirs, struct imp__kernel_d *out);
/* An adjoint of ln K, by lanes, times the derivatives: their sum over the scene's lanes. */
struct imp__kernel_bar imp__kernel_times(const struct imp__kernel_d *d, imp_spec bar,
                                         int lanes);

/* A Lambertian kernel towards the unit direction w: bar times the derivative of the logarithm of n.w. */
static inline struct imp__kernel_bar imp__lambert_times(imp_v3 n, imp_v3 w, double bar)
{
    struct imp__kernel_bar out = {{0}, {0}, {0}, 0, {0}};
    if (bar == 0) return out;
    const double by = bar / imp__dot(n, w);
    out.n = w * by;
    out.wi = n * by;
    return out;
}

/* The same for a meter, whose shape has the normal n. */
struct imp__kernel_bar imp__meter_times(const struct imp_sensor *s, imp_v3 n, imp_v3 w,
                                        double bar);

#endif

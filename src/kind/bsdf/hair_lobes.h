/* SPDX-License-Identifier: Apache-2.0
 *
 * Light through a fibre of circular section (Marschner et al. 2003; d'Eon et al. 2011;
 * Chiang et al. 2016). The fibre lies along y, and z is its normal. For a direction w, theta
 * is the angle to the section, sin(theta) = w_y, phi = atan2(w_z, w_x) the one in it, and
 * gamma = phi - pi/2 that to the normal. Light that leaves along wo has passed the section
 * p times:
 *
 *     p = 0: reflected (R); 1: TT; 2: TRT; 3: all that is reflected more often
 *
 * and the lobes are functions of three factors each, M_p(theta) A_p N_p(phi), where
 *
 *     integral of M_p cos(theta_i) dtheta_i = integral of N_p dphi_i = 1. */
#ifndef IMP_KIND_BSDF_HAIR_LOBES_H
#define IMP_KIND_BSDF_HAIR_LOBES_H

#include "math/vec.h"

enum { IMP_HAIR_LOBES = 4 };

/* The numbers of the model, from the roughnesses and the tilt of the scales. */
struct imp__hair_shape {
    double v[IMP_HAIR_LOBES];       /* variance of theta */
    double dv[IMP_HAIR_LOBES];      /* by the longitudinal roughness */
    double norm[IMP_HAIR_LOBES];    /* 1/(v (1 - e^(-2/v))) */
    double s, ds;                   /* of the logistic density of phi, by roughness */
    double share;                   /* of it between -pi and pi */
    double turn[IMP_HAIR_LOBES][2]; /* of theta_o by the scales: cosine and sine */
    double dturn[IMP_HAIR_LOBES];   /* by the tilt in degrees */
};
void imp__hair_shape(double longitudinal, double azimuthal, double tilt,
                     struct imp__hair_shape *out);

/* What follows from wo and the index, with derivatives by the index. */
struct imp__hair_sight {
    double sin_theta, cos_theta, phi, gamma;
    double F, dF;             /* reflectance */
    double gamma_t, dgamma_t; /* inside */
    double length, dlength;   /* of a passage, in radii */
};
void imp__hair_sight(imp_v3 wo, double eta, struct imp__hair_sight *out);

/* A_p, and its derivatives by F and by the transmittance T of a passage. */
struct imp__hair_parts {
    imp_spec A[IMP_HAIR_LOBES], dF[IMP_HAIR_LOBES], dT[IMP_HAIR_LOBES];
};
void imp__hair_parts(double F, imp_spec T, struct imp__hair_parts *out);

/* A direction of light. */
struct imp__hair_exit {
    double sin_theta, cos_theta, phi;
};
static inline struct imp__hair_exit imp__hair_exit(imp_v3 wi)
{
    return (struct imp__hair_exit){wi[1], sqrt(wi[0] * wi[0] + wi[2] * wi[2]),
                                   atan2(wi[2], wi[0])};
}
/* M_p N_p. by: NULL, or its derivatives by the longitudinal and azimuthal roughness, the
 * tilt and the index. */
double imp__hair_lobe(const struct imp__hair_shape *h, const struct imp__hair_sight *o,
                      int p, const struct imp__hair_exit *i, double by[4]);
/* Draws wi with density M_p N_p. u[0] for phi, the others for theta. */
imp_v3 imp__hair_draw(const struct imp__hair_shape *h, const struct imp__hair_sight *o,
                      int p, const double u[3]);

#endif

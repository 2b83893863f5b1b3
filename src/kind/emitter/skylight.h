/* SPDX-License-Identifier: Apache-2.0
 *
 * The clear sky of Hosek and Wilkie (2012) and the sun of their second paper (2013): fits
 * to brute-force simulations, for a turbidity of 1 to 10, an albedo of the ground and the
 * sun's elevation. With gamma the angle to the sun and theta the angle to the zenith,
 *
 *     L = (1 + A e^(B/(cos theta + .01)))
 *         (C + D e^(E gamma) + F cos^2 gamma + G chi(gamma) + H cos^(1/2) theta) R
 *     chi(gamma) = (1 + cos^2 gamma)/(1 + I^2 - 2 I cos gamma)^(3/2)
 *
 * A..I and R are polynomials of degree 5 in (elevation/(pi/2))^(1/3), and linear between
 * whole turbidities and in the albedo. The radiance of the sun is a cubic of the elevation
 * in 45 pieces, darker towards its limb by a polynomial of the cosine there.
 *
 * The tables (skylight_tables.txt) are the authors', under their licence, which is in
 * the file: for three colours, in units of luminance, and for eleven wavelengths, in
 * W m^-2 sr^-1 nm^-1. */
#ifndef IMP_KIND_EMITTER_SKYLIGHT_H
#define IMP_KIND_EMITTER_SKYLIGHT_H

#include "math/vec.h"
#include <importon/kinds.h>

enum { IMP_SKY_TURBIDITIES = 10, IMP_SKY_WAVES = 11, IMP_SKY_NUMBERS = 10 };
#define IMP_SKY_FIRST_NM 320
#define IMP_SKY_STEP_NM  40

/* The tables at one elevation of the sun. Channel k is a colour, or wavelength k. */
struct imp__skylight {
    int channels; /* 3 or IMP_SKY_WAVES */
    /* A..I, R */
    double sky[IMP_SKY_TURBIDITIES][2][IMP_SKY_WAVES][IMP_SKY_NUMBERS];
    double elevation;               /* of the sun, radians, in [0, pi/2] */
    double radius;                  /* of its disc, radians */
    double color[3][IMP_SKY_WAVES]; /* linear sRGB of a spectrum: lines between these */
};

/* by_wave: eleven wavelengths; else three colours. */
void imp__skylight_set(struct imp__skylight *s, double elevation, double radius,
                       bool by_wave);

/* What a radiance depends on, and its derivatives. */
struct imp__sky_value {
    double value, by_turbidity, by_albedo;
};
/* A direction, as all channels need it: theta <= pi/2 from the zenith, gamma from the sun. */
struct imp__sky_place {
    double cos_gamma, gamma;
    double up;   /* 1/(cos theta + .01) */
    double root; /* of cos theta */
};
struct imp__sky_place imp__sky_place(double cos_theta, double cos_gamma);
/* Whole turbidities around one. The derivative of a line is the difference of its ends; where
 * two lines meet it is the mean of theirs, as central differences find it. */
struct imp__sky_between {
    int low, high; /* indices of the ends */
    double share;  /* of the upper one */
    int from, to;  /* the derivative is (value[to] - value[from]) per */
    double per;
};
struct imp__sky_between imp__sky_between(double turbidity);
/* Radiance of the sky in channel k. */
struct imp__sky_value imp__sky_radiance(const struct imp__skylight *s, int k,
                                        const struct imp__sky_between *t, double albedo,
                                        const struct imp__sky_place *x);

/* Radiance of the sun at eleven wavelengths, where it is hit in a direction of this
 * elevation, with cos_limb between the ray and the sun's surface; its albedo has none. */
void imp__sun_radiance(double turbidity, double elevation, double cos_limb,
                       struct imp__sky_value out[IMP_SKY_WAVES]);
/* The same, its mean over the disc. */
void imp__sun_mean(const struct imp__skylight *s, double turbidity,
                   struct imp__sky_value out[IMP_SKY_WAVES]);

/* skylight_tables.txt, as it is built in. */
extern const float imp__sky_rgb_numbers[10][2][6][3][9];
extern const float imp__sky_rgb_radiance[10][2][6][3];
extern const float imp__sky_spec_numbers[10][2][6][11][9];
extern const float imp__sky_spec_radiance[10][2][6][11];
extern const float imp__sun_spec_radiance[10][45][11][4];
extern const float imp__sun_spec_limb[11][6];

#endif

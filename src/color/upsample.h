/* SPDX-License-Identifier: Apache-2.0
 *
 * From a colour to a spectrum that has it under daylight: the sigmoid of a quadratic
 * (Jakob and Hanika, "A Low-Dimensional Function Space for Efficient Spectral
 * Upsampling", 2019),
 *
 *     S(l) = 1/2 + v/(2 sqrt(1 + v^2)),   v = c0 x^2 + c1 x + c2,   x = (l - 360)/470
 *
 * with l in nm and c such that the linear sRGB colour of S under D65 is the given one.
 * Where that equation holds its derivative gives dc/drgb. On request the spectrum is
 * linear in the colour instead (rgb_basis.h), which derivatives and sums of colours like
 * better and measured spectra resemble less. */
#ifndef IMP_COLOR_UPSAMPLE_H
#define IMP_COLOR_UPSAMPLE_H

#include "cie.h"
#include <importon/kinds.h>
#include <math.h>
#include <stdbool.h>

/* scale S, and its derivatives by the colour's three numbers; or, if linear, the sum of
 * c_k B_k, whose derivatives are d_scale[k] B_k. */
struct imp__lifted {
    bool linear;
    double scale, c[3];
    double peak;                  /* the largest S'(v) of all wavelengths */
    double d_scale[3], d_c[3][3]; /* by r, g, b; d_c [i][k] = peak dc_i/drgb_k */
};

/* Weights of a reflectance's values in its colour under daylight: the same for all colours. */
#define IMP__LIFT_POINTS (2 * IMP_CIE_N - 1)
struct imp__lifter {
    imp_spec weight[IMP__LIFT_POINTS]; /* r, g, b */
    double x[IMP__LIFT_POINTS];
};
void imp__lifter_make(struct imp__lifter *out);

/* rgb in [0,1]; outside it is clamped, and its derivative there is 0. */
void imp__lift_reflectance(const double rgb[3], struct imp__lifted *out);
/* rgb >= 0: 2 m S of rgb/(2 m), m its largest. */
void imp__lift_unbounded(const double rgb[3], struct imp__lifted *out);
/* rgb >= 0, m its largest: s S of rgb/s, s = max(1, 2 m - 1). Up to 1 it is the spectrum of
 * a reflectance, which Mitsuba takes for an extinction and which it does not have beyond. */
void imp__lift_extinction(const double rgb[3], struct imp__lifted *out);
/* The first two to the bit, for many colours. */
void imp__lift_reflectance_by(const struct imp__lifter *by, const double rgb[3],
                              struct imp__lifted *out);
void imp__lift_unbounded_by(const struct imp__lifter *by, const double rgb[3],
                            struct imp__lifted *out);

/* Linear. `bounded`: a reflectance, clamped to [0,1]; else rgb >= 0. */
void imp__lift_linear(const double rgb[3], bool bounded, struct imp__lifted *out);

double imp__lifted_value(const struct imp__lifted *l, double nm);
/* At four wavelengths, to the bit. */
void imp__lifted_lanes(const struct imp__lifted *l, const double nm[4], imp_spec *value);
/* d [3] by r, g, b. */
double imp__lifted_value_d(const struct imp__lifted *l, double nm, double d[3]);
/* No less than the value at any wavelength. */
double imp__lifted_most(const struct imp__lifted *l);

#endif

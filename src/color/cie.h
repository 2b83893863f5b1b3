/* SPDX-License-Identifier: Apache-2.0
 *
 * The standard observer and daylight, 360-830 nm in steps of 5 nm
 * (docs/scene-format.md A.1). */
#ifndef IMP_COLOR_CIE_H
#define IMP_COLOR_CIE_H

#define IMP_CIE_N        95
#define IMP_CIE_FIRST_NM 360.0
#define IMP_CIE_STEP_NM  5.0
#define IMP_CIE_LAST_NM  830.0
/* Integral of the y curve, and what makes D65 a white of luminance 1. */
#define IMP_CIE_Y_INTEGRAL 106.7502593994140625
#define IMP_CIE_D65_SCALE  98.99741751876255

extern const double imp__cie_xyz[3][IMP_CIE_N];
extern const double imp__cie_d65[IMP_CIE_N];

/* Linear interpolation; 0 outside. */
double imp__cie_lookup(const double table[IMP_CIE_N], double nm);

#endif

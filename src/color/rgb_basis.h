/* SPDX-License-Identifier: Apache-2.0
 *
 * A linear basis of colours: three spectra B_c >= 0 whose sum is 1 and whose colours under
 * daylight are (1,0,0), (0,1,0), (0,0,1), so that r B_0 + g B_1 + b B_2 has the colour
 * (r, g, b) and is no reflectance above 1 where no number is. */
#ifndef IMP_COLOR_RGB_BASIS_H
#define IMP_COLOR_RGB_BASIS_H

#include "cie.h"

extern const double imp__rgb_basis_table[3][IMP_CIE_N];

/* Linear interpolation; outside the tables as at their ends. */
static inline void imp__rgb_basis(double nm, double b[3])
{
    const double at = (nm - IMP_CIE_FIRST_NM) / IMP_CIE_STEP_NM;
    const double x = at > 0 ? (at < IMP_CIE_N - 1 ? at : IMP_CIE_N - 1) : 0;
    const int i = x < IMP_CIE_N - 2 ? (int)x : IMP_CIE_N - 2;
    for (int c = 0; c < 3; c++) {
        const double *t = imp__rgb_basis_table[c] + i;
        b[c] = t[0] + (x - i) * (t[1] - t[0]);
    }
}

#endif

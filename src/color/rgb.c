/* SPDX-License-Identifier: Apache-2.0
 *
 * Matrices between XYZ and linear sRGB, and the integral of a spectrum. */
#include "rgb.h"
#include "cie.h"

static void matrix_apply(const double m[3][3], const double x[3], double y[3])
{
    for (int i = 0; i < 3; i++) y[i] = m[i][0] * x[0] + m[i][1] * x[1] + m[i][2] * x[2];
}

void imp__xyz_to_rgb(const double xyz[3], double rgb[3])
{
    static const double m[3][3] = {{3.240479, -1.537150, -0.498535},
                                   {-0.969256, 1.875991, 0.041556},
                                   {0.055648, -0.204043, 1.057311}};
    matrix_apply(m, xyz, rgb);
}

void imp__rgb_to_xyz(const double rgb[3], double xyz[3])
{
    static const double m[3][3] = {{0.412453, 0.357580, 0.180423},
                                   {0.212671, 0.715160, 0.072169},
                                   {0.019334, 0.119193, 0.950227}};
    matrix_apply(m, rgb, xyz);
}

/* 1000 points from end to end, each with the weight of 1/1000 (not 1/999) of the range:
 * the format fixes this, so that a constant 1 under D65 is 0.999 and not 1. */
void imp__spectrum_to_rgb(size_t n, const double *nm, const double *value, int daylight,
                          double rgb[3])
{
    enum { POINTS = 1000 };
    const double range = 470;
    double xyz[3] = {0, 0, 0};
    size_t k = 0;
    for (int i = 0; i < POINTS; i++) {
        const double l = IMP_CIE_FIRST_NM + range * i / (POINTS - 1);
        if (n < 2 || l < nm[0] || l > nm[n - 1]) continue;
        while (k + 2 < n && nm[k + 1] < l) k++;
        const double t = (l - nm[k]) / (nm[k + 1] - nm[k]);
        double v = value[k] + t * (value[k + 1] - value[k]);
        if (daylight) v *= imp__cie_lookup(imp__cie_d65, l) / IMP_CIE_D65_SCALE;
        for (int c = 0; c < 3; c++) xyz[c] += v * imp__cie_lookup(imp__cie_xyz[c], l);
    }
    for (int c = 0; c < 3; c++) xyz[c] *= range / POINTS / IMP_CIE_Y_INTEGRAL;
    imp__xyz_to_rgb(xyz, rgb);
}

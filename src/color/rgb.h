/* SPDX-License-Identifier: Apache-2.0
 *
 * Linear sRGB (Rec. 709 primaries, D65 white): luminance, XYZ, the transfer curve. */
#ifndef IMP_COLOR_RGB_H
#define IMP_COLOR_RGB_H

#include <math.h>
#include <stddef.h>

#define IMP_LUM_R 0.212671
#define IMP_LUM_G 0.715160
#define IMP_LUM_B 0.072169

static inline double imp__luminance(double r, double g, double b)
{
    return IMP_LUM_R * r + IMP_LUM_G * g + IMP_LUM_B * b;
}
void imp__xyz_to_rgb(const double xyz[3], double rgb[3]);
void imp__rgb_to_xyz(const double rgb[3], double xyz[3]);

/* IEC 61966-2-1, of values in [0,1]; outside, the curve's own continuation. */
static inline double imp__srgb_decode(double c)
{
    return c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
}
static inline double imp__srgb_encode(double c)
{
    return c <= 0.0031308 ? 12.92 * c : 1.055 * pow(c, 1 / 2.4) - 0.055;
}

/* Colour of a sampled spectrum (docs/scene-format.md 2.3), not clamped. Wavelengths
 * increase; the spectrum is linear between them and 0 outside. `daylight`: the colour of
 * a surface of this reflectance under D65; else that of a light of this power. */
void imp__spectrum_to_rgb(size_t n, const double *nm, const double *value, int daylight,
                          double rgb[3]);

#endif

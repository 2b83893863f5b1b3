/* SPDX-License-Identifier: Apache-2.0
 *
 * Sine and cosine of a fraction of a turn, and angles of vectors. Every direction drawn needs
 * the former; every hit of a sphere, direction to a photometric file, pixel of a sky and edge of a
 * form factor the latter. Written out they cost a third of the C library's, and give the same bits
 * with every C library. */
#ifndef IMP_MATH_TRIG_H
#define IMP_MATH_TRIG_H

#define IMP_WIDE 1
#define IMP_TEXT "math/trig_text.h"
#include "lane_text.h"
#define IMP_WIDE 4
#define IMP_TEXT "math/trig_text.h"
#include "lane_text.h"

#define IMP_WIDE 8
#define IMP_TEXT "math/trig_text.h"
#include "lane_text.h"

/* sin and cos of 2 pi u, |u| < 2^20. */
static inline void imp__sincos_turn(double u, double *s, double *c)
{
    const double four = 4 * u,
                 quarter = (double)(long long)(four + (four < 0 ? -0.5 : 0.5));
    const double x = (four - quarter) * 1.57079632679489661923;
    const double a = imp__sin_eighth_1(x), b = imp__cos_eighth_1(x);
    switch ((long long)quarter & 3) {
    case 0: *s = a, *c = b; break;
    case 1: *s = b, *c = -a; break;
    case 2: *s = -a, *c = -b; break;
    default: *s = -b, *c = a; break;
    }
}

#endif

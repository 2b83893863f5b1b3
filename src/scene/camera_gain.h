/* SPDX-License-Identifier: Apache-2.0
 *
 * What a camera does to radiance before it is a value of a picture: exposure, white
 * balance, vignetting, and the power law of a photograph that is compared with it. For
 * channel c at film position (px, py)
 *
 *     picture_c = g_c radiance_c        g_c = exposure balance_c (1 + a r^2 + b r^4)
 *
 * where r is the distance from the middle of the film over half its diagonal, and
 * balance = (red, 1, blue). Where it is compared with a photograph of values T = M^(1/gamma),
 * M linear in light, a further factor T^(1 - gamma) turns the residual of M into
 *
 *     T^(1 - gamma) M' - T  =  gamma (M'^(1/gamma) - T) + O((M' - M)^2)
 *
 * so that losses are those of the photograph's own values, and stay polynomials of the
 * picture, unbiased (docs/photographs.md). Where the power is expanded about another picture
 * V (docs/estimators.md 20), found when gamma was `at`, the same is written in units that gamma
 * does not change,
 *
 *     at/gamma V^(1 - gamma) M' + (1 - at/gamma) V  =  V + at (M'^(1/gamma) - V) + O((M' - V^gamma)^2)
 *
 * by a factor and an offset. */
#ifndef IMP_SCENE_CAMERA_GAIN_H
#define IMP_SCENE_CAMERA_GAIN_H

#include "scene.h"

enum imp__gain_input {
    IMP_GAIN_EXPOSURE,
    IMP_GAIN_RED,
    IMP_GAIN_BLUE,
    IMP_GAIN_VIGNETTING_2,
    IMP_GAIN_VIGNETTING_4,
    IMP_GAIN_GAMMA,
    IMP_GAIN_INPUTS
};
struct imp_camera_gain {
    const struct imp_input *input[IMP_GAIN_INPUTS];
    double middle[2], per_half_diagonal;
    bool fitted_gamma; /* gamma is written: targets are photographs */
};

/* A photograph that the picture is compared with: [height][width][channels] from the
 * crop's corner. */
struct imp_photograph {
    const float *pixels;
    int x, y, width, height, channels;
    double at; /* gamma that the pixels belong to; 0: they are compared as they are */
};

/* Below this a photograph's value is not used: dark current, rounding. */
#define IMP_PHOTOGRAPH_LEAST 1e-3

/* g at a film position; `photograph` may be NULL. d [IMP_GAIN_INPUTS]: its derivatives;
 * NULL: not wanted. */
imp_spec imp__gain_at(const struct imp_camera_gain *g, const struct imp_photograph *photo,
                      double px, double py, imp_spec *d);
/* What a photograph with an `at` adds to the value of each walk, and its derivative with
 * respect to gamma (may be NULL). */
imp_spec imp__gain_offset(const struct imp_camera_gain *g,
                          const struct imp_photograph *photo, double px, double py,
                          imp_spec *d);

#endif

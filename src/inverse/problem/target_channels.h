/* SPDX-License-Identifier: Apache-2.0
 *
 * Channels of a target: those of the picture (the first ones, of a part of a film's
 * response curves), or their luminance where the target has one channel and the picture
 * three. */
#ifndef IMP_INVERSE_TARGET_CHANNELS_H
#define IMP_INVERSE_TARGET_CHANNELS_H

#include "color/rgb.h"
#include "math/vec.h"
#include "problem.h"

static inline bool imp__sees_luminance(const struct imp__target *target, int channels)
{
    return !target->of_curves && target->desc.channels != channels;
}
/* Channel c of the target, from the picture's channels. */
static inline double imp__seen(bool luminance, const double *lanes, int c)
{
    return luminance ? imp__luminance(lanes[0], lanes[1], lanes[2]) : lanes[c];
}
/* The transpose: from cotangents of the target's n channels. */
static inline imp_spec imp__seen_bar(bool luminance, int n, const double *bar)
{
    imp_spec lanes = {0};
    if (luminance) return (imp_spec){IMP_LUM_R, IMP_LUM_G, IMP_LUM_B, 0} * bar[0];
    for (int c = 0; c < n; c++) lanes[c] = bar[c];
    return lanes;
}

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Channels of a target: those of the picture, or their luminance where the target has
 * one channel and the picture three. */
#ifndef IMP_INVERSE_SEEN_H
#define IMP_INVERSE_SEEN_H

#include "color/rgb.h"
#include "math/vec.h"

/* Channel c of the target, from the picture's channels. */
static inline double imp__seen(int target_channels, int channels, const double *lanes,
                               int c)
{
    return target_channels == channels ? lanes[c]
                                       : imp__luminance(lanes[0], lanes[1], lanes[2]);
}
/* The transpose: from cotangents of the target's channels. */
static inline imp_spec imp__seen_bar(int target_channels, int channels, const double *bar)
{
    if (target_channels != channels)
        return (imp_spec){IMP_LUM_R, IMP_LUM_G, IMP_LUM_B, 0} * bar[0];
    return channels == 3 ? (imp_spec){bar[0], bar[1], bar[2], 0} : (imp_spec){bar[0]};
}

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Which textures have forms in lanes. */
#include "texture_lanes.h"

extern const struct imp_texture_ops imp__bitmap, imp__checkerboard;

const struct imp_texture_lanes *imp__texture_lanes(const struct imp_texture *t)
{
    const struct imp_texture_lanes *l = t->ops == &imp__bitmap ? &imp__bitmap_lanes
                                        : t->ops == &imp__checkerboard
                                            ? &imp__checkerboard_lanes
                                            : NULL;
    return l && l->covers(t) ? l : NULL;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Textures with forms in lanes (textures_in_lanes.c). */
#ifndef IMP_KIND_TEXTURE_LANES_H
#define IMP_KIND_TEXTURE_LANES_H

#include "kind/kind_lanes.h"

extern const struct imp_texture_lanes imp__bitmap_lanes, imp__checkerboard_lanes;

#endif

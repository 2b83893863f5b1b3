/* SPDX-License-Identifier: Apache-2.0
 *
 * What textures share beside imp_input_eval and its derivatives (kinds.h), for inputs of
 * their own. The engine uses the loops of kind/build.h. */
#ifndef IMP_KIND_TEXTURE_INPUT_H
#define IMP_KIND_TEXTURE_INPUT_H

#include "kind/build.h"

/* Transpose of reading three numbers (element, +1, +2) as their luminance. Three
 * additions of one number each: every lane of `bar` stays in its lane, as sinks that
 * separate channels need it. */
void imp__luminance_scatter(struct imp_sink *sink, int param, size_t element,
                            imp_spec bar);

/* The input that a checkerboard, read as a colour, is at a place; NULL: t is another
 * texture. */
const struct imp_input *imp__checkerboard_input(const struct imp_texture *t,
                                                const struct imp_texcoord *at);

#endif

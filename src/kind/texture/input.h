/* SPDX-License-Identifier: Apache-2.0
 *
 * One input at a point, read as a colour or as one number. Textures that have inputs of
 * their own use these; the engine uses the loops of kind/build.h. */
#ifndef IMP_KIND_TEXTURE_INPUT_H
#define IMP_KIND_TEXTURE_INPUT_H

#include "kind/build.h"

typedef double imp_dot_fn(const void *x_dot, int param, size_t element);

void imp__input_eval(const struct imp_input *input, bool scalar,
                     const struct imp_texcoord *at, imp_spec *value);
void imp__input_scatter(const struct imp_input *input, bool scalar,
                        const struct imp_texcoord *at, const imp_spec *bar,
                        struct imp_sink *sink);
void imp__input_tangent(const struct imp_input *input, bool scalar,
                        const struct imp_texcoord *at, imp_dot_fn *dot, const void *x_dot,
                        imp_spec *value_dot);

/* Transpose of reading three numbers (element, +1, +2) as their luminance. Three
 * additions of one number each: every lane of `bar` stays in its lane, as sinks that tell
 * channels apart need it. */
void imp__luminance_scatter(struct imp_sink *sink, int param, size_t element,
                            imp_spec bar);

#endif

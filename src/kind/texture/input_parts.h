/* SPDX-License-Identifier: Apache-2.0
 *
 * Parts of an input's value and derivatives that few walks ask for (input.c). */
#ifndef IMP_KIND_TEXTURE_INPUT_PARTS_H
#define IMP_KIND_TEXTURE_INPUT_PARTS_H

#include "kind/build.h"

/* ---- input_bump.c -------------------------------------------------------------------- */

/* With h the height, the slopes of the raised surface have h_u and h_v along the normal in
 * place of what they had (Blinn 1978; along the normal a surface's own slopes vanish, but
 * where normals are interpolated): the normal is their cross product, on the side of the
 * geometric one. */
struct imp__bump {
    imp_spec normal;
    bool raised;    /* the texture has a slope there; false: the normal is z */
    imp_v3 d_uv[2]; /* d normal/d slope */
};
struct imp__bump imp__bump_at(const struct imp_input *input,
                              const struct imp_texcoord *at);

/* ---- input_spectrum.c ---------------------------------------------------------------- */

/* Looked up by wavelength: lane by lane, so that each piece stays in its lane. */
void imp__input_spectrum_scatter(const struct imp_input *input,
                                 const struct imp_carried *c, const imp_spec *bar,
                                 struct imp_sink *sink);
void imp__input_spectrum_tangent(const struct imp_input *input,
                                 const struct imp_carried *c, imp_dot_fn *dot,
                                 const void *x_dot, imp_spec *value_dot);

/* As a colour, or as a number made of one. */
void imp__input_colour_scatter(const struct imp_input *input, bool number,
                               const imp_spec *bar, struct imp_sink *sink);
void imp__input_colour_tangent(const struct imp_input *input, bool number,
                               imp_dot_fn *dot, const void *x_dot, imp_spec *value_dot);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Inputs and switches of principled. */
#ifndef IMP_PRINCIPLED_H
#define IMP_PRINCIPLED_H

#include "kind/registry.h"

enum {
    BASE,
    LUM,
    ROUGHNESS,
    ANISOTROPIC,
    METALLIC,
    TRANS,
    ETA,
    SPECULAR,
    SPEC_TINT,
    SHEEN,
    SHEEN_TINT,
    FLATNESS,
    CLEARCOAT,
    GLOSS,
    N_INPUTS
};

struct imp__principled_self {
    bool transmits, coated, by_eta;
};

extern const struct imp_input_desc imp__principled_inputs[];
enum imp_status imp__principled_prepare(const struct imp_build *b);
enum imp_status imp__principled_build(const struct imp_build *b, void *self,
                                      struct imp_bsdf *bsdf);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Inputs and switches of principled. */
#ifndef IMP_PRINCIPLED_H
#define IMP_PRINCIPLED_H

#include "blending.h"
#include "burley.h"
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

/* Inputs that are weights of a lobe, or that only its shape depends on. */
#define IMP_OF_FACETS                                                                    \
    (IMP_INPUT_BIT(ROUGHNESS) | IMP_INPUT_BIT(ANISOTROPIC) | IMP_INPUT_BIT(METALLIC) |   \
     IMP_INPUT_BIT(SPEC_TINT))
#define IMP_OF_GLASS                                                                     \
    (IMP_INPUT_BIT(ROUGHNESS) | IMP_INPUT_BIT(ANISOTROPIC) | IMP_INPUT_BIT(METALLIC) |   \
     IMP_INPUT_BIT(TRANS))
#define IMP_OF_DIFFUSE                                                                   \
    (IMP_INPUT_BIT(METALLIC) | IMP_INPUT_BIT(TRANS) | IMP_INPUT_BIT(SHEEN))
/* The least part of a lobe in what is drawn, with these derivatives wanted. */
static inline double imp__lobe_least(uint64_t derivative, uint64_t of)
{
    return derivative & of ? IMP_WANTED_PART : derivative ? 0.1 : 0.02;
}
/* Those by the shape of the facets (enum imp__score). */
static inline unsigned imp__principled_wanted(uint64_t derivative)
{
    return imp__burley_wanted(derivative & IMP_INPUT_BIT(ROUGHNESS),
                              derivative & IMP_INPUT_BIT(ANISOTROPIC));
}

struct imp__principled_self {
    bool transmits, coated, by_eta;
};

/* Seen from behind, z is reversed and the index inverted: below wo is always above. */
struct imp__principled_look {
    const struct imp__principled_self *p;
    imp_v3 wo, wi, m; /* m: half-vector, upwards */
    bool back, reflects;
    double e, de;     /* index behind over before; d e/d(eta or specular) in front */
    double n, om, im; /* |wo + e wi| with the sign that turns m up; wo.m, wi.m */
    double metallic, trans;
    struct imp__burley_facets facets;
};
/* Textures may leave [0, 1]: there they are cut, and constant. */
void imp__principled_cut(const imp_spec *in, imp_spec x[N_INPUTS]);
/* in: cut. */
struct imp__principled_look imp__principled_look(const struct imp_bsdf *b,
                                                 const imp_spec *in,
                                                 const struct imp_dirs *d);
/* Sets the half-vector. False: structurally zero. */
bool imp__principled_half(struct imp__principled_look *l);
/* For imp_bsdf_ops, where nothing is transmitted: with transmission the value jumps. */
void imp__principled_directions_d(const struct imp_bsdf *b, const imp_spec *in,
                                  const struct imp_dirs *d, imp_spec d_wo[3],
                                  imp_spec d_wi[3]);

extern const struct imp_input_desc imp__principled_inputs[];
enum imp_status imp__principled_prepare(const struct imp_build *b);
enum imp_status imp__principled_build(const struct imp_build *b, void *self,
                                      struct imp_bsdf *bsdf);

#endif

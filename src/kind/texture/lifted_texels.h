/* SPDX-License-Identifier: Apache-2.0
 *
 * Texels of three channels where walks carry wavelengths: each is lifted to a spectrum,
 * and the spectra are interpolated. With the linear basis a texel's spectrum is linear in
 * its numbers, and nothing is kept.
 *
 * A texel is lifted when a walk first looks it up. Texels of one colour share a spectrum, so
 * that time and memory follow the number of colours that are seen. */
#ifndef IMP_KIND_TEXTURE_LIFTED_TEXELS_H
#define IMP_KIND_TEXTURE_LIFTED_TEXELS_H

#include "color/upsample.h"
#include "kind/build.h"

enum imp__lift_rule {
    IMP__LIFT_BY_SIZE,     /* colours within [0,1] as reflectances, others as light */
    IMP__LIFT_REFLECTANCE, /* clamped to [0,1] */
    IMP__LIFT_ANY_SIZE
};

/* Members marked atomic are written by walks. */
struct imp__lifted_texels {
    imp_context *ctx;
    const float *data; /* [n][3] */
    size_t n;
    enum imp__lift_rule rule;
    bool made;  /* by this rule */
    bool whole; /* update lifts all texels, as bounds need them; 0 after make */
    uint32_t
        *spectrum_of; /* [n], atomic: 0 not lifted yet, s + 1: spectrum s; NULL: linear */
    struct imp__lifted *spectrum; /* [room] */
    float (*colour)[3];           /* [room], from which each spectrum was made */
    size_t room;
    uint32_t
        *used; /* atomic: the spectra taken, also if there was no room for the last */
    uint32_t
        *known; /* [1 << known_bits], atomic: by a hash of the colour, as spectrum_of */
    int known_bits;
    const struct imp__lifter *by;
};

/* The texels that a lookup sees, and their weights: n of them. */
struct imp__texel_sum {
    int n;
    const size_t *texel;
    const double *weight;
};

/* data [n][3] stays the caller's. Update makes the spectra. IMP_E_NOMEM. */
enum imp_status imp__lifted_texels_make(const struct imp_build *b, const float *data,
                                        size_t n, struct imp__lifted_texels *out);
/* Numbers have changed, or the rule has; no walk looks texels up meanwhile. */
void imp__lifted_texels_update(struct imp__lifted_texels *t, enum imp__lift_rule rule);

void imp__lifted_texels_eval(const struct imp__lifted_texels *t,
                             const struct imp__texel_sum *sum,
                             const struct imp_carried *carried, imp_spec *value);
/* bar, value_dot: as imp_texture_ops.scatter and .tangent; param: of the texels. */
void imp__lifted_texels_scatter(const struct imp__lifted_texels *t,
                                const struct imp__texel_sum *sum,
                                const struct imp_carried *carried, int param,
                                const imp_spec *bar, struct imp_sink *sink);
void imp__lifted_texels_tangent(const struct imp__lifted_texels *t,
                                const struct imp__texel_sum *sum,
                                const struct imp_carried *carried, int param,
                                imp_dot_fn *dot, const void *x_dot, imp_spec *value_dot);
/* The spectrum of texel k, unless linear; *own has it if it cannot be kept. */
const struct imp__lifted *imp__lifted_texel(const struct imp__lifted_texels *t, size_t k,
                                            struct imp__lifted *own);
/* No less than texel k at any wavelength. */
double imp__lifted_texels_most(const struct imp__lifted_texels *t, size_t k);

#endif

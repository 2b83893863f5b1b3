/* SPDX-License-Identifier: Apache-2.0
 *
 * Roughness of the microfacet kinds, as scenes write it: `alpha`, or `alpha_u` and
 * `alpha_v`; `distribution`; `sample_visible`. */
#ifndef IMP_KIND_BSDF_ROUGHNESS_H
#define IMP_KIND_BSDF_ROUGHNESS_H

#include "microfacet.h"

#define IMP_ROUGHNESS_INPUT(key, more)                                                   \
    {                                                                                    \
        .name = key, .role = IMP_REFLECTANCE, .flags = IMP_INPUT_SCALAR | (more),        \
        .fallback = 0.1, .lo = IMP_ALPHA_MIN, .hi = INFINITY, .unit = "1"                \
    }
/* The three inputs, in this order. */
#define IMP_ROUGHNESS_INPUTS                                                             \
    IMP_ROUGHNESS_INPUT("alpha", IMP_INPUT_OPTIONAL),                                    \
        IMP_ROUGHNESS_INPUT("alpha_u", IMP_INPUT_OPTIONAL),                              \
        IMP_ROUGHNESS_INPUT("alpha_v", IMP_INPUT_OPTIONAL)

/* Part of a kind's object; filled by imp__roughness_build. */
struct imp__roughness {
    enum imp__distribution type;
    bool visible, anisotropic;
};

/* One of alpha and (alpha_u, alpha_v) is there, so that it can be a parameter, and
 * numbers are not below the smallest roughness. */
enum imp_status imp__roughness_prepare(const struct imp_build *b);
enum imp_status imp__roughness_build(const struct imp_build *b, struct imp__roughness *r);

/* `in`: the three inputs. Textures may hold less than the smallest roughness: then it is
 * that, and constant. */
static inline struct imp__microfacet imp__roughness_at(const struct imp__roughness *r,
                                                       const imp_spec *in)
{
    const double au = in[r->anisotropic ? 1 : 0][0], av = in[r->anisotropic ? 2 : 0][0];
    return (struct imp__microfacet){r->type, r->visible, imp_max(au, IMP_ALPHA_MIN),
                                    imp_max(av, IMP_ALPHA_MIN), 0};
}
/* Derivatives that are wanted (imp_dirs), those by roughness (enum imp__score). The first of the
 * three inputs has bit `first`. */
static inline unsigned imp__roughness_wanted(const struct imp__roughness *r,
                                             uint64_t derivative, int first)
{
    const unsigned by = (unsigned)(derivative >> first) & 7;
    return !r->anisotropic ? (by & 1 ? IMP_SCORE_SCALE : 0)
                           : (by & 2 ? IMP_SCORE_U : 0) | (by & 4 ? IMP_SCORE_V : 0);
}
/* The same for drawing directions: with the derivatives that d wants. */
static inline struct imp__microfacet imp__roughness_drawn(const struct imp__roughness *r,
                                                          const imp_spec *in,
                                                          const struct imp_dirs *d,
                                                          int first)
{
    struct imp__microfacet f = imp__roughness_at(r, in);
    f.wanted = imp__roughness_wanted(r, d->derivative, first);
    return f;
}

/* Adds df by (au, av), lane by lane, to the derivatives `df` by the three inputs. */
static inline void imp__roughness_d(const struct imp__roughness *r, const imp_spec *in,
                                    const imp_spec d[2], imp_spec *df)
{
    for (int j = 0; j < 2; j++) {
        const int input = r->anisotropic ? 1 + j : 0;
        if (!(in[input][0] < IMP_ALPHA_MIN)) df[input] += d[j];
    }
}

#endif

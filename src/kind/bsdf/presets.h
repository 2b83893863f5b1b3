/* SPDX-License-Identifier: Apache-2.0
 *
 * Materials by name. */
#ifndef IMP_KIND_BSDF_PRESETS_H
#define IMP_KIND_BSDF_PRESETS_H

#include "kind/build.h"

struct imp__conductor {
    const char *name;
    double eta[3], k[3];
};
/* NULL: unknown. */
const struct imp__conductor *imp__conductor_find(const char *name);
/* All of them, in order; NULL after the last. */
const struct imp__conductor *imp__conductor_at(size_t i);

/* Inputs of the kinds that a Fresnel factor makes: a tint that multiplies it, and the
 * complex index. */
#define IMP_TINT_INPUT(key)                                                              \
    {                                                                                    \
        .name = key, .role = IMP_REFLECTANCE, .flags = IMP_INPUT_OPTIONAL,               \
        .fallback = 1, .hi = 1, .unit = "1"                                              \
    }
#define IMP_ETA_INPUT                                                                    \
    {                                                                                    \
        .name = "eta", .role = IMP_UNBOUNDED, .fallback = 0, .unit = "1"                 \
    }
#define IMP_K_INPUT                                                                      \
    {                                                                                    \
        .name = "k", .role = IMP_UNBOUNDED, .fallback = 1, .unit = "1"                   \
    }

/* The `material` property of the two conductor kinds: its numbers become the properties
 * eta and k, as if they had been written. */
enum imp_status imp__conductor_prepare(const struct imp_build *b);

/* Refractive index inside over outside, of kinds that it bends nothing in: with a
 * gradient. imp__ior_prepare makes it of the properties int_ior and ext_ior. */
#define IMP_IOR_INPUT(ratio, least, most)                                                \
    {                                                                                    \
        .name = "eta", .role = IMP_UNBOUNDED,                                            \
        .flags = IMP_INPUT_SCALAR | IMP_INPUT_NUMBER, .fallback = ratio, .lo = least,    \
        .hi = most, .unit = "1"                                                          \
    }
/* `inside`: the material that int_ior means where it is not written; ext_ior means air. An
 * error if both sides are equal and may not be. */
enum imp_status imp__ior_prepare(const struct imp_build *b, const char *inside,
                                 bool may_be_equal);

/* A refractive index, written as a number or a name (any case). */
enum imp_status imp__ior_read(const struct imp_build *b, const char *name,
                              const char *fallback, double *ior);

#endif

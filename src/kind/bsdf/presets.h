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

/* The `material` property of the two conductor kinds: its numbers become the properties
 * eta and k, as if they had been written. */
enum imp_status imp__conductor_prepare(const struct imp_build *b);

/* A refractive index, written as a number or a name (any case). */
enum imp_status imp__ior_read(const struct imp_build *b, const char *name,
                              const char *fallback, double *ior);

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * What `sunsky` (sunsky.c) keeps, and its radiance with derivatives. */
#ifndef IMP_KIND_EMITTER_SUNSKY_H
#define IMP_KIND_EMITTER_SUNSKY_H

#include "math/weight_table.h"
#include "skylight.h"

struct sunsky {
    struct imp__skylight light;
    imp_v3 axis[3], sun; /* of the sky, unit, world; the sun in their frame */
    double cos_radius, sun_solid, dim; /* dim: of the disc against the sun's */
    bool by_wave, mono, limb, dark;    /* dark: the sun is below the horizon */
    struct imp__weight_table table;
    double *sun_share; /* of directions that are drawn from the disc */
};

/* One channel's radiance, with derivatives. */
struct sunsky_both {
    struct imp__sky_value sky, sun;
};
/* All lanes in direction w, in the frame of the sky; the sun as dim as its disc is large. nm: where the
 * sky is by wavelengths. */
void imp__sunsky_lanes(const struct sunsky *s, double turbidity, const imp_spec *albedo,
                       const imp_spec *nm, imp_v3 w, struct sunsky_both out[4]);

static inline bool imp__sunsky_in_disc(const struct sunsky *s, double cos_gamma)
{
    return cos_gamma >= s->cos_radius;
}

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Sampling and density shared by point lights. */
#include "from_point.h"
#include "math/vec.h"
#include <math.h>

bool imp__point_light_sample(imp_v3 light, imp_v3 ref, struct imp_light_sample *out)
{
    const imp_v3 d = light - ref;
    const double r = imp__length(d);
    if (!(r > 1e-150 && r < INFINITY)) return false;
    *out = (struct imp_light_sample){.wi = d * (1 / r),
                                     .dist = r,
                                     .pdf = 1,
                                     .cos_light = 1,
                                     .p = light,
                                     .ng = d * (-1 / r)};
    return true;
}

double imp__point_light_pdf(const struct imp_emitter *e, const imp_v3 *ref,
                            const imp_v3 *wi, const struct imp_hit *hit,
                            const struct imp_surface *at)
{
    (void)e, (void)ref, (void)wi, (void)hit, (void)at;
    return 0;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * What a light sample needs whether its vertex is alone or in lanes: the part of the number that
 * chose a light, and the radiance of the point that was drawn. */
#ifndef IMP_WALK_LIGHT_POINT_H
#define IMP_WALK_LIGHT_POINT_H

#include "emitted.h"
#include "step.h"

/* Where u, which chose the light, lies in its interval, on [0, 1). */
static inline double imp__light_part(const struct imp_scene *scene, int light, double u,
                                     double pmf)
{
    const double below = light > 0 ? scene->light_cdf[light - 1] : 0;
    return imp_clamp((u - below) / pmf, 0, 0x1.fffffffffffffp-1);
}

/* The point; none of a light that is infinitely far. */
static inline imp_v3 imp__light_place_of(const struct imp_light_sample *ls)
{
    return isfinite(ls->dist) ? ls->p : (imp_v3){0};
}

/* The radiance of a light, from what is decided. That of an even one asks for its side
 * alone. */
static inline imp_spec imp__light_point_radiance(const struct imp_scene *scene,
                                                 const struct imp_carried *carried,
                                                 int light,
                                                 const struct imp_light_sample *ls)
{
    const struct imp_emitter *e = scene->emitters[light];
    if (imp_likely(imp__emitter_even(e, carried)))
        return imp__even_radiance(e, imp__decide1(ls->cos_light));
    const imp_v3 there =
        imp__decide((imp_v3){ls->uv[0], ls->uv[1], ls->dist, ls->cos_light});
    const struct imp_emission x = {
        {there[0], there[1]}, there[2], there[3], imp__decide(-ls->wi)};
    return imp__emitter_radiance(scene, light, &x, imp__decide(imp__light_place_of(ls)),
                                 carried);
}

#endif

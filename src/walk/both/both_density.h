/* SPDX-License-Identifier: Apache-2.0
 *
 * Densities of the vertices of bidirectional walks, drawn from either end. Densities per
 * steradian become densities per area with |cos|/r^2 at the geometric normal. Where the
 * wavelengths of a walk have densities of their own the mean over them is taken, which does
 * not depend on the one that drew. */
#ifndef IMP_WALK_BOTH_DENSITY_H
#define IMP_WALK_BOTH_DENSITY_H

#include "both.h"

static inline double imp__end_pdf(const struct imp_bsdf *b,
                                  const struct imp_carried *carried, const imp_spec *in,
                                  imp_v3 wo, imp_v3 wi, uint64_t derivative)
{
    const struct imp_dirs dirs = {wo, wi, IMP_SMOOTH, derivative};
    if (imp_likely(!b->shaped)) return b->ops->pdf(b, in, &dirs);
    imp_spec p;
    double sum = 0;
    imp__shaped_pdf(b, carried, in, &dirs, &p);
    for (int j = 0; j < carried->n; j++) sum += p[j];
    return sum / carried->n;
}

/* The density of `to`, where `from` draws it with pdf per steradian. */
static inline double imp__end_arrives(const struct imp_end *from,
                                      const struct imp_end *to, double pdf)
{
    if (to->far) return pdf;
    const imp_v3 d = to->p - from->p;
    const double r2 = imp__dot(d, d);
    if (!(r2 > 0)) return 0;
    if (imp__is_zero(to->ng)) return pdf / r2;
    return pdf * fabs(imp__dot(to->ng, d)) / (r2 * sqrt(r2));
}

static inline bool imp__end_is_far(const struct imp_emitter *e)
{
    return e->ops->flags & (IMP_EMITTER_ENVIRONMENT | IMP_EMITTER_FAR);
}
/* Does it shine from points of its surface in directions of a density? */
static inline bool imp__end_is_area(const struct imp_emitter *e)
{
    return e->ops->flags & IMP_EMITTER_AREA && !(e->ops->flags & IMP_EMITTER_DELTA);
}

/* That of a vertex that parallel light of a far light meets along d: it begins on a disk about
 * the scene, or on its surface. */
static inline double imp__end_arrives_across(const struct imp_scene *scene, int light,
                                             const struct imp_end *to, imp_v3 d)
{
    const struct imp_shape *shape = scene->emitters[light]->shape;
    const double r = scene->ball.radius;
    const double c = imp__is_zero(to->ng) ? 1 : fabs(imp__dot(to->ng, d));
    return (shape ? 1 / shape->area : IMP_INV_PI / (r * r)) * c;
}

/* That of a vertex that the sensor's walks meet first: film area per area across the ray, as
 * `weight` of a connection has it. */
static inline double imp__end_arrives_from_sensor(const struct imp_both *b, double weight,
                                                  const struct imp_end *to, imp_v3 d)
{
    const double c = imp__is_zero(to->ng) ? 1 : fabs(imp__dot(to->ng, d));
    return weight * c / (b->sensor->scale * b->pixels);
}

static inline double imp__end_pmf(const struct imp_scene *s, int light)
{
    return s->light_cdf[light] - (light ? s->light_cdf[light - 1] : 0);
}

/* With which walks begin at this point of a light; of the sky, in this direction. */
static inline double imp__end_begins(const struct imp_scene *scene, int light,
                                     const struct imp_emission *x)
{
    const struct imp_emitter *e = scene->emitters[light];
    const double pmf = imp__end_pmf(scene, light);
    if (e->ops->flags & IMP_EMITTER_DELTA) return pmf;
    return e->shape ? pmf / e->shape->area : pmf * e->ops->pdf_emission(e, x);
}

#endif

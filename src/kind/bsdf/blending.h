/* SPDX-License-Identifier: Apache-2.0
 *
 * Materials that are mixtures of others. A weight w counts the second of two, 1 - w the
 * first; texels beyond [0, 1] are cut. Where derivatives are taken, the probability with
 * which the second is drawn stays away from 0 and 1, since there the derivative with
 * respect to w, second minus first, has a part that the value has not.
 *
 * Delta lobes of nested materials are numbered anew, so that none share an index. */
#ifndef IMP_KIND_BSDF_BLENDING_H
#define IMP_KIND_BSDF_BLENDING_H

#include "kind/build.h"
#include "math/vec.h"

#define IMP_MIXING_LEAST 0.02
/* In imp_dirs.derivative. */
#define IMP_INPUT_BIT(j) (UINT64_C(1) << (j))
#define IMP_LOBES_MAX    128 /* records keep them in a signed byte */

/* Least probability of a part that a wanted derivative lives in: that with respect to its
 * weight, or to its roughness. The second moment of the value grows by 1/(1 - 1/6) = 1.2
 * for one such part, and by 1.6 at most, for the three of principledthin. */
#define IMP_WANTED_LEAST (1. / 6)
/* The same before probabilities are divided by their sum, 1 + this. */
#define IMP_WANTED_PART (IMP_WANTED_LEAST / (1 - IMP_WANTED_LEAST))

/* Input 0 is the weight. */
static inline double imp__mixing_weight(double w) { return imp_clamp(w, 0, 1); }
/* `wanted`: least probability of either where the derivative is by the weight itself. */
static inline double imp__mixing_chance(double w, const struct imp_dirs *d, double wanted)
{
    const double least = d->derivative & 1 ? wanted
                         : d->derivative   ? IMP_MIXING_LEAST
                                           : 0;
    return imp_clamp(w, least, 1 - least);
}
/* What is left of u, uniform again, once it is known to lie in [lo, hi). */
static inline double imp__mixing_rest(double u, double lo, double hi)
{
    return imp_clamp((u - lo) / (hi - lo), 0, 0x1.fffffffffffffp-1);
}

/* Probability of the coat's lobe over that of a base, where the coat reflects F: its share,
 * roughly. Where derivatives are taken, dark colours keep a part, and the coat a larger one
 * if they are by one of its own inputs, `wanted`. */
static inline double imp__coated_least(uint64_t derivative)
{
    return derivative ? 0.1 : 0;
}
static inline double imp__coat_least(uint64_t derivative, uint64_t wanted)
{
    return derivative & wanted ? IMP_WANTED_LEAST : IMP_MIXING_LEAST;
}
static inline double imp__coated_chance(imp_spec coat, imp_spec base,
                                        const struct imp_dirs *d, double F,
                                        uint64_t wanted)
{
    const double least = imp__coated_least(d->derivative);
    const double s = F * imp_max(imp__max3(coat), least),
                 r = (1 - F) * imp_max(imp__max3(base), least);
    const double q = s + r > 0 ? s / (s + r) : 1;
    if (!d->derivative) return q;
    return imp_clamp(q, imp__coat_least(d->derivative, wanted), 1 - IMP_MIXING_LEAST);
}

/* Delta lobes of a material. */
static inline int imp__lobes_of(const struct imp_bsdf *b)
{
    return !(b->flags & IMP_BSDF_DELTA) ? 0 : b->n_lobes ? b->n_lobes : 8;
}
static inline enum imp_status imp__lobes_check(const struct imp_build *build,
                                               const struct imp_bsdf *b)
{
    if (b->n_lobes <= IMP_LOBES_MAX) return IMP_OK;
    return imp_build_error(build, NULL, IMP_E_SCENE,
                           "materials are nested too deeply: %d ideal lobes; at most %d",
                           b->n_lobes, IMP_LOBES_MAX);
}

#endif

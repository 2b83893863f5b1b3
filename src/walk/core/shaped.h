/* SPDX-License-Identifier: Apache-2.0
 *
 * Materials and lights whose scalar inputs (a roughness, an index) depend on the
 * wavelength, so that each lane of a walk has a function of its own. Kinds read a scalar
 * from lane 0; here they are evaluated once a lane, with that lane's scalars, and the lane is
 * taken from the answer. Everything else goes to the kind as it is.
 *
 * A delta lobe that bends light by the index leads every lane elsewhere: the lane that
 * drew the direction goes on, those with another index end (value and density 0), and the
 * balance heuristic (lane_mis.h) gives the walk their share. */
#ifndef IMP_WALK_SHAPED_H
#define IMP_WALK_SHAPED_H

#include "color/wavelength.h"
#include "kind/build.h"

/* Lane that draws directions. */
static inline int imp__waves_drew(const struct imp_carried *carried)
{
    return ((const struct imp_waves *)carried)->drew; /* carried is its first member */
}

/* in_lane [n_in]: inputs with the scalars of one lane. */
void imp__shaped_inputs(const struct imp_bsdf *b, const imp_spec *in, int lane,
                        imp_spec *in_lane);
void imp__shaped_eval(const struct imp_bsdf *b, const struct imp_carried *carried,
                      const imp_spec *in, const struct imp_dirs *d, imp_spec *f);
void imp__shaped_eval_d(const struct imp_bsdf *b, const struct imp_carried *carried,
                        const imp_spec *in, const struct imp_dirs *d, imp_spec *df);
/* Densities of the lanes; 0 in lanes that the walk does not have. */
void imp__shaped_pdf(const struct imp_bsdf *b, const struct imp_carried *carried,
                     const imp_spec *in, const struct imp_dirs *d, imp_spec *p);
/* Index ratio for roulette: of the lane that drew, or the mean of the lanes where all go
 * on, so that it does not depend on which drew. */
double imp__shaped_index_ratio(const struct imp_bsdf *b,
                               const struct imp_carried *carried, const imp_spec *in,
                               const struct imp_dirs *d);
void imp__shaped_light(const struct imp_emitter *e, const struct imp_carried *carried,
                       const imp_spec *in, const struct imp_emission *x, imp_spec *le);
void imp__shaped_light_d(const struct imp_emitter *e, const struct imp_carried *carried,
                         const imp_spec *in, const struct imp_emission *x, imp_spec *dle);

/* ---- With or without shapes of their own ------------------------------------------- */

static inline void imp__bsdf_eval(const struct imp_bsdf *b,
                                  const struct imp_carried *carried, const imp_spec *in,
                                  const struct imp_dirs *d, imp_spec *f)
{
    if (imp_likely(!b->shaped)) b->ops->eval(b, in, d, f);
    else imp__shaped_eval(b, carried, in, d, f);
}
static inline void imp__bsdf_eval_d(const struct imp_bsdf *b,
                                    const struct imp_carried *carried, const imp_spec *in,
                                    const struct imp_dirs *d, imp_spec *df)
{
    if (imp_likely(!b->shaped)) b->ops->eval_d(b, in, d, df);
    else imp__shaped_eval_d(b, carried, in, d, df);
}
static inline void imp__light_eval(const struct imp_emitter *e,
                                   const struct imp_carried *carried, const imp_spec *in,
                                   const struct imp_emission *x, imp_spec *le)
{
    if (imp_likely(!e->shaped)) e->ops->eval(e, in, x, le);
    else imp__shaped_light(e, carried, in, x, le);
}

#endif

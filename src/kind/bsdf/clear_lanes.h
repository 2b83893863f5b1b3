/* SPDX-License-Identifier: Apache-2.0
 *
 * Rough boundaries of clear media in lanes (roughdielectric.c, principled_clear.c): the side that wo is
 * on, and the facet that turns wi into wo. */
#ifndef IMP_KIND_BSDF_CLEAR_LANES_H
#define IMP_KIND_BSDF_CLEAR_LANES_H

#include "facet_lanes.h"

/* Seen from behind the boundary is the same with z reversed and the index inverted: below wo is always
 * above. e: index on the far side of wo over that on its own. */
struct imp__clear_side {
    imp_wide3 wo, wi;
    imp_wide e;
    imp_wide_truth back, reflects;
};
/* eta: inside over outside. */
static inline struct imp__clear_side imp__clear_side(imp_wide eta, const imp_wide3 *wo,
                                                     const imp_wide3 *wi)
{
    const imp_wide zero = imp__wide(0);
    struct imp__clear_side s = {.wo = *wo, .wi = *wi, .back = wo->z < zero};
    s.wo.z = imp__wide_choose(s.back, -wo->z, wo->z);
    s.wi.z = imp__wide_choose(s.back, -wi->z, wi->z);
    s.e = imp__wide_choose(s.back, 1 / eta, eta);
    s.reflects = s.wi.z > zero;
    return s;
}

/* m ~ wo + wi, or wo + e wi; n: its length with the sign that turns m upwards; vm: wo.m, which om is but for
 * rounding; im: wi.m. */
struct imp__clear_half {
    imp_wide3 m;
    imp_wide n, vm, om, im;
};
/* Where there is such a facet. */
static inline imp_wide_truth imp__clear_half(const struct imp__clear_side *s,
                                             struct imp__clear_half *f)
{
    const imp_wide zero = imp__wide(0), one = imp__wide(1);
    const imp_wide3 h = imp__wide3_plus(
        s->wo, imp__wide3_times(s->wi, imp__wide_choose(s->reflects, one, s->e)));
    f->n = imp__wide_signed_as(imp__wide3_norm(h), h.z);
    f->m = imp__wide3_times(h, 1 / f->n);
    f->vm = imp__wide3_inner(s->wo, f->m);
    f->om = imp__wide_lesser(f->vm, one);
    f->im = imp__wide3_inner(s->wi, f->m);
    return (s->wo.z > zero) & (s->wi.z != zero) & (imp__wide_magnitude(f->n) > zero) &
           (f->om > zero) & ~((f->im > zero) ^ s->reflects) & (f->im != zero);
}

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Adjoint of a kick in a grid, for both interpolations: weights and addresses of a point
 * serve its value, gradient, Hessian and transpose. The two functions of an interpolation
 * are inlined here. */
#ifndef IMP_BEND_GRID_BACK_H
#define IMP_BEND_GRID_BACK_H

#include "bend_rays.h"

/* Weights and addresses at x into *at, the jet of second order of the coefficients. */
typedef void imp__grid_jet_fn(const struct imp__grid *g, imp_v3 x, bool single, void *at,
                              struct imp__jet *j);
/* bar += a d eta/d theta + b . d g/d theta, with what is in *at. */
typedef void imp__grid_splat_fn(const struct imp__grid *g, const void *at, double a,
                                imp_v3 b, struct imp__bar *bar);

static inline __attribute__((always_inline)) void
imp__grid_back_some(const struct imp__grid *g, bool single, bool arc, double dt, int n,
                    struct imp__back *b, struct imp__bar *bar, imp__grid_jet_fn *jet,
                    imp__grid_splat_fn *splat, void *at)
{
    const bool eta2 = g->desc.param == IMP_FIELD_ETA2;
    for (int o = 0; o < n; o++) {
        const int i = imp__lane_order(n, o);
        struct imp__jet j;
        double value;
        imp_v3 slope;
        jet(g, b->x[i], single, at, &j);
        if (eta2) imp__jet_from_eta2(&j, 2);
        imp__kick_back(arc, dt, &j, b, i, &value, &slope);
        if (!bar) continue;
        if (eta2) imp__eta2_vjp(&j, &value, &slope);
        splat(g, at, value, slope, bar);
    }
}

static inline __attribute__((always_inline)) void
imp__grid_kick_back(const imp_field *f, bool arc, double dt, int n, struct imp__back *b,
                    struct imp__bar *bar, imp__grid_jet_fn *jet,
                    imp__grid_splat_fn *splat, void *at)
{
    const struct imp__grid *g = (const struct imp__grid *)f;
    if (g->single) imp__grid_back_some(g, true, arc, dt, n, b, bar, jet, splat, at);
    else imp__grid_back_some(g, false, arc, dt, n, b, bar, jet, splat, at);
}

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * The last, fractional step of a ray, exactly onto a surface (docs/bent-rays.md 2.3). */
#include "bend_rays.h"

/* Solve G(Phi_tau(from)) = 0 on (0, t]: Newton with dG/dtau, kept inside a bracket. */
double imp__land_on(const struct imp__plan *p, const struct imp__surface *s,
                    const struct imp__state *from, double t, double g0, double g1,
                    struct imp__state *at)
{
    double lo = 0, hi = t, tau = t * g0 / (g0 - g1);
    struct imp__state rate;
    struct imp__surface_at sa;
    if (!(g0 < 0)) { /* begins on the surface: halve the step until it ends inside */
        for (tau = t / 2; tau > 1e-9 * t; tau /= 2) {
            *at = *from;
            imp__step(p->scheme, p->field, tau, 1, &at->x, &at->v, &at->path);
            imp__surface_eval(s, &at->x, &at->v, &sa);
            if (sa.g < 0) break;
            hi = tau;
        }
        if (!(tau > 1e-9 * t)) {
            *at = *from;
            return 0;
        }
        lo = tau;
        tau = (lo + hi) / 2;
    }
    for (int i = 0; i < 100; i++) {
        *at = *from;
        imp__step_rate(p->scheme, p->field, tau, at, &rate);
        imp__surface_eval(s, &at->x, &at->v, &sa);
        const double slope = imp__dot(sa.gx, rate.x) + imp__dot(sa.gv, rate.v);
        const double newton = sa.g / slope;
        if (sa.g == 0) break;
        if (slope > 0 && fabs(newton) <= 1e-15 * t) {
            tau = imp_clamp(tau - newton, 0.0, t);
            break;
        }
        if (sa.g > 0) hi = tau;
        else lo = tau;
        const double next = tau - newton;
        tau = next > lo && next < hi ? next : (lo + hi) / 2;
        if (!(hi - lo > 1e-16 * t)) break;
    }
    *at = *from;
    imp__step(p->scheme, p->field, tau, 1, &at->x, &at->v, &at->path);
    return tau;
}

const struct imp__surface *
imp__land_first(const struct imp__plan *p, const struct imp__domain *d,
                const struct imp__state *from, const imp_v3 *x1, const imp_v3 *v1,
                double *tau, struct imp__state *at, struct imp__surface *facet)
{
    const struct imp__surface *hit = NULL;
    for (int i = 0; i < d->n; i++) {
        const struct imp__surface *s = &d->surface[i];
        struct imp__surface_at a0, a1;
        struct imp__state there;
        if (s->kind == IMP__MESH) {
            if (!imp__facet(s, &from->x, x1, false, 1e-6 * p->size, facet)) continue;
            s = facet;
        }
        imp__surface_eval(s, x1, v1, &a1);
        if (!(a1.g > 0)) continue;
        imp__surface_eval(s, &from->x, &from->v, &a0);
        const bool once = s->kind == IMP__DISC || s->kind == IMP__APPROACH;
        if (a0.g > 0 && (once || a1.g <= a0.g))
            continue; /* began outside, or moves inwards */
        const double t = imp__land_on(p, s, from, p->t, a0.g, a1.g, &there);
        if (!imp__surface_covers(s, &there.x)) continue;
        if (!hit || t < *tau) hit = s, *tau = t, *at = there;
    }
    return hit;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Starts of rays: inside the field with v = eta d, or outside, along a straight line to
 * the surface where they enter. */
#include "bend_rays.h"

/* Intersect the line x + s d with a surface: it enters at *s_in and leaves at *s_out.
 * False: it never gets inside. */
static bool straight(const struct imp__surface *s, imp_v3 x, imp_v3 d, double *s_in,
                     double *s_out)
{
    *s_in = -INFINITY;
    *s_out = INFINITY;
    switch (s->kind) {
    case IMP__PLANE: {
        const double g = imp__dot(s->n, x) - s->offset, slope = imp__dot(s->n, d);
        if (slope < 0) *s_in = -g / slope;
        else if (slope > 0) *s_out = -g / slope;
        else return g <= 0;
        return true;
    }
    case IMP__SPHERE:
    case IMP__CYLINDER: {
        imp_v3 y = x - s->c, e = d;
        if (s->kind == IMP__CYLINDER)
            y -= s->n * imp__dot(y, s->n), e -= s->n * imp__dot(e, s->n);
        const double a = imp__dot(e, e), b = imp__dot(y, e);
        const double c = imp__dot(y, y) - s->radius * s->radius;
        if (a < 1e-30) return c <= 0;
        const double disc = b * b - a * c;
        if (!(disc > 0)) return false;
        const double q = -(b + copysign(sqrt(disc), b)), s1 = q / a, s2 = c / q;
        *s_in = fmin(s1, s2);
        *s_out = fmax(s1, s2);
        return true;
    }
    case IMP__SDF: { /* sphere tracing inside the distance field's box */
        imp_v3 lo = s->sdf->lo, hi = s->sdf->hi;
        double a = 0, b = INFINITY;
        for (int k = 0; k < 3; k++) {
            if (!isfinite(lo[k]) || !isfinite(hi[k])) continue;
            double p = (lo[k] - x[k]) / d[k], q = (hi[k] - x[k]) / d[k];
            if (d[k] == 0) p = x[k] >= lo[k] ? -INFINITY : INFINITY, q = INFINITY;
            a = fmax(a, fmin(p, q));
            b = fmin(b, fmax(p, q));
        }
        double at = a;
        for (int i = 0; i < 1000 && at < b; i++) {
            struct imp__jet j;
            const imp_v3 y = x + d * at;
            imp__field_eval1(s->sdf, &y, 1, &j);
            const double slope = imp__dot(j.g, d);
            if (j.eta < 1e-3 && slope < 0) { /* near: Newton */
                const double ds = -j.eta / slope;
                at += ds;
                if (fabs(ds) < 1e-15 * (1 + fabs(at))) {
                    *s_in = at;
                    return true;
                }
            } else {
                at += fmax(j.eta, 1e-6);
            }
        }
        return false;
    }
    case IMP__DISC:
    case IMP__APPROACH:
    case IMP__MESH: return true;
    }
    return true;
}

static bool starts_inside(const struct imp__plan *p, const struct imp__domain *d,
                          const struct imp__state *a)
{
    if (!imp__inside(&a->x, &p->lo, &p->hi)) return false;
    for (int i = 0; i < d->n; i++) {
        struct imp__surface_at at;
        if (d->surface[i].kind == IMP__DISC || d->surface[i].kind == IMP__APPROACH ||
            d->surface[i].kind == IMP__MESH)
            continue;
        imp__surface_eval(&d->surface[i], &a->x, &a->v, &at);
        if (!(at.g <= 1e-9 * p->size * imp__length(at.gx))) return false;
    }
    return true;
}

/* A ray that starts inside has v = eta d. One that starts outside follows a straight line
 * to the surface that it enters last. There it is refracted if that is the surface's
 * event; otherwise indices match, and v stays. */
void imp__start_ray(const struct imp__plan *p, const struct imp_bend_rays *rays, size_t i,
                    struct imp__start *s)
{
    const struct imp__domain *dom = imp__plan_domain(p, imp__ray_group(rays, i));
    *s = (struct imp__start){.x0 = imp__v3_load(rays->x[i]),
                             .d0 = imp__v3_load(rays->d[i])};
    s->length = imp__length(s->d0);
    s->d0 *= 1 / s->length;
    s->at.x = s->x0;
    if (!(s->length > 0) || !imp__is_finite(s->x0) || !imp__is_finite(s->d0)) {
        s->flags = IMP_BEND_BROKEN;
        s->at.v = s->d0;
        return;
    }
    if (p->options.outside) {
        double in = -INFINITY, out = INFINITY;
        for (int k = 0; k < dom->n; k++) {
            double a, b;
            if (dom->surface[k].kind == IMP__MESH) {
                const imp_v3 end = s->x0 + s->d0 * (1e3 * p->size);
                if (!imp__facet(&dom->surface[k], &s->x0, &end, true, 1e-6 * p->size,
                                &s->facet)) {
                    s->flags = IMP_BEND_MISSED;
                    return;
                }
                a = (s->facet.offset - imp__dot(s->facet.n, s->x0)) /
                    imp__dot(s->facet.n, s->d0);
                if (a > in) in = a, s->entry = &dom->surface[k];
                continue;
            }
            if (!straight(&dom->surface[k], s->x0, s->d0, &a, &b)) {
                s->flags = IMP_BEND_MISSED;
                return;
            }
            if (a > in) in = a, s->entry = &dom->surface[k];
            out = fmin(out, b);
        }
        if (!s->entry || !(in >= 0) || !(in < out)) {
            s->flags = in >= 0 ? IMP_BEND_MISSED : IMP_BEND_STARTED_OUT;
            s->entry = NULL;
            return;
        }
        s->tau = in / p->outside_index;
        s->at.v = p->outside_index * s->d0;
        s->at.x = s->x0 + s->tau * s->at.v;
        s->at.path = p->outside_index * p->outside_index * s->tau;
        imp__field_eval1(p->field, &s->at.x, 1, &s->jet);
        if (s->entry->event == IMP_BEND_REFRACT) {
            struct imp__surface_at at;
            struct imp__bend_turn turn;
            imp__surface_eval(imp__start_entry(s), &s->at.x, &s->at.v, &at);
            const imp_v3 n = imp__normalize(at.gx);
            if (fabs(imp__dot(n, s->d0)) < p->grazing) s->flags = IMP_BEND_GRAZING;
            imp__bend_turn(&n, &s->at.v, s->jet.eta, false, &turn);
            if (turn.reflected) s->flags = IMP_BEND_MISSED;
            s->at.v = turn.v;
        }
    } else {
        imp__field_eval1(p->field, &s->at.x, 1, &s->jet);
        s->at.v = s->jet.eta * s->d0;
    }
    if (!(s->jet.eta > 0) || !isfinite(s->jet.eta) || !imp__is_finite(s->jet.g))
        s->flags = IMP_BEND_BROKEN;
    else if (!s->flags && !starts_inside(p, dom, &s->at)) s->flags = IMP_BEND_STARTED_OUT;
}

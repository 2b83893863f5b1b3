/* SPDX-License-Identifier: Apache-2.0
 *
 * Surfaces where rays end or turn: G(x, v), negative inside, with its derivatives, and
 * the momentum's map there (docs/bent-rays.md 2.6, 3.5). */
#include "bend_rays.h"
#include "scene/scene.h"

/* x - c across the axis */
static inline imp_v3 across(const struct imp__surface *s, imp_v3 x)
{
    imp_v3 y = x - s->c;
    return y - s->n * imp__dot(y, s->n);
}

void imp__surface_eval(const struct imp__surface *s, const imp_v3 *x, const imp_v3 *v,
                       struct imp__surface_at *at)
{
    at->gv = (imp_v3){0};
    switch (s->kind) {
    case IMP__PLANE:
    case IMP__DISC:
    case IMP__MESH: /* the plane of the triangle that was hit */
        at->g = imp__dot(s->n, *x) - s->offset;
        at->gx = s->n;
        break;
    case IMP__SPHERE: {
        const imp_v3 y = *x - s->c;
        at->g = (imp__dot(y, y) - s->radius * s->radius) / 2;
        at->gx = y;
        break;
    }
    case IMP__CYLINDER: {
        const imp_v3 y = across(s, *x);
        at->g = (imp__dot(y, y) - s->radius * s->radius) / 2;
        at->gx = y;
        break;
    }
    case IMP__SDF: {
        struct imp__jet j;
        imp__field_eval1(s->sdf, x, 1, &j);
        at->g = j.eta;
        at->gx = j.g;
        break;
    }
    case IMP__APPROACH: {
        const imp_v3 y = *x - s->c;
        at->g = imp__dot(y, *v);
        at->gx = *v;
        at->gv = y;
        break;
    }
    }
}

void imp__surface_hess(const struct imp__surface *s, const imp_v3 *x, const imp_v3 *m,
                       imp_v3 *out)
{
    switch (s->kind) {
    case IMP__PLANE:
    case IMP__DISC:
    case IMP__MESH:
    case IMP__APPROACH: *out = (imp_v3){0}; break;
    case IMP__SPHERE: *out = *m; break;
    case IMP__CYLINDER: *out = *m - s->n * imp__dot(*m, s->n); break;
    case IMP__SDF: {
        struct imp__jet j;
        imp__field_eval1(s->sdf, x, 2, &j);
        *out = imp__jet_times(&j, *m);
        break;
    }
    }
}

bool imp__surface_covers(const struct imp__surface *s, const imp_v3 *x)
{
    if (s->kind != IMP__DISC) return true;
    const imp_v3 y = across(s, *x);
    return imp__dot(y, y) <= s->radius * s->radius;
}

/* Refraction of the momentum v at a normal n, into the index e2:
 *     a = n.v,  q^2 = e2^2 - |v|^2 + a^2,  v' = v + (sign(a) q - a) n
 * Mirrors reflect, and so does any surface if q^2 <= 0: v' = v - 2 a n. */
void imp__bend_turn(const imp_v3 *n, const imp_v3 *v, double e2, bool mirror,
                    struct imp__bend_turn *t)
{
    t->a = imp__dot(*n, *v);
    const double q2 = e2 * e2 - imp__dot(*v, *v) + t->a * t->a;
    t->reflected = mirror || !(q2 > 0);
    if (t->reflected) {
        t->q = t->sign = 0;
        t->c = -2 * t->a;
    } else {
        t->q = sqrt(q2);
        t->sign = t->a < 0 ? -1 : 1;
        t->c = t->sign * t->q - t->a;
    }
    t->v = *v + t->c * *n;
}

void imp__bend_turn_vjp(const struct imp__bend_turn *t, const imp_v3 *n, const imp_v3 *v,
                        double e2, const imp_v3 *bar, imp_v3 *v_bar, imp_v3 *n_bar,
                        double *e2_bar)
{
    const imp_v3 m = *bar;
    const double cb = imp__dot(m, *n);
    if (t->reflected) {
        *v_bar = m - (2 * cb) * *n;
        *n_bar = -2 * (t->a * m + cb * *v);
        *e2_bar = 0;
        return;
    }
    const double ab = cb * (t->sign * t->a / t->q - 1);
    *v_bar = m + ab * *n - (cb * t->sign / t->q) * *v;
    *n_bar = t->c * m + ab * *v;
    *e2_bar = cb * t->sign * e2 / t->q;
}

void imp__bend_turn_jvp(const struct imp__bend_turn *t, const imp_v3 *n, const imp_v3 *v,
                        double e2, const imp_v3 *v_dot, const imp_v3 *n_dot,
                        double e2_dot, imp_v3 *dot)
{
    const double a_dot = imp__dot(*n, *v_dot) + imp__dot(*n_dot, *v);
    double c_dot = -2 * a_dot;
    if (!t->reflected)
        c_dot =
            t->sign * (e2 * e2_dot - imp__dot(*v, *v_dot) + t->a * a_dot) / t->q - a_dot;
    *dot = *v_dot + c_dot * *n + t->c * *n_dot;
}

bool imp__facet(const struct imp__surface *s, const imp_v3 *a, const imp_v3 *b,
                bool inwards, double nearest, struct imp__surface *facet)
{
    const imp_v3 way = *b - *a;
    const double length = imp__length(way);
    const imp_v3 d = way * (1 / length);
    double from = nearest;
    struct imp_hit hit;
    for (int tries = 0; tries < 16; tries++) {
        if (!(length > from) || !imp__intersect(s->scene, a, &d, from, length, &hit))
            return false;
        const struct imp_shape *shape = s->scene->shapes[hit.shape];
        struct imp_surface at;
        shape->ops->surface(shape, &hit, a, &d, &at);
        const double out = imp__dot(at.ng, d);
        if (inwards ? out < 0 : out > 0) {
            *facet = *s;
            facet->n = at.ng;
            facet->offset = imp__dot(at.ng, at.p);
            return true;
        }
        from = hit.t * (1 + 1e-6) + nearest; /* crossed the other way */
    }
    return false;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Lines through one shape: an analytic one by its own `intersect`, triangles one by one in double
 * (Möller and Trumbore 1997), curves by the scene's tree, past what else it holds. */
#include "selftest_lines.h"
#include "math/warp.h"

bool imp__probe_set(struct imp__probe *p, const struct imp_scene *scene,
                    const struct imp_shape *s, bool stands)
{
    const imp_v3 half = (s->hi - s->lo) * 0.5, centre = (s->hi + s->lo) * 0.5;
    const double most = imp__max3(half);
    if (!imp__is_finite(s->lo) || !imp__is_finite(s->hi) || !(most > 0)) return false;
    *p = (struct imp__probe){scene, s, stands, centre, {0}, 0, 0};
    for (int i = 0; i < 3; i++) {
        if (half[i] < 0) return false;
        p->half[i] = 1.25 * half[i] + 0.1 * most;
        p->centre[i] = centre[i];
    }
    p->centre[3] = 0;
    p->reach = imp__length(p->half);
    p->scale = p->reach + imp__length(p->centre);
    return s->geometry != IMP_CURVES || stands;
}

struct imp__chord imp__probe_line(const struct imp__probe *p, struct imp_key key)
{
    struct imp__chord l = {.length = 4 * p->reach};
    double face[3];
    l.d = imp__uniform_sphere((double[2]){imp__u01(key, 0), imp__u01(key, 1)});
    for (int i = 0; i < 3; i++) {
        face[i] = fabs(l.d[i]) * 4 * p->half[(i + 1) % 3] * p->half[(i + 2) % 3];
        l.shadow += face[i];
    }
    /* A place on one of the three faces that the line enters by. */
    double x = imp__u01(key, 2) * l.shadow;
    int i = 0;
    while (i < 2 && x >= face[i]) x -= face[i++];
    imp_v3 q = p->centre;
    q[i] += l.d[i] > 0 ? -p->half[i] : p->half[i];
    for (int k = 1; k < 3; k++)
        q[(i + k) % 3] += (2 * imp__u01(key, 2 + (uint32_t)k) - 1) * p->half[(i + k) % 3];
    l.o = q - l.d * p->reach;
    return l;
}

/* ---- Crossings --------------------------------------------------------------------- */

static imp_v3 vertex(const struct imp_triangles *t, uint32_t i)
{
    const float *p = t->positions + 3 * (size_t)i;
    return imp__v3(p[0], p[1], p[2]);
}

/* Adds a hit in the order of t; one too many falls off at the end. */
static int hit_add(struct imp_hit *hit, int n, const struct imp_hit *one)
{
    int at = n < IMP_CROSSINGS_MAX ? n : IMP_CROSSINGS_MAX - 1;
    if (n == IMP_CROSSINGS_MAX && !(one->t < hit[at].t)) return n;
    for (; at > 0 && hit[at - 1].t > one->t; at--) hit[at] = hit[at - 1];
    hit[at] = *one;
    return imp_min(n + 1, IMP_CROSSINGS_MAX);
}

static int triangles_cross(const struct imp__probe *p, const struct imp__chord *l,
                           struct imp_hit *hit)
{
    const struct imp_triangles *t = &p->s->triangles;
    int n = 0;
    for (size_t k = 0; k < t->n_triangles; k++) {
        const uint32_t *i = t->indices + 3 * k;
        const imp_v3 p0 = vertex(t, i[0]), e1 = vertex(t, i[1]) - p0,
                     e2 = vertex(t, i[2]) - p0, h = imp__cross(l->d, e2);
        const double det = imp__dot(e1, h);
        if (det == 0) continue;
        const imp_v3 s = l->o - p0, q = imp__cross(s, e1);
        const double u = imp__dot(s, h) / det, v = imp__dot(l->d, q) / det,
                     at = imp__dot(e2, q) / det;
        if (!(u >= 0 && v >= 0 && u + v <= 1 && at > 0 && at < l->length)) continue;
        const struct imp_hit one = {
            .shape = p->s->index, .prim = (int)k, .t = at, .u = u, .v = v};
        n = hit_add(hit, n, &one);
    }
    return n;
}

static int analytic_cross(const struct imp__probe *p, const struct imp__chord *l,
                          struct imp_hit *hit)
{
    int n = 0;
    double from = 0;
    while (n < IMP_CROSSINGS_MAX) {
        struct imp_hit one = {.shape = p->s->index};
        if (!p->s->ops->intersect(p->s, &l->o, &l->d, from, l->length, &one)) break;
        hit[n++] = one;
        if (!(one.t > from)) break; /* the row `hits` says so */
        from = one.t + 1e-9 * p->scale;
    }
    return n;
}

static int curves_cross(const struct imp__probe *p, const struct imp__chord *l,
                        struct imp_hit *hit)
{
    int n = 0;
    double from = 0;
    struct imp_hit one;
    while (n < IMP_CROSSINGS_MAX &&
           imp__intersect(p->scene, &l->o, &l->d, from, l->length, &one)) {
        if (one.shape == p->s->index && one.place == 0) hit[n++] = one;
        from = one.t + 1e-6 * p->scale;
    }
    return n;
}

int imp__probe_crossings(const struct imp__probe *p, const struct imp__chord *line,
                         struct imp_hit *hit)
{
    switch (p->s->geometry) {
    case IMP_TRIANGLES: return triangles_cross(p, line, hit);
    case IMP_ANALYTIC: return analytic_cross(p, line, hit);
    case IMP_CURVES: return curves_cross(p, line, hit);
    }
    return 0;
}

bool imp__probe_hit(const struct imp__probe *p, const struct imp__chord *line, double t,
                    double slack, struct imp_hit *hit, int *rank)
{
    struct imp_hit all[IMP_CROSSINGS_MAX];
    const int n = imp__probe_crossings(p, line, all);
    int best = -1;
    for (int k = 0; k < n; k++)
        if (fabs(all[k].t - t) <= slack &&
            (best < 0 || fabs(all[k].t - t) < fabs(all[best].t - t)))
            best = k;
    if (best < 0) return false;
    *hit = all[best];
    *rank = best;
    return true;
}

double imp__probe_most(const struct imp__probe *p)
{
    const size_t n = p->s->geometry == IMP_TRIANGLES ? p->s->triangles.n_triangles : 1;
    return fmax(1e8 / (double)n, 200);
}

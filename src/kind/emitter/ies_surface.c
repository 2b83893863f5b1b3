/* SPDX-License-Identifier: Apache-2.0
 *
 * The surface of a luminaire that glows by a table: how much of it is seen from a direction, the
 * radiance that follows, and the shapes that can. */
#include "ies.h"
#include "kind/build.h"
#include "kind/shape/shape.h"
#include "math/trig.h"

#define FACETS_MAX   64
#define DEGREE       (IMP_PI / 180)
#define EDGE_ON      1e-9 /* of the area: nothing is shown */
#define SAME_NORMALS (1 - 1e-10)

double imp__ies_projected(const struct imp__ies *x, imp_v3 w)
{
    double sum = x->same;
    if (x->across > 0) {
        const double c = imp__dot(w, x->axis);
        sum += x->across * sqrt(imp_max(1 - c * c, 0.0));
    }
    for (int k = 0; k < x->n_facets; k++)
        sum += x->facets[k].area * imp_max(imp__dot(w, x->facets[k].n), 0.0);
    return sum;
}

double imp__ies_opening(const struct imp__ies *x, imp_v3 w)
{
    const double *s = x->data->size;
    return s[0] * s[1] * fabs(imp__dot(w, x->nadir)) +
           s[2] * (s[0] * fabs(imp__dot(w, x->c90)) + s[1] * fabs(imp__dot(w, x->c0)));
}

static double surface_area(const struct imp__ies *x)
{
    double sum = x->same + x->across;
    for (int k = 0; k < x->n_facets; k++) sum += x->facets[k].area;
    return sum;
}

double imp__ies_radiance(const struct imp__ies *x, imp_v3 w)
{
    const double shown = imp__ies_projected(x, w);
    return shown > EDGE_ON * surface_area(x) ? imp__ies_intensity(x, w) / shown : 0;
}

double imp__ies_bound(const struct imp__ies *x, imp_v3 d, double angle)
{
    const struct imp_ies_data *t = x->data;
    const int n = t->n_vertical;
    const double v = acos(imp_clamp(imp__dot(d, x->nadir), -1.0, 1.0));
    const double from = (v - angle) / DEGREE, to = (v + angle) / DEGREE;
    double most = 0, shown = x->same + x->across;
    const bool any = t->type != IMP_PHOTOMETRY_C; /* its angles are not from nadir */
    if (!any && (to < t->vertical[0] || from > t->vertical[n - 1])) return 0;
    for (int k = 0; k < n; k++) { /* all angles of the table that touch the range */
        if (!any && k + 1 < n && t->vertical[k + 1] < from) continue;
        if (!any && k > 0 && t->vertical[k - 1] > to) break;
        for (int j = 0; j < t->n_horizontal; j++)
            most = imp_max(t->candela[(size_t)j * (size_t)n + (size_t)k], most);
    }
    for (int k = 0; k < x->n_facets; k++) {
        const double tilt = acos(imp_clamp(imp__dot(d, x->facets[k].n), -1.0, 1.0));
        shown += x->facets[k].area * imp_max(cos(imp_max(tilt - angle, 0.0)), 0.0);
    }
    return shown > 0 ? x->factor * most / shown : 0;
}

double imp__ies_mean(const struct imp__ies *x, imp_v3 n)
{
    enum { UP = 32, AROUND = 64 };
    const struct imp_frame f = imp__frame_from_normal(n);
    double sum = 0;
    for (int i = 0; i < UP; i++)
        for (int j = 0; j < AROUND; j++) {
            const double z = (i + 0.5) / UP, r = sqrt(1 - z * z);
            const double phi = (j + 0.5) * IMP_2PI / AROUND;
            sum += imp__ies_radiance(
                x, imp__to_world(&f, imp__v3(r * cos(phi), r * sin(phi), z)));
        }
    return sum / (UP * AROUND);
}

/* ---- Shapes ---------------------------------------------------------------------- */

/* A ray through the middle of an analytic shape, which is flat. */
static bool probe(const struct imp_shape *s, struct imp_surface *at)
{
    const imp_v3 centre = (s->lo + s->hi) * 0.5;
    const double reach = imp__length(s->hi - s->lo);
    for (int k = 0; k < 3; k++) {
        imp_v3 d = imp__v3(0, 0, 0);
        struct imp_hit hit = {.shape = s->index};
        d[k] = -1;
        const imp_v3 o = centre - d * reach;
        if (!s->ops->intersect(s, &o, &d, 0, INFINITY, &hit)) continue;
        s->ops->surface(s, &hit, &o, &d, at);
        return true;
    }
    return false;
}

static imp_v3 corner(const struct imp_triangles *t, size_t triangle, int k)
{
    const float *p = t->positions + 3 * (size_t)t->indices[3 * triangle + (size_t)k];
    return imp__v3((double)p[0], (double)p[1], (double)p[2]);
}

/* The directions that triangles face, and how much area has each. */
static enum imp_status facets_find(const struct imp_build *b, const struct imp_shape *s,
                                   struct imp__ies *x, struct imp_surface *first)
{
    const struct imp_triangles *t = &s->triangles;
    struct imp__ies_facet *f = imp_build_alloc(b, FACETS_MAX, sizeof *f);
    if (!f) return imp__error(b->ctx, IMP_E_NOMEM, "scene: out of memory");
    double sum = 0;
    for (size_t i = 0; i < t->n_triangles; i++) {
        const imp_v3 p = corner(t, i, 0), o = p, d = imp__v3(0, 0, 0);
        const double area =
            0.5 * imp__length(imp__cross(corner(t, i, 1) - p, corner(t, i, 2) - p));
        const struct imp_hit hit = {
            .shape = s->index, .prim = (int)i, .u = 1.0 / 3, .v = 1.0 / 3};
        struct imp_surface at;
        if (!(area > 0)) continue;
        s->ops->surface(s, &hit, &o, &d, &at);
        if (x->n_facets == 0) *first = at;
        int k = 0;
        while (k < x->n_facets && !(imp__dot(f[k].n, at.ng) > SAME_NORMALS)) k++;
        if (k == FACETS_MAX)
            return imp_build_error(b, NULL, IMP_E_UNSUPPORTED,
                                   "its shape '%s' faces more than %d directions: use a "
                                   "box, a sphere or a flat one for the luminaire",
                                   s->name ? s->name : "", FACETS_MAX);
        if (k == x->n_facets) f[x->n_facets++] = (struct imp__ies_facet){at.ng, 0};
        f[k].area += area;
        sum += area;
    }
    for (int k = 0; k < x->n_facets; k++) f[k].area *= s->area / sum; /* floats' area */
    x->facets = f;
    return IMP_OK;
}

enum imp_status imp__ies_surface_read(const struct imp_build *b,
                                      const struct imp_shape *s, struct imp__ies *x,
                                      struct imp_surface *at)
{
    enum imp_status st = IMP_OK;
    struct imp_round round;
    if (s->geometry == IMP_TRIANGLES) {
        IMP_TRY(facets_find(b, s, x, at));
    } else if (imp__shape_round(s, &round)) {
        const double length = imp__length(round.axis);
        if (length == 0) x->same = IMP_PI * round.radius * round.radius;
        else {
            x->across = s->area / IMP_PI; /* 2 pi r h, of which 2 r h is seen */
            x->axis = round.axis * (1 / length);
        }
    } else if (s->ops->round) {
        IMP_TRY(imp_build_error(b, NULL, IMP_E_UNSUPPORTED,
                                "its shape '%s' is an oval cylinder: by a table only a "
                                "circular one glows",
                                s->name ? s->name : ""));
    } else {
        struct imp__ies_facet *f = imp_build_alloc(b, 1, sizeof *f);
        if (!f) IMP_TRY(imp__error(b->ctx, IMP_E_NOMEM, "scene: out of memory"));
        if (!probe(s, at))
            IMP_TRY(imp_build_error(b, NULL, IMP_E_UNSUPPORTED,
                                    "its shape '%s' (%s) cannot glow by a table",
                                    s->name ? s->name : "", s->ops->name));
        *f = (struct imp__ies_facet){at->ng, s->area};
        x->n_facets = 1;
        x->facets = f;
    }
out:
    return st;
}

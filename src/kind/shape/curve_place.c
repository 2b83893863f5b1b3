/* SPDX-License-Identifier: Apache-2.0
 *
 * With q from the line to the point p = o + t d, both tubes have |q| = r(v). Where the
 * circles are swept across the line, q c' = 0; for an envelope of balls, q c' + r r' = 0.
 * Embree's t and v are near the root of both equations, which Newton's rule finds. */
#include "curve.h"

static imp_v3 load(const struct imp_curves *k, size_t i)
{
    const float *p = k->points + 4 * i;
    return imp__v3(p[0], p[1], p[2]);
}

void imp__curve_weights(int degree, double v, double b[4][4])
{
    const double w = 1 - v;
    const double line[4][4] = {{w, v}, {-1, 1}};
    const double spline[4][4] = {
        /* uniform, cubic */
        {w * w * w / 6, (v * v * (3 * v - 6) + 4) / 6, (3 * v * (1 + v * w) + 1) / 6,
         v * v * v / 6},
        {-w * w / 2, v * (3 * v - 4) / 2, (1 + v * (2 - 3 * v)) / 2, v * v / 2},
        {w, 3 * v - 2, 1 - 3 * v, v},
        {-1, 3, -3, 1}};
    for (int j = 0; j < 4; j++)
        for (int m = 0; m < 4; m++) b[j][m] = degree == 1 ? line[j][m] : spline[j][m];
}

void imp__curve_at(const struct imp_curves *k, int segment, double v,
                   struct imp__curve_at *out)
{
    const size_t i = k->first[segment];
    const int n = k->degree + 1;
    double b[4][4];
    imp__curve_weights(k->degree, v, b);
    *out = (struct imp__curve_at){.r = 0};
    for (int m = 0; m < n; m++) {
        const imp_v3 p = load(k, i + (size_t)m);
        const double r = k->points[4 * (i + (size_t)m) + 3];
        out->c += p * b[0][m];
        out->d1 += p * b[1][m];
        out->d2 += p * b[2][m];
        out->r += r * b[0][m];
        out->r1 += r * b[1][m];
    }
}

/* The ball at an end of a cone, on the side of the ray's beginning. */
static imp_v3 ball_meet(const struct imp__curve_at *at, imp_v3 o, imp_v3 d)
{
    const imp_v3 from = o - at->c;
    const double a = imp__dot(d, d), b = imp__dot(from, d) / a;
    const imp_v3 nearest = from - d * b; /* of the line to the centre */
    const double e = at->r * at->r - imp__dot(nearest, nearest);
    return nearest - d * sqrt(imp_max(e, 0.0) / a);
}

imp_v3 imp__curve_meet(const struct imp_curves *k, int segment, double t, double *v,
                       imp_v3 o, imp_v3 d, struct imp__curve_at *out)
{
    const bool cone = k->degree == 1;
    const double v0 = *v > 0 ? imp_min(*v, 1.0) : 0; /* Embree may give no number */
    double x = v0, y = t;
    bool fine = true;
    imp_v3 q;
    for (int i = 0; i < 4 && fine; i++) {
        imp__curve_at(k, segment, x, out);
        q = o + d * y - out->c;
        const double f = imp__dot(q, q) - out->r * out->r,
                     g = imp__dot(q, out->d1) + (cone ? out->r * out->r1 : 0);
        const double ft = 2 * imp__dot(q, d),
                     fv = -2 * (imp__dot(q, out->d1) + out->r * out->r1),
                     gt = imp__dot(d, out->d1),
                     gv = imp__dot(q, out->d2) - imp__dot(out->d1, out->d1) +
                          (cone ? out->r1 * out->r1 : 0);
        const double det = ft * gv - fv * gt;
        const double dt = (f * gv - fv * g) / det, dv = (ft * g - gt * f) / det;
        y -= dt;
        x -= dv;
        fine = fabs(x - v0) < 0.05; /* and a number */
    }
    if (fine) { /* its front, and not where the ray leaves the tube */
        imp__curve_at(k, segment, x, out);
        q = imp__normalize(o + d * y - out->c);
        fine = imp__dot(imp__curve_normal(k, out, q), d) < 0;
    }
    const bool at_end = v0 < 1e-3 || v0 > 1 - 1e-3;
    if (cone && (fine ? x <= 0 || x >= 1 : at_end)) {
        *v = (fine ? x : v0) < 0.5 ? 0 : 1;
        imp__curve_at(k, segment, *v, out);
        q = ball_meet(out, o, d);
        goto unit;
    }
    if (!fine) x = v0, y = t; /* edge-on: the point of the circle that is next */
    *v = imp_clamp(x, 0.0, 1.0);
    imp__curve_at(k, segment, *v, out);
    q = o + d * y - out->c;
    if (!cone) q -= out->d1 * (imp__dot(q, out->d1) / imp__dot(out->d1, out->d1));
unit:
    q = imp__normalize(q);
    if (imp__is_finite(q)) return q;
    return imp__frame_from_normal(imp__curve_axis(out)).s; /* the radius is 0 there */
}

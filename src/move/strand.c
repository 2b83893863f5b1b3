/* SPDX-License-Identifier: Apache-2.0
 *
 * Surfaces of bsplinecurves, and how they move by their points of control (strand.h). */
#include "strand.h"
#include "kind/shape/curve.h"
#include "math/warp.h"

extern const struct imp_shape_ops imp__bsplinecurve;

bool imp__is_strand(const struct imp_scene *scene, int shape, int64_t place)
{
    double factor;
    return scene->shapes[shape]->ops == &imp__bsplinecurve &&
           imp__place_alike(scene, place, &factor);
}

/* ---- Lines -------------------------------------------------------------------------- */

void imp__strand_at(const struct imp_scene *scene, int shape, int64_t place, int segment,
                    double v, struct imp__strand *out)
{
    const struct imp_curves *k = &scene->shapes[shape]->curves;
    const size_t first = k->first[segment], n = (size_t)k->degree + 1;
    double b[4][4], factor = 1;
    imp_v3 sum[4] = {{0}, {0}, {0}, {0}};
    *out = (struct imp__strand){.v = v};
    imp__curve_weights(k->degree, v, b);
    for (size_t m = 0; m < n; m++) {
        const float *q = k->points + 4 * (first + m);
        for (int i = 0; i < 4; i++) sum[i] += imp__v3(q[0], q[1], q[2]) * b[i][m];
        out->r += q[3] * b[0][m];
        out->r1 += q[3] * b[1][m];
        out->r2 += q[3] * b[2][m];
    }
    if (place > 0) {
        struct imp_map map[2];
        imp__place_map(scene, place, 0, &map[0], &map[1]);
        imp__place_alike(scene, place, &factor);
        sum[0] = imp__map_point(&map[0], sum[0]);
        for (int i = 1; i < 4; i++) sum[i] = imp__map_vector(&map[0], sum[i]);
    }
    out->c = sum[0];
    out->d1 = sum[1];
    out->d2 = sum[2];
    out->d3 = sum[3];
    out->r *= factor;
    out->r1 *= factor;
    out->r2 *= factor;
}

void imp__strand_end(const struct imp_scene *scene, int shape, int64_t place, int segment,
                     bool end, struct imp__strand *out)
{
    const double next = 1e-3;
    imp__strand_at(scene, shape, place, segment, end, out);
    if (!(imp__dot(out->d1, out->d1) > 0))
        imp__strand_at(scene, shape, place, segment, end ? 1 - next : next, out);
}

double imp__strand_foot(const struct imp_scene *scene, int shape, int64_t place,
                        int segment, imp_v3 p)
{
    enum { COARSE = 8, STEPS = 8 };
    struct imp__strand x;
    double best = 0, least = INFINITY;
    for (int i = 0; i <= COARSE; i++) {
        imp__strand_at(scene, shape, place, segment, (double)i / COARSE, &x);
        const double d = imp__dot(p - x.c, p - x.c);
        if (d < least) best = (double)i / COARSE;
        least = imp_min(least, d);
    }
    for (int i = 0; i < STEPS; i++) {
        imp__strand_at(scene, shape, place, segment, best, &x);
        const double g = imp__dot(p - x.c, x.d1),
                     slope = imp__dot(p - x.c, x.d2) - imp__dot(x.d1, x.d1);
        if (!(slope < 0)) break;
        best = imp_clamp(best - g / slope, 0.0, 1.0);
    }
    return best;
}

/* Where points coincide at an end, next to it. */
struct imp__strand_axes imp__strand_axes(const struct imp__strand *x)
{
    const double length = imp__length(x->d1), to = x->v > 0.5 ? -1 : 1;
    const imp_v3 d = length > 0 ? x->d1 : imp__dot(x->d2, x->d2) > 0 ? x->d2 * to : x->d3;
    const imp_v3 a = imp__dot(d, d) > 0 ? imp__normalize(d) : imp__v3(1, 0, 0);
    const struct imp_frame f = imp__frame_from_normal(a);
    return (struct imp__strand_axes){a, f.s, f.t, length};
}

/* ---- Points ------------------------------------------------------------------------- */

static imp_v3 unit_part(imp_v3 n, imp_v3 N_dot, double length)
{
    return (N_dot - n * imp__dot(n, N_dot)) * (1 / length);
}

bool imp__strand_point(const struct imp__strand *x, const struct imp__strand_axes *axes,
                       imp_v3 e, struct imp__strand_point *out)
{
    const double L = axes->length, bent = imp__dot(e, x->d2), A = L * L - x->r * bent;
    const imp_v3 around = imp__cross(axes->a, e), N = e * A - x->d1 * x->r1,
                 e_v = axes->a * (-bent / L);
    const double length = imp__length(N);
    if (!(L > 0) || !(length > 0)) return false;
    const double A_v = 2 * imp__dot(x->d1, x->d2) - x->r1 * bent -
                       x->r * (imp__dot(e_v, x->d2) + imp__dot(e, x->d3)),
                 A_t = -x->r * imp__dot(around, x->d2);
    out->p = x->c + e * x->r;
    out->n = N * (1 / length);
    out->along = axes->a * (A / L) + e * x->r1;
    out->around = around;
    out->n_v =
        unit_part(out->n, e_v * A + e * A_v - x->d2 * x->r1 - x->d1 * x->r2, length);
    out->n_t = unit_part(out->n, around * A + e * A_t, length);
    out->area = x->r * length / L;
    return true;
}

double imp__strand_bends(const struct imp__strand_point *x, const struct imp__strand *at,
                         imp_v3 w)
{
    const double v = imp__dot(w, x->along) / imp__dot(x->along, x->along),
                 t = at->r > 0 ? imp__dot(w, x->around) / at->r : 0;
    return imp__dot(w, x->n_v) * v + imp__dot(w, x->n_t) * t;
}

/* ---- Outlines ----------------------------------------------------------------------- */

/* N.(X - from) = (l - r e.k)(e.D + r) - b along one turn, e = s cos t + t sin t; parallel: r is left out of
 * the second factor. */
struct outline {
    double l, r, k[2], D[2], plus, b;
    double most; /* bound of the second derivative */
};
static double outline_at(const struct outline *f, double t, double *slope)
{
    const double c = cos(t), s = sin(t);
    const double A = f->l - f->r * (f->k[0] * c + f->k[1] * s),
                 E = f->D[0] * c + f->D[1] * s + f->plus;
    *slope = -f->r * (f->k[1] * c - f->k[0] * s) * E + A * (f->D[1] * c - f->D[0] * s);
    return A * E - f->b;
}

static double root_find(const struct outline *f, double lo, double hi, double at_lo)
{
    enum { STEPS = 60 };
    double t = 0.5 * (lo + hi), slope;
    for (int i = 0; i < STEPS && hi - lo > 1e-15; i++) {
        const double value = outline_at(f, t, &slope);
        if (value == 0) return t;
        if ((value < 0) == (at_lo < 0)) lo = t;
        else hi = t;
        const double next = t - value / slope;
        if (fabs(next - t) < 1e-15) return t;
        t = next > lo && next < hi ? next : 0.5 * (lo + hi);
    }
    return t;
}

#define DEEPEST  12
#define STRAIGHT 1e-12 /* a look along a straight line: no turn is before another */

/* Roots between lo and hi; those that no bound tells apart, 1e-4 and nearer, are one or none. */
static void roots_find(const struct outline *f, double lo, double hi, double at_lo,
                       double at_hi, int depth, double *turn, int *n)
{
    const double h = hi - lo, middle = 0.5 * (lo + hi);
    const bool crosses = (at_lo < 0) != (at_hi < 0);
    double slope;
    if (!crosses && imp_min(fabs(at_lo), fabs(at_hi)) > f->most * h * h / 8) return;
    const double value = outline_at(f, middle, &slope);
    if (crosses && (depth == DEEPEST || fabs(slope) > f->most * h / 2)) {
        if (*n < IMP_STRAND_OUTLINES) turn[(*n)++] = root_find(f, lo, hi, at_lo);
        return;
    }
    if (depth == DEEPEST) return;
    roots_find(f, lo, middle, at_lo, value, depth + 1, turn, n);
    roots_find(f, middle, hi, value, at_hi, depth + 1, turn, n);
}

int imp__strand_outline(const struct imp__strand *x, const struct imp__strand_axes *axes,
                        imp_v3 from, bool parallel, double turn[IMP_STRAND_OUTLINES])
{
    enum { CELLS = 6 };
    const imp_v3 D = parallel ? from : x->c - from;
    const double L = axes->length;
    struct outline f = {.l = L * L,
                        .r = x->r,
                        .k = {imp__dot(axes->s, x->d2), imp__dot(axes->t, x->d2)},
                        .D = {imp__dot(axes->s, D), imp__dot(axes->t, D)},
                        .plus = parallel ? 0 : x->r,
                        .b = L * x->r1 * imp__dot(axes->a, D)};
    const double bent = f.r * hypot(f.k[0], f.k[1]), away = hypot(f.D[0], f.D[1]);
    f.most = f.l * away + f.plus * bent + 2 * bent * away;
    if (!(f.most > STRAIGHT * f.l * imp__length(D))) return 0;
    double slope, value[CELLS + 1];
    int n = 0;
    for (int i = 0; i < CELLS; i++)
        value[i] = outline_at(&f, IMP_2PI * i / CELLS, &slope);
    value[CELLS] = value[0];
    for (int i = 0; i < CELLS; i++)
        roots_find(&f, IMP_2PI * i / CELLS, IMP_2PI * (i + 1) / CELLS, value[i],
                   value[i + 1], 0, turn, &n);
    return n;
}

/* ---- Shapes ------------------------------------------------------------------------- */

int imp__strand_ends(const struct imp_curves *k, int segment)
{
    const uint8_t joined = k->joined[segment];
    return (joined & 1 ? 0 : 1) | (joined & 2 ? 0 : 2);
}

int imp__strand_folds(const struct imp_scene *scene, int shape, int64_t place)
{
    enum { PLACES = 16 };
    const struct imp_curves *k = &scene->shapes[shape]->curves;
    for (size_t i = 0; i < k->n_segments; i++)
        for (int m = 0; m <= PLACES; m++) {
            struct imp__strand x;
            const int ends = imp__strand_ends(k, (int)i);
            if ((m == 0 && ends & 1) || (m == PLACES && ends & 2))
                imp__strand_end(scene, shape, place, (int)i, m > 0, &x);
            else imp__strand_at(scene, shape, place, (int)i, (double)m / PLACES, &x);
            const double L2 = imp__dot(x.d1, x.d1);
            const imp_v3 across = x.d2 - x.d1 * (imp__dot(x.d1, x.d2) / L2);
            if (!(L2 > x.r * imp__length(across))) return (int)i;
        }
    return -1;
}

/* ---- Velocities --------------------------------------------------------------------- */

/* A glued point, and N, from which its velocity comes. */
struct glued_line {
    struct imp__strand x;
    struct imp__strand_axes axes;
    imp_v3 e, n, N;
    double A, length, side;
    double b[4][4];
    size_t first;
};

static void line_read(const struct imp__moves *moves, const struct imp__glued *x,
                      struct glued_line *out)
{
    const struct imp_curves *k = &moves->scene->shapes[x->shape]->curves;
    out->first = k->first[x->prim];
    imp__curve_weights(k->degree, x->b[0], out->b);
    imp__strand_at(moves->scene, x->shape, 0, x->prim, x->b[0], &out->x);
    out->axes = imp__strand_axes(&out->x);
    const imp_v3 q = x->p - out->x.c, a = out->axes.a;
    out->e = imp__normalize(q - a * imp__dot(a, q));
    out->A = imp__dot(out->x.d1, out->x.d1) - out->x.r * imp__dot(out->e, out->x.d2);
    out->N = out->e * out->A - out->x.d1 * out->x.r1;
    out->length = imp__length(out->N);
    out->n = out->N * (1 / out->length);
    out->side = imp__dot(out->n, x->n) < 0 ? -1 : 1;
}

void imp__strand_velocity(const struct imp__moves *moves, const struct imp__glued *x,
                          const double *theta, struct imp__velocity *out)
{
    struct glued_line k;
    line_read(moves, x, &k);
    imp_v3 d[3] = {{0}, {0}, {0}};
    double r[2] = {0, 0};
    for (size_t m = 0; m < 4; m++) {
        const double *q = theta + 4 * (k.first + m);
        for (int i = 0; i < 3; i++) d[i] += imp__move_vector(q) * k.b[i][m];
        for (int i = 0; i < 2; i++) r[i] += q[3] * k.b[i][m];
    }
    const double L = k.axes.length;
    if (!(k.x.r > 0) || !(L > 0) || !(k.length > 0)) return;
    const imp_v3 e_dot = k.axes.a * (-imp__dot(k.e, d[1]) / L);
    const double A_dot = 2 * imp__dot(k.x.d1, d[1]) - r[0] * imp__dot(k.e, k.x.d2) -
                         k.x.r * (imp__dot(e_dot, k.x.d2) + imp__dot(k.e, d[2]));
    const imp_v3 N_dot = e_dot * k.A + k.e * A_dot - d[1] * k.x.r1 - k.x.d1 * r[1];
    out->v += d[0] + k.e * r[0] + e_dot * k.x.r;
    const imp_v3 n_dot = unit_part(k.n, N_dot, k.length) * k.side;
    out->n += n_dot;
    out->area +=
        r[0] / k.x.r - imp__dot(k.x.d1, d[1]) / (L * L) + imp__dot(k.n, N_dot) / k.length;
}

void imp__strand_bar(const struct imp__moves *moves, const struct imp__glued *x,
                     const struct imp__velocity *bar, double *theta_bar)
{
    struct glued_line k;
    line_read(moves, x, &k);
    const double L = k.axes.length, area = bar->area;
    if (!(k.x.r > 0) || !(L > 0) || !(k.length > 0)) return;
    const imp_v3 N_bar =
        unit_part(k.n, bar->n * k.side, k.length) + k.n * (area / k.length);
    const double A_bar = imp__dot(k.e, N_bar);
    const imp_v3 e_bar = N_bar * k.A + bar->v * k.x.r - k.x.d2 * (k.x.r * A_bar);
    const double turned = imp__dot(k.axes.a, e_bar) / L;
    const imp_v3 d_bar[3] = {
        bar->v, k.x.d1 * (2 * A_bar - area / (L * L)) - N_bar * k.x.r1 - k.e * turned,
        k.e * (-k.x.r * A_bar)};
    const double r_bar[2] = {area / k.x.r + imp__dot(k.e, bar->v) -
                                 A_bar * imp__dot(k.e, k.x.d2),
                             -imp__dot(k.x.d1, N_bar)};
    for (size_t m = 0; m < 4; m++) {
        double *q = theta_bar + 4 * (k.first + m);
        for (int i = 0; i < 3; i++) imp__move_vector_bar(q, d_bar[i] * k.b[i][m]);
        for (int i = 0; i < 2; i++) q[3] += r_bar[i] * k.b[i][m];
    }
}

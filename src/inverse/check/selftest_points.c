/* SPDX-License-Identifier: Apache-2.0
 *
 * Points that shapes draw, against lines that know nothing of them (selftest_lines.h): the area,
 * points drawn by it, and points drawn towards a place, whose density p has
 *
 *     E[1/p] = the solid angle under which the shape is seen,
 *
 * counted once for every crossing of a direction, or once if the nearest alone is drawn. */
#include "math/warp.h"
#include "selftest_shape.h"
#include <string.h>

#define CUTS  4 /* of the box along an axis, for cells of points */
#define CELLS (CUTS * CUTS * CUTS)
#define OFTEN 100  /* hits in a cell that is looked at */
#define DRAWN 4000 /* points that are looked for by a line */

/* Sums over pairs of a line and a point, or over directions of one place. */
struct sums {
    double value, square, hits;
};
static void sums_add(struct sums *s, double x, double hits)
{
    s->value += x;
    s->square += x * x;
    s->hits += hits;
}
/* The variance of the mean of n. Where few or no hits of this weight say too little of it, that of
 * ten. */
static double variance_of(const struct sums *s, double n, double weight)
{
    const double seen = fmax(s->square - s->value * s->value / n, 0) / (n * (n - 1));
    return fmax(seen, 10 * imp__sqr(weight / n));
}

static int cell_of(const struct imp_shape *s, imp_v3 x, int cuts)
{
    int cell = 0;
    for (int i = 0; i < 3; i++) {
        const double size = s->hi[i] - s->lo[i];
        const double at = size > 0 ? (x[i] - s->lo[i]) / size * cuts : 0;
        cell = cuts * cell + (int)imp_clamp(at, 0., cuts - 1.);
    }
    return cell;
}

/* What nothing has been compared for has seen no error below 1. */
static void scores_end(struct imp__scores *s)
{
    imp__scores_end(s);
    if (!(s->sees > 0)) s->sees = 1;
}

/* ---- By area --------------------------------------------------------------------------- */

struct area {
    double n, drawn, lost; /* points looked for, and not found on the surface */
    struct sums all, line[CELLS], point[CELLS];
    struct imp__scores area, points;
};

/* The area on either side of every wall of cells, by one line. */
static void line_take(const struct imp__probe *p, struct imp_key key, struct area *a)
{
    const struct imp__chord l = imp__probe_line(p, key);
    struct imp_hit hit[IMP_CROSSINGS_MAX];
    const int n = imp__probe_crossings(p, &l, hit);
    int cell[IMP_CROSSINGS_MAX];
    const double one = 2 * l.shadow;
    for (int k = 0; k < n; k++) cell[k] = cell_of(p->s, l.o + l.d * hit[k].t, CUTS);
    for (int k = 0; k < n; k++) {
        int same = 0;
        bool first = true;
        for (int j = 0; j < n; j++) {
            same += cell[j] == cell[k];
            first &= j >= k || cell[j] != cell[k];
        }
        if (first) sums_add(&a->line[cell[k]], one * same, same);
    }
    if (n > 0) sums_add(&a->all, one * n, n);
}

/* Does a line along the normal meet the surface there, with the same normal and uv? */
static bool is_there(const struct imp__probe *p, imp_v3 x, imp_v3 ng, const double uv[2])
{
    const double away = 0.01 * p->reach, slack = 1e-5 * p->scale;
    const struct imp__chord l = {.o = x + ng * away, .d = -ng, .length = 4 * p->reach};
    struct imp_hit hit;
    struct imp_surface at;
    int rank;
    if (!imp__probe_hit(p, &l, away, slack, &hit, &rank)) return false;
    imp__probe_surface(p, &hit, &l, &at);
    const double du = fabs(at.uv[0] - uv[0]), dv = fabs(at.uv[1] - uv[1]);
    const double off = imp__length(at.dp_du) * fabs(du - rint(du)) +
                       imp__length(at.dp_dv) * fabs(dv - rint(dv));
    return imp__dot(at.ng, ng) > 0.999 && (p->s->by_triangle || off < 10 * slack);
}

static void point_take(const struct imp__probe *p, const double u[2], bool looked,
                       struct area *a)
{
    struct imp_surface at = {.located = {.prim = -1}};
    p->s->ops->sample_area(p->s, u, &at);
    const bool square = p->s->ops->flags & IMP_SHAPE_SQUARE && !p->s->by_triangle;
    const bool sane =
        imp__is_finite(at.p) && imp__is_finite(at.ng) &&
        fabs(imp__dot(at.ng, at.ng) - 1) < 1e-6 && !imp__shape_outside(p, at.p) &&
        (!square || (fabs(at.uv[0] - u[0]) < 1e-9 && fabs(at.uv[1] - u[1]) < 1e-9));
    a->n += looked;
    a->lost += looked && !(sane && is_there(p, at.p, at.ng, at.uv));
    if (!imp__is_finite(at.p)) return;
    a->drawn++;
    sums_add(&a->point[cell_of(p->s, at.p, CUTS)], p->s->area, 1);
}

/* n lines and n points. */
static void area_take(struct imp__selftest *t, const struct imp__probe *p, int n,
                      bool points, struct area *a)
{
    const double most = imp__probe_most(p) / 5;
    *a = (struct area){0};
    for (int k = 0; k < n; k++) {
        if (k % 1000 == 0 && imp__selftest_stopped(t)) return;
        line_take(p, imp__key(t->options.seed, 53, (uint64_t)k), a);
        const struct imp_key key = imp__key(t->options.seed, 54, (uint64_t)k);
        const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
        if (points) point_take(p, u, k < DRAWN && k < most, a);
    }
    const double area = a->all.value / n;
    const imp_v3 h = p->half;
    const double one = 4 * (h[0] * h[1] + h[1] * h[2] + h[2] * h[0]); /* mean 2 a(w) */
    imp__scores_add(&a->area, p->s->area, area,
                    sqrt(variance_of(&a->all, n, one)) + 1e-6 * area);
    scores_end(&a->area);
    if (!points) return;
    bool any = false;
    for (int c = 0; c < CELLS; c++) {
        if (!(fmax(a->line[c].hits, a->point[c].hits) > OFTEN)) continue;
        const double drawn = a->point[c].value / n, lines = a->line[c].value / n;
        imp__scores_add(&a->points, drawn, lines,
                        sqrt(variance_of(&a->point[c], n, p->s->area) +
                             variance_of(&a->line[c], n, one)));
        any = true;
    }
    if (!any) a->points = a->area;
    scores_end(&a->points);
}

/* The area of triangles is the sum of theirs; of others, that by lines. */
static double triangles_area(const struct imp_triangles *t)
{
    double sum = 0;
    for (size_t k = 0; k < t->n_triangles; k++) {
        imp_v3 x[3];
        for (int i = 0; i < 3; i++) {
            const float *v = t->positions + 3 * (size_t)t->indices[3 * k + (size_t)i];
            x[i] = imp__v3(v[0], v[1], v[2]);
        }
        sum += 0.5 * imp__length(imp__cross(x[1] - x[0], x[2] - x[0]));
    }
    return sum;
}

/* ---- Towards a place ------------------------------------------------------------------- */

struct toward {
    double n, bad, density; /* the last: worst relative difference */
    struct imp__scores angle;
};

/* One drawn point: what its density says, and whether it is there. */
static bool toward_take(const struct imp__probe *p, imp_v3 ref, const double u[2],
                        bool looked, struct toward *a, struct imp_light_sample *x)
{
    const struct imp_shape *s = p->s;
    *x = (struct imp_light_sample){.located = {.prim = -1}};
    a->n++;
    if (!s->ops->sample_toward(s, &ref, u, x)) return false;
    const double far = imp__length(p->centre - ref) + p->scale;
    const imp_v3 off = x->p - (ref + x->wi * x->dist);
    const bool sane = imp__is_finite(x->wi) && fabs(imp__dot(x->wi, x->wi) - 1) < 1e-6 &&
                      x->dist > 0 && x->pdf > 0 && isfinite(x->pdf) &&
                      imp__length(off) < 1e-6 * far && !imp__shape_outside(p, x->p);
    a->bad += !sane;
    if (!sane || !looked) return sane;
    const double cosine = fabs(imp__dot(x->ng, x->wi));
    if (!(cosine > 0.05)) return true; /* digits of the crossing are lost */
    const struct imp__chord l = {.o = ref, .d = x->wi, .length = x->dist + 4 * p->reach};
    struct imp_hit hit;
    struct imp_surface at;
    int rank = 0;
    if (!imp__probe_hit(p, &l, x->dist, 1e-5 * far / cosine, &hit, &rank) ||
        (rank > 0 && s->ops->flags & IMP_SHAPE_NEAREST)) {
        a->bad++;
        return true;
    }
    imp__probe_surface(p, &hit, &l, &at);
    a->bad += !(imp__dot(at.ng, x->ng) > 0.999 &&
                fabs(x->cos_light + imp__dot(x->wi, at.n)) < 1e-3);
    const double pdf = s->ops->pdf_toward(s, &ref, &hit, &at);
    const double error = fabs(pdf / x->pdf - 1);
    a->density = fmax(a->density, isfinite(error) ? error : INFINITY);
    return true;
}

/* Crossings of one direction, by octants of the box. */
static void direction_take(const struct imp__probe *p, imp_v3 ref, imp_v3 d, double angle,
                           struct sums octant[8])
{
    const struct imp__chord l = {
        .o = ref, .d = d, .length = imp__length(p->centre - ref) + 2 * p->reach};
    struct imp_hit hit[IMP_CROSSINGS_MAX];
    int n = imp__probe_crossings(p, &l, hit), count[8] = {0};
    if (p->s->ops->flags & IMP_SHAPE_NEAREST) n = imp_min(n, 1);
    for (int k = 0; k < n; k++) count[cell_of(p->s, l.o + l.d * hit[k].t, 2)]++;
    for (int c = 0; c < 8; c++)
        if (count[c]) sums_add(&octant[c], count[c] * angle, count[c]);
}

static void places_take(const struct imp__selftest *t, const struct imp__probe *p, int n,
                        struct toward *a)
{
    const double most = imp__probe_most(p) / 5 / t->options.directions;
    *a = (struct toward){0};
    for (int i = 0; i < t->options.directions; i++) {
        /* Places outside of the larger box, from which it lies in a cone. */
        const struct imp_key at = imp__key(t->options.seed, 55, (uint64_t)i);
        const imp_v3 axis =
            imp__uniform_sphere((double[2]){imp__u01(at, 0), imp__u01(at, 1)});
        const double far = p->reach * (1.1 + 3 * imp__sqr(imp__u01(at, 2)));
        const imp_v3 ref = p->centre + axis * far;
        const struct imp_frame frame = imp__frame_from_normal(-axis);
        const double s2 = imp__sqr(p->reach / far), height = s2 / (1 + sqrt(1 - s2));
        const double looked = fmin(DRAWN / t->options.directions + 1, most);
        struct sums own[8] = {{0}}, other[8] = {{0}};
        for (int k = 0; k < n; k++) {
            const struct imp_key key =
                imp__key(t->options.seed, 600 + (uint64_t)i, (uint64_t)k);
            const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
            struct imp_light_sample x;
            if (toward_take(p, ref, u, k < looked, a, &x))
                sums_add(&own[cell_of(p->s, x.p, 2)], 1 / x.pdf, 1);
            const double z = 1 - imp__u01(key, 2) * height, r = sqrt(1 - z * z),
                         phi = IMP_2PI * imp__u01(key, 3);
            const imp_v3 d =
                imp__to_world(&frame, imp__v3(r * cos(phi), r * sin(phi), z));
            direction_take(p, ref, d, IMP_2PI * height, other);
        }
        for (int c = 0; c < 8; c++) {
            if (!(fmax(own[c].hits, other[c].hits) > OFTEN)) continue;
            imp__scores_add(&a->angle, own[c].value / n, other[c].value / n,
                            sqrt(variance_of(&own[c], n, 0) +
                                 variance_of(&other[c], n, IMP_2PI * height)) +
                                1e-5 * other[c].value / n);
        }
    }
    scores_end(&a->angle);
}

/* ---- Rows ------------------------------------------------------------------------------- */

/* So many lines or directions at a time that a self-test of many triangles ends. */
static int affordable(const struct imp__probe *p, const struct imp__selftest *t, int m)
{
    return (int)fmin(m, fmax(imp__probe_most(p) / t->options.directions, 20));
}

static enum imp_status area_rows(struct imp__selftest *t, const struct imp__probe *p)
{
    enum imp_status st = IMP_OK;
    const struct imp_shape *s = p->s;
    const char *name = s->name, *kind = s->ops->name;
    const bool points = s->ops->sample_area && s->area > 0;
    const int d = t->options.directions, first = t->options.samples / d + 1;
    struct area a = {0};
    if (s->geometry == IMP_TRIANGLES && s->area > 0) {
        const double sum = triangles_area(&s->triangles);
        IMP_TRY(imp__selftest_row(
            t, &(struct imp_selftest_row){.object = name,
                                          .kind = kind,
                                          .contract = "area",
                                          .value = s->area,
                                          .reference = sum,
                                          .error = fabs(s->area / sum - 1),
                                          .limit = 1e-5,
                                          .chance = -1}));
    }
    if (s->geometry == IMP_TRIANGLES && !points) return IMP_OK;
    for (int m = first, next; m > 0; m = next) {
        const int can = affordable(p, t, m);
        area_take(t, p, can * d, points, &a);
        const double sees = fmax(a.area.sees, a.points.sees);
        next = can < m || a.lost > 0 ? 0 : imp__selftest_more(t, m, sees);
    }
    if (s->geometry == IMP_ANALYTIC)
        IMP_TRY(imp__selftest_z(t, name, kind, "area", &a.area));
    if (!points) return IMP_OK;
    IMP_TRY(imp__selftest_count(t, name, kind, "drawn", a.lost, a.n));
    IMP_TRY(imp__selftest_z(t, name, kind, "points", &a.points));
out:
    return st;
}

static enum imp_status toward_rows(struct imp__selftest *t, const struct imp__probe *p)
{
    enum imp_status st = IMP_OK;
    const struct imp_shape *s = p->s;
    const char *name = s->name, *kind = s->ops->name;
    struct toward a = {0};
    if (!s->ops->sample_toward || !(s->area > 0)) return IMP_OK;
    for (int m = t->options.samples / t->options.directions + 1, next; m > 0; m = next) {
        const int can = affordable(p, t, m);
        places_take(t, p, can, &a);
        next = can < m || a.bad > 0 ? 0 : imp__selftest_more(t, m, a.angle.sees);
    }
    IMP_TRY(imp__selftest_count(t, name, kind, "towards", a.bad, a.n));
    if (a.bad > 0) return IMP_OK;
    IMP_TRY(imp__selftest_row(t, &(struct imp_selftest_row){.object = name,
                                                            .kind = kind,
                                                            .contract = "density",
                                                            .value = a.density,
                                                            .error = a.density,
                                                            .limit = 1e-3,
                                                            .chance = -1}));
    IMP_TRY(imp__selftest_z(t, name, kind, "angle", &a.angle));
out:
    return st;
}

enum imp_status imp__selftest_points(struct imp__selftest *t, const struct imp__probe *p)
{
    const enum imp_status st = area_rows(t, p);
    return st == IMP_OK ? toward_rows(t, p) : st;
}

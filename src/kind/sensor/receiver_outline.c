/* SPDX-License-Identifier: Apache-2.0
 *
 * Grids of points on disks and flat meshes: a raster over the rectangle around the shape, of
 * which those points count that lie on it. */
#include "receiver_outline.h"
#include "base/arguments.h"
#include "kind/shape/mesh_triangle.h"
#include "kind/shape/shape.h"
#include "math/warp.h"
#include <stdlib.h>

#define CHORDS      720  /* of an ellipse: a part of 1e-5 of the radius inside of it */
#define FLATNESS    1e-5 /* of the size of a mesh, which has floats */
#define ON_OUTLINE  1e-6 /* of the size: nearer points count as on the outline */
#define PLACE_ERROR 1e-5 /* of the size: a point is where its numbers put it */

extern const struct imp_shape_ops imp__disk;

static bool is_mesh(const struct imp_shape *s)
{
    return s->ops->surface == imp__mesh_surface;
}

static void flatten(const struct imp__outline *o, imp_v3 p, double at[2])
{
    for (int k = 0; k < 2; k++) at[k] = imp__dot(p - o->origin, o->axis[k]);
}

static double size_of(const struct imp__outline *o)
{
    return hypot(o->side[0], o->side[1]);
}

/* ---- Edges ---------------------------------------------------------------------------- */

/* An edge of a triangle, with its ends in an order of their own. */
struct edge {
    float from[3], to[3];
};

static int triples_compare(const float a[3], const float b[3])
{
    for (int k = 0; k < 3; k++)
        if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
    return 0;
}
static int edges_compare(const void *pa, const void *pb)
{
    const struct edge *a = pa, *b = pb;
    const int from = triples_compare(a->from, b->from);
    return from ? from : triples_compare(a->to, b->to);
}

/* All edges of the triangles, equal ones beside each other. Vertices at one place are one. */
static void edges_sort(const struct imp_shape *s, struct edge *edge)
{
    const struct imp__mesh *m = s->self;
    const size_t n = s->triangles.n_triangles;
    for (size_t k = 0; k < 3 * n; k++) {
        const float *a = m->positions + 3 * (size_t)m->indices[k];
        const size_t next = k % 3 == 2 ? k - 2 : k + 1;
        const float *c = m->positions + 3 * (size_t)m->indices[next];
        const bool swap = triples_compare(a, c) > 0;
        memcpy(edge[k].from, swap ? c : a, sizeof edge[k].from);
        memcpy(edge[k].to, swap ? a : c, sizeof edge[k].to);
    }
    qsort(edge, 3 * n, sizeof *edge, edges_compare);
}

static imp_v3 widened(const float p[3]) { return imp__v3(p[0], p[1], p[2]); }

/* ---- The rectangle -------------------------------------------------------------------- */

/* The box of all edges along the axes, from the origin. */
static void box_of(const struct imp__outline *o, double lo[2], double hi[2])
{
    for (int k = 0; k < 2; k++) lo[k] = INFINITY, hi[k] = -INFINITY;
    for (size_t i = 0; i < o->n; i++)
        for (int k = 0; k < 4; k++) {
            lo[k % 2] = fmin(lo[k % 2], o->edge[i][k]);
            hi[k % 2] = fmax(hi[k % 2], o->edge[i][k]);
        }
}

/* Turns the axes by the angle whose cosine and sine are c and s, and the edges back. */
static void turn(struct imp__outline *o, double c, double s)
{
    const imp_v3 x = o->axis[0], y = o->axis[1];
    o->axis[0] = x * c + y * s;
    o->axis[1] = y * c - x * s;
    for (size_t i = 0; i < o->n; i++)
        for (int k = 0; k < 4; k += 2) {
            const double u = o->edge[i][k], v = o->edge[i][k + 1];
            double sv = s * v, su = s * u;
            IMP_OPAQUE(sv); /* GCC 12 makes one fused operation of complex products */
            IMP_OPAQUE(su);
            o->edge[i][k] = c * u + sv;
            o->edge[i][k + 1] = c * v - su;
        }
}

/* The smallest rectangle with a side along an edge, which is the smallest of all (Freeman and
 * Shapira 1975). Of equal ones the first. */
static void rectangle_choose(struct imp__outline *o)
{
    double best = INFINITY, along[2] = {1, 0};
    for (size_t i = 0; i < o->n; i++) {
        const double *e = o->edge[i], dx = e[2] - e[0], dy = e[3] - e[1];
        const double length = hypot(dx, dy);
        double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
        if (!(length > 0)) continue;
        for (size_t j = 0; j < o->n; j++) {
            const double *f = o->edge[j];
            const double at[2] = {(dx * f[0] + dy * f[1]) / length,
                                  (dx * f[1] - dy * f[0]) / length};
            for (int k = 0; k < 2; k++) {
                lo[k] = imp_min(at[k], lo[k]);
                hi[k] = imp_max(at[k], hi[k]);
            }
        }
        const double area = (hi[0] - lo[0]) * (hi[1] - lo[1]);
        if (!(area < best * (1 - 1e-6))) continue;
        best = area;
        along[0] = dx / length;
        along[1] = dy / length;
    }
    turn(o, along[0], along[1]);
}

/* The quarter turn that brings the first axis next to x, or y; the origin goes to the corner. */
static void rectangle_settle(struct imp__outline *o)
{
    double lo[2], hi[2];
    const int main_axis = fmax(fabs(o->axis[0][0]), fabs(o->axis[1][0])) > 1e-3 ? 0 : 1;
    int best = 0;
    double most = -INFINITY;
    for (int k = 0; k < 4; k++) {
        const double towards = (k < 2 ? 1 : -1) * o->axis[k % 2][main_axis] -
                               1e-9 * k; /* the first of ties */
        if (towards > most) most = towards, best = k;
    }
    turn(o, best == 0 ? 1 : best == 2 ? -1 : 0, best == 1 ? 1 : best == 3 ? -1 : 0);
    box_of(o, lo, hi);
    o->origin += o->axis[0] * lo[0] + o->axis[1] * lo[1];
    for (size_t i = 0; i < o->n; i++)
        for (int k = 0; k < 4; k++) o->edge[i][k] -= lo[k % 2];
    for (int k = 0; k < 2; k++) o->side[k] = hi[k] - lo[k];
}

/* ---- Outlines -------------------------------------------------------------------------- */

static enum imp_status edges_take(const struct imp_build *b, size_t n,
                                  struct imp__outline *o)
{
    o->edge = imp__alloc(b->ctx, n + 1, sizeof *o->edge);
    return o->edge ? IMP_OK
                   : imp_build_error(b, NULL, IMP_E_NOMEM, "no memory for an outline");
}

/* p(x, y) = centre + x a + y c of the unit disk, by place's polar uv. */
static void disk_arms(const struct imp_shape *s, imp_v3 *centre, imp_v3 *a, imp_v3 *c)
{
    struct imp_surface at;
    int prim;
    s->ops->place(s, (const double[]){0, 0}, &at, &prim);
    *centre = at.p;
    s->ops->place(s, (const double[]){1, 0}, &at, &prim);
    *a = at.p - *centre;
    s->ops->place(s, (const double[]){1, 0.25}, &at, &prim);
    *c = at.p - *centre;
}

static enum imp_status disk_outline(const struct imp_build *b, const struct imp_shape *s,
                                    struct imp__outline *o)
{
    imp_v3 a, c;
    IMP_CHECKED(edges_take(b, CHORDS, o));
    disk_arms(s, &o->origin, &a, &c);
    /* An ellipse by its longer arm; a circle keeps its own axes. */
    const bool second = imp__length(c) > imp__length(a) * (1 + 1e-9);
    const imp_v3 n = imp__cross(o->axis[0], o->axis[1]);
    o->axis[0] = imp__normalize(second ? c : a);
    o->axis[1] = imp__cross(n, o->axis[0]);
    for (o->n = 0; o->n < CHORDS; o->n++)
        for (int k = 0; k < 2; k++) {
            const double phi = IMP_2PI * (double)(o->n + (size_t)k) / CHORDS;
            flatten(o, o->origin + a * cos(phi) + c * sin(phi), o->edge[o->n] + 2 * k);
        }
    return IMP_OK;
}

static enum imp_status flat_check(const struct imp_build *b, const struct imp_shape *s,
                                  imp_v3 normal)
{
    const imp_v3 reach = s->hi - s->lo;
    const double most = FLATNESS * imp__length(reach);
    const struct imp__mesh *m = s->self;
    const imp_v3 first = imp__mesh_corner(m, 0).p0;
    for (size_t k = 0; k < s->triangles.n_triangles; k++) {
        const struct imp__mesh_corner t = imp__mesh_corner(m, k);
        const imp_v3 p = t.p0 - first, across = imp__cross(t.e1, t.e2);
        const double off =
            fmax(fabs(imp__dot(p, normal)), fmax(fabs(imp__dot(p + t.e1, normal)),
                                                 fabs(imp__dot(p + t.e2, normal))));
        if (off > most || imp__dot(across, normal) < 0)
            return imp_build_error(b, NULL, IMP_E_SCENE,
                                   "a grid is on a flat shape, and triangle %zu of '%s' "
                                   "(%s) %s",
                                   k, s->name, s->ops->name,
                                   off > most ? "is not in the plane of the others"
                                              : "faces the other way than the others");
    }
    return IMP_OK;
}

static enum imp_status mesh_outline(const struct imp_build *b, const struct imp_shape *s,
                                    imp_v3 normal, struct imp__outline *o)
{
    const size_t n = 3 * s->triangles.n_triangles;
    IMP_CHECKED(flat_check(b, s, normal));
    IMP_CHECKED(edges_take(b, n, o));
    struct edge *edge = imp__alloc(b->ctx, n, sizeof *edge);
    if (!edge)
        return imp_build_error(b, NULL, IMP_E_NOMEM, "no memory for edges of a mesh");
    edges_sort(s, edge);
    o->origin = widened(edge[0].from);
    for (size_t k = 0, same; k < n; k += same) {
        for (same = 1; k + same < n && !edges_compare(&edge[k], &edge[k + same]);) same++;
        if (same > 1) continue; /* between two triangles */
        flatten(o, widened(edge[k].from), o->edge[o->n]);
        flatten(o, widened(edge[k].to), o->edge[o->n++] + 2);
    }
    imp__release(b->ctx, edge);
    if (o->n == 0)
        return imp_build_error(b, NULL, IMP_E_SCENE,
                               "the shape '%s' (%s) has no outline: each of its edges "
                               "belongs to two triangles",
                               s->name, s->ops->name);
    rectangle_choose(o);
    return IMP_OK;
}

enum imp_status imp__outline_create(const struct imp_build *b, const struct imp_shape *s,
                                    imp_v3 normal, struct imp__outline *out)
{
    const struct imp_frame frame = imp__frame_from_normal(normal);
    enum imp_status st;
    *out = (struct imp__outline){.axis = {frame.s, frame.t}};
    if (s->ops == &imp__disk) st = disk_outline(b, s, out);
    else if (is_mesh(s)) st = mesh_outline(b, s, normal, out);
    else
        st = imp_build_error(b, NULL, IMP_E_SCENE,
                             "a grid is on a rectangle, a disk or a flat mesh, and its "
                             "shape '%s' is a %s",
                             s->name, s->ops->name);
    if (st == IMP_OK) rectangle_settle(out);
    else imp__outline_destroy(b, out);
    return st;
}

void imp__outline_destroy(const struct imp_build *b, struct imp__outline *o)
{
    imp__release(b->ctx, o->edge);
    o->edge = NULL;
}

/* ---- Points ---------------------------------------------------------------------------- */

static double outline_distance(const struct imp__outline *o, const double at[2])
{
    double least = INFINITY;
    for (size_t i = 0; i < o->n; i++) {
        const double *e = o->edge[i], dx = e[2] - e[0], dy = e[3] - e[1];
        const double px = at[0] - e[0], py = at[1] - e[1], l2 = dx * dx + dy * dy;
        const double t = l2 > 0 ? imp_clamp((px * dx + py * dy) / l2, 0.0, 1.0) : 0;
        least = imp_min(hypot(px - t * dx, py - t * dy), least);
    }
    return least;
}

static bool disk_numbers(const struct imp_shape *s, imp_v3 p, double u[2])
{
    imp_v3 centre, a, c;
    disk_arms(s, &centre, &a, &c);
    const imp_v3 d = p - centre;
    const double aa = imp__dot(a, a), cc = imp__dot(c, c), ac = imp__dot(a, c);
    const double x = imp__dot(a, d), y = imp__dot(c, d), det = aa * cc - ac * ac;
    const double xy[2] = {(cc * x - ac * y) / det, (aa * y - ac * x) / det};
    if (!(xy[0] * xy[0] + xy[1] * xy[1] < 1)) return false;
    imp__concentric_disk_inverse(xy, u);
    return true;
}

/* By the triangle that it lies in most deeply. */
static bool mesh_numbers(const struct imp_shape *s, imp_v3 p, double u[2])
{
    const struct imp__mesh *m = s->self;
    double deepest = -1e-6, weight[2] = {0, 0};
    int prim = -1;
    for (size_t k = 0; k < s->triangles.n_triangles; k++) {
        const struct imp__mesh_corner t = imp__mesh_corner(m, k);
        const imp_v3 d = p - t.p0;
        const double aa = imp__dot(t.e1, t.e1), cc = imp__dot(t.e2, t.e2),
                     ac = imp__dot(t.e1, t.e2), x = imp__dot(t.e1, d),
                     y = imp__dot(t.e2, d), det = aa * cc - ac * ac;
        if (!(det > 0)) continue;
        const double b1 = (cc * x - ac * y) / det, b2 = (aa * y - ac * x) / det;
        const double depth = fmin(fmin(b1, b2), 1 - b1 - b2);
        if (depth > deepest)
            deepest = depth, prim = (int)k, weight[0] = b1, weight[1] = b2;
    }
    if (prim >= 0) imp__mesh_area_numbers(s, prim, weight, u);
    return prim >= 0;
}

/* The numbers by which sample_area makes the point p. False: it is not on the shape. */
static enum imp_status numbers_of(const struct imp_build *b, const struct imp_shape *s,
                                  const struct imp__outline *o, imp_v3 p, double u[2],
                                  bool *on)
{
    struct imp_surface at;
    *on = is_mesh(s) ? mesh_numbers(s, p, u) : disk_numbers(s, p, u);
    if (!*on) return IMP_OK;
    s->ops->sample_area(s, u, &at);
    const imp_v3 off = at.p - p;
    if (imp__length(off) <= PLACE_ERROR * size_of(o)) return IMP_OK;
    return imp_build_error(b, NULL, IMP_E_SCENE,
                           "a point of the grid on '%s' is not found again: the areas of "
                           "its triangles are too different",
                           s->name);
}

enum imp_status imp__outline_points(const struct imp_build *b, const struct imp_shape *s,
                                    const struct imp__outline *o, double margin,
                                    int columns, int rows, struct imp_receiver *r, int *n)
{
    const size_t room = (size_t)columns * (size_t)rows;
    const double beside = fmax(margin * (1 - 1e-9), ON_OUTLINE * size_of(o));
    double(*place)[2] = imp_build_alloc(b, room, sizeof *place);
    int32_t(*cell)[2] = imp_build_alloc(b, room, sizeof *cell);
    *n = 0;
    if (!place || !cell)
        return imp_build_error(b, NULL, IMP_E_NOMEM,
                               "no memory for the points of a grid");
    for (int y = 0; y < rows; y++)
        for (int x = 0; x < columns; x++) {
            const double at[2] = {margin +
                                      (x + 0.5) / columns * (o->side[0] - 2 * margin),
                                  margin + (y + 0.5) / rows * (o->side[1] - 2 * margin)};
            const imp_v3 p = o->origin + o->axis[0] * at[0] + o->axis[1] * at[1];
            bool on;
            IMP_CHECKED(numbers_of(b, s, o, p, place[*n], &on));
            if (!on || outline_distance(o, at) < beside) continue;
            cell[*n][0] = x;
            cell[(*n)++][1] = y;
        }
    if (*n == 0)
        return imp_build_error(b, NULL, IMP_E_SCENE,
                               "none of %d x %d points lies on its shape '%s', %g from "
                               "the outline",
                               columns, rows, s->name, margin);
    r->place = place;
    r->cell = cell;
    r->columns = columns;
    r->rows = rows;
    return IMP_OK;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Shading normals of meshes with vertex normals (moves.h): how they turn over a triangle, and how
 * normals that are sums over the faces around a vertex follow its neighbours:
 *
 *     n_i = S/|S|,  S = sum_f theta_f n_f,  n_f = c/|c|, c = a x b,
 *     theta_f the angle between a and b, the edges of face f from vertex i. */
#include "base/context.h"
#include "math/trig.h"
#include "moves.h"
#include <stdlib.h>
#include <string.h>

bool imp__moves_smooth(const struct imp_scene *scene, int shape)
{
    const struct imp_shape *s = scene->shapes[shape];
    return s->smooth && s->geometry == IMP_TRIANGLES &&
           s->ops->surface == imp__mesh_surface;
}

static imp_v3 triple(const float *array, uint32_t i)
{
    const float *p = array + 3 * (size_t)i;
    return imp__v3(p[0], p[1], p[2]);
}

void imp__glued_shade(struct imp__glued *x, const struct imp__corners *f)
{
    if (!f->smooth) return;
    const imp_v3 e[2] = {f->p[1] - f->p[0], f->p[2] - f->p[0]};
    const imp_v3 N = f->n[0] * x->b[0] + f->n[1] * x->b[1] + f->n[2] * x->b[2];
    const double aa = imp__dot(e[0], e[0]), ab = imp__dot(e[0], e[1]),
                 bb = imp__dot(e[1], e[1]), det = aa * bb - ab * ab;
    x->length = imp__length(N);
    /* As imp__mesh_point, where the shape is in no instance. */
    const double unit = x->place > 0 ? imp__length(f->n[0]) : 1;
    if (!(x->length > 1e-6 * unit) || !(det > 0)) return;
    x->smooth = true;
    x->shade = N * (1 / x->length);
    for (int k = 0; k < 2; k++) {
        const imp_v3 d = f->n[k + 1] - f->n[0];
        x->turn[k] = (d - x->shade * imp__dot(x->shade, d)) * (1 / x->length);
    }
    x->slope[0] = (e[0] * bb - e[1] * ab) * (1 / det);
    x->slope[1] = (e[1] * aa - e[0] * ab) * (1 / det);
}

/* ---- Normals of vertices -------------------------------------------------------------- */

struct imp__fans {
    size_t n;         /* vertices */
    uint32_t *place;  /* [n] the least vertex at the same position */
    uint32_t *start;  /* [n + 1] where the corners of a place begin */
    uint32_t *corner; /* [3 n_triangles] 3 triangle + corner */
};

struct placed {
    float p[3];
    uint32_t vertex;
};
static int by_place(const void *a, const void *b)
{
    const struct placed *x = a, *y = b;
    for (int i = 0; i < 3; i++)
        if (x->p[i] != y->p[i]) return x->p[i] < y->p[i] ? -1 : 1;
    return x->vertex < y->vertex ? -1 : x->vertex > y->vertex;
}

enum imp_status imp__vertex_places(imp_context *ctx, const float *positions, size_t n,
                                   uint32_t *place)
{
    struct placed *placed = imp__alloc(ctx, n, sizeof *placed);
    if (!placed)
        return imp__error(ctx, IMP_E_NOMEM, "no memory for the places of vertices");
    for (size_t k = 0; k < n; k++) {
        memcpy(placed[k].p, positions + 3 * k, sizeof placed[k].p);
        placed[k].vertex = (uint32_t)k;
    }
    qsort(placed, n, sizeof *placed, by_place);
    for (size_t k = 0, first = 0; k < n; k++) {
        const float *p = placed[k].p, *q = placed[first].p;
        if (p[0] != q[0] || p[1] != q[1] || p[2] != q[2]) first = k;
        place[placed[k].vertex] = placed[first].vertex;
    }
    imp__release(ctx, placed);
    return IMP_OK;
}

static void corners_find(const struct imp_triangles *t, struct imp__fans *f)
{
    memset(f->start, 0, (f->n + 1) * sizeof *f->start);
    for (size_t k = 0; k < 3 * t->n_triangles; k++)
        f->start[f->place[t->indices[k]] + 1]++;
    for (size_t k = 0; k < f->n; k++) f->start[k + 1] += f->start[k];
    for (size_t k = 0; k < 3 * t->n_triangles; k++)
        f->corner[f->start[f->place[t->indices[k]]]++] = (uint32_t)k;
    for (size_t k = f->n; k > 0; k--) f->start[k] = f->start[k - 1];
    f->start[0] = 0;
}

enum imp_status imp__fans_make(imp_context *ctx, const struct imp_triangles *t,
                               struct imp__fans **out)
{
    struct imp__fans *f = imp__alloc(ctx, 1, sizeof *f);
    if (f) {
        *f = (struct imp__fans){.n = t->n_vertices};
        f->place = imp__alloc(ctx, f->n, sizeof *f->place);
        f->start = imp__alloc(ctx, f->n + 1, sizeof *f->start);
        f->corner = imp__alloc(ctx, 3 * t->n_triangles, sizeof *f->corner);
    }
    if (!f || !f->place || !f->start || !f->corner) {
        imp__fans_free(ctx, f);
        return imp__error(ctx, IMP_E_NOMEM, "no memory for vertex normals");
    }
    const enum imp_status st =
        imp__vertex_places(ctx, t->positions, t->n_vertices, f->place);
    if (st != IMP_OK) {
        imp__fans_free(ctx, f);
        return st;
    }
    corners_find(t, f);
    *out = f;
    return IMP_OK;
}

void imp__fans_free(imp_context *ctx, struct imp__fans *fans)
{
    if (!fans) return;
    imp__release(ctx, fans->place);
    imp__release(ctx, fans->start);
    imp__release(ctx, fans->corner);
    imp__release(ctx, fans);
}

/* A face as a vertex has it: its edges from there. */
struct fan_face {
    uint32_t i[3];
    imp_v3 a, b, n;
    double area2, angle; /* |a x b|; 0: it counts nothing */
};
static struct fan_face fan_face(const struct imp_triangles *t, uint32_t corner)
{
    struct fan_face f;
    const uint32_t *index = t->indices + corner / 3 * 3;
    for (uint32_t k = 0; k < 3; k++) f.i[k] = index[(corner + k) % 3];
    const imp_v3 p = triple(t->positions, f.i[0]);
    f.a = triple(t->positions, f.i[1]) - p;
    f.b = triple(t->positions, f.i[2]) - p;
    const imp_v3 c = imp__cross(f.a, f.b);
    f.area2 = imp__length(c);
    f.n = f.area2 > 0 ? c * (1 / f.area2) : (imp_v3){0};
    f.angle = f.area2 > 0 ? atan2(f.area2, imp__dot(f.a, f.b)) : 0;
    return f;
}

/* d angle/d a: its tip moves away from b. */
static imp_v3 angle_slope(imp_v3 a, imp_v3 b)
{
    const double aa = imp__dot(a, a);
    return imp__normalize(b - a * (imp__dot(a, b) / aa)) * (-1 / sqrt(aa));
}

static void face_bar(const struct fan_face *f, imp_v3 S_bar, double *positions_bar)
{
    const imp_v3 n_bar = S_bar * f->angle;
    const double angle_bar = imp__dot(f->n, S_bar);
    const imp_v3 c_bar = (n_bar - f->n * imp__dot(f->n, n_bar)) * (1 / f->area2);
    const imp_v3 a_bar = imp__cross(f->b, c_bar) + angle_slope(f->a, f->b) * angle_bar;
    const imp_v3 b_bar = imp__cross(c_bar, f->a) + angle_slope(f->b, f->a) * angle_bar;
    imp__move_vector_bar(positions_bar + 3 * (size_t)f->i[0], -a_bar - b_bar);
    imp__move_vector_bar(positions_bar + 3 * (size_t)f->i[1], a_bar);
    imp__move_vector_bar(positions_bar + 3 * (size_t)f->i[2], b_bar);
}

void imp__fans_normals_bar(const struct imp__fans *fans, const struct imp_triangles *t,
                           double *normals_bar, double *positions_bar)
{
    for (size_t v = 0; v < fans->n; v++) {
        double *own = normals_bar + 3 * v;
        const imp_v3 bar = imp__v3(own[0], own[1], own[2]);
        const size_t place = fans->place[v];
        if (imp__is_zero(bar) || place == v) continue;
        own[0] = own[1] = own[2] = 0;
        imp__move_vector_bar(normals_bar + 3 * place, bar);
    }
    for (size_t v = 0; v < fans->n; v++) {
        double *own = normals_bar + 3 * v;
        const imp_v3 bar = imp__v3(own[0], own[1], own[2]);
        if (imp__is_zero(bar)) continue;
        own[0] = own[1] = own[2] = 0;
        imp_v3 S = {0};
        for (uint32_t k = fans->start[v]; k < fans->start[v + 1]; k++) {
            const struct fan_face f = fan_face(t, fans->corner[k]);
            S += f.n * f.angle;
        }
        const double length = imp__length(S);
        if (!(length > 0)) continue; /* a fixed normal, as imp__mesh_normals gives it */
        const imp_v3 n = S * (1 / length);
        const imp_v3 S_bar = (bar - n * imp__dot(n, bar)) * (1 / length);
        for (uint32_t k = fans->start[v]; k < fans->start[v + 1]; k++) {
            const struct fan_face f = fan_face(t, fans->corner[k]);
            if (f.area2 > 0) face_bar(&f, S_bar, positions_bar);
        }
    }
}

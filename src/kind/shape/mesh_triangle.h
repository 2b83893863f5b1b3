/* SPDX-License-Identifier: Apache-2.0
 *
 * A triangle of a mesh from its arrays: shared by mesh.c, which answers hits, and
 * mesh_build.c. */
#ifndef IMP_MESH_TRIANGLE_H
#define IMP_MESH_TRIANGLE_H

#include "math/pair.h"
#include "shape.h"
#include <string.h>

/* Number `index` of an array of triples that goes on for IMP_MESH_PADDING floats: one load. */
#define IMP_MESH_PADDING 4
static inline imp_v3 imp__mesh_load(const float *array, uint32_t index)
{
    imp_float4 p;
    memcpy(&p, array + 3 * (size_t)index, sizeof p);
    imp_v3 v = imp__widen(p);
    v[3] = 0;
    return v;
}

/* First vertex of a triangle and its edges from there. */
struct imp__mesh_corner {
    imp_v3 p0, e1, e2;
};
static inline struct imp__mesh_corner imp__mesh_corner(const struct imp__mesh *m,
                                                       size_t prim)
{
    const uint32_t *i = m->indices + 3 * prim;
    const imp_v3 p0 = imp__mesh_load(m->positions, i[0]);
    return (struct imp__mesh_corner){p0, imp__mesh_load(m->positions, i[1]) - p0,
                                     imp__mesh_load(m->positions, i[2]) - p0};
}

/* uv of a point of a triangle. */
static inline void imp__mesh_uv(const struct imp__mesh *m, const struct imp_hit *hit,
                                double uv[2])
{
    const double b1 = hit->u, b2 = hit->v;
    /* Without uv they are the weights of the file's second and third vertex. */
    uv[0] = m->reversed ? b2 : b1;
    uv[1] = m->reversed ? b1 : b2;
    if (m->uvs) {
        const uint32_t *i = m->indices + 3 * (size_t)hit->prim;
        const float *t0 = m->uvs + 2 * (size_t)i[0], *t1 = m->uvs + 2 * (size_t)i[1],
                    *t2 = m->uvs + 2 * (size_t)i[2];
        for (int k = 0; k < 2; k++)
            uv[k] = t0[k] + b1 * ((double)t1[k] - t0[k]) + b2 * ((double)t2[k] - t0[k]);
    }
}

/* Position, normals and uv: all that a light sample needs. */
static inline void imp__mesh_point(const struct imp__mesh *m, const struct imp_hit *hit,
                                   const struct imp__mesh_corner *c, imp_v3 ng,
                                   struct imp_surface *out)
{
    const double b1 = hit->u, b2 = hit->v, b0 = 1 - b1 - b2;
    out->p = c->p0 + c->e1 * b1 + c->e2 * b2;
    out->ng = ng;
    out->n = ng;
    if (m->normals) {
        const uint32_t *i = m->indices + 3 * (size_t)hit->prim;
        const imp_v3 n = imp__mesh_load(m->normals, i[0]) * b0 +
                         imp__mesh_load(m->normals, i[1]) * b1 +
                         imp__mesh_load(m->normals, i[2]) * b2;
        const double l = imp__length(n);
        if (l > 1e-6) out->n = n * (1 / l);
    }
    imp__mesh_uv(m, hit, out->uv);
}

/* The first of n triangles after which c exceeds x, or the last. Without branches: each would be a
 * coin toss. */
static inline size_t imp__cumulative_find(const double *c, size_t n, double x)
{
    size_t lo = 0;
    while (n > 1) {
        const size_t half = n / 2;
        lo += (size_t) !(c[lo + half] > x) * half;
        n -= half;
    }
    return lo;
}

/* A triangle by its area; *within: where u lies in its part of all, on [0, 1). */
static inline size_t imp__mesh_triangle_draw(const struct imp_shape *s,
                                             const struct imp__mesh *m, double u,
                                             double *within)
{
    /* The first triangle whose cumulative area exceeds x: those without area never are. */
    const double x = u * s->area, *c = m->cumulative;
    size_t lo;
    if (m->last == 1) { /* by masks, since a branch would be a coin toss here, too */
        const imp_pair_mask first = imp__pair_exceeds(c[1], x);
        const imp_pair part = imp__pair_choose(first, (imp_pair){x, c[1]},
                                               (imp_pair){x - c[1], c[2] - c[1]});
        lo = 1 + (size_t)first[0];
        *within = part[0] / part[1];
    } else {
        lo = imp__cumulative_find(c, m->last + 1, x);
        *within = (x - c[lo]) / (c[lo + 1] - c[lo]);
    }
    *within = imp_min(imp_max(*within, 0.0), 0x1.fffffffffffffp-1);
    return lo;
}

/* dp_du and dp_dv, from uv where they say something. */
static inline void imp__mesh_slopes(const struct imp__mesh *m, const uint32_t *i,
                                    const struct imp__mesh_corner *e,
                                    struct imp_surface *out)
{
    out->dp_du = m->reversed ? e->e2 : e->e1;
    out->dp_dv = m->reversed ? e->e1 : e->e2;
    if (!m->uvs) return;
    const float *t0 = m->uvs + 2 * (size_t)i[0], *t1 = m->uvs + 2 * (size_t)i[1],
                *t2 = m->uvs + 2 * (size_t)i[2];
    const double u1 = (double)t1[0] - t0[0], v1 = (double)t1[1] - t0[1];
    const double u2 = (double)t2[0] - t0[0], v2 = (double)t2[1] - t0[1];
    const double det = u1 * v2 - v1 * u2;
    /* Solve e_k = u_k dp_du + v_k dp_dv unless the uv triangle is a sliver. */
    if (fabs(det) > 1e-12 * ((u1 * u1 + v1 * v1) + (u2 * u2 + v2 * v2))) {
        out->dp_du = (e->e1 * v2 - e->e2 * v1) * (1 / det);
        out->dp_dv = (e->e2 * u1 - e->e1 * u2) * (1 / det);
    }
}

/* 0 0 1 without area. Kept, they would be 24 bytes a triangle, from memory. */
static inline imp_v3 imp__mesh_face_normal(const struct imp__mesh_corner *e)
{
    const imp_v3 c = imp__cross(e->e1, e->e2);
    const double length = imp__length(c);
    return length > 0 ? c * (1 / length) : imp__v3(0, 0, 1);
}

/* Without facets. */
static inline void imp__mesh_from_arrays(const struct imp__mesh *m,
                                         const struct imp_hit *hit,
                                         struct imp_surface *out)
{
    const size_t prim = (size_t)hit->prim;
    const struct imp__mesh_corner c = imp__mesh_corner(m, prim);
    imp__mesh_point(m, hit, &c, imp__mesh_face_normal(&c), out);
    imp__mesh_slopes(m, m->indices + 3 * prim, &c, out);
    if (m->face_tangents) {
        const double *tangent = m->face_tangents + 3 * prim;
        out->s = imp__v3(tangent[0], tangent[1], tangent[2]);
        out->t = imp__cross(out->n, out->s);
    } else {
        imp__surface_frame(out);
    }
}

#endif

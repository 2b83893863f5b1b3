/* SPDX-License-Identifier: Apache-2.0
 *
 * Triangle meshes in lanes: hits of a mesh, and points of a light that is one. */
#include "math/warp.h"
#include "mesh_triangle.h"
#include "shape_lanes.h"

/* ---- Loads ------------------------------------------------------------------------------- */

/* A vector of the facets of triangles prim[k]. */
#define FACETS(m, prim, member)                                                          \
    ({                                                                                   \
        imp_wide3 v_;                                                                    \
        for (int k = 0; k < IMP_WIDE_LANES; k++)                                         \
            imp__wide3_set(&v_, k, (m)->facets[(prim)[k]].member);                       \
        v_;                                                                              \
    })
/* A vector of the arrays of a vertex of each. */
static inline imp_wide3 vertices(const struct imp__mesh *m, const float *array,
                                 const int32_t prim[], int corner)
{
    imp_wide3 v;
    for (int k = 0; k < IMP_WIDE_LANES; k++)
        imp__wide3_set(
            &v, k,
            imp__mesh_load(array, m->indices[3 * (size_t)prim[k] + (size_t)corner]));
    return v;
}

/* ---- Hits -------------------------------------------------------------------------------- */

/* Shading normals at barycentric weights b1, b2, beside the geometric ones. */
static inline imp_wide3 normals_at(const struct imp__mesh *m, const int32_t prim[],
                                   imp_wide b1, imp_wide b2, imp_wide3 ng)
{
    if (!m->normals) return ng;
    const imp_wide b0 = 1 - b1 - b2;
    const imp_wide3 n0 = imp__wide3_times(vertices(m, m->normals, prim, 0), b0),
                    n1 = imp__wide3_times(vertices(m, m->normals, prim, 1), b1),
                    n2 = imp__wide3_times(vertices(m, m->normals, prim, 2), b2);
    const imp_wide3 n = imp__wide3_plus(imp__wide3_plus(n0, n1), n2);
    const imp_wide l = imp__wide3_norm(n);
    return imp__wide3_choose(l > imp__wide(1e-6), imp__wide3_times(n, 1 / l), ng);
}
static inline imp_wide3 point_at(imp_wide3 p0, imp_wide3 e1, imp_wide3 e2, imp_wide b1,
                                 imp_wide b2)
{
    return imp__wide3_plus(imp__wide3_plus(p0, imp__wide3_times(e1, b1)),
                           imp__wide3_times(e2, b2));
}

static void uv_at(const struct imp_shape *s, const int32_t prim[], imp_wide b1,
                  imp_wide b2, imp_wide uv[2])
{
    const struct imp__mesh *m = s->self;
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        const struct imp_hit hit = {.prim = prim[k], .u = b1[k], .v = b2[k]};
        double own[2];
        imp__mesh_uv(m, &hit, own);
        uv[0][k] = own[0];
        uv[1][k] = own[1];
    }
}

static void surfaces(const struct imp_shape *s, const struct imp_wide_hits *h, bool uv,
                     struct imp_wide_surface *out)
{
    const struct imp__mesh *m = s->self;
    const imp_wide b1 = imp__wide_taken(h->u, h->at), b2 = imp__wide_taken(h->v, h->at);
    int32_t prim[IMP_WIDE_LANES];
    for (int k = 0; k < IMP_WIDE_LANES; k++) prim[k] = h->prim[h->at[k]];
    if (uv) uv_at(s, prim, b1, b2, out->uv);
    if (m->facets) {
        out->p = point_at(FACETS(m, prim, p0), FACETS(m, prim, e1), FACETS(m, prim, e2),
                          b1, b2);
        out->ng = FACETS(m, prim, ng);
        out->frame.n = normals_at(m, prim, b1, b2, out->ng);
        if (m->face_tangents) {
            out->frame.s = FACETS(m, prim, s);
            out->frame.t = FACETS(m, prim, t);
        } else {
            imp__wide_surface_frame(&out->frame, FACETS(m, prim, dp_du));
        }
        return;
    }
    const imp_wide3 p0 = vertices(m, m->positions, prim, 0),
                    e1 = imp__wide3_minus(vertices(m, m->positions, prim, 1), p0),
                    e2 = imp__wide3_minus(vertices(m, m->positions, prim, 2), p0);
    const imp_wide3 c = imp__wide3_outer(e1, e2);
    const imp_wide length = imp__wide3_norm(c);
    out->p = point_at(p0, e1, e2, b1, b2);
    out->ng = imp__wide3_choose(length > imp__wide(0), imp__wide3_times(c, 1 / length),
                                imp__wide3_of(imp__v3(0, 0, 1)));
    out->frame.n = normals_at(m, prim, b1, b2, out->ng);
    imp__wide_surface_frame(&out->frame, m->reversed ? e2 : e1);
}

/* ---- Points of lights -------------------------------------------------------------------- */

/* A triangle of each lane, by area, and where u lies in its part (imp__mesh_triangle_draw). */
static inline imp_wide draw(const struct imp_shape *s, imp_wide u, int32_t prim[])
{
    const struct imp__mesh *m = s->self;
    imp_wide within;
    if (m->last == 1) {
        const double *c = m->cumulative;
        const imp_wide x = u * s->area;
        const imp_wide_truth first = imp__wide(c[1]) > x;
        for (int k = 0; k < IMP_WIDE_LANES; k++) prim[k] = 1 + (int32_t)first[k];
        within = imp__wide_choose(first, x, x - c[1]) /
                 imp__wide_choose(first, imp__wide(c[1]), imp__wide(c[2] - c[1]));
        return imp__wide_lesser(imp__wide_larger(within, imp__wide(0)),
                                imp__wide(0x1.fffffffffffffp-1));
    }
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        double own;
        prim[k] = (int32_t)imp__mesh_triangle_draw(s, m, u[k], &own);
        within[k] = own;
    }
    return within;
}

/* Its point, by the weights of the triangle's second and third vertex. */
static inline void draw_at(const struct imp_shape *s, const imp_wide u[2], int32_t prim[],
                           imp_wide *b1, imp_wide *b2)
{
    const imp_wide within = draw(s, u[0], prim);
    const imp_wide half =
        0.5 * imp__wide_lesser(within, u[1]); /* imp__uniform_triangle */
    *b1 = within - half;
    *b2 = u[1] - half;
}

static void sample_area(const struct imp_shape *s, const imp_wide u[2],
                        struct imp_wide_emission *out)
{
    const struct imp__mesh *m = s->self;
    int32_t *prim = out->prim;
    imp_wide b1, b2;
    draw_at(s, u, prim, &b1, &b2);
    out->p =
        point_at(FACETS(m, prim, p0), FACETS(m, prim, e1), FACETS(m, prim, e2), b1, b2);
    out->ng = FACETS(m, prim, ng);
    out->n = normals_at(m, prim, b1, b2, out->ng);
    out->located[0] = b1;
    out->located[1] = b2;
    uv_at(s, prim, b1, b2, out->uv);
}

static void sample_toward(const struct imp_shape *s, const imp_wide3 *ref,
                          const imp_wide u[2], struct imp_wide_light *out)
{
    const struct imp__mesh *m = s->self;
    int32_t prim[IMP_WIDE_LANES];
    imp_wide b1, b2;
    draw_at(s, u, prim, &b1, &b2);
    const imp_wide3 ng = FACETS(m, prim, ng);
    const imp_wide3 p =
        point_at(FACETS(m, prim, p0), FACETS(m, prim, e1), FACETS(m, prim, e2), b1, b2);
    imp__lights_from_area(*ref, p, ng, normals_at(m, prim, b1, b2, ng),
                          imp__wide(m->inv_area), out);
    if (!out->recorded) return;
    for (int k = 0; k < IMP_WIDE_LANES; k++) out->prim[k] = prim[k];
    out->located[0] = b1;
    out->located[1] = b2;
    uv_at(s, prim, b1, b2, out->uv);
}

/* Meshes of few triangles. */
static bool lights(const struct imp_shape *s)
{
    return ((const struct imp__mesh *)s->self)->facets != NULL;
}

const struct imp_shape_lanes imp__mesh_lanes = {.surface = surfaces,
                                                .sample_toward = sample_toward,
                                                .lights = lights,
                                                .sample_area = sample_area};

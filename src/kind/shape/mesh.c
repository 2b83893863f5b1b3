/* SPDX-License-Identifier: Apache-2.0
 *
 * Triangle meshes, from files (`obj`, `ply`) or from calls (`mesh`), in world space after
 * build. A mirroring to_world or flip_normals reverses the winding, so that geometric and
 * shading normals agree (docs/scene-format.md 4.3, as Mitsuba 3.10). */
#include "math/warp.h"
#include "shape.h"
#include <string.h>

/* Embree takes larger coordinates for invalid. */
#define COORDINATE_MAX 1e18

/* Number `index` of an array of triples that goes on for PADDING floats: one load. */
#define PADDING 4
static inline imp_v3 load3(const float *array, uint32_t index)
{
    imp_float4 p;
    memcpy(&p, array + 3 * (size_t)index, sizeof p);
    imp_v3 v = imp__widen(p);
    v[3] = 0;
    return v;
}

static enum imp_status positions_place(const struct imp_build *b, struct imp_shape *s,
                                       const struct imp_mesh_data *data,
                                       const struct imp_placement *at, float *out)
{
    s->lo = imp__v3(INFINITY, INFINITY, INFINITY);
    s->hi = -s->lo;
    for (size_t k = 0; k < data->n_vertices; k++) {
        const float *q = data->positions + 3 * k;
        const imp_v3 p = imp__point(&at->to_world, imp__v3(q[0], q[1], q[2]));
        for (int i = 0; i < 3; i++) {
            if (!(fabs(p[i]) < COORDINATE_MAX))
                return imp_build_error(b, NULL, IMP_E_SCENE,
                                       "vertex %zu is not finite, or further out than %g",
                                       k, COORDINATE_MAX);
            const float x = (float)p[i];
            out[3 * k + i] = x;
            s->lo[i] = fmin(s->lo[i], x);
            s->hi[i] = fmax(s->hi[i], x);
        }
    }
    s->lo[3] = s->hi[3] = 0;
    return IMP_OK;
}

static enum imp_status normals_place(const struct imp_build *b, const struct imp_shape *s,
                                     const struct imp_mesh_data *data,
                                     const struct imp_placement *at, float *out)
{
    for (size_t k = 0; k < data->n_vertices; k++) {
        const float *q = data->normals + 3 * k;
        imp_v3 n = imp__normal(&at->to_local, imp__v3(q[0], q[1], q[2]));
        const double length = imp__length(n);
        if (!isfinite(length))
            return imp_build_error(b, NULL, IMP_E_SCENE,
                                   "the normal of vertex %zu is not finite", k);
        if (length > 0) n = n * ((s->flip_normals ? -1 : 1) / length);
        for (int i = 0; i < 3; i++) out[3 * k + i] = (float)n[i];
    }
    return IMP_OK;
}

static enum imp_status data_check(const struct imp_build *b,
                                  const struct imp_mesh_data *data)
{
    if (data->n_triangles == 0 || data->n_vertices == 0)
        return imp_build_error(b, NULL, IMP_E_SCENE, "it has no triangles");
    if (data->n_triangles > INT32_MAX || data->n_vertices > INT32_MAX)
        return imp_build_error(b, NULL, IMP_E_SCENE,
                               "it has more than 2^31 triangles or vertices");
    for (size_t k = 0; k < 3 * data->n_triangles; k++)
        if (data->indices[k] >= data->n_vertices)
            return imp_build_error(b, NULL, IMP_E_SCENE,
                                   "triangle %zu names vertex %u; there are %zu", k / 3,
                                   data->indices[k], data->n_vertices);
    for (size_t k = 0; data->uvs && k < 2 * data->n_vertices; k++)
        if (!isfinite(data->uvs[k]))
            return imp_build_error(b, NULL, IMP_E_SCENE,
                                   "the uv of vertex %zu is not finite", k / 2);
    return IMP_OK;
}

static enum imp_status areas_sum(const struct imp_build *b, struct imp__mesh *m,
                                 struct imp_shape *s, size_t n)
{
    m->cumulative = imp__arena_take(b->arena, n + 1, sizeof *m->cumulative);
    double *normals = imp__arena_take(b->arena, 3 * n, sizeof *normals);
    m->face_normals = normals;
    if (!m->cumulative || !normals)
        return imp_build_error(b, NULL, IMP_E_NOMEM, "out of memory");
    const imp_v3 centre = (s->lo + s->hi) * 0.5;
    double sum = 0, volume = 0;
    m->cumulative[0] = 0;
    for (size_t k = 0; k < n; k++) {
        const uint32_t *i = m->indices + 3 * k;
        const imp_v3 p = load3(m->positions, i[0]);
        const imp_v3 c =
            imp__cross(load3(m->positions, i[1]) - p, load3(m->positions, i[2]) - p);
        const double before = sum, length = imp__length(c);
        const imp_v3 ng = length > 0 ? c * (1 / length) : imp__v3(0, 0, 1);
        for (int j = 0; j < 3; j++) normals[3 * k + (size_t)j] = ng[j];
        sum += length / 2;
        volume += imp__dot(p - centre, c) / 6;
        if (sum > before) m->last = k;
        m->cumulative[k + 1] = sum;
    }
    if (!isfinite(sum))
        return imp_build_error(b, NULL, IMP_E_SCENE, "its area is not finite");
    s->area = sum;
    s->triangles.volume = volume;
    m->inv_area = sum > 0 ? 1 / sum : 0;
    return IMP_OK;
}

/* Do all vertex normals say what the faces say? Then they are not worth looking up. */
static bool is_flat(const struct imp__mesh *m, const float *normals, size_t n)
{
    for (size_t k = 0; k < 3 * n; k++) {
        const double *ng = m->face_normals + k / 3 * 3;
        const imp_v3 d = load3(normals, m->indices[k]) - imp__v3(ng[0], ng[1], ng[2]);
        if (!(imp__dot(d, d) < 1e-13)) return false;
    }
    return true;
}

/* First vertex of a triangle and its edges from there. */
struct corner {
    imp_v3 p0, e1, e2;
};
static inline struct corner corner(const struct imp__mesh *m, size_t prim)
{
    const uint32_t *i = m->indices + 3 * prim;
    const imp_v3 p0 = load3(m->positions, i[0]);
    return (struct corner){p0, load3(m->positions, i[1]) - p0,
                           load3(m->positions, i[2]) - p0};
}

/* Position, normals and uv: all that a light sample needs. */
static inline void point(const struct imp__mesh *m, const struct imp_hit *hit,
                         const struct corner *c, imp_v3 ng, struct imp_surface *out)
{
    const double b1 = hit->u, b2 = hit->v, b0 = 1 - b1 - b2;
    out->p = c->p0 + c->e1 * b1 + c->e2 * b2;
    out->ng = ng;
    out->n = ng;
    if (m->normals) {
        const uint32_t *i = m->indices + 3 * (size_t)hit->prim;
        const imp_v3 n = load3(m->normals, i[0]) * b0 + load3(m->normals, i[1]) * b1 +
                         load3(m->normals, i[2]) * b2;
        const double l = imp__length(n);
        if (l > 1e-6) out->n = n * (1 / l);
    }
    /* Without uv they are the weights of the file's second and third vertex. */
    out->uv[0] = m->reversed ? b2 : b1;
    out->uv[1] = m->reversed ? b1 : b2;
    if (m->uvs) {
        const uint32_t *i = m->indices + 3 * (size_t)hit->prim;
        const float *t0 = m->uvs + 2 * (size_t)i[0], *t1 = m->uvs + 2 * (size_t)i[1],
                    *t2 = m->uvs + 2 * (size_t)i[2];
        for (int k = 0; k < 2; k++)
            out->uv[k] =
                t0[k] + b1 * ((double)t1[k] - t0[k]) + b2 * ((double)t2[k] - t0[k]);
    }
}

/* dp_du and dp_dv, from uv where they say something. */
static inline void slopes(const struct imp__mesh *m, const uint32_t *i,
                          const struct corner *e, struct imp_surface *out)
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

static inline imp_v3 face_normal(const struct imp__mesh *m, size_t prim)
{
    const double *ng = m->face_normals + 3 * prim;
    return imp__v3(ng[0], ng[1], ng[2]);
}

/* Without facets. */
static void surface_from_arrays(const struct imp__mesh *m, const struct imp_hit *hit,
                                struct imp_surface *out)
{
    const size_t prim = (size_t)hit->prim;
    const struct corner c = corner(m, prim);
    point(m, hit, &c, face_normal(m, prim), out);
    slopes(m, m->indices + 3 * prim, &c, out);
    if (m->face_tangents) {
        const double *tangent = m->face_tangents + 3 * prim;
        out->s = imp__v3(tangent[0], tangent[1], tangent[2]);
        out->t = imp__cross(out->n, out->s);
    } else {
        imp__surface_frame(out);
    }
}

void imp__mesh_surface(const struct imp_shape *s, const struct imp_hit *hit,
                       const imp_v3 *o, const imp_v3 *d, struct imp_surface *out)
{
    (void)o, (void)d;
    const struct imp__mesh *m = s->self;
    if (imp_unlikely(!m->facets)) {
        surface_from_arrays(m, hit, out);
        return;
    }
    const struct imp__facet *f = &m->facets[hit->prim];
    point(m, hit, &(struct corner){f->p0, f->e1, f->e2}, f->ng, out);
    out->dp_du = f->dp_du;
    out->dp_dv = f->dp_dv;
    if (m->face_tangents) {
        out->s = f->s;
        out->t = f->t;
    } else {
        imp__surface_frame(out);
    }
}

/* Frames of a mesh whose normals are its faces': made once. */
static enum imp_status tangents_make(const struct imp_build *b, struct imp__mesh *m,
                                     size_t n)
{
    double *tangents = imp__arena_take(b->arena, 3 * n, sizeof *tangents);
    if (!tangents) return imp_build_error(b, NULL, IMP_E_NOMEM, "out of memory");
    for (size_t k = 0; k < n; k++) {
        const struct imp_hit hit = {.prim = (int)k};
        const struct corner c = corner(m, k);
        struct imp_surface at;
        point(m, &hit, &c, face_normal(m, k), &at);
        slopes(m, m->indices + 3 * k, &c, &at);
        imp__surface_frame(&at);
        for (int j = 0; j < 3; j++) tangents[3 * k + (size_t)j] = at.s[j];
    }
    m->face_tangents = tangents;
    return IMP_OK;
}

static enum imp_status facets_make(const struct imp_build *b, struct imp__mesh *m,
                                   size_t n)
{
    struct imp__facet *facets = imp__arena_take(b->arena, n, sizeof *facets);
    if (!facets) return imp_build_error(b, NULL, IMP_E_NOMEM, "out of memory");
    for (size_t k = 0; k < n; k++) {
        const struct imp_hit hit = {.prim = (int)k};
        const struct corner c = corner(m, k);
        struct imp_surface at;
        surface_from_arrays(m, &hit, &at);
        facets[k] =
            (struct imp__facet){c.p0, c.e1, c.e2, at.ng, at.dp_du, at.dp_dv, at.s, at.t};
    }
    m->facets = facets;
    return IMP_OK;
}

enum imp_status imp__mesh_build(const struct imp_build *b, void *self,
                                struct imp_shape *s, const struct imp_mesh_data *data,
                                bool face_normals)
{
    enum imp_status st = IMP_OK;
    struct imp__mesh *m = self;
    struct imp_placement at;

    IMP_TRY(imp__shape_placement(b, s, &at));
    IMP_TRY(data_check(b, data));
    const size_t n = data->n_vertices;
    float *positions = imp_build_alloc(b, 3 * n + PADDING, sizeof *positions);
    float *normals =
        face_normals ? NULL : imp_build_alloc(b, 3 * n + PADDING, sizeof *normals);
    if (!positions || (!normals && !face_normals))
        IMP_TRY(imp_build_error(b, NULL, IMP_E_NOMEM, "out of memory"));
    IMP_TRY(positions_place(b, s, data, &at, positions));
    m->positions = positions;
    m->uvs = data->uvs;
    m->indices = data->indices;
    m->reversed = at.mirrored != s->flip_normals;
    if (m->reversed) {
        uint32_t *indices =
            imp__arena_take(b->arena, 3 * data->n_triangles, sizeof *indices);
        if (!indices) IMP_TRY(imp_build_error(b, NULL, IMP_E_NOMEM, "out of memory"));
        for (size_t k = 0; k < data->n_triangles; k++) {
            indices[3 * k] = data->indices[3 * k];
            indices[3 * k + 1] = data->indices[3 * k + 2];
            indices[3 * k + 2] = data->indices[3 * k + 1];
        }
        m->indices = indices;
    }
    if (normals && data->normals) IMP_TRY(normals_place(b, s, data, &at, normals));
    else if (normals)
        IMP_TRY(imp__mesh_normals(b->ctx, n, data->n_triangles, m->positions, m->indices,
                                  normals));
    IMP_TRY(areas_sum(b, m, s, data->n_triangles));
    m->normals = normals && !is_flat(m, normals, data->n_triangles) ? normals : NULL;
    if (!m->normals) IMP_TRY(tangents_make(b, m, data->n_triangles));
    if (data->n_triangles <= IMP_FACETS_MAX)
        IMP_TRY(facets_make(b, m, data->n_triangles));
    s->geometry = IMP_TRIANGLES;
    s->smooth = m->normals != NULL;
    s->triangles.n_vertices = n;
    s->triangles.n_triangles = data->n_triangles;
    s->triangles.positions = m->positions;
    s->triangles.indices = m->indices;
out:
    return st;
}

/* A triangle by its area, and barycentric weights in it. */
static inline struct imp_hit draw(const struct imp_shape *s, const struct imp__mesh *m,
                                  const double u[2])
{
    /* The first triangle whose cumulative area exceeds x: those without area never are.
     * Without branches: each would be a coin toss. */
    const double x = u[0] * s->area;
    size_t lo = 0;
    for (size_t n = m->last + 1; n > 1;) {
        const size_t half = n / 2;
        lo += (size_t) !(m->cumulative[lo + half] > x) * half;
        n -= half;
    }
    const double below = m->cumulative[lo], width = m->cumulative[lo + 1] - below;
    const double within =
        imp_min(imp_max((x - below) / width, 0.0), 0x1.fffffffffffffp-1);
    double b[2];
    imp__uniform_triangle((double[2]){within, u[1]}, b);
    return (struct imp_hit){.prim = (int)lo, .u = b[0], .v = b[1]};
}

bool imp__mesh_sample(const struct imp_shape *s, const imp_v3 *ref, const double u[2],
                      struct imp_light_sample *out)
{
    const struct imp__mesh *m = s->self;
    if (!(s->area > 0)) return false;
    const struct imp_hit hit = draw(s, m, u);
    const size_t lo = (size_t)hit.prim;
    const struct imp__facet *f = m->facets ? &m->facets[lo] : NULL;
    const struct corner c = f ? (struct corner){f->p0, f->e1, f->e2} : corner(m, lo);
    struct imp_surface at;
    point(m, &hit, &c, f ? f->ng : face_normal(m, lo), &at);
    out->uv[0] = at.uv[0];
    out->uv[1] = at.uv[1];
    return imp__light_from_area(*ref, at.p, at.ng, at.n, m->inv_area, out);
}

void imp__mesh_sample_area(const struct imp_shape *s, const double u[2],
                           struct imp_surface *out)
{
    const struct imp_hit hit = draw(s, s->self, u);
    imp__mesh_surface(s, &hit, NULL, NULL, out);
}

double imp__mesh_pdf(const struct imp_shape *s, const imp_v3 *ref,
                     const struct imp_hit *hit, const struct imp_surface *at)
{
    (void)hit;
    const struct imp__mesh *m = s->self;
    return imp__area_to_angle(*ref, at->p, at->ng, m->inv_area);
}

static enum imp_status mesh_build(const struct imp_build *b, void *self,
                                  struct imp_shape *s)
{
    bool face_normals;
    const enum imp_status st = imp_build_bool(b, "face_normals", false, &face_normals);
    if (st != IMP_OK) return st;
    if (!b->node->mesh)
        return imp_build_error(b, NULL, IMP_E_SCENE, "no triangles were given to it");
    return imp__mesh_build(b, self, s, b->node->mesh, face_normals);
}

/* The file has been read by now; its properties are only marked as known. */
static enum imp_status file_build(const struct imp_build *b, void *self,
                                  struct imp_shape *s)
{
    const char *filename;
    bool flip;
    enum imp_status st = imp_build_string(b, "filename", NULL, &filename);
    if (st == IMP_OK) st = imp_build_bool(b, "flip_tex_coords", false, &flip);
    if (st != IMP_OK) return st;
    return mesh_build(b, self, s);
}

const struct imp_shape_ops imp__mesh = {.size = sizeof(struct imp_shape_ops),
                                        .name = "mesh",
                                        .object_size = sizeof(struct imp__mesh),
                                        .build = mesh_build,
                                        .surface = imp__mesh_surface,
                                        .sample_toward = imp__mesh_sample,
                                        .pdf_toward = imp__mesh_pdf,
                                        .sample_area = imp__mesh_sample_area};
const struct imp_shape_ops imp__obj = {.size = sizeof(struct imp_shape_ops),
                                       .name = "obj",
                                       .object_size = sizeof(struct imp__mesh),
                                       .build = file_build,
                                       .surface = imp__mesh_surface,
                                       .sample_toward = imp__mesh_sample,
                                       .pdf_toward = imp__mesh_pdf,
                                       .sample_area = imp__mesh_sample_area};
const struct imp_shape_ops imp__ply = {.size = sizeof(struct imp_shape_ops),
                                       .name = "ply",
                                       .object_size = sizeof(struct imp__mesh),
                                       .build = file_build,
                                       .surface = imp__mesh_surface,
                                       .sample_toward = imp__mesh_sample,
                                       .pdf_toward = imp__mesh_pdf,
                                       .sample_area = imp__mesh_sample_area};

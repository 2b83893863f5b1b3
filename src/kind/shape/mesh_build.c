/* SPDX-License-Identifier: Apache-2.0
 *
 * Triangle meshes are made: arrays placed in the world, volume, areas where points are drawn,
 * and what a hit would otherwise compute again. */
#include "base/pool.h"
#include "mesh_triangle.h"
#include "shape.h"

/* Embree takes larger coordinates for invalid. */
#define COORDINATE_MAX 1e18

#define LEAST 32768 /* vertices that are worth a thread */

/* Shared by all threads: each places a range; the boxes of ranges make up the shape's. */
struct placing {
    const struct imp_build *b;
    const struct imp_mesh_data *data;
    const struct imp_placement *at;
    pthread_mutex_t lock; /* of s->lo and s->hi */
    struct imp_shape *s;
    float *out;
};

static enum imp_status range_place(size_t first, size_t end, void *payload)
{
    struct placing *place = payload;
    imp_v3 lo = imp__v3(INFINITY, INFINITY, INFINITY), hi = -lo;
    for (size_t k = first; k < end; k++) {
        const float *q = place->data->positions + 3 * k;
        const imp_v3 p = imp__point(&place->at->to_world, imp__v3(q[0], q[1], q[2]));
        for (int i = 0; i < 3; i++) {
            if (!(fabs(p[i]) < COORDINATE_MAX))
                return imp_build_error(place->b, NULL, IMP_E_SCENE,
                                       "vertex %zu is not finite, or further out than %g",
                                       k, COORDINATE_MAX);
            const float x = (float)p[i];
            place->out[3 * k + (size_t)i] = x;
            lo[i] = imp_min(lo[i], x);
            hi[i] = imp_max(hi[i], x);
        }
    }
    pthread_mutex_lock(&place->lock);
    for (int i = 0; i < 3; i++) {
        place->s->lo[i] = imp_min(lo[i], place->s->lo[i]);
        place->s->hi[i] = imp_max(hi[i], place->s->hi[i]);
    }
    pthread_mutex_unlock(&place->lock);
    return IMP_OK;
}

static enum imp_status positions_place(const struct imp_build *b, struct imp_shape *s,
                                       const struct imp_mesh_data *data,
                                       const struct imp_placement *at, float *out)
{
    struct placing place = {b, data, at, PTHREAD_MUTEX_INITIALIZER, s, out};
    s->lo = imp__v3(INFINITY, INFINITY, INFINITY);
    s->hi = -s->lo;
    const enum imp_status st =
        imp__parallel_ranges(b->ctx, data->n_vertices, LEAST, range_place, &place);
    s->lo[3] = s->hi[3] = 0;
    return st;
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

struct checking {
    const struct imp_build *b;
    const struct imp_mesh_data *data;
};
static enum imp_status corners_check(size_t first, size_t end, void *payload)
{
    const struct checking *x = payload;
    uint32_t most = 0;
    for (size_t k = first; k < end; k++) most = imp_max(most, x->data->indices[k]);
    if (most < x->data->n_vertices) return IMP_OK;
    for (size_t k = first; k < end; k++)
        if (x->data->indices[k] >= x->data->n_vertices)
            return imp_build_error(x->b, NULL, IMP_E_SCENE,
                                   "triangle %zu names vertex %u; there are %zu", k / 3,
                                   x->data->indices[k], x->data->n_vertices);
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
    struct checking x = {b, data};
    const enum imp_status st =
        imp__parallel_ranges(b->ctx, 3 * data->n_triangles, LEAST, corners_check, &x);
    if (st != IMP_OK) return st;
    for (size_t k = 0; data->uvs && k < 2 * data->n_vertices; k++)
        if (!isfinite(data->uvs[k]))
            return imp_build_error(b, NULL, IMP_E_SCENE,
                                   "the uv of vertex %zu is not finite", k / 2);
    return IMP_OK;
}

/* Blocks of triangles: their volumes add up in one order, whoever computed them. */
#define BLOCK 4096
struct measuring {
    const struct imp__mesh *m;
    imp_v3 centre;
    size_t n;       /* triangles */
    double *volume; /* [n / BLOCK + 1], of cones from the centre */
};

static enum imp_status blocks_measure(size_t first, size_t end, void *payload)
{
    const struct measuring *x = payload;
    for (size_t block = first; block < end; block++) {
        double volume = 0;
        for (size_t k = block * BLOCK; k < imp_min((block + 1) * BLOCK, x->n); k++) {
            const struct imp__mesh_corner e = imp__mesh_corner(x->m, k);
            volume += imp__dot(e.p0 - x->centre, imp__cross(e.e1, e.e2)) / 6;
        }
        x->volume[block] = volume;
    }
    return IMP_OK;
}

static enum imp_status volume_sum(const struct imp_build *b, const struct imp__mesh *m,
                                  struct imp_shape *s, size_t n)
{
    const size_t blocks = n / BLOCK + (n % BLOCK != 0);
    struct measuring x = {m, (s->lo + s->hi) * 0.5, n,
                          imp__alloc_raw(b->ctx, blocks, sizeof *x.volume)};
    if (!x.volume) return imp_build_error(b, NULL, IMP_E_NOMEM, "out of memory");
    const enum imp_status st =
        imp__parallel_ranges(b->ctx, blocks, LEAST / BLOCK, blocks_measure, &x);
    s->triangles.volume = 0;
    for (size_t k = 0; k < blocks; k++) s->triangles.volume += x.volume[k];
    imp__release(b->ctx, x.volume);
    return st;
}

/* Into m->cumulative, one place behind. */
static enum imp_status areas_find(size_t first, size_t end, void *payload)
{
    const struct imp__mesh *m = payload;
    for (size_t k = first; k < end; k++) {
        const struct imp__mesh_corner e = imp__mesh_corner(m, k);
        m->cumulative[k + 1] = imp__length(imp__cross(e.e1, e.e2)) / 2;
    }
    return IMP_OK;
}

enum imp_status imp__shape_measure(imp_context *ctx, struct imp_arena *arena,
                                   struct imp_shape *s)
{
    struct imp__mesh *m = s->self;
    const size_t n = s->triangles.n_triangles;
    if (s->ops->surface != imp__mesh_surface || m->cumulative) return IMP_OK;
    m->cumulative = imp__arena_take(arena, n + 1, sizeof *m->cumulative);
    if (!m->cumulative)
        return imp__error(ctx, IMP_E_NOMEM, "%s: out of memory for areas", s->name);
    const enum imp_status st = imp__parallel_ranges(ctx, n, LEAST, areas_find, m);
    if (st != IMP_OK) return st;
    double sum = 0;
    m->cumulative[0] = 0;
    for (size_t k = 0; k < n; k++) {
        const double before = sum;
        sum += m->cumulative[k + 1];
        if (sum > before) m->last = k;
        m->cumulative[k + 1] = sum;
    }
    s->area = sum;
    m->inv_area = sum > 0 ? 1 / sum : 0;
    return IMP_OK;
}

/* Are all vertex normals equal to those of the faces? Then they need no lookup. */
static bool is_flat(const struct imp__mesh *m, const float *normals, size_t n)
{
    for (size_t k = 0; k < n; k++) {
        const struct imp__mesh_corner c = imp__mesh_corner(m, k);
        const imp_v3 ng = imp__mesh_face_normal(&c);
        for (size_t j = 3 * k; j < 3 * k + 3; j++) {
            const imp_v3 d = imp__mesh_load(normals, m->indices[j]) - ng;
            if (!(imp__dot(d, d) < 1e-13)) return false;
        }
    }
    return true;
}

/* Frames of a mesh whose normals are its faces'. tangents [3 n]. */
static void tangents_fill(const struct imp__mesh *m, size_t n, double *tangents)
{
    for (size_t k = 0; k < n; k++) {
        const struct imp_hit hit = {.prim = (int)k};
        const struct imp__mesh_corner c = imp__mesh_corner(m, k);
        struct imp_surface at;
        imp__mesh_point(m, &hit, &c, imp__mesh_face_normal(&c), &at);
        imp__mesh_slopes(m, m->indices + 3 * k, &c, &at);
        imp__surface_frame(&at);
        for (int j = 0; j < 3; j++) tangents[3 * k + (size_t)j] = at.s[j];
    }
}
static enum imp_status tangents_make(const struct imp_build *b, struct imp__mesh *m,
                                     size_t n)
{
    double *tangents = imp__arena_take(b->arena, 3 * n, sizeof *tangents);
    if (!tangents) return imp_build_error(b, NULL, IMP_E_NOMEM, "out of memory");
    tangents_fill(m, n, tangents);
    m->face_tangents = tangents;
    return IMP_OK;
}

static void facets_fill(const struct imp__mesh *m, size_t n, struct imp__facet *facets)
{
    for (size_t k = 0; k < n; k++) {
        const struct imp_hit hit = {.prim = (int)k};
        const struct imp__mesh_corner c = imp__mesh_corner(m, k);
        struct imp_surface at;
        imp__mesh_from_arrays(m, &hit, &at);
        facets[k] =
            (struct imp__facet){c.p0, c.e1, c.e2, at.ng, at.dp_du, at.dp_dv, at.s, at.t};
    }
}
static enum imp_status facets_make(const struct imp_build *b, struct imp__mesh *m,
                                   size_t n)
{
    struct imp__facet *facets = imp__arena_take(b->arena, n, sizeof *facets);
    if (!facets) return imp_build_error(b, NULL, IMP_E_NOMEM, "out of memory");
    facets_fill(m, n, facets);
    m->facets = facets;
    return IMP_OK;
}

/* Room for n triples, not zeroed, and for what is loaded with the last of them. */
static float *triples_take(const struct imp_build *b, size_t n)
{
    float *array = imp__arena_take(b->arena, 3 * n + IMP_MESH_PADDING, sizeof *array);
    if (array) memset(array + 3 * n, 0, IMP_MESH_PADDING * sizeof *array);
    return array;
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
    float *positions = triples_take(b, n),
          *normals = face_normals ? NULL : triples_take(b, n);
    if (!positions || (!normals && !face_normals))
        IMP_TRY(imp_build_error(b, NULL, IMP_E_NOMEM, "out of memory"));
    IMP_TRY(positions_place(b, s, data, &at, positions));
    m->positions = positions;
    memcpy(m->to_world, at.to_world.m, sizeof m->to_world);
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
    IMP_TRY(volume_sum(b, m, s, data->n_triangles));
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

/* By an affine map; `back`: its inverse, NULL of one that turns normals as it turns vectors. */
static void arrays_move(struct imp_shape *s, const double to_world[12],
                        const struct imp_map *back)
{
    struct imp__mesh *m = s->self;
    const size_t n = s->triangles.n_vertices;
    /* Arrays that build made: constant but for this. */
    float *positions = (float *)(uintptr_t)m->positions,
          *normals = (float *)(uintptr_t)m->normals;
    s->lo = imp__v3(INFINITY, INFINITY, INFINITY);
    s->hi = -s->lo;
    for (size_t k = 0; k < n; k++) {
        const imp_v3 p =
            imp__rows_point(to_world, imp__mesh_load(m->positions, (uint32_t)k));
        imp_v3 t = p;
        if (normals) {
            const imp_v3 n = imp__mesh_load(m->normals, (uint32_t)k);
            t = back && !imp__is_zero(n) ? imp__normalize(imp__map_normal(back, n))
                                         : imp__rows_vector(to_world, n);
        }
        for (int i = 0; i < 3; i++) {
            positions[3 * k + (size_t)i] = (float)p[i];
            if (normals) normals[3 * k + (size_t)i] = (float)t[i];
            s->lo[i] = imp_min(positions[3 * k + (size_t)i], s->lo[i]);
            s->hi[i] = imp_max(positions[3 * k + (size_t)i], s->hi[i]);
        }
    }
    s->lo[3] = s->hi[3] = 0;
    if (m->face_tangents)
        tangents_fill(m, s->triangles.n_triangles, (double *)(uintptr_t)m->face_tangents);
    if (m->facets)
        facets_fill(m, s->triangles.n_triangles,
                    (struct imp__facet *)(uintptr_t)m->facets);
}

void imp__mesh_move(struct imp_shape *s, const double to_world[12])
{
    arrays_move(s, to_world, NULL);
}

bool imp__mesh_placed(struct imp_shape *s, double to_world[12], bool set)
{
    struct imp__mesh *m = s->self;
    struct imp_map from, by, back;
    if (!set) {
        memcpy(to_world, m->to_world, sizeof m->to_world);
        return true;
    }
    memcpy(by.m, to_world, sizeof by.m);
    memcpy(from.m, m->to_world, sizeof from.m);
    if (!imp__map_inverse(&from, &from)) return false;
    by = imp__map_product(&by, &from);
    if (!imp__map_inverse(&by, &back)) return false;
    arrays_move(s, by.m, &back);
    memcpy(m->to_world, to_world, sizeof m->to_world);
    return true;
}

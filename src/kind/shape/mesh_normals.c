/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertex normals of a mesh that has none: every face's unit normal weighted by its angle
 * at the vertex (Thuermer and Wuethrich 1998). Files split a vertex where its uv differ,
 * so the sum runs over all vertices at one position, not over one index.
 *
 * All threads work, each for a range of vertices, or of slots of the hash table: it looks at
 * everything, in order, and takes what belongs to its range. So the sums do not depend on how
 * many threads there are. */
#include "base/pool.h"
#include "math/trig.h"
#include "shape.h"
#include <stdatomic.h>
#include <string.h>

#define LEAST 32768 /* vertices, or slots, that are worth a thread */

struct normals {
    size_t n_vertices, n_triangles;
    const float *positions;
    const uint32_t *indices;
    uint32_t *place; /* [n_vertices] the first vertex at the same position */
    size_t slots;
    uint32_t *table;   /* [slots] vertex + 1; 0: free */
    _Atomic bool full; /* a part of it, and places are missing */
    double (*sum)[3];  /* [n_vertices] */
    float *out;
};

/* Equal positions are equal bits; +0 and -0 are one place. */
static uint64_t position_hash(const float p[3])
{
    uint64_t h = 0x9e3779b97f4a7c15u;
    for (int i = 0; i < 3; i++) {
        const float x = p[i] + 0.0f;
        uint32_t bits;
        memcpy(&bits, &x, sizeof bits);
        h = (h ^ bits) * 0xff51afd7ed558ccdu;
        h ^= h >> 32;
    }
    return h;
}

/* The slot where v is looked for first. */
#define AHEAD 16 /* vertices for whose slots memory is asked before they are needed */
static inline size_t home(const struct normals *m, size_t v)
{
    return position_hash(m->positions + 3 * v) & (m->slots - 1);
}

/* The place of v by slots [first, end), where k is the first to look at; `used` counts those
 * that are not free. */
static uint32_t place_find(const struct normals *m, size_t v, size_t k, size_t first,
                           size_t end, size_t *used)
{
    const float *p = m->positions + 3 * v;
    for (;; k = k + 1 < end ? k + 1 : first) {
        if (m->table[k] == 0) {
            m->table[k] = (uint32_t)(v + 1);
            ++*used;
            return (uint32_t)v;
        }
        const float *q = m->positions + 3 * (size_t)(m->table[k] - 1);
        if (p[0] == q[0] && p[1] == q[1] && p[2] == q[2]) return m->table[k] - 1;
    }
}

/* Those of the vertices whose hash says a slot from `first` to `end`. A range of all slots is
 * never full; a part of them is if somebody chose the vertices for it. */
static enum imp_status places_find(size_t first, size_t end, void *payload)
{
    struct normals *m = payload;
    size_t used = 0;
    memset(m->table + first, 0, (end - first) * sizeof *m->table);
    for (size_t v = 0; v < m->n_vertices; v++) {
        if (v + AHEAD < m->n_vertices)
            __builtin_prefetch(&m->table[home(m, v + AHEAD)], 1);
        const size_t k = home(m, v);
        if (k < first || k >= end) continue;
        if (used == end - first) {
            atomic_store(&m->full, true);
            return IMP_OK;
        }
        m->place[v] = place_find(m, v, k, first, end, &used);
    }
    return IMP_OK;
}

/* Of the places from `first` to `end`. */
static enum imp_status angles_add(size_t first, size_t end, void *payload)
{
    const struct normals *m = payload;
    memset(m->sum + first, 0, (end - first) * sizeof *m->sum);
    for (size_t k = 0; k < m->n_triangles; k++) {
        const uint32_t *index = m->indices + 3 * k;
        size_t at[3];
        bool own[3];
        for (int i = 0; i < 3; i++) {
            at[i] = m->place[index[i]];
            own[i] = at[i] >= first && at[i] < end;
        }
        if (!own[0] && !own[1] && !own[2]) continue;
        imp_v3 p[3];
        for (int i = 0; i < 3; i++) {
            const float *q = m->positions + 3 * (size_t)index[i];
            p[i] = imp__v3(q[0], q[1], q[2]);
        }
        const imp_v3 normal = imp__cross(p[1] - p[0], p[2] - p[0]);
        const double twice_area = imp__length(normal);
        if (!(twice_area > 0)) continue;
        /* From sine and cosine, which keep the angle exact for slivers, where acos loses
         * it. */
        const imp_v3 e0 = p[1] - p[0], e1 = p[2] - p[1], e2 = p[0] - p[2];
        const imp_v3 cosine = {-imp__dot(e0, e2), -imp__dot(e0, e1), -imp__dot(e1, e2),
                               0};
        const imp_v3 weight =
            imp__angles(cosine, imp__spec(twice_area)) * (1 / twice_area);
        for (int i = 0; i < 3; i++)
            for (int c = 0; own[i] && c < 3; c++)
                m->sum[at[i]][c] += normal[c] * weight[i];
    }
    return IMP_OK;
}

static enum imp_status normals_write(size_t first, size_t end, void *payload)
{
    const struct normals *m = payload;
    for (size_t v = first; v < end; v++) {
        const double *sum = m->sum[m->place[v]];
        const imp_v3 n = imp__v3(sum[0], sum[1], sum[2]);
        const double length = imp__length(n);
        const imp_v3 unit = length > 0 ? n * (1 / length) : imp__v3(1, 0, 0);
        for (int i = 0; i < 3; i++) m->out[3 * v + (size_t)i] = (float)unit[i];
    }
    return IMP_OK;
}

enum imp_status imp__mesh_normals(imp_context *ctx, size_t n_vertices, size_t n_triangles,
                                  const float *positions, const uint32_t *indices,
                                  float *out)
{
    enum imp_status st = IMP_OK;
    struct normals m = {.n_vertices = n_vertices,
                        .n_triangles = n_triangles,
                        .positions = positions,
                        .indices = indices,
                        .slots = 16,
                        .out = out};
    while (m.slots < 2 * n_vertices) m.slots *= 2;
    m.place = imp__alloc_raw(ctx, n_vertices, sizeof *m.place);
    m.table = imp__alloc_raw(ctx, m.slots, sizeof *m.table);
    m.sum = imp__alloc_raw(ctx, n_vertices, sizeof *m.sum);
    if (!m.place || !m.table || !m.sum)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "out of memory for vertex normals"));
    st = imp__parallel_ranges(ctx, m.slots, 2 * LEAST, places_find, &m);
    if (st == IMP_OK && atomic_load(&m.full)) st = places_find(0, m.slots, &m);
    if (st == IMP_OK) st = imp__parallel_ranges(ctx, n_vertices, LEAST, angles_add, &m);
    if (st == IMP_OK)
        st = imp__parallel_ranges(ctx, n_vertices, LEAST, normals_write, &m);
out:
    imp__release(ctx, m.place);
    imp__release(ctx, m.table);
    imp__release(ctx, m.sum);
    return st;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertex normals of a mesh that has none: every face's unit normal weighted by its angle
 * at the vertex (Thuermer and Wuethrich 1998). Files split a vertex where its uv differ,
 * so the sum runs over all vertices at one position, not over one index.
 *
 * All threads work, each for a range of vertices, or of slots of the hash table: it reads
 * everything, in order, and adds what belongs to its range. So the sums do not depend on
 * the number of threads. */
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
    uint32_t *table, vertex; /* [slots]; their bits that name a vertex */
    _Atomic bool full;       /* a part of it, and places are missing */
    double (*sum)[3];        /* [n_vertices] */
    float *out;
};

/* ---- Places -------------------------------------------------------------------------- */

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

/* A slot of the table is 0, or vertex + 1 in its lower bits and in those above, which no vertex
 * needs, bits of its hash: 12 bits for a mesh of a million vertices. So nearly every collision of
 * different vertices is found without their positions, which would come from memory. */
#define AHEAD 16 /* vertices whose slots are prefetched before they are needed */
static inline size_t home(const struct normals *m, uint64_t hash)
{
    return hash & (m->slots - 1);
}

/* The place of v by slots [first, end); `used` counts those that are not free. */
static uint32_t place_find(const struct normals *m, size_t v, uint64_t hash, size_t first,
                           size_t end, size_t *used)
{
    const float *p = m->positions + 3 * v;
    const uint32_t tag = (uint32_t)(hash >> 32) & ~m->vertex;
    for (size_t k = home(m, hash);; k = k + 1 < end ? k + 1 : first) {
        const uint32_t slot = m->table[k];
        if (slot == 0) {
            m->table[k] = tag | (uint32_t)(v + 1);
            ++*used;
            return (uint32_t)v;
        }
        if ((slot & ~m->vertex) != tag) continue;
        const uint32_t at = (slot & m->vertex) - 1;
        const float *q = m->positions + 3 * (size_t)at;
        if (p[0] == q[0] && p[1] == q[1] && p[2] == q[2]) return at;
    }
}

/* Places of the vertices whose hash gives a slot from `first` to `end`. A range of all slots is
 * never full; a part of them is if somebody chose the vertices for it. */
static enum imp_status places_find(size_t first, size_t end, void *payload)
{
    struct normals *m = payload;
    size_t used = 0;
    uint64_t ahead[AHEAD] = {0};
    memset(m->table + first, 0, (end - first) * sizeof *m->table);
    for (size_t i = 0; i < m->n_vertices + AHEAD; i++) {
        const uint64_t hash = ahead[i % AHEAD]; /* of vertex i - AHEAD */
        if (i < m->n_vertices) {
            ahead[i % AHEAD] = position_hash(m->positions + 3 * i);
            __builtin_prefetch(&m->table[home(m, ahead[i % AHEAD])], 1);
        }
        if (i < AHEAD || home(m, hash) < first || home(m, hash) >= end) continue;
        if (used == end - first) {
            atomic_store(&m->full, true);
            return IMP_OK;
        }
        m->place[i - AHEAD] = place_find(m, i - AHEAD, hash, first, end, &used);
    }
    return IMP_OK;
}

/* ---- Sums ---------------------------------------------------------------------------- */

/* A coordinate of four points, and one of four vectors. */
struct four {
    imp_v3 x, y, z;
};
static inline struct four four_minus(const struct four *a, const struct four *b)
{
    return (struct four){a->x - b->x, a->y - b->y, a->z - b->z};
}
static inline imp_v3 four_dot(const struct four *a, const struct four *b)
{
    return (a->x * b->x + a->y * b->y) + a->z * b->z;
}
static inline struct four four_cross(const struct four *a, const struct four *b)
{
    return (struct four){a->y * b->z - a->z * b->y, a->z * b->x - a->x * b->z,
                         a->x * b->y - a->y * b->x};
}
static inline imp_v3 four_root(imp_v3 x)
{
    return (imp_v3){sqrt(x[0]), sqrt(x[1]), sqrt(x[2]), sqrt(x[3])};
}
static inline struct four four_load(const float *positions, const uint32_t *index)
{
    const float *a = positions + 3 * (size_t)index[0],
                *b = positions + 3 * (size_t)index[3],
                *c = positions + 3 * (size_t)index[6],
                *d = positions + 3 * (size_t)index[9];
    return (struct four){imp__widen((imp_float4){a[0], b[0], c[0], d[0]}),
                         imp__widen((imp_float4){a[1], b[1], c[1], d[1]}),
                         imp__widen((imp_float4){a[2], b[2], c[2], d[2]})};
}

/* What four triangles add to their corners: unit normals times angles. @return twice their
 * areas; without area, they add nothing. */
static inline imp_v3 four_weigh(const float *positions, const uint32_t index[12],
                                struct four add[3])
{
    struct four p[3];
    for (int i = 0; i < 3; i++) p[i] = four_load(positions, index + i);
    const struct four e0 = four_minus(&p[1], &p[0]), e1 = four_minus(&p[2], &p[1]),
                      e2 = four_minus(&p[0], &p[2]), back = four_minus(&p[2], &p[0]);
    const struct four normal = four_cross(&e0, &back);
    const imp_v3 twice_area = four_root(four_dot(&normal, &normal)), one = 1 / twice_area;
    const imp_v3 cosine[3] = {-four_dot(&e0, &e2), -four_dot(&e0, &e1),
                              -four_dot(&e1, &e2)};
    for (int i = 0; i < 3; i++) {
        /* From sine and cosine, which keep the angle exact for slivers, where acos loses
         * it. */
        const imp_v3 weight = imp__angles_4(cosine[i], twice_area) * one;
        add[i] = (struct four){normal.x * weight, normal.y * weight, normal.z * weight};
    }
    return twice_area;
}

/* Adds normals, weighted by angles, at the places from `first` to `end`. */
static enum imp_status angles_add(size_t first, size_t end, void *payload)
{
    const struct normals *m = payload;
    memset(m->sum + first, 0, (end - first) * sizeof *m->sum);
    for (size_t k = 0; k < m->n_triangles; k += 4) {
        const size_t n = imp_min(m->n_triangles - k, (size_t)4);
        uint32_t index[12] = {0};
        size_t at[12];
        bool own = false;
        memcpy(index, m->indices + 3 * k, 3 * n * sizeof *index);
        for (int i = 0; i < 12; i++) {
            at[i] = m->place[index[i]] - first;
            own |= at[i] < end - first;
        }
        if (!own) continue;
        struct four add[3];
        const imp_v3 twice_area = four_weigh(m->positions, index, add);
        for (size_t j = 0; j < n; j++) {
            for (size_t i = 0; i < 3 && twice_area[j] > 0; i++) {
                if (at[3 * j + i] >= end - first) continue;
                double *sum = m->sum[first + at[3 * j + i]];
                sum[0] += add[i].x[j];
                sum[1] += add[i].y[j];
                sum[2] += add[i].z[j];
            }
        }
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
                        .vertex = 1,
                        .out = out};
    while (m.slots < 2 * n_vertices) m.slots *= 2;
    while (m.vertex < n_vertices) m.vertex = 2 * m.vertex + 1;
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

/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertex normals of a mesh that has none: every face's unit normal weighted by its angle
 * at the vertex (Thuermer and Wuethrich 1998). Files split a vertex where its uv differ,
 * so the sum runs over all vertices at one position, not over one index. */
#include "shape.h"
#include <string.h>

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

/* place[v] = the first vertex at the same position. */
static enum imp_status places_find(imp_context *ctx, size_t n, const float *positions,
                                   uint32_t *place)
{
    size_t slots = 16;
    while (slots < 2 * n) slots *= 2;
    uint32_t *table = imp__alloc(ctx, slots, sizeof *table); /* vertex + 1; 0: free */
    if (!table) return imp__error(ctx, IMP_E_NOMEM, "out of memory for vertex normals");
    for (size_t v = 0; v < n; v++) {
        const float *p = positions + 3 * v;
        size_t k = position_hash(p) & (slots - 1);
        for (;; k = (k + 1) & (slots - 1)) {
            if (table[k] == 0) {
                table[k] = (uint32_t)(v + 1);
                place[v] = (uint32_t)v;
                break;
            }
            const float *q = positions + 3 * (size_t)(table[k] - 1);
            if (p[0] == q[0] && p[1] == q[1] && p[2] == q[2]) {
                place[v] = table[k] - 1;
                break;
            }
        }
    }
    imp__release(ctx, table);
    return IMP_OK;
}

enum imp_status imp__mesh_normals(imp_context *ctx, size_t n_vertices, size_t n_triangles,
                                  const float *positions, const uint32_t *indices,
                                  float *out)
{
    enum imp_status st = IMP_OK;
    uint32_t *place = imp__alloc(ctx, n_vertices, sizeof *place);
    imp_v3 *sum = imp__alloc(ctx, n_vertices, sizeof *sum);
    if (!place || !sum)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "out of memory for vertex normals"));
    IMP_TRY(places_find(ctx, n_vertices, positions, place));

    for (size_t k = 0; k < n_triangles; k++) {
        const uint32_t *index = indices + 3 * k;
        imp_v3 p[3];
        for (int i = 0; i < 3; i++) {
            const float *q = positions + 3 * (size_t)index[i];
            p[i] = imp__v3(q[0], q[1], q[2]);
        }
        const imp_v3 normal = imp__cross(p[1] - p[0], p[2] - p[0]);
        const double twice_area = imp__length(normal);
        if (!(twice_area > 0)) continue;
        for (int i = 0; i < 3; i++) {
            const imp_v3 a = p[(i + 1) % 3] - p[i], b = p[(i + 2) % 3] - p[i];
            /* atan2 keeps the angle exact for slivers, where acos loses it. */
            const double angle = atan2(twice_area, imp__dot(a, b));
            sum[place[index[i]]] += normal * (angle / twice_area);
        }
    }
    for (size_t v = 0; v < n_vertices; v++) {
        const imp_v3 n = sum[place[v]];
        const double length = imp__length(n);
        const imp_v3 unit = length > 0 ? n * (1 / length) : imp__v3(1, 0, 0);
        for (int i = 0; i < 3; i++) out[3 * v + i] = (float)unit[i];
    }
out:
    imp__release(ctx, place);
    imp__release(ctx, sum);
    return st;
}

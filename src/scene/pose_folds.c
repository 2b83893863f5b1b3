/* SPDX-License-Identifier: Apache-2.0
 *
 * Meshes whose vertices were moved singly (pose.h): triangles that have vanished, or lie face down
 * on what is around them, which they did not before. With c_f the normal of a face times twice its
 * area and S_v the sum of those around a vertex, a face has turned over where
 *
 *     c_f.(S_v - c_f) < 0  at all of its three vertices. */
#include "base/context.h"
#include "pose.h"
#include <string.h>

/* Twice the area over the square of the longest side; file coordinates are floats. */
#define SLIVER 1e-6

static imp_v3 vertex(const float *positions, uint32_t i)
{
    const float *p = positions + 3 * (size_t)i;
    return imp__v3(p[0], p[1], p[2]);
}

static imp_v3 face(const float *positions, const uint32_t *i)
{
    const imp_v3 p = vertex(positions, i[0]);
    return imp__cross(vertex(positions, i[1]) - p, vertex(positions, i[2]) - p);
}

static bool is_sliver(const float *positions, const uint32_t *i)
{
    double longest = 0;
    for (int k = 0; k < 3; k++) {
        const imp_v3 e = vertex(positions, i[(k + 1) % 3]) - vertex(positions, i[k]);
        longest = imp_max(longest, imp__dot(e, e));
    }
    return !(imp__length(face(positions, i)) > SLIVER * longest);
}

/* S_v of all vertices: sum [n_vertices][3]. */
static void sums(const struct imp_triangles *t, const float *positions, double *sum)
{
    memset(sum, 0, 3 * t->n_vertices * sizeof *sum);
    for (size_t k = 0; k < t->n_triangles; k++) {
        const uint32_t *i = t->indices + 3 * k;
        const imp_v3 c = face(positions, i);
        for (int j = 0; j < 9; j++)
            sum[3 * (size_t)i[j / 3] + (size_t)(j % 3)] += c[j % 3];
    }
}

static bool is_turned(const float *positions, const uint32_t *i, const double *sum)
{
    const imp_v3 c = face(positions, i);
    for (int k = 0; k < 3; k++) {
        const double *s = sum + 3 * (size_t)i[k];
        if (!(imp__dot(c, imp__v3(s[0], s[1], s[2]) - c) < 0)) return false;
    }
    return true;
}

enum imp_status imp__mesh_folds(const struct imp_scene *scene,
                                const struct imp_triangles *t, const float *rest,
                                size_t *triangle, const char **why)
{
    double *now = imp__alloc(scene->ctx, 6 * t->n_vertices, sizeof *now);
    double *then = now + 3 * t->n_vertices;
    *why = NULL;
    if (!now) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a mesh");
    sums(t, t->positions, now);
    sums(t, rest, then);
    for (size_t k = 0; k < t->n_triangles && !*why; k++) {
        const uint32_t *i = t->indices + 3 * k;
        *triangle = k;
        if (is_sliver(t->positions, i) && !is_sliver(rest, i)) *why = "vanish";
        else if (is_turned(t->positions, i, now) && !is_turned(rest, i, then))
            *why = "turn over";
    }
    imp__release(scene->ctx, now);
    return IMP_OK;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Which triangles of a mesh are pairs. */
#include "tree_quads.h"
#include <math.h>

enum { ALONE = 4 * 3 };

static imp_v3 position(const float *positions, uint32_t corner)
{
    const float *p = positions + 3 * (size_t)corner;
    return imp__v3((double)p[0], (double)p[1], (double)p[2]);
}

#define THINNEST 1e-20 /* square of the sine of an angle */
static bool has_area(const struct imp_triangles *mesh, const uint32_t *corner)
{
    const imp_v3 a = position(mesh->positions, corner[0]),
                 e1 = position(mesh->positions, corner[1]) - a,
                 e2 = position(mesh->positions, corner[2]) - a, n = imp__cross(e1, e2);
    return imp__dot(n, n) > THINNEST * imp__dot(e1, e1) * imp__dot(e2, e2);
}

/* For triangle i and the next one, which shares an edge that runs the other way there: as
 * imp_tree_quad.turned. */
static int turned_of(const struct imp_triangles *mesh, size_t i)
{
    const uint32_t *a = mesh->indices + 3 * i, *b = a + 3;
    for (int j = 0; i + 1 < mesh->n_triangles && j < 3; j++)
        for (int k = 0; k < 3; k++)
            if (a[(j + 1) % 3] == b[(k + 2) % 3] && a[(j + 2) % 3] == b[(k + 1) % 3])
                return has_area(mesh, a) && has_area(mesh, b) ? j + 4 * k : ALONE;
    return ALONE;
}

void imp__tree_quads_destroy(imp_context *ctx, struct imp_tree_quads *q)
{
    if (!q) return;
    imp__release(ctx, q->quad);
    imp__release(ctx, q);
}

/* Returns how many there are, with `turned` of each; 0: most triangles are alone. */
static size_t pairs_find(const struct imp_triangles *mesh, uint8_t *turned)
{
    const size_t most = 2 * mesh->n_triangles / 3;
    size_t n = 0;
    for (size_t i = 0; i < mesh->n_triangles; i++, n++) {
        if (n == most) return 0;
        turned[n] = (uint8_t)turned_of(mesh, i);
        i += turned[n] != ALONE;
    }
    return n;
}

static void fill(const struct imp_triangles *mesh, const uint8_t *turned,
                 struct imp_tree_quads *q)
{
    size_t i = 0;
    for (size_t n = 0; n < q->n; n++, i++) {
        const uint32_t *a = mesh->indices + 3 * i;
        const int j = turned[n] & 3, k = turned[n] >> 2;
        const uint32_t c0 = a[j], c1 = a[(j + 1) % 3], c3 = a[(j + 2) % 3];
        q->quad[n] = (struct imp_tree_quad){
            {c0, c1, k < 3 ? a[3 + k] : c3, c3}, (uint32_t)i, turned[n]};
        i += k < 3;
    }
}

bool imp__tree_quads_create(imp_context *ctx, const struct imp_triangles *mesh,
                            struct imp_tree_quads **out, int64_t *bytes)
{
    bool done = false;
    struct imp_tree_quads *q = NULL;
    uint8_t *turned = imp__alloc_raw(ctx, 2 * mesh->n_triangles / 3 + 1, sizeof *turned);
    *out = NULL;
    if (!turned) return false;
    const size_t n = pairs_find(mesh, turned);
    done = n == 0;
    if (n > 0) q = imp__alloc(ctx, 1, sizeof *q);
    if (q) {
        q->n = n;
        q->positions = mesh->positions;
        q->quad = imp__alloc_raw(ctx, n, sizeof *q->quad);
        done = q->quad != NULL;
    }
    if (q && done) {
        fill(mesh, turned, q);
        *bytes += (int64_t)(n * sizeof *q->quad);
        *out = q;
    } else imp__tree_quads_destroy(ctx, q);
    imp__release(ctx, turned);
    return done;
}

/* Where a ray meets the plane of a triangle (Moeller and Trumbore, "Fast, minimum storage ray-triangle
 * intersection", 1997), with u and v of b and c. */
struct plane_hit {
    double t, u, v;
};
static struct plane_hit plane_hit(imp_v3 a, imp_v3 b, imp_v3 c, imp_v3 o, imp_v3 d)
{
    const imp_v3 e1 = b - a, e2 = c - a, s = o - a, h = imp__cross(d, e2),
                 q = imp__cross(s, e1);
    const double inverse = 1 / imp__dot(e1, h);
    return (struct plane_hit){imp__dot(e2, q) * inverse, imp__dot(s, h) * inverse,
                              imp__dot(d, q) * inverse};
}
static double least_part(const struct plane_hit *x)
{
    return imp_min(imp_min(x->u, x->v), 1 - x->u - x->v);
}

static bool is_met(const struct plane_hit *x, double tmin)
{
    return least_part(x) >= 0 && x->t >= tmin;
}

#define DIAGONAL 1e-3 /* nearer to it doubles decide which half is met */

/* Is it the second? The halves need not lie in a plane: a ray may meet both beside their edge, where the
 * nearer counts, or leave one and meet the other. By rounding it may meet neither. */
static bool is_second(const struct plane_hit *first, const struct plane_hit *second,
                      double tmin)
{
    const bool a = is_met(first, tmin), b = is_met(second, tmin);
    if (a && b) return second->t < first->t;
    if (a || b) return b;
    if ((first->t >= tmin) != (second->t >= tmin)) return second->t >= tmin;
    return least_part(second) > least_part(first);
}

void imp__tree_quads_hit(const struct imp_tree_quads *q, unsigned prim, double u,
                         double v, imp_v3 o, imp_v3 d, double tmin, struct imp_hit *hit)
{
    const struct imp_tree_quad *quad = &q->quad[prim];
    const int j = quad->turned & 3, k = (int)(quad->turned >> 2);
    const uint32_t *corner = quad->corner;
    const imp_v3 p1 = position(q->positions, corner[1]),
                 p3 = position(q->positions, corner[3]);
    const bool near = k < 3 && fabs(u + v - 1) < DIAGONAL;
    bool second = k < 3 && u + v > 1;
    struct plane_hit x = {0}, other = {0};
    if (!second || near) x = plane_hit(position(q->positions, corner[0]), p1, p3, o, d);
    if (second || near)
        other = plane_hit(position(q->positions, corner[2]), p3, p1, o, d);
    if (near) second = is_second(&x, &other, tmin);
    if (second) x = other;
    const double a = imp_clamp(x.u, 0.0, 1.0), b = imp_clamp(x.v, 0.0, 1 - a),
                 part[3] = {1 - a - b, a, b}; /* of corner `at` and those after it */
    const int at = second ? k : j;
    hit->prim = (int)quad->first + second;
    hit->u = part[(4 - at) % 3];
    hit->v = part[(5 - at) % 3];
    if (x.t >= tmin && isfinite(x.t)) hit->t = x.t;
}

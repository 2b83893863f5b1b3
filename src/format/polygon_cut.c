/* SPDX-License-Identifier: Apache-2.0
 *
 * Convex polygons are fanned from their first corner, others lose one ear after another
 * (Meisters 1975). Every triangle has the orientation of the polygon; then the sum of their
 * indicator functions is the winding number, which is 1 in a simple polygon: they cover it
 * once. */
#include "polygon_cut.h"
#include <math.h>

struct flat { /* projected along the largest component of the normal, anticlockwise */
    const double *p;
    int u, v;
    double sign;
};

static double area2(const struct flat *f, uint32_t a, uint32_t b, uint32_t c)
{
    const double *A = f->p + 3 * (size_t)a, *B = f->p + 3 * (size_t)b,
                 *C = f->p + 3 * (size_t)c;
    return f->sign * ((B[f->u] - A[f->u]) * (C[f->v] - A[f->v]) -
                      (B[f->v] - A[f->v]) * (C[f->u] - A[f->u]));
}

static bool same(const struct flat *f, uint32_t a, uint32_t b)
{
    const double *A = f->p + 3 * (size_t)a, *B = f->p + 3 * (size_t)b;
    return A[f->u] == B[f->u] && A[f->v] == B[f->v];
}

/* Newell's normal, twice the area; 0: no area. */
static double flatten(const double *p, size_t n, struct flat *f)
{
    double normal[3] = {0};
    for (size_t i = 0; i < n; i++) {
        const double *a = p + 3 * i, *b = p + 3 * ((i + 1) % n);
        for (int k = 0; k < 3; k++) {
            const int u = (k + 1) % 3, v = (k + 2) % 3;
            /* from the first corner, so that far from the origin nothing cancels */
            normal[k] += (a[u] - p[u]) * (b[v] - p[v]) - (a[v] - p[v]) * (b[u] - p[u]);
        }
    }
    int axis = 0;
    for (int k = 1; k < 3; k++)
        if (fabs(normal[k]) > fabs(normal[axis])) axis = k;
    *f = (struct flat){p, (axis + 1) % 3, (axis + 2) % 3, normal[axis] < 0 ? -1 : 1};
    return fabs(normal[axis]);
}

/* No other corner in the triangle of three that follow each other; one on its edges counts
 * if `touching`. Corners at the place of one of the three are the same point of a seam. */
static bool is_ear(const struct flat *f, const uint32_t *ring, size_t n, size_t i,
                   bool touching)
{
    const uint32_t a = ring[(i + n - 1) % n], b = ring[i], c = ring[(i + 1) % n];
    if (!(area2(f, a, b, c) > 0)) return false;
    for (size_t k = 0; k < n; k++) {
        const uint32_t q = ring[k];
        if (same(f, q, a) || same(f, q, b) || same(f, q, c)) continue;
        const double x = area2(f, a, b, q), y = area2(f, b, c, q), z = area2(f, c, a, q);
        if (touching ? x >= 0 && y >= 0 && z >= 0 : x > 0 && y > 0 && z > 0) return false;
    }
    return true;
}

/* The position in the ring of a corner to cut off; n: there is none. */
static size_t ear_find(const struct flat *f, const uint32_t *ring, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (is_ear(f, ring, n, i, true)) return i;
    for (size_t i = 0; i < n; i++)
        if (is_ear(f, ring, n, i, false)) return i;
    for (size_t i = 0; i < n; i++) /* a corner without area: in line, or a seam's end */
        if (area2(f, ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n]) == 0) return i;
    return n;
}

static bool is_fan(const struct flat *f, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (area2(f, (uint32_t)i, (uint32_t)((i + 1) % n), (uint32_t)((i + 2) % n)) < 0)
            return false;
    for (size_t i = 2; i < n; i++)
        if (area2(f, 0, (uint32_t)i - 1, (uint32_t)i) < 0) return false;
    return true;
}

static void put(const struct flat *f, uint32_t a, uint32_t b, uint32_t c, uint32_t *out,
                size_t *n)
{
    if (!(area2(f, a, b, c) > 0)) return;
    out[3 * *n] = a, out[3 * *n + 1] = b, out[3 * *n + 2] = c;
    ++*n;
}

enum imp_status imp__polygon_cut(imp_context *ctx, const double *p, size_t n,
                                 uint32_t *out, size_t *n_out)
{
    struct flat f;
    uint32_t ring[IMP_POLYGON_MAX];
    *n_out = 0;
    const double area = flatten(p, n, &f);
    if (!isfinite(area)) return imp__error(ctx, IMP_E_SCENE, "its area is not finite");
    if (area == 0) return IMP_OK;
    if (is_fan(&f, n)) {
        for (uint32_t i = 2; i < n; i++) put(&f, 0, i - 1, i, out, n_out);
        return IMP_OK;
    }
    if (n > IMP_POLYGON_MAX)
        return imp__error(ctx, IMP_E_SCENE,
                          "it is not convex and has %zu corners, more than %d", n,
                          IMP_POLYGON_MAX);
    for (uint32_t i = 0; i < n; i++) ring[i] = i;
    for (; n >= 3; n--) {
        const size_t i = ear_find(&f, ring, n);
        if (i == n) return imp__error(ctx, IMP_E_SCENE, "it crosses itself");
        put(&f, ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n], out, n_out);
        for (size_t k = i; k + 1 < n; k++) ring[k] = ring[k + 1];
    }
    return IMP_OK;
}

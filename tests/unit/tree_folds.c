/* SPDX-License-Identifier: Apache-2.0
 *
 * Pairs of triangles that are folded, as Embree's quadrilaterals: what rays meet beside the fold, from
 * outside and from one half to the other, is the nearest of what they meet of the two triangles in
 * double. */
#include "imp_tap.h"
#include "math/offset.h"
#include "math/rng.h"
#include "scene/intersector.h"
#include "shape_nodes.h"

enum { FOLDS = 40, RAYS = 200000 };
#define ROUNDING 2e-6 /* of Embree's distances, and of its barycentric numbers */

static double between(struct imp_key key, uint32_t dim, double a, double b)
{
    return a + (b - a) * imp__u01(key, dim);
}

static imp_v3 corner_of(const float *p, uint32_t k)
{
    return imp__v3((double)p[3 * k], (double)p[3 * k + 1], (double)p[3 * k + 2]);
}

/* Folds far from each other: an edge, 0 to 1, and a corner on either side, 2 and 3, by angles between
 * a knife's and a plane's. */
static void folds_make(float *p, uint32_t *index)
{
    for (int k = 0; k < FOLDS; k++) {
        const struct imp_key key = imp__key(7, 0, (uint64_t)k);
        const imp_v3 at = imp__v3(3 * (k % 8) - 10, 3 * (k / 8) - 6, 0);
        const struct imp_mat4 turn = imp__rotate(
            imp__normalize(imp__v3(between(key, 0, -1, 1), between(key, 1, -1, 1), .3)),
            between(key, 2, 0, 360));
        const double fold = IMP_PI * (k % 10 ? between(key, 3, .02, .98) : 1);
        const imp_v3 corner[4] = {
            imp__v3(0, 0, -.5), imp__v3(0, 0, .5),
            imp__v3(.6, 0, between(key, 4, -.4, .4)),
            imp__v3(.6 * cos(fold), .6 * sin(fold), between(key, 5, -.4, .4))};
        for (int c = 0; c < 4; c++) {
            const imp_v3 x = imp__point(&turn, corner[c]) + at;
            for (int i = 0; i < 3; i++) p[12 * k + 3 * c + i] = (float)x[i];
        }
        const uint32_t own[6] = {2, 1, 0, 3, 0, 1};
        for (int c = 0; c < 6; c++) index[6 * k + c] = (uint32_t)(4 * k) + own[c];
    }
}

/* A ray against a triangle in double. */
struct meeting {
    double t, inside; /* how far inside of the edges, in parts of the heights */
    double rounding;  /* of a float's distance along the ray */
};
static struct meeting meet(const float *p, const uint32_t *index, imp_v3 o, imp_v3 d)
{
    const imp_v3 a = corner_of(p, index[0]), b = corner_of(p, index[1]),
                 c = corner_of(p, index[2]), n = imp__cross(b - a, c - a);
    const double slope = imp__dot(d, n), t = imp__dot(a - o, n) / slope,
                 nn = imp__dot(n, n);
    const imp_v3 x = o + d * t;
    const double in_a = imp__dot(imp__cross(c - b, x - b), n) / nn,
                 in_b = imp__dot(imp__cross(a - c, x - c), n) / nn;
    return (struct meeting){.t = t,
                            .inside = fmin(fmin(in_a, in_b), 1 - in_a - in_b),
                            .rounding =
                                ROUNDING * (1 + fabs(t)) * sqrt(nn) / fabs(slope)};
}

/* A point of half h of fold k; beside: next to the fold. */
static imp_v3 point_of(const float *p, struct imp_key key, int k, int h, bool beside,
                       imp_v3 *n)
{
    const imp_v3 a = corner_of(p, (uint32_t)(4 * k)),
                 b = corner_of(p, (uint32_t)(4 * k + 1)),
                 c = corner_of(p, (uint32_t)(4 * k + 2 + h));
    const double along = between(key, 6, .05, .95),
                 out = beside ? exp(between(key, 7, log(1e-5), log(3e-3)))
                              : between(key, 7, .1, .9);
    *n = imp__normalize(imp__cross(b - a, c - a));
    return (a * (1 - along) + b * along) * (1 - out) + c * out;
}

/* From outside to a point beside a fold, or to that from the other half. */
static void ray_make(const float *p, int i, imp_v3 *o, imp_v3 *d)
{
    const struct imp_key key = imp__key(8, 0, (uint64_t)i),
                         other = imp__key(9, 0, (uint64_t)i);
    const int k = i % FOLDS, half = i / FOLDS % 2;
    imp_v3 n;
    const imp_v3 to = point_of(p, key, k, half, true, &n);
    if (i % 3) {
        *o = to + imp__v3(between(key, 0, -4, 4), between(key, 1, -4, 4),
                          between(key, 2, -4, 4));
        *d = imp__normalize(to - *o);
    } else {
        const imp_v3 from = point_of(p, other, k, !half, i % 2, &n);
        *d = imp__normalize(to - from);
        *o = imp__offset(from, n, *d);
    }
}

static void folds(imp_context *ctx, bool robust)
{
    static float p[12 * FOLDS + 4];
    static uint32_t index[6 * FOLDS];
    static struct imp_bsdf glass = {.flags = IMP_BSDF_DELTA | IMP_BSDF_TRANSMIT};
    struct imp_mesh_data mesh = {.n_vertices = 4 * FOLDS,
                                 .n_triangles = 2 * FOLDS,
                                 .positions = p,
                                 .indices = index};
    enum imp_status st;
    int n_met = 0, missed = 0, behind = 0, beside = 0, early = 0, elsewhere = 0;
    folds_make(p, index);
    world_begin(ctx);
    if (robust) world.default_bsdf = &glass;
    struct imp_node *n = node_new("shape", "mesh");
    n->mesh = &mesh;
    node_bool(n, "face_normals", true);
    if (!shape_build(n, &st) || imp__intersector_create(&world) != IMP_OK) {
        tap_ok(0, "a scene");
        return;
    }
    const struct imp_intersector *x = world.intersector;
    tap_ok(x->holds && x->quads[0] && x->quads[0]->n == FOLDS, "%d folded pairs%s", FOLDS,
           robust ? ", robust" : "");
    for (int i = 0; i < RAYS; i++) {
        imp_v3 o, d;
        struct imp_hit hit;
        double sure = INFINITY, rounding = 0;
        ray_make(p, i, &o, &d);
        const bool found = imp__intersect(&world, &o, &d, 0, INFINITY, &hit);
        const double t = found ? hit.t : INFINITY;
        bool there = !found;
        for (int k = 0; k < 2 * FOLDS; k++) {
            const struct meeting m = meet(p, index + 3 * k, o, d);
            if (m.t > m.rounding && m.inside > m.rounding && m.t < sure)
                sure = m.t, rounding = m.rounding;
            /* Embree may meet what a ray along it has just left: that distance is a float. */
            const double off = m.t < 0 ? m.rounding : 1e-9 * (1 + t);
            if (found && hit.prim == k && fabs(m.t - t) < off &&
                m.inside > -5 * m.rounding)
                there = true;
        }
        n_met += found;
        early += found && t < 0;
        missed += !found && sure < INFINITY;
        behind += found && t > sure + rounding;
        beside += !there;
        elsewhere += found && hit.prim / 2 != i % FOLDS;
    }
    tap_ok(n_met > RAYS / 2 && elsewhere < n_met / 4,
           "rays meet them # %d of %d, %d another one", n_met, RAYS, elsewhere);
    tap_ok(missed == 0 && behind == 0,
           "the nearest half counts # %d missed, %d met behind it", missed, behind);
    tap_ok(early == 0 && beside == 0,
           "hits are where the ray meets the triangle # %d before it, %d elsewhere",
           early, beside);
    world_end();
}

/* Four pairs, and the same with a half of the second whose corners are on one line. */
static void without_area(imp_context *ctx)
{
    static const float p[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, .3f, .3f, 0};
    static const uint32_t index[] = {0, 1, 2, 2, 3, 0, 1, 4, 0, 1, 3, 4,
                                     0, 1, 2, 2, 3, 0, 0, 1, 2, 2, 3, 0};
    const struct imp_triangles mesh = {.n_triangles = 8,
                                       .positions = p,
                                       .indices = index},
                               line = {.n_triangles = 8,
                                       .positions = (float[15]){0, 0, 0, 1, 0, 0, 1, 1, 0,
                                                                0, 1, 0, .3f, 0, 0},
                                       .indices = index};
    struct imp_tree_quads *q[2] = {NULL, NULL};
    int64_t bytes = 0;
    const bool made = imp__tree_quads_create(ctx, &mesh, &q[0], &bytes) &&
                      imp__tree_quads_create(ctx, &line, &q[1], &bytes);
    tap_ok(made && q[0] && q[0]->n == 4 && q[1] && q[1]->n == 5,
           "a triangle without area is in no pair");
    imp__tree_quads_destroy(ctx, q[0]);
    imp__tree_quads_destroy(ctx, q[1]);
}

int main(void)
{
    imp_context *ctx;
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 1;
    folds(ctx, false);
    folds(ctx, true);
    without_area(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Pairs of triangles as Embree's quadrilaterals: the hits of the same triangles in an order without
 * pairs, and points that lie where the rays say. */
#include "imp_tap.h"
#include "math/offset.h"
#include "math/rng.h"
#include "scene/intersector.h"
#include "scene/ray_columns.h"
#include "shape_nodes.h"

enum { PATCHES = 400, TRIANGLES = 2 * PATCHES, RAYS = 400000 };

static double between(struct imp_key key, uint32_t dim, double a, double b)
{
    return a + (b - a) * imp__u01(key, dim);
}

/* Bent patches of four corners, each cut by a diagonal; one in ten has no second triangle. In pairs, with
 * their corners turned in all nine ways; else all first triangles, then all second ones. name[i]: of
 * triangle i, the number it has in pairs. */
static size_t mesh_make(bool pairs, float *p, uint32_t *index, int *name)
{
    size_t n = 0;
    for (int half = 0; half < (pairs ? 1 : 2); half++)
        for (int k = 0; k < PATCHES; k++) {
            const struct imp_key key = imp__key(3, 0, (uint64_t)k);
            for (int c = 0; c < 12; c++)
                p[12 * k + c] = (float)(between(key, (uint32_t)(c % 3), -4, 4) +
                                        between(key, (uint32_t)(10 + c), -0.4, 0.4));
            const uint32_t own[2][3] = {{0, 1, 2}, {2, 3, 0}};
            const int turn[2] = {k % 3, k / 3 % 3}, n_own = k % 10 ? 2 : 1;
            for (int t = 0; t < n_own; t++) {
                if (!pairs && t != half) continue;
                for (int c = 0; c < 3; c++)
                    index[3 * n + (size_t)c] =
                        (uint32_t)(4 * k) + own[t][(c + turn[t]) % 3];
                name[n++] = 2 * k + t;
            }
        }
    return n;
}

struct found {
    bool met, dark;
    int name;
    double t, u, v;
};

static double column[6][RAYS + IMP_COLUMN_SLACK], far_end[2][RAYS + IMP_COLUMN_SLACK];

/* How many rays find something else in columns, eight at a time. */
static int columns_differ(const struct found *alone, const int *name)
{
    static double t[RAYS], u[RAYS], v[RAYS];
    static int32_t shape[RAYS], prim[RAYS];
    static int64_t place[RAYS];
    static bool hidden[RAYS];
    struct imp_ray_columns rays = {.n = RAYS, .far = far_end[0]};
    const struct imp_hit_columns hits = {t, u, v, shape, prim, place};
    int wrong = 0;
    for (int c = 0; c < 3; c++) rays.o[c] = column[c], rays.d[c] = column[3 + c];
    imp__intersect_columns(&world, &rays, &hits);
    rays.far = far_end[1];
    imp__occluded_columns(&world, &rays, hidden);
    for (int i = 0; i < RAYS; i++) {
        const struct found *a = &alone[i];
        wrong += (shape[i] >= 0) != a->met || hidden[i] != a->dark ||
                 (a->met && (t[i] != a->t || u[i] != a->u || v[i] != a->v ||
                             name[prim[i]] != a->name));
    }
    return wrong;
}

static imp_v3 corner_of(const float *p, int patch, int c)
{
    const float *x = p + 12 * patch + 3 * c;
    return imp__v3((double)x[0], (double)x[1], (double)x[2]);
}

/* From anywhere to anywhere; to a point of an edge of a patch; nearly along a patch; from a patch on. */
static void ray_make(const float *p, int i, imp_v3 *o, imp_v3 *d)
{
    const struct imp_key key = imp__key(4, 0, (uint64_t)i);
    const int patch = i / 4 % PATCHES, turn = i % 3;
    const imp_v3 a = corner_of(p, patch, turn), b = corner_of(p, patch, (turn + 1) % 3),
                 c = corner_of(p, patch, (turn + 2) % 3),
                 n = imp__normalize(imp__cross(b - a, c - a));
    const double u = imp__u01(key, 6), v = imp__u01(key, 7) * (1 - u);
    imp_v3 to =
        imp__v3(between(key, 3, -4, 4), between(key, 4, -4, 4), between(key, 5, -4, 4));
    *o = imp__v3(between(key, 0, -6, 6), between(key, 1, -6, 6), between(key, 2, -6, 6));
    if (i % 4 == 1) to = a + (b - a) * u;
    if (i % 4 == 2) {
        to = a + (b - a) * u + (c - a) * v;
        *o = to + (a - b) * between(key, 0, -2, 2) + (a - c) * between(key, 1, -2, 2) +
             n * between(key, 2, -1e-3, 1e-3);
    }
    *d = imp__normalize(to - *o);
    if (i % 4 == 3) {
        *d = imp__normalize(*o);
        *o = imp__offset(a + (b - a) * u + (c - a) * v, n, *d);
    }
}

/* Shadow rays of the last three end before what is met, at it, or behind it. */
static double end_of(int i, double t)
{
    const int k = i / 4 % 3;
    if (i % 4 == 0) return 3;
    return k == 0 ? t * (1 - 10 * IMP_RAY_EPSILON) : k == 1 ? t : t * (1 + 1e-6);
}

/* What the rays find; *far: how far points are from where rays from anywhere are. False: no scene. */
static bool trace(imp_context *ctx, bool pairs, bool robust, bool brief,
                  struct found *out, double *far)
{
    static struct imp_bsdf glass = {.flags = IMP_BSDF_DELTA | IMP_BSDF_TRANSMIT};
    static float p[12 * PATCHES + 4];
    static uint32_t index[3 * TRIANGLES];
    static int name[TRIANGLES];
    struct imp_mesh_data mesh = {
        .n_vertices = 4 * PATCHES, .positions = p, .indices = index};
    mesh.n_triangles = mesh_make(pairs, p, index, name);
    world_begin(ctx);
    if (robust) world.default_bsdf = &glass;
    world.spp = brief; /* of no sensor: fewer walks than triangles */
    struct imp_node *n = node_new("shape", "mesh");
    n->mesh = &mesh;
    node_bool(n, "face_normals", true);
    enum imp_status st;
    const struct imp_shape *s = shape_build(n, &st);
    if (!s || imp__intersector_create(&world) != IMP_OK) return false;
    const struct imp_intersector *x = world.intersector;
    tap_ok(x->holds && x->brief == brief && (x->quads[0] != NULL) == pairs &&
               (!pairs || x->quads[0]->n == PATCHES),
           "%zu triangles, %s%s", mesh.n_triangles,
           pairs ? "as quadrilaterals" : "each by itself",
           brief ? ", in a tree made in little time" : "");
    *far = 0;
    for (int i = 0; i < RAYS; i++) {
        imp_v3 o, d;
        struct imp_hit hit = {.t = 3};
        struct imp_surface at;
        ray_make(p, i, &o, &d);
        for (int c = 0; c < 3; c++) column[c][i] = o[c], column[3 + c][i] = d[c];
        out[i].met = imp__intersect(&world, &o, &d, 0, INFINITY, &hit);
        far_end[0][i] = INFINITY;
        far_end[1][i] = end_of(i, hit.t);
        out[i].dark = imp__occluded(&world, &o, &d, 0, far_end[1][i]);
        if (!out[i].met) continue;
        out[i].name = name[hit.prim];
        out[i].t = hit.t;
        out[i].u = hit.u;
        out[i].v = hit.v;
        s->ops->surface(s, &hit, &o, &d, &at);
        if (i % 4 == 0) *far = fmax(*far, imp__length(at.p - (o + d * hit.t)));
    }
    const int differ = columns_differ(out, name);
    tap_ok(differ == 0, "rays in columns: the same bits # %d of %d differ", differ, RAYS);
    world_end();
    return true;
}

/* Rays from anywhere: at edges, and nearly along a triangle, others may be met. */
static void compare(const struct found *pair, const struct found *single)
{
    int n = 0, met = 0, second = 0, differ = 0, beside = 0;
    for (int i = 0; i < RAYS; i += 4) {
        const struct found *a = &pair[i], *b = &single[i];
        n++;
        met += a->met;
        second += a->met && a->name % 2;
        differ += a->met != b->met || a->dark != b->dark || fabs(a->t - b->t) > 1e-4;
        /* Where both halves are met, at their common edge, either may be named. */
        beside +=
            a->met && b->met &&
            (a->name != b->name || fabs(a->u - b->u) > 1e-4 || fabs(a->v - b->v) > 1e-4);
    }
    tap_ok(met > n / 3 && met < n && second > met / 4,
           "rays meet and miss # %d of %d, %d of them a second half", met, n, second);
    tap_ok(differ <= n / 10000, "the same hits as of single triangles # %d differ",
           differ);
    tap_ok(beside <= n / 5000, "at the same places of the same triangles # %d differ",
           beside);
}

/* Of a ray into an edge that two facets share, either may be named. */
static void same(const struct found *slow, const struct found *brief)
{
    int differ = 0, edges = 0;
    for (int i = 0; i < RAYS; i++) {
        const struct found *a = &slow[i], *b = &brief[i];
        const bool equal = a->met == b->met && a->dark == b->dark &&
                           (!a->met || (a->name == b->name && a->t == b->t &&
                                        a->u == b->u && a->v == b->v));
        if (i % 4 == 1) edges += !equal;
        else differ += !equal;
    }
    tap_ok(differ == 0 && edges <= RAYS / 4 / 1000,
           "a tree made in little time: the same bits # %d differ, %d at edges", differ,
           edges);
}

int main(void)
{
    static struct found pair[RAYS], single[RAYS], brief[RAYS];
    imp_context *ctx;
    double far[2];
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 1;
    for (int robust = 0; robust < 2; robust++) {
        if (!trace(ctx, true, robust, true, brief, &far[0]) ||
            !trace(ctx, true, robust, false, pair, &far[0]) ||
            !trace(ctx, false, robust, false, single, &far[1])) {
            tap_ok(0, "scenes");
            return tap_done();
        }
        compare(pair, single);
        same(pair, brief);
        tap_ok(far[0] < 1e-12 && far[1] < 2e-4,
               "points lie on their rays # farthest %.2g, of single triangles %.2g",
               far[0], far[1]);
    }
    imp_context_destroy(ctx);
    return tap_done();
}

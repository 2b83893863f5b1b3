/* SPDX-License-Identifier: Apache-2.0
 *
 * Rays that leave closed rooms between two triangles, or enter a body and never leave it.
 * Rays travel as walks do: from a surface, moved off it by imp__offset, in a direction
 * uniform on the hemisphere; bodies inside a room are crossed straight on, as boundaries
 * of media and glass are. A ray in a room that hits nothing is an escape, and so is one
 * that enters a convex body and meets anything else before its back.
 *
 * At most 10 in 10^8 rays (`leaks long`); by default 10^7. */
#include "base/pool.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/warp.h"
#include "shape_nodes.h"

#define ITEM 100000 /* rays of one item */

static imp_context *ctx;
static struct imp_bsdf wall = {.flags = IMP_BSDF_SMOOTH},
                       glass = {.flags = IMP_BSDF_DELTA | IMP_BSDF_TRANSMIT};

/* An icosahedron, each triangle divided into four n times, pushed out to the sphere. */
static struct imp_mesh_data ball(int n)
{
    const double g = (1 + sqrt(5)) / 2;
    const double corner[12][3] = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                                  {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                                  {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
    static const uint32_t face[20][3] = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10},
                                         {0, 10, 11}, {1, 5, 9},  {5, 11, 4}, {11, 10, 2},
                                         {10, 7, 6},  {7, 1, 8},  {3, 9, 4},  {3, 4, 2},
                                         {3, 2, 6},   {3, 6, 8},  {3, 8, 9},  {4, 9, 5},
                                         {2, 4, 11},  {6, 2, 10}, {8, 6, 7},  {9, 8, 1}};
    size_t triangles = 20;
    for (int k = 0; k < n; k++) triangles *= 4;
    /* Corners are not shared between triangles, but have the same bits. */
    double(*p)[3] = malloc(3 * triangles * sizeof *p);
    float *positions = malloc((9 * triangles + 4) * sizeof *positions);
    uint32_t *indices = malloc(3 * triangles * sizeof *indices);
    for (size_t f = 0; f < 20; f++)
        for (int i = 0; i < 3; i++)
            memcpy(p[3 * f + (size_t)i], corner[face[f][i]], sizeof *p);
    for (size_t count = 20; count < triangles; count *= 4)
        for (size_t f = count; f-- > 0;) {
            double c[6][3]; /* corners, and the middles opposite to them */
            memcpy(c, p[3 * f], 3 * sizeof *c);
            for (int i = 0; i < 3; i++)
                for (int k = 0; k < 3; k++)
                    c[3 + i][k] = 0.5 * (c[(i + 1) % 3][k] + c[(i + 2) % 3][k]);
            static const int part[4][3] = {{0, 5, 4}, {1, 3, 5}, {2, 4, 3}, {3, 4, 5}};
            for (int t = 0; t < 4; t++)
                for (int i = 0; i < 3; i++)
                    memcpy(p[3 * (4 * f + (size_t)t) + (size_t)i], c[part[t][i]],
                           sizeof *p);
        }
    for (size_t k = 0; k < 3 * triangles; k++) {
        const double l = sqrt(p[k][0] * p[k][0] + p[k][1] * p[k][1] + p[k][2] * p[k][2]);
        for (int i = 0; i < 3; i++) positions[3 * k + (size_t)i] = (float)(p[k][i] / l);
        indices[k] = (uint32_t)k;
    }
    free(p);
    return (struct imp_mesh_data){.n_vertices = 3 * triangles,
                                  .n_triangles = triangles,
                                  .positions = positions,
                                  .indices = indices};
}
/* A cube of n x n cells a face, pushed out to the sphere: two triangles a cell, which share corners and
 * are folded, but for cells have corners of their own. They are quadrilaterals to Embree. */
static struct imp_mesh_data ball_of_pairs(int n)
{
    const size_t cells = 6 * (size_t)n * (size_t)n;
    float *positions = malloc((12 * cells + 4) * sizeof *positions);
    uint32_t *indices = malloc(6 * cells * sizeof *indices);
    for (size_t k = 0; k < cells; k++) {
        const int face = (int)k % 6, i = (int)(k / 6) % n, j = (int)(k / 6) / n;
        static const int own[6] = {0, 1, 2, 2, 3, 0};
        for (int c = 0; c < 4; c++) {
            const int out = face % 2 ? -n : n, a = 2 * (i + (c == 1 || c == 2)) - n,
                      b = 2 * (j + c / 2) - n;
            int x[3];
            x[face / 2] = out;
            x[(face / 2 + 1) % 3] = face % 2 ? b : a;
            x[(face / 2 + 2) % 3] = face % 2 ? a : b;
            const double l = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
            for (int d = 0; d < 3; d++)
                positions[12 * k + 3 * (size_t)c + (size_t)d] = (float)(x[d] / l);
        }
        for (int c = 0; c < 6; c++)
            indices[6 * k + (size_t)c] = (uint32_t)(4 * k) + (uint32_t)own[c];
    }
    return (struct imp_mesh_data){.n_vertices = 4 * cells,
                                  .n_triangles = 2 * cells,
                                  .positions = positions,
                                  .indices = indices};
}
static void ball_free(struct imp_mesh_data *m)
{
    free((void *)(uintptr_t)m->positions);
    free((void *)(uintptr_t)m->indices);
}

/* Turned about an axis that no edge is parallel to. */
static struct imp_mat4 placed(imp_v3 at, double size)
{
    const struct imp_mat4 t = imp__translate(at),
                          s = imp__scale(imp__v3(size, size, size)),
                          r = imp__rotate(imp__normalize(imp__v3(.3, .5, .7)), 37);
    const struct imp_mat4 rs = imp__mat4_multiply(&r, &s);
    return imp__mat4_multiply(&t, &rs);
}
static void shape(struct imp_node *n, struct imp_mat4 at, bool inwards)
{
    enum imp_status st;
    node_transform(n, at);
    if (inwards) node_bool(n, "flip_normals", true);
    if (!shape_build(n, &st)) {
        fprintf(stderr, "leaks: %s\n", imp_last_error(ctx));
        exit(3);
    }
}

struct journey {
    int room; /* shapes below this index are the room, the others convex bodies */
    imp_v3 centre;
    uint64_t seed;
    size_t rays, escapes, lost; /* lost: entered a body, and met something else */
};

static enum imp_status travel(size_t item, int worker, int slot, void *payload)
{
    struct journey *j = payload;
    size_t escapes = 0, lost = 0;
    int inside = -1;
    imp_v3 o = j->centre, d = {0};
    bool start = true;
    (void)worker, (void)slot;
    for (uint64_t i = 0; i < ITEM; i++) {
        const struct imp_key key = imp__key(j->seed, item, i);
        const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
        struct imp_hit hit;
        struct imp_surface at;
        if (start) {
            o = j->centre;
            d = imp__uniform_sphere(u);
            inside = -1;
            start = false;
        }
        if (!imp__intersect(&world, &o, &d, 0, INFINITY, &hit)) {
            escapes++;
            start = true;
            continue;
        }
        const struct imp_shape *s = world.shapes[hit.shape];
        s->ops->surface(s, &hit, &o, &d, &at);
        const bool front = imp__dot(d, at.ng) < 0;
        if (hit.shape >= j->room) {
            /* Edge-on, a ray that grazes a body enters and leaves within the offset. */
            const bool fits = front ? inside < 0 : inside == hit.shape;
            const bool grazes = fabs(imp__dot(d, at.ng)) < 1e-3;
            if (!fits && !grazes) lost++;
            inside = front ? hit.shape : -1;
        } else {
            if (inside >= 0) lost++;
            if (!front) escapes++; /* it met the room from behind */
            inside = -1;
            d = imp__uniform_sphere(u);
            if (imp__dot(d, at.ng) < 0) d = -d;
        }
        o = imp__offset(at.p, at.ng, d);
    }
    __atomic_add_fetch(&j->escapes, escapes, __ATOMIC_RELAXED);
    __atomic_add_fetch(&j->lost, lost, __ATOMIC_RELAXED);
    return IMP_OK;
}

static void room_begin(struct imp_bsdf *b)
{
    world_begin(ctx);
    world.default_bsdf = b;
}

static void measure(const char *what, int room, imp_v3 centre, size_t rays, size_t most)
{
    struct journey j = {.room = room, .centre = centre, .seed = 5, .rays = rays};
    const struct imp_loop loop = {.n_items = rays / ITEM, .work = travel, .payload = &j};
    if (imp__intersector_create(&world) != IMP_OK ||
        imp__parallel(ctx, &loop, NULL) != IMP_OK)
        exit(3);
    tap_ok(j.escapes <= most && j.lost <= most, "%s # %zu rays, %zu escapes, %zu lost",
           what, rays, j.escapes, j.lost);
    world_end();
}

/* Rooms and bodies of these meshes. */
static void balls(size_t rays, size_t most, imp_v3 at, struct imp_mesh_data *fine,
                  struct imp_mesh_data *rough, const char *of)
{
    struct imp_node *n;
    char what[100];

    room_begin(&wall);
    n = node_new("shape", "mesh");
    n->mesh = fine;
    shape(n, placed(at, 1.7), true);
    snprintf(what, sizeof what, "a ball of %zu triangles, %s", fine->n_triangles, of);
    measure(what, 1, at, rays, most);

    room_begin(&glass);
    shape(node_new("shape", "sphere"), placed(at, 3), true);
    n = node_new("shape", "mesh");
    n->mesh = rough;
    shape(n, placed(at + imp__v3(1, 0, 0), .6), false);
    n = node_new("shape", "mesh");
    n->mesh = fine;
    shape(n, placed(at + imp__v3(-1, 0, 0), .6), false);
    shape(node_new("shape", "cube"), placed(at + imp__v3(0, 1.2, 0), .4), false);
    shape(node_new("shape", "sphere"), placed(at + imp__v3(0, -1.2, 0), .5), false);
    snprintf(what, sizeof what, "glass bodies of %s in a sphere", of);
    measure(what, 1, at, rays, most);

    room_begin(&glass);
    n = node_new("shape", "mesh");
    n->mesh = fine;
    shape(n, placed(at, 300), true);
    shape(node_new("shape", "cube"), placed(at + imp__v3(80, 0, 0), 40), false);
    n = node_new("shape", "mesh");
    n->mesh = fine;
    shape(n, placed(at + imp__v3(-80, 0, 0), 60), false);
    snprintf(what, sizeof what, "bodies in a large ball, of %s", of);
    measure(what, 1, at, rays, most);
}

int main(int argc, char **argv)
{
    const bool full = argc > 1 && strcmp(argv[1], "long") == 0;
    const size_t rays = (full ? 100000000 : 10000000) / 5, most = full ? 2 : 1;
    const imp_v3 at = {.31, -.17, .53, 0};
    struct imp_mesh_data fine = ball(5), rough = ball(1), fine_pairs = ball_of_pairs(41),
                         rough_pairs = ball_of_pairs(3);
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 3;

    room_begin(&wall);
    shape(node_new("shape", "cube"), placed(at, 1.7), true);
    measure("a cube of 12 triangles", 1, at, rays, most);

    /* Walls that are shapes of their own: edges meet, vertices are rounded apart. */
    room_begin(&wall);
    for (int k = 0; k < 6; k++) {
        const struct imp_mat4 turn =
            k < 4 ? imp__rotate(imp__v3(0, 1, 0), 90 * k)
                  : imp__rotate(imp__v3(1, 0, 0), k == 4 ? 90 : -90);
        const struct imp_mat4 out = imp__translate(imp__v3(0, 0, -1)),
                              all = placed(at, 1.7);
        const struct imp_mat4 wall = imp__mat4_multiply(&turn, &out);
        shape(node_new("shape", "rectangle"), imp__mat4_multiply(&all, &wall), false);
    }
    measure("six rectangles", 6, at, rays, most);

    balls(rays, most, at, &fine, &rough, "single triangles");
    balls(full ? rays : rays / 2, most, at, &fine_pairs, &rough_pairs, "pairs");

    ball_free(&fine);
    ball_free(&rough);
    ball_free(&fine_pairs);
    ball_free(&rough_pairs);
    imp_context_destroy(ctx);
    return tap_done();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Shading normals of meshes with vertex normals where something moves: how they turn over a
 * triangle, their velocities and the transposes, and how normals follow vertices, against
 * differences of normals that are computed again. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/warp.h"
#include "move/moves.h"
#include <stdio.h>

#define FILE_NAME "moves_shading.obj"

static imp_context *ctx;

/* A bent grid of 5 x 5 vertices; the last row lies on the first one of a second grid, as vertices of
 * their own. */
enum { SIDE = 5 };
static void grid_write(void)
{
    FILE *f = fopen(FILE_NAME, "w");
    if (!f) exit(99);
    for (int part = 0; part < 2; part++)
        for (int y = 0; y < SIDE; y++)
            for (int x = 0; x < SIDE; x++) {
                const double v = y + part * (SIDE - 1);
                fprintf(f, "v %.9g %.9g %.9g\n", (double)x, v,
                        sin(x + .3 * v) + .4 * cos(1.3 * v));
            }
    for (int part = 0; part < 2; part++)
        for (int y = 0; y < SIDE - 1; y++)
            for (int x = 0; x < SIDE - 1; x++) {
                const int a = 1 + part * SIDE * SIDE + y * SIDE + x;
                fprintf(f, "f %d %d %d\nf %d %d %d\n", a, a + 1, a + SIDE, a + 1,
                        a + SIDE + 1, a + SIDE);
            }
    fclose(f);
}

static void normals_test(imp_scene *scene)
{
    const struct imp_triangles *t = &scene->shapes[0]->triangles;
    const size_t n = t->n_vertices;
    struct imp__fans *fans;
    double *bar = calloc(3 * n, sizeof *bar), *normals_bar = calloc(3 * n, sizeof *bar),
           *weight = calloc(3 * n, sizeof *bar), *along = calloc(3 * n, sizeof *bar);
    float *moved = calloc(3 * n, sizeof *moved), *normals = calloc(3 * n, sizeof *moved);
    double worst = 0;
    test_must(ctx, imp__fans_make(ctx, t, &fans));
    for (uint32_t trial = 0; trial < 20; trial++) {
        const struct imp_key key = imp__key(3, 1, trial);
        for (size_t k = 0; k < 3 * n; k++) {
            weight[k] = normals_bar[k] = imp__u01(key, (uint32_t)k) - 0.5;
            along[k] = imp__u01(key, (uint32_t)(1000 + k)) - 0.5;
            bar[k] = 0;
        }
        for (size_t k = 0; k < n; k++) /* what lies on each other moves together */
            for (size_t j = 0; j < k; j++)
                if (memcmp(t->positions + 3 * k, t->positions + 3 * j, 12) == 0)
                    memcpy(along + 3 * k, along + 3 * j, 3 * sizeof *along);
        imp__fans_normals_bar(fans, t, normals_bar, bar);
        double value[4], own = 0;
        static const double at[4] = {1, -1, 2, -2};
        const double h = 0.02;
        for (int s = 0; s < 4; s++) {
            for (size_t k = 0; k < 3 * n; k++)
                moved[k] = (float)(t->positions[k] + at[s] * h * along[k]);
            test_must(ctx, imp__mesh_normals(ctx, n, t->n_triangles, moved, t->indices,
                                             normals));
            value[s] = 0;
            for (size_t k = 0; k < 3 * n; k++) value[s] += weight[k] * normals[k];
        }
        for (size_t k = 0; k < 3 * n; k++) own += bar[k] * along[k];
        const double d = (8 * (value[0] - value[1]) - (value[2] - value[3])) / (12 * h);
        worst = fmax(worst, fabs(own - d));
        for (size_t k = 0; k < 3 * n; k++) worst = fmax(worst, fabs(normals_bar[k]));
    }
    tap_ok(worst < 3e-4, "normals follow vertices, as differences do # %.1e", worst);
    imp__fans_free(ctx, fans);
    free(bar), free(normals_bar), free(weight), free(along), free(moved), free(normals);
}

/* Over a triangle, and along the numbers of a pose, with the transpose. */
static void points_test(imp_scene *scene, enum imp__move_kind kind, const char *name)
{
    struct imp__moves m = imp__moves_begin(scene, NULL);
    test_must(ctx, imp__moves_add(&m, kind, 0));
    const struct imp_shape *shape = scene->shapes[0];
    double *theta = calloc(m.n, sizeof *theta), *bar = calloc(m.n, sizeof *bar);
    double slide = 0, transposed = 0, turned = 0;
    for (uint32_t i = 0; i < 64; i++) {
        const struct imp_key key = imp__key(4, (uint64_t)kind, i);
        double b[2];
        imp__uniform_triangle((double[2]){imp__u01(key, 0), imp__u01(key, 1)}, b);
        const struct imp_located at = {(int)i, {(float)b[0], (float)b[1]}};
        struct imp_surface here, there;
        imp__located_surface(scene, 0, &at, 0, 0, &here);
        const struct imp__glued x = imp__glued_at(scene, 0, &at, 0, 0, here.ng);
        const double h = 1e-3;
        struct imp_hit hit = {.prim = (int)i, .u = at.at[0] + h, .v = at.at[1] - 2 * h};
        shape->ops->surface(shape, &hit, NULL, NULL, &there);
        const imp_v3 r = there.p - here.p;
        const imp_v3 d =
            x.turn[0] * imp__dot(x.slope[0], r) + x.turn[1] * imp__dot(x.slope[1], r);
        slide = fmax(slide, imp__length(there.n - here.n - d));
        slide = fmax(slide, imp__length(x.shade - here.n));
        for (size_t k = 0; k < m.n; k++) {
            theta[k] = imp__u01(key, (uint32_t)(10 + k)) - 0.5;
            bar[k] = 0;
        }
        const struct imp__velocity v = imp__velocity_of(&m, &x, theta);
        const imp_v3 a = imp__v3(theta[3], theta[4], theta[5]);
        if (kind == IMP_MOVE_POSE)
            turned = fmax(turned, imp__length(v.shade - imp__cross(a, here.n)));
        turned = fmax(turned, fabs(imp__dot(v.shade, here.n)));
        struct imp__velocity w = {.area = 0};
        double forward = 0, reverse = 0;
        for (int k = 0; k < 3; k++) {
            w.v[k] = imp__u01(key, (uint32_t)(1500 + k)) - 0.5;
            w.shade[k] = imp__u01(key, (uint32_t)(1600 + k)) - 0.5;
            forward += w.v[k] * v.v[k] + w.shade[k] * v.shade[k];
        }
        imp__velocity_bar(&m, &x, &w, bar);
        for (size_t k = 0; k < m.n; k++) reverse += bar[k] * theta[k];
        transposed = fmax(transposed, fabs(forward - reverse));
    }
    tap_ok(slide < 1e-4, "%s: the normal over 64 triangles # %.1e", name, slide);
    tap_ok(turned < 1e-12, "%s: its velocity # %.1e", name, turned);
    tap_ok(transposed < 1e-12, "%s: the transpose # %.1e", name, transposed);
    free(theta), free(bar);
    imp__moves_free(&m);
}

int main(void)
{
    ctx = test_context(1);
    grid_write();
    imp_scene *scene = test_scene_text(
        ctx,
        "<scene version='3.0.0'><integrator type='path'/><shape type='obj' id='cloth'>"
        "<string name='filename' value='" FILE_NAME "'/><bsdf type='diffuse'/></shape>"
        "<emitter type='constant'/><sensor type='perspective'/></scene>",
        IMP_RGB);
    normals_test(scene);
    points_test(scene, IMP_MOVE_POSE, "pose");
    points_test(scene, IMP_MOVE_VERTICES, "vertices");
    imp_scene_destroy(scene);
    remove(FILE_NAME);
    imp_context_destroy(ctx);
    return tap_done();
}

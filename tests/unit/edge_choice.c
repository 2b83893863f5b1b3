/* SPDX-License-Identifier: Apache-2.0
 *
 * Choice of points on edges: densities against lengths that are summed edge by edge, of all edges
 * and of silhouettes seen from points and along directions, before and after a pilot. */
#include "move/edge_choice.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/warp.h"

static imp_context *ctx;

/* A ball of rings x 2 rings facets above a square. */
static imp_scene *ball(int rings)
{
    const int around = 2 * rings;
    const size_t n = (size_t)(rings + 1) * (size_t)around;
    char path[] = "/tmp/edge_choice_XXXXXX.obj", xml[2048];
    const int fd = mkstemps(path, 4);
    FILE *f = fdopen(fd, "w");
    for (size_t k = 0; k < n; k++) {
        const double t = IMP_PI * (double)(k / (size_t)around) / rings,
                     p = IMP_2PI * (double)(k % (size_t)around) / around;
        fprintf(f, "v %.9g %.9g %.9g\n", sin(t) * cos(p), sin(t) * sin(p), cos(t));
    }
    for (int i = 0; i < rings; i++)
        for (int j = 0; j < around; j++) {
            const int a = i * around + j + 1, b = i * around + (j + 1) % around + 1;
            if (i < rings - 1) fprintf(f, "f %d %d %d\n", a, a + around, b + around);
            if (i > 0) fprintf(f, "f %d %d %d\n", a, b + around, b);
        }
    fclose(f);
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'/><emitter "
             "type='constant'/><sensor type='perspective'/>"
             "<shape type='obj'><string name='filename' value='%s'/><boolean "
             "name='face_normals' value='true'/></shape><shape type='rectangle'>"
             "<transform name='to_world'><translate z='-2'/></transform></shape>"
             "</scene>",
             path);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    remove(path);
    return scene;
}

static double length_of(const struct imp__edge *e) { return imp__length(e->b - e->a); }

static bool is_silhouette(const struct imp__edges *e, const struct imp__edge *x,
                          imp_v3 from, bool parallel)
{
    return imp__edge_side(e, x, imp__cross(x->b - x->a, parallel ? from : x->a - from)) !=
           0;
}

/* The integral of x^2 + 1 over edges, by draws. */
static double weight(imp_v3 p) { return p[0] * p[0] + 1; }
static double exact(const struct imp__edge *e)
{
    const double a = e->a[0], b = e->b[0];
    return length_of(e) * ((a * a + a * b + b * b) / 3 + 1);
}

/* Standard errors are at most `largest` of the sums. */
static void draws_test(const struct imp__edge_choice *c, const char *name, double largest)
{
    enum { DRAWS = 60000 };
    struct tap_stat all = {0, 0, 0};
    double sum = 0;
    for (size_t k = 0; k < c->edges->n; k++) sum += exact(&c->edges->edge[k]);
    for (uint32_t i = 0; i < DRAWS; i++) {
        struct imp__edge_point x;
        imp__edge_choice_draw(c, imp__u01(imp__key(3, 0, i), 0), &x);
        tap_add(&all, x.inv_pdf * weight(x.p));
    }
    tap_z(&all, sum, 0.01 * sum, name);
    int off = 0;
    for (uint32_t view = 0; view < 6; view++) {
        const struct imp_key key = imp__key(4, view, 0);
        const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
        const bool parallel = view % 2;
        const imp_v3 from = imp__uniform_sphere(u) * (parallel ? 1 : 1.1 + view);
        struct tap_stat found = {0, 0, 0};
        double there = 0;
        for (size_t k = 0; k < c->edges->n; k++) {
            const struct imp__edge *e = &c->edges->edge[k];
            if (is_silhouette(c->edges, e, from, parallel)) there += exact(e);
        }
        for (uint32_t i = 0; i < DRAWS / 4; i++) {
            struct imp__edge_point x = {0};
            const bool any = imp__edge_choice_silhouette(
                c, 0, from, parallel, imp__u01(imp__key(5, view, i), 0), &x);
            off += any && !is_silhouette(c->edges, x.edge, from, parallel);
            tap_add(&found, any ? x.inv_pdf * weight(x.p) : 0);
        }
        char what[128];
        snprintf(what, sizeof what, "silhouettes %s %u, %s", parallel ? "along" : "from",
                 view, name);
        tap_z(&found, there, largest * there, what);
    }
    tap_ok(off == 0, "nothing but silhouettes # %d", off);
}

static void choice_test(int rings)
{
    imp_scene *scene = ball(rings);
    struct imp__edges edges;
    struct imp__edge_tree tree;
    struct imp__edge_choice c;
    double *measure, *moment;
    enum { CELLS = 700 };
    test_must(ctx, imp__edges_build(scene, IMP_EDGES_ALL, &edges));
    test_must(ctx, imp__edge_tree_build(&edges, &tree));
    test_must(ctx, imp__edge_choice_begin(&edges, &tree, NULL, 1, &c));
    draws_test(&c, "by length", 0.03);
    imp__edge_choice_free(&c);
    measure = calloc(edges.n, sizeof *measure);
    moment = calloc(CELLS, sizeof *moment);
    for (size_t k = 0; k < edges.n; k++)
        measure[k] =
            length_of(&edges.edge[k]) * (0.3 + imp__u01(imp__key(1, 0, (uint64_t)k), 0));
    for (int k = 0; k < CELLS; k++)
        moment[k] =
            k % 3 && k > 3 ? exp(3 * imp__u01(imp__key(2, 0, (uint64_t)k), 0)) : 0;
    test_must(ctx, imp__edge_choice_begin(&edges, &tree, measure, CELLS, &c));
    imp__edge_choice_learn(&c, moment, 0.15);
    draws_test(&c, "by what a pilot has found", 0.08);
    const double kept = c.cell[1] - c.cell[0];
    tap_near(kept, 0.15 / CELLS, 1e-12, 0, "a cell in which nothing was found is kept");
    free(measure);
    free(moment);
    imp__edge_choice_free(&c);
    imp__edge_tree_free(&tree);
    imp__edges_free(&edges);
    imp_scene_destroy(scene);
}

int main(void)
{
    ctx = test_context(1);
    choice_test(3);
    choice_test(40);
    imp_context_destroy(ctx);
    return tap_done();
}

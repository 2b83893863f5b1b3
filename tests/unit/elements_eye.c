/* SPDX-License-Identifier: Apache-2.0
 *
 * The eye's rays inside the hierarchy: every leaf has just the rays that end in it, what
 * they carry and see is what a search for each gives, and running out of memory at any
 * place of a solve leaves something that can be solved or destroyed. */
#include "elements/elements.h"
#include "imp_fail_alloc.h"
#include "imp_scene.h"
#include "imp_tap.h"

/* Quads, triangles cut as meshes, and a lamp seen by the eye. */
static const char *const text =
    "<scene version='3.0.0'><sensor type='perspective'><transform name='to_world'>"
    "<lookat origin='0.2,0.4,2.9' target='0,-0.1,0' up='0,1,0'/></transform>"
    "<float name='fov' value='60'/><film type='hdrfilm'>"
    "<integer name='width' value='24'/><integer name='height' value='20'/></film>"
    "</sensor>"
    "<shape type='cube' id='box'><boolean name='flip_normals' value='true'/>"
    "<transform name='to_world'><scale x='1' y='1' z='3'/></transform>"
    "<bsdf type='diffuse'><float name='reflectance' value='0.5'/></bsdf></shape>"
    "<shape type='ply' id='wedge'><string name='filename' value='%s'/></shape>"
    "<shape type='rectangle' id='lamp'><transform name='to_world'>"
    "<scale value='0.2'/><translate x='-0.4' y='0.3' z='0.5'/></transform>"
    "<emitter type='area'><float name='radiance' value='3'/></emitter></shape></scene>";

static const char *const mesh =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face 3\nproperty list uchar int vertex_indices\n"
    "end_header\n-0.6 -0.9 0\n0.7 -0.9 0.1\n0.1 0.5 -0.3\n0.1 -0.9 0.8\n"
    "3 0 3 2\n3 3 1 2\n3 0 1 3\n";

static imp_scene *scene_of(imp_context *ctx)
{
    char path[] = "/tmp/importon-wedge-XXXXXX.ply", xml[4096];
    const int fd = mkstemps(path, 4);
    FILE *f = fd >= 0 ? fdopen(fd, "w") : NULL;
    if (!f || fputs(mesh, f) < 0 || fclose(f) != 0) {
        printf("Bail out! no temporary file\n");
        exit(99);
    }
    snprintf(xml, sizeof xml, text, path);
    imp_scene *s = test_scene_text(ctx, xml, IMP_RGB);
    remove(path);
    return s;
}

static void ranges(const imp_elements *e, const char *name)
{
    size_t wrong = 0, inside = 0, triangles = 0, misses = 0;
    for (size_t k = 0; k < e->n_elements; k++) {
        const struct imp__element *x = &e->elements[k];
        if (x->child) {
            const struct imp__element *c = &e->elements[x->child];
            wrong += c[0].hit[0] != x->hit[0] || c[3].hit[1] != x->hit[1];
            for (int q = 0; q < 3; q++) wrong += c[q].hit[1] != c[q + 1].hit[0];
            continue;
        }
        for (uint32_t i = x->hit[0]; i < x->hit[1]; i++, inside++) {
            const struct imp__el_hit *h = &e->hits[i];
            wrong += imp__el_find(e, h->root, h->u, h->v, NULL) != k;
            triangles += x->corners == 3;
        }
    }
    for (size_t i = 0; i < e->n_hits; i++) misses += e->hits[i].root == EL_NONE;
    tap_ok(wrong == 0 && inside + misses == e->n_hits && triangles > 100,
           "%s: leaves have the rays that end in them # %zu rays, %zu in triangles, "
           "%zu wrong, %zu elements",
           name, inside, triangles, wrong, e->n_elements);
}

static void eye(imp_context *ctx, imp_scene *s, const struct imp_elements_options *o,
                const char *name)
{
    imp_elements *e;
    test_must(ctx, imp_elements_create(s, o, &e));
    test_must(ctx, imp_elements_solve(e));
    ranges(e, name);

    double worst = 0, most = 0, worst_a = 0;
    double *a = calloc(e->n_coef, sizeof *a);
    test_must(ctx, imp__el_see(e));
    for (size_t i = 0; i < e->n_hits && a; i++) {
        const struct imp__el_hit *hit = &e->hits[i];
        double out[3], sum = 0, h[EL_N_MAX];
        imp__el_flat(e, hit, out);
        for (int c = 0; c < e->ch; c++) sum += e->eye[c] * out[c];
        most = fmax(most, sum);
        worst = fmax(worst, fabs(e->seen[hit->ray] - sum));
        if (hit->root == EL_NONE) continue;
        const struct imp__el_root *r = &e->roots[hit->root];
        const uint32_t leaf = imp__el_find(e, hit->root, hit->u, hit->v, NULL);
        h[0] = e->basis.lead[0];
        if (imp__el_n(e, r) > 1)
            imp__basis_eval(&e->basis, imp__to_local(&r->frame, hit->w), h);
        for (int q = 0; q < imp__el_n(e, r); q++)
            a[e->elements[leaf].coef + (size_t)q] += hit->weight * h[q];
    }
    for (size_t q = 0; q < e->n_coef && a; q++)
        worst_a = fmax(worst_a, fabs(a[q] - e->a[q]));
    tap_ok(a && most > 0 && worst < 1e-13 * most && worst_a < 1e-14,
           "%s: what rays see and carry # %.1e of %.3g, %.1e", name, worst, most,
           worst_a);
    free(a);
    imp_elements_destroy(e);
}

/* A negative weight: the lamp that the eye sees counts, on both sides. */
static void negative(imp_context *ctx, imp_scene *s)
{
    double j[2][2];
    for (int k = 0; k < 2; k++) {
        const struct imp_elements_source source = {.size = sizeof source,
                                                   .weight = k ? -2 : 1};
        struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
        struct imp_elements_info info = {.size = sizeof info};
        imp_elements *e;
        o.sources = &source;
        o.n_sources = 1;
        o.eps_first = o.eps_last = 0.05;
        test_must(ctx, imp_elements_create(s, &o, &e));
        test_must(ctx, imp_elements_solve(e));
        test_must(ctx, imp_elements_get_info(e, &info));
        j[k][0] = info.measure;
        j[k][1] = info.measure_direct;
        imp_elements_destroy(e);
    }
    tap_ok(j[0][1] > 0 && fabs(j[1][1] / j[0][1] + 2) < 1e-12 &&
               fabs(j[1][0] / j[0][0] + 2) < 1e-9,
           "weight -2 measures -2 times as much # direct %.4g, %.4g", j[0][1], j[1][1]);
}

/* The lamp of scene a, seen directly, in closed form: a trapezoid in the picture. Lamps
 * are what a grid of rays aliases on: they are bright, small and upright. */
static void lamp_seen(imp_context *ctx)
{
    const double near = 0.49 * 1.4 / (2.4 - 0.625), far = 0.49 * 1.4 / (2.4 - 0.375);
    const double wide = 0.25 * 1.4 / (2.4 - 0.625), narrow = 0.25 * 1.4 / (2.4 - 0.375);
    const double want = 10 * (wide + narrow) / 2 * (near - far);
    static const struct {
        const char *res;
        double limit;
    } at[] = {{"res=16", 1e-3}, {"res=32", 1e-3}, {"res=64", 1e-3}, {"res=128", 1e-3}};
    for (size_t k = 0; k < imp_count(at); k++) {
        imp_scene *s = test_scene(ctx, "elements/a.xml", IMP_MONO, at[k].res);
        struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
        struct imp_elements_info info = {.size = sizeof info};
        imp_elements *e;
        char name[64];
        o.eps_first = o.eps_last = 0.05;
        test_must(ctx, imp_elements_create(s, &o, &e));
        test_must(ctx, imp_elements_solve(e));
        test_must(ctx, imp_elements_get_info(e, &info));
        snprintf(name, sizeof name, "scene a's lamp, rays by default, %s", at[k].res);
        tap_near(info.measure_direct, want, at[k].limit, 0, name);
        imp_elements_destroy(e);
        imp_scene_destroy(s);
    }
}

/* Allocation n fails, n + 1, ...: an error, and the next try on the same object is right
 * to the bit. */
static void memory(void)
{
    struct fail_alloc heap = {0};
    struct imp_context_options co = IMP_CONTEXT_OPTIONS_INIT;
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    imp_context *ctx;
    co.threads = 1;
    co.allocator = fail_alloc_hooks(&heap);
    test_must(NULL, imp_context_create(&co, &ctx));
    imp_scene *s = test_scene(ctx, "elements/b.xml", IMP_MONO, "res=4");
    o.eps_first = 0.05, o.eps_last = 0.01, o.stop = -1;
    double want = NAN;
    int failures = 0, again = 0, bad = 0;
    for (long n = 0; n < 100000; n += 1 + n / 32) {
        imp_elements *e = NULL;
        heap.calls = 0;
        heap.fail_at = n; /* 0: never */
        enum imp_status st = imp_elements_create(s, &o, &e);
        if (st == IMP_OK) st = imp_elements_solve(e);
        heap.fail_at = 0;
        if (n == 0) want = imp__el_measure(e, NULL);
        else if (st == IMP_E_NOMEM) failures++;
        else if (st != IMP_OK) bad++;
        if (e && st != IMP_OK) {
            imp_film *f = NULL;
            const bool whole = e->solved && e->sorted; /* it failed at the very end */
            bad +=
                (imp_elements_image(e, 0, IMP_ELEMENTS_GATHER, 1, &f) == IMP_OK) != whole;
            imp_film_destroy(f);
            /* Elements that were split by then change the rest: the answer is as good. */
            bad += imp_elements_solve(e) != IMP_OK;
            bad += !(fabs(imp__el_measure(e, NULL) / want - 1) < 0.03);
            bad +=
                !(fabs(imp__el_measure_adjoint(e) / imp__el_measure(e, NULL) - 1) < 1e-5);
            again++;
        }
        imp_elements_destroy(e);
        if (n > 0 && st == IMP_OK) break;
    }
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    tap_ok(bad == 0 && failures > 30 && again > 10 && heap.live == 0,
           "out of memory %d times, %d solved again # bad %d, %ld left", failures, again,
           bad, heap.live);
}

int main(void)
{
    imp_context *ctx = test_context(2);
    imp_scene *s = scene_of(ctx);
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    const struct imp_elements_phong glossy = {
        sizeof glossy, "*", {0.2, 0.3, 0.1}, {0.4, 0.3, 0.5}, 10};
    const struct imp_elements_source two[2] = {
        {.size = sizeof *two, .region = {3, 2, 17, 11}, .weight = 0.5},
        {.size = sizeof *two}};
    o.stop = -1, o.eps_last = 2e-3;
    eye(ctx, s, &o, "diffuse");
    o.phong = &glossy, o.n_phong = 1;
    o.sources = two, o.n_sources = 2;
    eye(ctx, s, &o, "glossy, two sources");
    o.n_sources = 1, o.picture = 1;
    eye(ctx, s, &o, "the view is no source");
    negative(ctx, s);
    imp_scene_destroy(s);
    lamp_seen(ctx);
    imp_context_destroy(ctx);
    memory();
    return tap_done();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * What a hostile host does to finite elements: lamps that go out between two solutions,
 * planes that are not numbers, polygons without area beside sound ones. */
#include "elements/elements.h"
#include "imp_scene.h"
#include "imp_tap.h"

static imp_elements *solved(imp_scene *s, const struct imp_elements_options *o)
{
    imp_elements *e;
    test_must(s->ctx, imp_elements_create(s, o, &e));
    test_must(s->ctx, imp_elements_solve(e));
    return e;
}

static void lamp_set(imp_scene *s, const char *name, double value)
{
    char text[64];
    size_t index;
    snprintf(text, sizeof text, "light_%s.emitter.radiance.value", name);
    test_must(s->ctx, imp_scene_find_param(s, text, &index));
    test_must(s->ctx, imp_scene_set_values(s, index, 1, &value));
}

/* A second solution of the same elements knows nothing of light that is not there. */
static void lamps_out(imp_context *ctx)
{
    static const char *const lamp[4] = {"left", "right", "ceiling", "back"};
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    imp_scene *s = test_scene(ctx, "elements/b.xml", IMP_MONO, "res=32");
    o.stop = -1, o.eps_last = 1e-4;
    imp_elements *e = solved(s, &o);
    const size_t links = e->n_links;
    for (int k = 0; k < 3; k++) lamp_set(s, lamp[k], 0);
    imp_elements *fresh = solved(s, &o);
    test_must(ctx, imp_elements_update(e));
    test_must(ctx, imp_elements_solve(e));
    const double a = imp__el_measure(e, NULL), b = imp__el_measure(fresh, NULL);
    tap_ok(
        fabs(a / b - 1) < 0.02 && e->n_links < links + fresh->n_links,
        "three of four lamps go out # %.5g, fresh %.5g; %zu links, then %zu, fresh %zu",
        a, b, links, e->n_links, fresh->n_links);
    imp_elements_destroy(fresh);
    const size_t before = e->n_links;
    lamp_set(s, "back", 0);
    test_must(ctx, imp_elements_update(e));
    test_must(ctx, imp_elements_solve(e));
    tap_ok(imp__el_measure(e, NULL) == 0 && e->n_links == before,
           "all go out: no light, no new link # %zu, %zu: %s", before, e->n_links,
           e->reason);
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

/* Arrays of a host that was compiled with a later header: longer structs, whose new fields
 * must be 0; and structs of other sizes, or none. */
static void later_structs(imp_context *ctx)
{
    struct later_phong {
        struct imp_elements_phong now;
        double more;
    } phong[2] = {{{sizeof *phong, "floor", {0.1, 0.1, 0.1}, {0.6, 0.6, 0.6}, 15}, 0},
                  {{sizeof *phong, "left", {0.2, 0.2, 0.2}, {0.5, 0.5, 0.5}, 9}, 0}};
    struct later_beam {
        struct imp_elements_beam now;
        double more;
    } beams[2] = {{{sizeof *beams, "light_left", {0}, 20}, 0},
                  {{sizeof *beams, "light_right", {0}, 20}, 0}};
    const struct imp_elements_phong p[2] = {
        {sizeof *p, "floor", {0.1, 0.1, 0.1}, {0.6, 0.6, 0.6}, 15},
        {sizeof *p, "left", {0.2, 0.2, 0.2}, {0.5, 0.5, 0.5}, 9}};
    const struct imp_elements_beam q[2] = {{sizeof *q, "light_left", {0}, 20},
                                           {sizeof *q, "light_right", {0}, 20}};
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    imp_scene *s = test_scene(ctx, "elements/b.xml", IMP_MONO, "res=16");
    imp_elements *e = NULL;
    o.eps_last = 3e-3;
    o.order = 4;
    o.n_phong = 2, o.n_beams = 2;
    o.phong = p, o.beams = q;
    imp_elements *now = solved(s, &o);
    o.phong = &phong[0].now, o.beams = &beams[0].now;
    imp_elements *later = solved(s, &o);
    tap_ok(imp__el_measure(now, NULL) == imp__el_measure(later, NULL),
           "longer structs in arrays # %.9g", imp__el_measure(later, NULL));
    imp_elements_destroy(now);
    imp_elements_destroy(later);
    for (int k = 0; k < 4; k++) {
        phong[1].more = k == 0;
        phong[1].now.size = k == 1 ? sizeof *p : sizeof *phong;
        beams[0].now.size = k == 2 ? 0 : sizeof *beams;
        beams[1].more = k == 3;
        const enum imp_status st = imp_elements_create(s, &o, &e);
        tap_ok(st == IMP_E_ARG &&
                   strstr(imp_last_error(ctx), k < 2 ? "phong" : "beams") != NULL,
               "refused # %s", st == IMP_OK ? "taken" : imp_last_error(ctx));
        if (st == IMP_OK) imp_elements_destroy(e);
    }
    imp_scene_destroy(s);
}

static void planes(imp_context *ctx)
{
    imp_scene *s = test_scene(ctx, "elements/b.xml", IMP_MONO, "res=8");
    int refused = 0;
    for (int k = 0; k < 18; k++) {
        struct imp_elements_source p = {.size = sizeof p,
                                        .kind = IMP_ELEMENTS_PLANE,
                                        .origin = {0.2, 0.2, 0.2},
                                        .edge_u = {0.1, 0, 0},
                                        .edge_v = {0, 0, 0.1}};
        struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
        imp_elements *e = NULL;
        double *const v = k % 9 < 3 ? p.origin : k % 9 < 6 ? p.edge_u : p.edge_v;
        v[k % 3] = k < 9 ? NAN : INFINITY;
        o.sources = &p, o.n_sources = 1;
        refused += imp_elements_create(s, &o, &e) == IMP_E_ARG && !e &&
                   strstr(imp_last_error(ctx), "finite") != NULL;
    }
    tap_ok(refused == 18, "planes that are not numbers # %d of 18 refused: %s", refused,
           imp_last_error(ctx));
    imp_scene_destroy(s);
}

/* Measurements of a host with a newer header, longer by members that it does not use, or
 * does use; and of size 0. */
static void sizes(imp_context *ctx)
{
    struct longer {
        struct imp_elements_source now;
        double later[3];
    } two[2] = {{.now = IMP_ELEMENTS_SOURCE_INIT}, {.now = IMP_ELEMENTS_SOURCE_INIT}};
    imp_scene *s = test_scene(ctx, "elements/b.xml", IMP_MONO, "res=8");
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    struct imp_elements_info info = {.size = sizeof info};
    double want[2];
    for (int k = 0; k < 2; k++) {
        two[k].now.kind = IMP_ELEMENTS_SHAPE;
        two[k].now.shape = k ? "floor" : "ceiling";
        o.sources = &two[k].now, o.n_sources = 1, o.eps_last = 5e-3, o.stop = -1;
        imp_elements *e = solved(s, &o);
        test_must(ctx, imp_elements_get_info(e, &info));
        want[k] = info.measures[0];
        imp_elements_destroy(e);
    }
    for (int k = 0; k < 2; k++) two[k].now.size = sizeof two[k];
    o.sources = &two[0].now, o.n_sources = 2;
    imp_elements *e = solved(s, &o);
    test_must(ctx, imp_elements_get_info(e, &info));
    tap_ok(fabs(info.measures[0] / want[0] - 1) < 0.02 &&
               fabs(info.measures[1] / want[1] - 1) < 0.02,
           "longer structs # %g, %g; alone %g, %g", info.measures[0], info.measures[1],
           want[0], want[1]);
    imp_elements_destroy(e);
    two[1].later[2] = 1;
    e = NULL;
    tap_ok(imp_elements_create(s, &o, &e) == IMP_E_ARG && !e, "a later member # %s",
           imp_last_error(ctx));
    two[1].now.size = 0;
    tap_ok(imp_elements_create(s, &o, &e) == IMP_E_ARG && !e, "size 0 is refused # %s",
           imp_last_error(ctx));
    imp_scene_destroy(s);
}

/* A closed box as a mesh, with triangles without area among the sound ones: a furnace. */
static void no_area(imp_context *ctx)
{
    static const float p[8 * 3] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0,
                                   0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1};
    static const uint32_t t[] = {0, 1, 2, 0, 2, 3, 4, 6, 5, 4, 7, 6, 0, 0, 1,
                                 0, 5, 1, 0, 4, 5, 3, 2, 6, 3, 6, 7, 5, 5, 5,
                                 0, 3, 7, 0, 7, 4, 1, 5, 6, 1, 6, 2, 2, 7, 2};
    const double gray[3] = {0.5, 0.5, 0.5}, one[3] = {1, 1, 1};
    imp_scene *s;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "mesh", "box", NULL);
    imp_scene_bool(s, "face_normals", 1);
    imp_scene_mesh(s, 8, imp_count(t) / 3, p, NULL, NULL, t);
    imp_scene_begin(s, "emitter", "area", NULL, NULL);
    imp_scene_rgb(s, "radiance", one);
    imp_scene_end(s);
    imp_scene_begin(s, "bsdf", "diffuse", NULL, NULL);
    imp_scene_rgb(s, "reflectance", gray);
    imp_scene_end(s);
    imp_scene_end(s);
    test_must(ctx, imp_scene_commit(s));
    const struct imp_elements_source source = {
        .size = sizeof source, .kind = IMP_ELEMENTS_SHAPE, .shape = "box"};
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    struct imp_elements_info info = {.size = sizeof info};
    o.sources = &source, o.n_sources = 1;
    o.stop = -1, o.eps_last = 2e-3;
    imp_elements *e = solved(s, &o);
    test_must(ctx, imp_elements_get_info(e, &info));
    /* Irradiance pi E / (1 - rho). */
    tap_ok(
        info.skipped == 3 && info.polygons == 6 &&
            fabs(info.measure / (2 * IMP_PI) - 1) < 0.01,
        "triangles without area are left out # %zu skipped, %zu polygons, %.5f of %.5f",
        info.skipped, info.polygons, info.measure, 2 * IMP_PI);
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

int main(void)
{
    imp_context *ctx = test_context(2);
    lamps_out(ctx);
    later_structs(ctx);
    planes(ctx);
    sizes(ctx);
    no_area(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}

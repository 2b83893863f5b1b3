/* SPDX-License-Identifier: Apache-2.0
 *
 * Whoever derived something from numbers of theta is told, once, after they are set; and
 * not where nothing changed. */
#include "bend/inside.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <stdlib.h>

static const char plates[] =
    "<scene version='3.0.0'><integrator type='direct'/><sensor "
    "type='perspective'><transform name='to_world'>"
    "<lookat origin='0,0,5' target='0,0,0' up='0,1,0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='16'/>"
    "<integer name='height' value='16'/></film></sensor>"
    "<bsdf type='diffuse' id='a'><float name='reflectance' value='0.5'/></bsdf>"
    "<bsdf type='diffuse' id='b'><float name='reflectance' value='0.5'/></bsdf>"
    "<shape type='sphere'><ref id='a'/></shape><shape type='sphere'><ref id='b'/></shape>"
    "<emitter type='constant'/></scene>";

/* Paths of Mitsuba's traverse() to objects that are called by their ids here. */
static void aliases(imp_context *ctx)
{
    static const char scene[] =
        "<scene version='3.0.0'><integrator type='volpath'/>"
        "<texture type='checkerboard' id='squares'/>"
        "<medium type='homogeneous' id='fog'><float name='albedo' value='.5'/>"
        "<phase type='blendphase'><float name='weight' value='.2'/>"
        "<phase type='hg' id='ahead'/><phase type='hg'/></phase></medium>"
        "<bsdf type='twosided' id='sheet'><bsdf type='blendbsdf' id='mixed'>"
        "<float name='weight' value='.3'/><bsdf type='diffuse' id='first'/>"
        "<bsdf type='diffuse'><ref id='squares' name='reflectance'/></bsdf></bsdf>"
        "<bsdf type='diffuse' id='under'/></bsdf>"
        "<shape type='rectangle' id='leaf'><bsdf type='mask'><bsdf type='diffuse' "
        "id='green'/></bsdf></shape>"
        "<shape type='sphere' id='ball'><ref id='sheet'/></shape>"
        "<shape type='sphere' id='cloud'><bsdf type='null'/>"
        "<ref id='fog' name='interior'/></shape>"
        "<shape type='rectangle' name='panel'><emitter type='area' id='glow'/></shape>"
        "<shape type='sphere' id='smoke'><bsdf type='null'/><medium type='homogeneous' "
        "name='interior'><float name='albedo' value='.4'/><phase type='hg'/></medium>"
        "</shape></scene>";
    static const char *const pairs[][2] = {
        {"ball.bsdf.brdf_0.weight.value", "mixed.weight.value"},
        {"ball.bsdf.brdf_0.bsdf_0.reflectance.value", "first.reflectance.value"},
        {"sheet.brdf_0.bsdf_0.reflectance", "first.reflectance.value"},
        {"ball.bsdf.brdf_0.bsdf_1.reflectance.color1.value", "squares.color1.value"},
        {"ball.bsdf.brdf_1.reflectance.value", "under.reflectance.value"},
        {"leaf.bsdf.nested_bsdf.reflectance.value", "green.reflectance.value"},
        {"cloud.interior_medium.albedo.value.value", "fog.albedo.value"},
        {"cloud.interior_medium.phase_function.weight.value", "fog.phase.weight.value"},
        {"cloud.interior_medium.phase_function.phase_0.g", "ahead.g.value"},
        {"fog.phase_function.phase_1.g", "fog.phase.phase_1.g.value"},
        {"smoke.interior_medium.albedo.value.value", "smoke.interior.albedo.value"},
        {"smoke.interior_medium.phase_function.g", "smoke.interior.phase.g.value"},
        {"group.ball.bsdf.brdf_0.weight.value", "mixed.weight.value"},
        {"panel.emitter.radiance.value", "glow.radiance.value"},
    };
    imp_scene *s = test_scene_text(ctx, scene, IMP_RGB);
    for (size_t k = 0; k < sizeof pairs / sizeof *pairs; k++) {
        struct imp_param_info p = {.size = sizeof p};
        size_t index;
        const enum imp_status st = imp_scene_find_param(s, pairs[k][0], &index);
        if (st == IMP_OK) test_must(ctx, imp_scene_get_param(s, index, &p));
        tap_ok(st == IMP_OK && strcmp(p.name, pairs[k][1]) == 0, "%s is %s # %s",
               pairs[k][0], pairs[k][1], st == IMP_OK ? p.name : imp_last_error(ctx));
    }
    static const char *const none[] = {"ball.bsdf.brdf_2.weight.value",
                                       "ball.bsdf.brdf_1.bsdf_0.reflectance.value",
                                       "cloud.exterior_medium.albedo.value.value",
                                       "ball",
                                       "ball.",
                                       "..",
                                       ""};
    for (size_t k = 0; k < sizeof none / sizeof *none; k++) {
        size_t index;
        tap_ok(imp_scene_find_param(s, none[k], &index) == IMP_E_ARG,
               "'%s' is no parameter", none[k]);
    }
    static const char *const geometry[] = {"ball.vertex_positions", "ball.positions",
                                           "camera.x_fov"};
    for (size_t k = 0; k < sizeof geometry / sizeof *geometry; k++) {
        size_t index;
        tap_ok(imp_scene_find_param(s, geometry[k], &index) == IMP_E_ARG &&
                   strstr(imp_last_error(ctx), "are not among them"),
               "%s: numbers that move things are no parameters", geometry[k]);
    }
    size_t leaf;
    tap_ok(imp_scene_find_param(s, "leaf.to_world", &leaf) == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "imp_scene_add_geometry"),
           "and what of this scene becomes one says by what");
    imp_scene_destroy(s);
}

/* Names that are too long for a distance are next to none. */
static void long_names(imp_context *ctx)
{
    char name[121], xml[1024];
    size_t index;
    memset(name, 'x', sizeof name - 1);
    name[sizeof name - 1] = 0;
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'/><sensor "
             "type='perspective'/><emitter type='constant'/><shape type='sphere'><bsdf "
             "type='diffuse' id='%s'/></shape><shape type='sphere'><bsdf type='diffuse' "
             "id='lamp'/></shape></scene>",
             name + 20);
    imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
    tap_ok(imp_scene_find_param(s, "lamq", &index) == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "the nearest are lamp.reflectance.value") &&
               !strstr(imp_last_error(ctx), name + 20),
           "a long name is not next to 'lamq' # %s", imp_last_error(ctx));
    tap_ok(imp_scene_find_param(s, name, &index) == IMP_E_ARG &&
               !strstr(imp_last_error(ctx), "nearest"),
           "nothing is next to a long name # %s", imp_last_error(ctx));
    imp_scene_destroy(s);
}

/* The sum of two numbers, as whoever derived it keeps it. */
struct derived {
    const imp_scene *scene;
    int param[2], n_calls;
    double sum;
    const struct derived *of; /* derived from this; or NULL */
};
static void derive(void *payload)
{
    struct derived *d = payload;
    d->n_calls++;
    d->sum = d->of ? 2 * d->of->sum : 0;
    for (int k = 0; k < 2 && !d->of; k++)
        d->sum += imp__param_get(&d->scene->params[d->param[k]], 0);
}

static void listeners(imp_context *ctx)
{
    imp_scene *s = test_scene_text(ctx, plates, IMP_MONO);
    size_t a, b;
    test_must(ctx, imp_scene_find_param(s, "a.reflectance", &a));
    test_must(ctx, imp_scene_find_param(s, "b.reflectance", &b));
    struct derived sum = {.scene = s, .param = {(int)a, (int)b}};
    struct derived twice = {.scene = s, .of = &sum};
    test_must(ctx, imp__theta_watch(s, (int)a, derive, &sum));
    test_must(ctx, imp__theta_watch(s, (int)b, derive, &sum));
    test_must(ctx, imp__theta_watch(s, (int)b, derive, &sum)); /* again: no effect */
    test_must(ctx, imp__theta_watch(s, (int)a, derive, &twice));

    test_must(ctx, imp_scene_set_values(s, a, 1, (double[]){0.25}));
    tap_ok(sum.n_calls == 1 && sum.sum == 0.75 && twice.n_calls == 1 && twice.sum == 1.5,
           "one parameter: both are called, in order");
    test_must(ctx, imp_scene_set_values(s, b, 1, (double[]){0.125}));
    tap_ok(sum.n_calls == 2 && sum.sum == 0.375 && twice.n_calls == 1,
           "the other: only who watches it");

    double *theta = calloc(imp_scene_n_theta(s), sizeof *theta);
    imp_scene_get_theta(s, theta);
    test_must(ctx, imp_scene_set_theta(s, theta));
    tap_ok(sum.n_calls == 2, "the same numbers: nobody is called");
    theta[s->params[a].info.offset] = theta[s->params[b].info.offset] = 0.5;
    test_must(ctx, imp_scene_set_theta(s, theta));
    tap_ok(sum.n_calls == 3 && sum.sum == 1 && twice.sum == 2, "both at once: one call");
    theta[s->params[b].info.offset] = 2;
    tap_ok(imp_scene_set_theta(s, theta) == IMP_E_ARG && sum.n_calls == 3,
           "refused numbers: nobody is called");

    imp_problem *p;
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "*.reflectance.value"));
    test_must(ctx, imp_problem_set_x(p, (double[]){0.75, 0.125}));
    tap_ok(sum.n_calls == 4 && sum.sum == 0.875, "the numbers of a problem: one call");
    const struct imp_check_row *rows;
    size_t n;
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 1;
    o.only = "frozen,dot,euler,fresh,loss,ends";
    o.draws_s = 0.02;
    o.paths = 8, o.fresh_spp = 4;
    test_must(ctx, imp_check(p, &o, &run, &rows, &n));
    tap_ok(sum.n_calls > 4 && sum.sum == 0.875 && twice.sum == 1.75,
           "check: called, and at the end as it was");
    imp_problem_destroy(p);
    free(theta);
    imp_scene_destroy(s);
}

/* A grid keeps its greatest coefficient, and steps of later plans are chosen by it. */
static void fields(imp_context *ctx)
{
    imp_scene *s = test_scene_text(
        ctx,
        "<scene version='3.0.0'><sensor type='perspective'/><shape type='sphere'>"
        "<bsdf type='null'/><medium type='graded' id='glass' name='interior'>"
        "<volume type='grid'><vector name='lo' value='-2,-2,-2'/>"
        "<vector name='hi' value='2,2,2'/><integer name='cells' value='4'/>"
        "<float name='index' value='1.25'/></volume></medium></shape>"
        "<emitter type='constant'/></scene>",
        IMP_RGB);
    size_t at;
    test_must(ctx, imp_scene_find_param(s, "glass.field.coefficients", &at));
    const imp_field *f = imp__graded_field(s->bodies[0]->graded);
    const double before = imp__field_index_max(f);
    test_must(ctx, imp_scene_set_values(s, at, 1, (double[]){1.5}));
    tap_ok(before == 1.25 && imp__field_index_max(f) == 1.5,
           "greatest index of a grid: %g, then %g", before, imp__field_index_max(f));
    imp_scene_destroy(s);
}

int main(void)
{
    imp_context *ctx = test_context(1);
    aliases(ctx);
    long_names(ctx);
    listeners(ctx);
    fields(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}

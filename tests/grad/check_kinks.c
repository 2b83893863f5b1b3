/* SPDX-License-Identifier: Apache-2.0
 *
 * Checks of frozen walks where the picture has kinks: behind a ball of graded index hang
 * texels as different as can be, and the slope of what a walk sees jumps from texel to
 * texel. A walk that stands on a border is no wrong derivative, and a wrong derivative
 * is one on borders too. Fresh steps of a spot's angles stay between beam and cutoff. */
#include "bend/inside.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse_scenes.h"
#include "math/rng.h"
#include <math.h>

#define PATHS 1000

/* The picture is repeated 5 times each way: texels are small, borders are near. */
static const char scene[] =
    "<scene version='3.0.0'><integrator type='path'/><sensor type='perspective'>"
    "<float name='fov' value='18'/><transform name='to_world'>"
    "<lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='16'/><integer name='height' "
    "value='16'/><rfilter type='box'/></film></sensor>"
    "<shape type='sphere' id='lens'><bsdf type='null'/>"
    "<medium type='graded' name='interior'><volume type='plume'>"
    "<float name='n0' value='1.2'/><float name='b' value='0.3'/>"
    "<float name='width' value='0.5'/></volume><float name='step' value='0.1'/></medium>"
    "</shape><shape type='rectangle'><transform name='to_world'><scale value='3'/>"
    "<translate z='-2'/></transform><emitter type='area'><texture type='bitmap' "
    "name='radiance' id='map'><string name='filename' value='" IMP_SCENES
    "/textured/waves.png'/><transform name='to_uv'><scale value='5'/></transform>"
    "</texture></emitter></shape></scene>";

static imp_context *ctx;

static imp_scene *dots(void)
{
    imp_scene *s = test_scene_text(ctx, scene, IMP_RGB);
    static double texel[64 * 64 * 3];
    size_t k;
    test_must(ctx, imp_scene_find_param(s, "map.data", &k));
    for (uint64_t i = 0; i < 64 * 64 * 3; i++)
        texel[i] = (imp__mix64(i + 77) & 1) ? 2 : 0.01;
    test_must(ctx, imp_scene_set_values(s, k, 64 * 64 * 3, texel));
    return s;
}

struct found {
    int failed, kinks;
    double worst;
};

static struct found frozen(imp_scene *s, uint64_t seed)
{
    imp_problem *p = test_problem(ctx, s, "lens*");
    struct found f = {0};
    const struct imp_check_row *rows;
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    size_t n;
    o.only = "frozen,dot,euler,fresh,loss,ends";
    o.draws_s = 0.02;
    o.paths = PATHS;
    o.fresh_spp = 1;
    run.seed = seed;
    test_must(ctx, imp_check(p, &o, &run, &rows, &n));
    for (size_t i = 0; i < n; i++) {
        const struct imp_check_row *r = &rows[i];
        if (strcmp(r->method, "frozen") || r->limit == 0) continue;
        f.failed += !r->ok;
        f.kinks += r->kinks;
        f.worst = fmax(f.worst, r->error);
    }
    imp_problem_destroy(p);
    return f;
}

/* The field's kind with a transpose that is off. */
static const struct imp__field_ops *right;
static double off;
static void wrong_splat(const imp_field *f, const imp_v3 *x, double a, const imp_v3 *b,
                        struct imp__bar *bar)
{
    const imp_v3 c = *b * off;
    right->splat(f, x, a * off, &c, bar);
}

/* A spot whose light falls off within one degree: steps of a third of an angle would cross it. */
static void spot_test(void)
{
    imp_scene *s = test_scene_text(
        ctx,
        "<scene version='3.0.0'><integrator type='direct'/><sensor type='perspective'>"
        "<float name='fov' value='50'/><transform name='to_world'><lookat "
        "origin='.4,-5.5,2.3' target='0,0,.6' up='0,0,1'/></transform><film "
        "type='hdrfilm'><integer name='width' value='24'/><integer name='height' "
        "value='16'/><rfilter type='box'/></film></sensor><shape type='rectangle'>"
        "<transform name='to_world'><scale value='3'/></transform><bsdf type='diffuse'/>"
        "</shape><emitter type='spot' id='lamp'><float name='intensity' "
        "value='9'/><float "
        "name='cutoff_angle' value='24'/><float name='beam_width' value='23'/><transform "
        "name='to_world'><lookat origin='0,0,3' target='.2,0,0' up='0,1,0'/></transform>"
        "</emitter></scene>",
        IMP_MONO);
    imp_problem *p = test_problem(ctx, s, "lamp.cutoff_angle*");
    test_must(ctx, imp_problem_activate(p, "lamp.beam_width*"));
    const struct imp_check_row *rows;
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    size_t n;
    o.only = "fresh";
    o.fresh_spp = 256;
    test_must(ctx, imp_check(p, &o, &run, &rows, &n));
    tap_ok(n == 2, "a spot's angles have a row each");
    for (size_t i = 0; i < n; i++)
        tap_ok(rows[i].ok == 1 && rows[i].step < 1 &&
                   rows[i].se < 0.1 * fabs(rows[i].reference),
               "%s # %.5f, differences %.5f se %.5f, step %g", rows[i].param,
               rows[i].value, rows[i].reference, rows[i].se, rows[i].step);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(0);
    spot_test();
    imp_scene *s = dots();
    struct found sum = {0};
    uint64_t kinked = 0;
    int most = 0;
    for (uint64_t seed = 1; seed <= 8; seed++) {
        const struct found f = frozen(s, seed);
        sum.failed += f.failed;
        sum.kinks += f.kinks;
        if (f.kinks > most) most = f.kinks, kinked = seed;
        sum.worst = fmax(sum.worst, f.worst);
    }
    tap_ok(sum.kinks > 0, "walks stand on kinks # %d", sum.kinks);
    tap_ok(sum.failed == 0, "and that is no failure # %d rows, worst error %.1e",
           sum.failed, sum.worst);

    imp_field *field = (imp_field *)(uintptr_t)imp__graded_field(s->bodies[0]->graded);
    struct imp__field_ops wrong = *field->ops;
    right = field->ops;
    wrong.splat = wrong_splat;
    wrong.kick_back = NULL;
    field->ops = &wrong;
    for (int k = 0; k < 3; k++) {
        static const double much[] = {1.01, 1.0001, -1};
        off = much[k];
        const struct found f = frozen(s, kinked);
        tap_ok(f.failed == 6 && f.kinks == 0,
               "gradients times %g are caught, every one, on kinks too # %d of 6, %.1e; "
               "%d kinks",
               off, f.failed, f.worst, f.kinks);
    }
    field->ops = right;
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return tap_done();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * The rod (rod.h): what leaves at its left end, and the derivatives with respect to the
 * eight extinctions and albedos.
 *
 * In three dimensions the rod is a medium whose phase function is two narrow cones, which
 * a host registers. The derivative of an empty cell is where estimators differ that
 * divide by extinction: of collisions that stand where they are, none is ever in it. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/estimate/problem_tracer.h"
#include "inverse/estimate/replicates.h"
#include "math/warp.h"
#include "rod.h"
#include "vol_write.h"
#include "walk/core/walk.h"

static imp_context *ctx;

/* ---- The phase function ------------------------------------------------------------ */

#define CONE 1e-6 /* 1 - cos of its angle */

static void rod_sample(const struct imp_phase *p, const imp_spec *in, const double u[3],
                       struct imp_dirs *d)
{
    (void)p, (void)in;
    const double c = 1 - CONE * u[1], s = sqrt(1 - c * c), phi = 2 * M_PI * u[2];
    d->wi = (imp_v3){s * cos(phi), s * sin(phi), u[0] < .5 ? c : -c, 0};
}
static double rod_pdf(const struct imp_phase *p, const imp_spec *in,
                      const struct imp_dirs *d)
{
    (void)p, (void)in;
    /* Directions are rounded to floats. */
    return fabs(d->wi[2]) >= 1 - CONE - 3e-7 ? 1 / (4 * M_PI * CONE) : 0;
}
static void rod_eval(const struct imp_phase *p, const imp_spec *in,
                     const struct imp_dirs *d, imp_spec *f)
{
    imp_spec_fill(f, rod_pdf(p, in, d));
}
static void rod_eval_d(const struct imp_phase *p, const imp_spec *in,
                       const struct imp_dirs *d, imp_spec *df)
{
    (void)p, (void)in, (void)d, (void)df;
}
static const struct imp_phase_ops rod = {.size = sizeof rod,
                                         .name = "rod",
                                         .sample = rod_sample,
                                         .eval = rod_eval,
                                         .pdf = rod_pdf,
                                         .eval_d = rod_eval_d};

/* ---- The scene ------------------------------------------------------------------------ */

static imp_scene *scene_make(const char *extinction, const char *albedo_file)
{
    char text[4096];
    snprintf(
        text, sizeof text,
        "<scene version='3.0.0'><integrator type='volpath'>"
        "<integer name='rr_depth' value='100'/></integrator>"
        "<medium type='heterogeneous' id='rod'><phase type='rod'/>"
        "<volume name='sigma_t' type='gridvolume' id='sigma'>"
        "<string name='filename' value='%s'/>"
        "<string name='filter_type' value='nearest'/>"
        "<transform name='to_world'><translate x='-0.5' y='-0.5'/></transform></volume>"
        "<volume name='albedo' type='gridvolume' id='albedo'>"
        "<string name='filename' value='%s'/>"
        "<string name='filter_type' value='nearest'/>"
        "<transform name='to_world'><translate x='-0.5' y='-0.5'/></transform></volume>"
        "</medium>"
        "<shape type='cube'><bsdf type='null'/><ref id='rod' name='interior'/>"
        "<transform name='to_world'><scale x='0.6' y='0.6' z='0.7'/>"
        "<translate z='0.5'/></transform></shape>"
        "<shape type='rectangle'><emitter type='area'>"
        "<float name='radiance' value='%g'/></emitter>"
        "<transform name='to_world'><translate z='-0.6'/></transform></shape>"
        "<shape type='rectangle'><emitter type='area'>"
        "<float name='radiance' value='%g'/></emitter>"
        "<transform name='to_world'><rotate x='1' angle='180'/><translate z='2'/>"
        "</transform></shape>"
        "<sensor type='orthographic'><transform name='to_world'><scale value='0.001'/>"
        "<lookat origin='0,0,-0.4' target='0,0,1' up='0,1,0'/></transform>"
        "<film type='hdrfilm'><integer name='width' value='16'/>"
        "<integer name='height' value='16'/><rfilter type='box'/></film></sensor>"
        "</scene>",
        extinction, albedo_file, ROD_LEFT, ROD_RIGHT);
    return test_scene_text(ctx, text, IMP_MONO);
}

/* Gradient of the mean over all walks with collisions that stand: a sink of sums. */
struct sums {
    struct imp_sink sink;
    int param;
    double sum[ROD_CELLS];
};
static void sums_add(struct imp_sink *sink, int param, size_t element, int channels,
                     const imp_spec *bar)
{
    struct sums *s = (struct sums *)sink;
    (void)channels;
    if (param == s->param) s->sum[element] += (*bar)[0];
}

int main(void)
{
    static const double published[ROD_CELLS] = {-.00394, -.01404, -.00166, -.01853,
                                                -.00754, -.00911, -.00679, -.01163};
    char s_path[64], a_path[64];
    double s[ROD_CELLS], a[ROD_CELLS], g[64], se[64];
    struct imp_estimate v;
    struct imp_run run = IMP_RUN_INIT;
    for (int i = 0; i < ROD_CELLS; i++) {
        s[i] = (double)rod_sigma[i];
        a[i] = (double)rod_albedo[i];
    }
    tap_near(rod_exact(s, a), .21356738, 0, 5e-8, "truth: what leaves");
    for (int i = 0; i < ROD_CELLS; i++)
        tap_near(rod_derivative(i, 0), published[i], 0, 6e-6, "truth: its derivative");

    ctx = test_context(0);
    test_must(ctx, imp_register_phase(ctx, &rod));
    vol_write(s_path, 1, 1, ROD_CELLS, 1, rod_sigma);
    vol_write(a_path, 1, 1, ROD_CELLS, 1, rod_albedo);
    imp_scene *scene = scene_make(s_path, a_path);
    imp_problem *p = test_problem(ctx, scene, "*");
    run.spp = 1500;
    run.seed = 3;
    test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g, se));
    struct tap_stat stat = {run.spp * 256., v.value, 0};
    stat.m2 = v.se * v.se * stat.n * (stat.n - 1);
    tap_z(&stat, rod_exact(s, a), 1e-3, "what leaves");
    for (int k = 0; k < 2; k++) {
        const size_t at = test_variable(p, scene, ctx, k ? "albedo.data" : "sigma.data");
        for (size_t i = 0; i < ROD_CELLS; i++) {
            char what[64];
            struct tap_stat d = {1e6, g[at + i], 0};
            d.m2 = se[at + i] * se[at + i] * d.n * (d.n - 1);
            snprintf(what, sizeof what, "derivative by %s of cell %zu",
                     k ? "albedo" : "extinction", i);
            tap_z(&d, rod_derivative((int)i, k), 6e-4, what);
        }
    }

    /* Walks whose collisions stand. */
    struct imp_arena arena;
    struct imp_tracer tracer;
    struct sums sums = {.sink.add = sums_add};
    size_t param;
    test_must(ctx, imp_scene_find_param(scene, "sigma.data", &param));
    sums.param = (int)param;
    test_must(ctx, imp__problem_tracer(p, &run, NULL, &tracer));
    tracer.collisions_fixed = true;
    imp__arena_init(&arena, ctx);
    const int walks = 400000;
    struct tap_stat empty = {0, 0, 0};
    for (int i = 0; i < walks; i++) {
        const struct imp_arena_mark mark = imp__arena_mark(&arena);
        struct imp_walk walk;
        const double before = sums.sum[1];
        imp__walk_trace(&tracer, &arena, i % 16, i / 16 % 16, i / 256, &walk);
        imp__walk_sweep(&tracer, &walk, imp__spec(1), &sums.sink);
        tap_add(&empty, sums.sum[1] - before);
        imp__arena_rewind(&arena, mark);
    }
    imp__arena_free(&arena);
    const double se_empty = tap_se(&empty);
    tap_ok(fabs(empty.mean - -.02669) <= 4 * se_empty + 1e-5 && se_empty < 5e-4 &&
               fabs(empty.mean - rod_derivative(1, 0)) > 10 * se_empty,
           "collisions that stand never see the gain of the empty cell "
           "# mean %.5f se %.2g, truth %.5f",
           empty.mean, se_empty, rod_derivative(1, 0));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
    remove(s_path);
    remove(a_path);
    return tap_done();
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Recorded walks as a host uses them. At the parameters of the draw, pictures, losses and
 * gradients are those of tracing, but for rounding, on any number of threads. At others they
 * agree with fresh ones within their errors, and gradients in both modes agree with each
 * other and with differences. The effective sample size is compared with a closed form.
 * What they cannot answer is refused. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "walk/kept/store.h"
#include <importon/elements.h>
#include <importon/walks.h>

#define FAIL_Z 4.5

static imp_context *ctx;

/* ---- Pictures -------------------------------------------------------------------- */

static imp_film *render(imp_scene *scene, const imp_walks *walks, int spp, uint64_t seed,
                        enum imp_points points)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = spp;
    run.seed = seed;
    run.points = points;
    run.walks = walks;
    test_must(scene->ctx, imp_render(scene, &run, &film));
    return film;
}
static imp_walks *keep(imp_scene *scene, int spp, uint64_t seed, enum imp_points points,
                       bool losses, double survival)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_walks_options o = IMP_WALKS_OPTIONS_INIT;
    imp_walks *walks;
    run.spp = spp;
    run.seed = seed;
    run.points = points;
    o.losses = losses;
    o.survival = survival;
    test_must(scene->ctx, imp_walks_keep(scene, &run, &o, &walks));
    return walks;
}
static bool same_film(imp_film *a, imp_film *b)
{
    struct imp_film_info i = {.size = sizeof i}, j = {.size = sizeof j};
    imp_film_get_info(a, &i);
    imp_film_get_info(b, &j);
    const size_t n = (size_t)i.width * (size_t)i.height * (size_t)i.channels;
    return i.channels == j.channels && i.width == j.width && i.height == j.height &&
           memcmp(imp_film_mean(a), imp_film_mean(b), n * sizeof(float)) == 0 &&
           (!i.has_se || memcmp(imp_film_se(a), imp_film_se(b), n * sizeof(float)) == 0);
}

/* ---- Losses ---------------------------------------------------------------------- */

#define NUMBERS 256
struct answer {
    struct imp_estimate f;
    double g[NUMBERS], se[NUMBERS];
};
static imp_problem *problem_of(imp_scene *scene, const char *glob)
{
    imp_problem *p;
    test_must(scene->ctx, imp_problem_create(scene, &p));
    test_must(scene->ctx, imp_problem_activate(p, glob));
    struct imp_sensor_info info = {.size = sizeof info};
    test_must(scene->ctx, imp_scene_get_sensor(scene, 0, &info));
    struct imp_target t = IMP_TARGET_INIT;
    const size_t n = (size_t)info.width * (size_t)info.height * (size_t)scene->channels;
    float *pixels = calloc(n, sizeof *pixels);
    for (size_t k = 0; k < n; k++) pixels[k] = 0.1f + 0.3f * (float)(k % 7) / 7;
    t.width = info.width;
    t.height = info.height;
    t.channels = scene->channels;
    t.pixels = pixels;
    test_must(scene->ctx, imp_problem_add_target(p, &t));
    free(pixels);
    return p;
}
static struct answer loss(imp_problem *p, const imp_walks *walks, int spp, uint64_t seed,
                          enum imp_points points)
{
    struct answer a = {.f = {0}};
    struct imp_run run = IMP_RUN_INIT;
    run.spp = spp;
    run.seed = seed;
    run.points = points;
    run.walks = walks;
    test_must(ctx, imp_problem_objective(p, NULL, &run, &a.f, a.g, a.se));
    return a;
}

/* ---- The same bits --------------------------------------------------------------- */

/* Largest difference, of values that are not small beside the errors. */
static double apart(const struct answer *a, const struct answer *b)
{
    double worst = fabs(a->f.value - b->f.value) / fabs(a->f.value);
    worst = fmax(worst, fabs(a->f.se - b->f.se) / a->f.se);
    for (int k = 0; k < NUMBERS; k++) {
        const double size = fmax(fabs(a->g[k]), a->se[k]);
        if (!(size > 0)) continue;
        worst = fmax(worst, fabs(a->g[k] - b->g[k]) / size);
        worst = fmax(worst, fabs(a->se[k] - b->se[k]) / size);
    }
    return worst;
}

static void to_the_bit(const char *file, const char *defines, enum imp_color_mode mode,
                       const char *glob, enum imp_points points)
{
    imp_scene *scene = test_scene(ctx, file, mode, defines);
    imp_walks *walks = keep(scene, 9, 5, points, false, -1);
    imp_film *traced = render(scene, NULL, 9, 5, points);
    imp_film *kept = render(scene, walks, 0, 0, IMP_POINTS_SCENE);
    tap_ok(same_film(traced, kept), "%s %s: picture, to the bit", file,
           defines ? defines : "");
    imp_film_destroy(traced);
    imp_film_destroy(kept);
    imp_walks_destroy(walks);

    imp_problem *p = problem_of(scene, glob);
    walks = keep(scene, 9, 5, points, true, -1);
    const struct answer a = loss(p, NULL, 9, 5, points);
    const struct answer b = loss(p, walks, 0, 0, IMP_POINTS_SCENE);
    const double worst = apart(&a, &b);
    /* Walks that are reduced are rounded in another order; others are not. */
    tap_ok(worst <= (mode == IMP_SPECTRAL ? 0 : 1e-11) && a.g[0] != 0,
           "%s %s: loss, gradient and errors # %.1e", file, defines ? defines : "",
           worst);
    imp_problem_destroy(p);
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

static void any_threads(void)
{
    imp_context *three = test_context(3);
    imp_scene *one_scene = test_scene(ctx, "cornell.xml", IMP_RGB, "res=20");
    imp_scene *three_scene = test_scene(three, "cornell.xml", IMP_RGB, "res=20");
    imp_walks *a = keep(one_scene, 8, 3, IMP_POINTS_SCENE, false, 0);
    imp_walks *b = keep(three_scene, 8, 3, IMP_POINTS_SCENE, false, 0);
    imp_film *x = render(one_scene, a, 0, 0, 0), *y = render(three_scene, b, 0, 0, 0);
    struct imp_walks_weight u = IMP_WALKS_WEIGHT_INIT, v = IMP_WALKS_WEIGHT_INIT;
    size_t white;
    test_must(ctx, imp_scene_find_param(one_scene, "white.reflectance", &white));
    test_must(ctx, imp_scene_set_values(one_scene, white, 1, &(double){0.6}));
    test_must(three, imp_scene_set_values(three_scene, white, 1, &(double){0.6}));
    test_must(ctx, imp_walks_weigh(a, 0, NULL, &u));
    test_must(three, imp_walks_weigh(b, 0, NULL, &v));
    tap_ok(same_film(x, y) && u.ess == v.ess && u.growth == v.growth,
           "one and three threads: the same bits # ess %.4f growth %.3f", u.ess,
           u.growth);
    imp_film_destroy(x);
    imp_film_destroy(y);
    imp_walks_destroy(a);
    imp_walks_destroy(b);
    imp_scene_destroy(one_scene);
    imp_scene_destroy(three_scene);
    imp_context_destroy(three);
}

/* ---- At other parameters --------------------------------------------------------- */

static void set(imp_scene *scene, const char *name, double factor)
{
    size_t k;
    test_must(ctx, imp_scene_find_param(scene, name, &k));
    struct imp_param_info info = {.size = sizeof info};
    test_must(ctx, imp_scene_get_param(scene, k, &info));
    double *x = malloc((info.count + 1) * sizeof *x);
    test_must(ctx, imp_scene_get_values(scene, k, x));
    for (size_t e = 0; e < info.count; e++)
        x[e] = fmin(x[e] * factor * (1 + 0.05 * (double)(e % 3)), info.hi);
    test_must(ctx, imp_scene_set_values(scene, k, info.count, x));
    free(x);
}

/* Means over blocks of the picture, recorded walks against fresh ones, with both errors. */
static void elsewhere(const char *file, const char *defines, enum imp_color_mode mode,
                      const char *name, double factor, double least)
{
    enum { BLOCKS = 4 };
    imp_scene *scene = test_scene(ctx, file, mode, defines);
    imp_walks *walks = keep(scene, 64, 21, IMP_POINTS_INDEPENDENT, false, 0);
    imp_film *before = render(scene, walks, 0, 0, 0);
    set(scene, name, factor);
    struct imp_walks_weight weight = IMP_WALKS_WEIGHT_INIT;
    test_must(ctx, imp_walks_weigh(walks, 0, NULL, &weight));
    imp_film *kept = render(scene, walks, 0, 0, 0);
    imp_film *fresh = render(scene, NULL, 128, 22, IMP_POINTS_INDEPENDENT);
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(kept, &info);
    double worst = 0, change = 0;
    for (int by = 0; by < BLOCKS; by++)
        for (int bx = 0; bx < BLOCKS; bx++) {
            double d = 0, var = 0, old = 0;
            for (int y = by * info.height / BLOCKS; y < (by + 1) * info.height / BLOCKS;
                 y++)
                for (int x = bx * info.width / BLOCKS; x < (bx + 1) * info.width / BLOCKS;
                     x++)
                    for (int c = 0; c < imp_min(info.channels, 3); c++) {
                        const size_t k =
                            (size_t)(y * info.width + x) * (size_t)info.channels +
                            (size_t)c;
                        d += imp_film_mean(kept)[k] - imp_film_mean(fresh)[k];
                        old += imp_film_mean(before)[k] - imp_film_mean(fresh)[k];
                        /* Channels of one walk depend on each other. */
                        var += 3 * (pow(imp_film_se(kept)[k], 2) +
                                    pow(imp_film_se(fresh)[k], 2));
                    }
            if (!(var > 0)) continue;
            worst = fmax(worst, fabs(d) / sqrt(var));
            change = fmax(change, fabs(old) / sqrt(var));
        }
    tap_ok(worst < FAIL_Z && change > 1 && weight.ess >= least && !weight.refused,
           "%s: %s times %g # worst z %.2f, picture changed by %.0f, ess %.3f growth "
           "%.3f %s",
           file, name, factor, worst, change, weight.ess, weight.growth,
           weight.refused ? weight.refused : "");
    imp_film_destroy(before);
    imp_film_destroy(kept);
    imp_film_destroy(fresh);
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* <J v, s> = <v, J' s>, and differences of the loss on the same walks. */
static void both_modes(const char *file, const char *defines, enum imp_color_mode mode,
                       const char *glob, const char *moved)
{
    imp_scene *scene = test_scene(ctx, file, mode, defines);
    imp_walks *walks = keep(scene, 8, 31, IMP_POINTS_INDEPENDENT, true, 0);
    imp_problem *p = problem_of(scene, glob);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_sensor_info info = {.size = sizeof info};
    const size_t n = imp_problem_n_variables(p);
    double g[NUMBERS], v[NUMBERS], x[NUMBERS], forward = 0, reverse = 0, size = 0;
    imp_film *jv;
    set(scene, moved, 0.9);
    run.walks = walks;
    test_must(ctx, imp_scene_get_sensor(scene, 0, &info));
    const size_t pixels =
        (size_t)info.width * (size_t)info.height * (size_t)scene->channels;
    float *adjoint = calloc(pixels, sizeof *adjoint);
    for (size_t k = 0; k < n; k++) v[k] = 0.5 + 0.1 * (double)(k % 5);
    /* Of one pixel: pictures hold floats, and sums of many would show it. */
    const size_t one = pixels / 2;
    double most = 0;
    for (int c = 0; c < scene->channels; c++) {
        memset(adjoint, 0, pixels * sizeof *adjoint);
        adjoint[one - one % (size_t)scene->channels + (size_t)c] = 1;
        test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, NULL));
        test_must(ctx, imp_problem_forward(p, v, &run, &jv));
        forward = imp_film_mean(jv)[one - one % (size_t)scene->channels + (size_t)c];
        reverse = size = 0;
        for (size_t k = 0; k < n; k++) reverse += g[k] * v[k], size += fabs(g[k] * v[k]);
        most = fmax(most, fabs(forward - reverse) / fmax(size, 1e-30));
        imp_film_destroy(jv);
    }
    tap_ok(most < 1e-6, "%s: forward and reverse, through a picture of floats # %.2g",
           file, most);
    free(adjoint);

    /* The loss of fixed decisions is smooth, and the gradient is its derivative for a
     * quadratic loss with leave-one-out. */
    imp_problem_get_x(p, x);
    const struct answer here = loss(p, walks, 0, 0, 0);
    double slope = 0, best = INFINITY;
    for (size_t k = 0; k < n; k++) slope += here.g[k] * v[k] * x[k];
    for (double h = 1e-3; h > 1e-6; h /= 10) {
        struct imp_estimate f[2];
        double at[NUMBERS];
        for (int s = 0; s < 2; s++) {
            for (size_t k = 0; k < n; k++) at[k] = x[k] * (1 + (s ? h : -h) * v[k]);
            test_must(ctx, imp_problem_objective(p, at, &run, &f[s], NULL, NULL));
        }
        best =
            fmin(best, fabs((f[1].value - f[0].value) / (2 * h) - slope) / fabs(slope));
    }
    test_must(ctx, imp_problem_set_x(p, x));
    tap_ok(best < 1e-6, "%s: gradient against differences of the loss # %.2g", file,
           best);
    imp_problem_destroy(p);
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* ---- Walk by walk, in doubles ---------------------------------------------------- */

struct dotted {
    struct imp_sink sink; /* first */
    const struct imp_active *active;
    const double *v;
    double sum;
};
static void dotted_add(struct imp_sink *sink, int param, size_t element, int channels,
                       const imp_spec *bar)
{
    struct dotted *d = (struct dotted *)sink;
    const int64_t base = d->active->base[param];
    if (base < 0) return;
    for (int c = 0; c < 3; c++)
        d->sum +=
            (*bar)[c] * d->v[(size_t)base + element + (size_t)(channels == 3 ? c : 0)];
}

static void walk_by_walk(const char *file, const char *defines, const char *moved)
{
    imp_scene *scene = test_scene(ctx, file, IMP_RGB, defines);
    imp_walks *walks = keep(scene, 4, 31, IMP_POINTS_INDEPENDENT, true, 0);
    const struct imp_film_desc *film = &scene->sensors[0]->film;
    struct imp_active active;
    struct imp_arena arena;
    double worst = 0, sum = 0;
    set(scene, moved, 0.9);
    test_must(ctx, imp__active_create(scene, walks->chosen, &active));
    double *v = calloc(active.n, sizeof *v);
    for (size_t k = 0; k < active.n; k++) v[k] = 0.1 + (double)(k % 3);
    imp__arena_init(&arena, ctx);
    const struct imp_tracer tracer = {.scene = scene,
                                      .integrator = walks->integrator,
                                      .sensor = scene->sensors[0],
                                      .active = &active,
                                      .kept = &walks->stores[0],
                                      .collisions_fixed = true};
    for (int i = 0; i < 1000; i++) {
        const struct imp_arena_mark mark = imp__arena_mark(&arena);
        struct dotted d = {{.add = dotted_add}, &active, v, 0};
        struct imp_walk w;
        imp__walk_trace(&tracer, &arena, i * 7 % film->crop_w, i * 13 % film->crop_h,
                        i % 4, &w);
        const imp_spec dot = imp__walk_tangent(&tracer, &w, v);
        imp__walk_sweep(&tracer, &w, (imp_spec){1, 1, 1, 0}, &d.sink);
        const double forward = dot[0] + dot[1] + dot[2];
        worst = fmax(worst, fabs(forward - d.sum) / fmax(fabs(forward), 1e-2));
        sum += fabs(forward);
        imp__arena_rewind(&arena, mark);
    }
    tap_ok(worst < 1e-12 && sum > 0, "%s: forward and reverse, walk by walk # %.2g", file,
           worst);
    imp__arena_free(&arena);
    imp__active_destroy(ctx, &active);
    free(v);
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* ---- The effective sample size ---------------------------------------------------- */

/* A phong lobe seen from above, drawn half by a cosine and half by (m + 1)/2 pi cos^m; by
 * cosines c the density is p_m(c) = c + (m + 1)/2 c^m. Drawn with m = 1, where p_1 = 2 c,
 *
 *     n/ESS = int_0^1 p_m^2/p_1 dc = 3/4 + (m + 1)^2/(16 m) */
static void closed_form(double m)
{
    static const char xml[] =
        "<scene version='3.0.0'><integrator type='path'/><sensor type='orthographic'>"
        "<transform name='to_world'><lookat origin='0,0,4' target='0,0,0' up='0,1,0'/>"
        "</transform><film type='hdrfilm'><integer name='width' value='16'/><integer "
        "name='height' value='16'/><rfilter type='box'/></film></sensor>"
        "<shape type='rectangle'><transform name='to_world'><scale value='4'/>"
        "</transform><bsdf type='phong' id='lobe'><float name='exponent' value='1'/>"
        "</bsdf></shape><emitter type='constant'/></scene>";
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    imp_walks *walks = keep(scene, 256, 3, IMP_POINTS_INDEPENDENT, false, 0);
    struct imp_walks_weight w = IMP_WALKS_WEIGHT_INIT;
    size_t k;
    test_must(ctx, imp_walks_weigh(walks, 0, NULL, &w));
    tap_ok(w.ess == 1 && !w.refused && w.n_walks == 65536, "at the draw all walks count");
    test_must(ctx, imp_scene_find_param(scene, "lobe.exponent", &k));
    test_must(ctx, imp_scene_set_values(scene, k, 1, &m));
    test_must(ctx, imp_walks_weigh(walks, 0, NULL, &w));
    /* 65536 walks; w^2 has a relative spread of about 2. */
    tap_near(w.ess, 1 / (0.75 + (m + 1) * (m + 1) / (16 * m)), 0.02, 0,
             "exponent moved: effective sample size in closed form");
    float mask[256] = {0};
    for (int i = 0; i < 64; i++) mask[i] = 1;
    test_must(ctx, imp_walks_weigh(walks, 0, mask, &w));
    tap_ok(w.n_walks == 16384, "and of a quarter of the picture # %.3f", w.ess);
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* The same lobe, drawn with the probability s and else evenly: q_m = s p_m + 1 - s whichever
 * drew, and n/ESS = int_0^1 q_m^2/q_1 dc. Where the vertex splits, both are drawn, and all
 * that was drawn has the ratio p_m/p_1. */
static void closed_form_of_mixtures(double m, double s, bool splits)
{
    enum { CELLS = 1000 };
    char xml[1024];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'><string name='weights' "
             "value='kernel=%g,uniform=%g'/><integer name='split' value='%d'/>"
             "</integrator><sensor type='orthographic'><transform name='to_world'>"
             "<lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform><film "
             "type='hdrfilm'><integer name='width' value='16'/><integer name='height' "
             "value='16'/><rfilter type='box'/></film></sensor><shape type='rectangle'>"
             "<transform name='to_world'><scale value='4'/></transform><bsdf "
             "type='phong' id='lobe'><float name='exponent' value='1'/></bsdf></shape>"
             "<emitter type='constant'/></scene>",
             s, 1 - s, splits);
    double moment = 0.75 + (m + 1) * (m + 1) / (16 * m);
    if (!splits) {
        moment = 0;
        for (int k = 0; k < CELLS; k++) {
            const double c = (k + 0.5) / CELLS;
            const double q = s * (c + (m + 1) / 2 * pow(c, m)) + 1 - s;
            moment += q * q / (2 * s * c + 1 - s) / CELLS;
        }
    }
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    imp_walks *walks = keep(scene, 256, 3, IMP_POINTS_INDEPENDENT, false, 0);
    struct imp_walks_weight w = IMP_WALKS_WEIGHT_INIT;
    size_t k;
    test_must(ctx, imp_scene_find_param(scene, "lobe.exponent", &k));
    test_must(ctx, imp_scene_set_values(scene, k, 1, &m));
    test_must(ctx, imp_walks_weigh(walks, 0, NULL, &w));
    tap_near(w.ess, 1 / moment, 0.02, 0,
             splits ? "both of a mixture drawn: effective sample size in closed form"
                    : "a mixture: effective sample size in closed form");
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* Roulette's part is 1 at the numbers of the draw, whoever decided the survival: with
 * extinctions that differ between lanes, behind which the throughput has a colour, and by
 * a guide. A number is moved by so little that only the looking begins. */
static void roulette_at_the_draw(imp_scene *scene, const imp_guide *guide,
                                 const char *name, const char *what)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_walks_options o = IMP_WALKS_OPTIONS_INIT;
    struct imp_walks_weight w = IMP_WALKS_WEIGHT_INIT;
    imp_walks *walks;
    run.spp = 8;
    run.seed = 3;
    run.guide = guide;
    o.survival = -1;
    test_must(ctx, imp_walks_keep(scene, &run, &o, &walks));
    set(scene, name, 1 - 1e-9);
    size_t k;
    test_must(ctx, imp_scene_find_param(scene, name, &k));
    struct imp_param_info info = {.size = sizeof info};
    test_must(ctx, imp_scene_get_param(scene, k, &info));
    double x[NUMBERS];
    test_must(ctx, imp_scene_get_values(scene, k, x));
    for (size_t e = 0; e < info.count; e++) x[e] = x[e] / (1 + 0.05 * (double)(e % 3));
    test_must(ctx, imp_scene_set_values(scene, k, info.count, x));
    test_must(ctx, imp_walks_weigh(walks, 0, NULL, &w));
    tap_ok(w.growth > 0 && w.ess > 1 - 1e-6,
           "%s: all walks count # 1 - %.2g, growth %.3f", what, 1 - w.ess, w.growth);
    imp_walks_destroy(walks);
}

static void roulette_counts_once(void)
{
    static const char fog[] =
        "<scene version='3.0.0'><integrator type='volpath'><integer name='rr_depth' "
        "value='2'/></integrator><medium type='homogeneous' id='fog'><rgb name='sigma_t' "
        "value='.2,.6,1.4'/><rgb name='albedo' value='.9,.8,.7'/></medium><sensor "
        "type='perspective'><transform name='to_world'><lookat origin='0,0,2' "
        "target='0,0,0' up='0,1,0'/></transform><ref id='fog'/><film "
        "type='hdrfilm'><integer name='width' value='12'/><integer name='height' "
        "value='12'/></film></sensor><shape type='sphere'><boolean name='flip_normals' "
        "value='true'/><float name='radius' value='3'/><bsdf type='diffuse' "
        "id='wall'><rgb name='reflectance' value='.7,.6,.5'/></bsdf><ref name='exterior' "
        "id='fog'/></shape><shape type='sphere'><float name='radius' "
        "value='.3'/><emitter "
        "type='area'/><ref name='exterior' id='fog'/></shape></scene>";
    imp_scene *scene = test_scene_text(ctx, fog, IMP_RGB);
    roulette_at_the_draw(scene, NULL, "wall.reflectance.value", "coloured extinction");
    imp_scene_destroy(scene);

    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    struct imp_elements_guide_options go = IMP_ELEMENTS_GUIDE_OPTIONS_INIT;
    imp_elements *e;
    imp_guide *guide;
    scene = test_scene(ctx, "cornell.xml", IMP_RGB, "res=12 max_depth=-1");
    o.stop = 0.05;
    go.roulette = 1;
    go.share = 0.3;
    test_must(ctx, imp_elements_create(scene, &o, &e));
    test_must(ctx, imp_elements_solve(e));
    test_must(ctx, imp_elements_guide(e, &go, &guide));
    roulette_at_the_draw(scene, guide, "white.reflectance.value", "guided roulette");
    imp_guide_destroy(guide);
    imp_elements_destroy(e);
    imp_scene_destroy(scene);
}

/* ---- Refused --------------------------------------------------------------------- */

static void refused_with(imp_scene *scene, const imp_walks *walks, const char *word,
                         const char *what)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.walks = walks;
    const enum imp_status st = imp_render(scene, &run, &film);
    tap_ok(st != IMP_OK && strstr(imp_last_error(ctx), word), "%s # %s", what,
           st == IMP_OK ? "not refused" : imp_last_error(ctx));
    if (st == IMP_OK) imp_film_destroy(film);
}

/* A closed room: by roulette at the albedo .4, the second moment of the throughput grows
 * by rho^2/.4 a step; with a floor q by rho^2/q. */
static void diverging(void)
{
    static const char xml[] =
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='-1'/><integer name='rr_depth' value='2'/></integrator>"
        "<sensor type='perspective'><film type='hdrfilm'><integer name='width' "
        "value='16'/><integer name='height' value='16'/></film></sensor>"
        "<shape type='sphere'><boolean name='flip_normals' value='true'/><float "
        "name='radius' value='3'/><bsdf type='diffuse' id='wall'><float "
        "name='reflectance' value='.4'/></bsdf></shape><shape type='sphere'><point "
        "name='center' x='0' y='0' z='2'/><float name='radius' value='.3'/><emitter "
        "type='area'/></shape></scene>";
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    struct imp_walks_weight w = IMP_WALKS_WEIGHT_INIT;
    size_t k;
    test_must(ctx, imp_scene_find_param(scene, "wall.reflectance", &k));
    imp_walks *bare = keep(scene, 64, 3, IMP_POINTS_INDEPENDENT, false, -1);
    imp_walks *floored = keep(scene, 64, 3, IMP_POINTS_INDEPENDENT, false, 0);
    test_must(ctx, imp_scene_set_values(scene, k, 1, &(double){0.6}));
    test_must(ctx, imp_walks_weigh(bare, 0, NULL, &w));
    /* The lamp, which reflects nothing, takes a few of the steps. */
    tap_near(w.growth, 0.36 / 0.4, 0.01, 0, "roulette at .4, albedo .6: growth .9");
    test_must(ctx, imp_scene_set_values(scene, k, 1, &(double){0.7}));
    refused_with(scene, bare, "infinite", "roulette at .4, albedo .7: variance diverges");
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.walks = floored;
    tap_ok(imp_render(scene, &run, &film) == IMP_OK, "with a floor of .8 it does not");
    imp_film_destroy(film);
    test_must(ctx, imp_walks_weigh(floored, 0, NULL, &w));
    tap_near(w.growth, 0.49 / 0.8, 0.01, 0, "and the growth is .49/.8");
    test_must(ctx, imp_scene_set_values(scene, k, 1, &(double){0.97}));
    refused_with(scene, floored, "infinite", "albedo .97 against a floor of .8");
    imp_walks_destroy(bare);
    imp_walks_destroy(floored);
    imp_scene_destroy(scene);
}

/* Some walks are looked at first; next to the limit all of them decide. */
static void next_to_the_limit(void)
{
    imp_scene *scene = test_scene(ctx, "textured.xml", IMP_RGB, "width=32 height=24");
    struct imp_run run = IMP_RUN_INIT;
    struct imp_walks_options o = IMP_WALKS_OPTIONS_INIT;
    struct imp_walks_weight w = IMP_WALKS_WEIGHT_INIT;
    double ess = 0;
    size_t k;
    run.spp = 32;
    test_must(ctx, imp_scene_find_param(scene, "metal.alpha", &k));
    for (int side = 0; side < 3; side++) { /* find it; just below; just above */
        imp_walks *walks;
        imp_film *film;
        o.ess = side == 0 ? 0 : ess + (side == 1 ? -1e-5 : 1e-5);
        test_must(ctx, imp_scene_set_values(scene, k, 1, &(double){0.2}));
        test_must(ctx, imp_walks_keep(scene, &run, &o, &walks));
        test_must(ctx, imp_scene_set_values(scene, k, 1, &(double){0.16}));
        test_must(ctx, imp_walks_weigh(walks, 0, NULL, &w));
        ess = w.ess;
        run.walks = walks;
        if (side == 2)
            refused_with(scene, walks, "effective sample size", "just above the limit");
        else if (side == 1) {
            tap_ok(imp_render(scene, &run, &film) == IMP_OK && !w.refused,
                   "just below the limit # ess %.5f of %.0f", ess, w.n_walks);
            imp_film_destroy(film);
        }
        run.walks = NULL;
        imp_walks_destroy(walks);
    }
    imp_scene_destroy(scene);
}

/* A material in few pixels: a ball of metal, and two plates that face each other closely, so
 * that light goes to and fro between them. Few walks meet them, and these have to say it. */
static void in_few_pixels(const char *name, double at, double to, const char *word)
{
    static const char xml[] =
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='-1'/><integer name='rr_depth' value='2'/></integrator><sensor "
        "type='perspective'><float name='fov' value='40'/><transform name='to_world'>"
        "<lookat origin='0,0,8' target='0,0,0' up='0,1,0'/></transform><film "
        "type='hdrfilm'><integer name='width' value='64'/><integer name='height' "
        "value='64'/><rfilter type='box'/></film></sensor><emitter type='constant'/>"
        "<shape type='rectangle'><transform name='to_world'><scale value='4'/>"
        "</transform><bsdf type='diffuse' id='wall'><float name='reflectance' "
        "value='.2'/></bsdf></shape><shape type='sphere'><point name='center' x='1.5' "
        "y='1.2' z='3'/><float name='radius' value='.06'/><bsdf type='roughconductor' "
        "id='metal'><float name='alpha' value='.3'/></bsdf></shape>"
        "<bsdf type='twosided' id='both'><bsdf type='diffuse' id='white'><float "
        "name='reflectance' value='.3'/></bsdf></bsdf>"
        "<shape type='rectangle'><transform name='to_world'><scale value='.4'/><rotate "
        "y='1' angle='90'/><translate x='-1.02' z='3'/></transform><ref id='both'/>"
        "</shape><shape type='rectangle'><transform name='to_world'><scale value='.4'/>"
        "<rotate y='1' angle='-90'/><translate x='-.98' z='3'/></transform><ref "
        "id='both'/></shape></scene>";
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    imp_walks *walks = keep(scene, 64, 3, IMP_POINTS_INDEPENDENT, false, -1);
    struct imp_walks_weight all = IMP_WALKS_WEIGHT_INIT, some;
    size_t k;
    test_must(ctx, imp_scene_find_param(scene, name, &k));
    test_must(ctx, imp_scene_set_values(scene, k, 1, &at));
    test_must(ctx, imp_walks_weigh(walks, 0, NULL, &all));
    test_must(ctx, imp__walks_weigh(walks, walks->stores, NULL, 1024, &some, NULL));
    tap_ok(!all.refused && fabs(some.n_walks / all.n_walks - 1) < 0.1 &&
               fabs(some.ess - all.ess) < 0.02 &&
               fabs(some.growth / all.growth - 1) < 0.2,
           "%s %g: some walks say what all say # walks %.0f of %.0f, ess %.4f of %.4f, "
           "growth %.3f of %.3f %s",
           name, at, some.n_walks, all.n_walks, some.ess, all.ess, some.growth,
           all.growth, all.refused ? all.refused : "");
    test_must(ctx, imp_scene_set_values(scene, k, 1, &to));
    refused_with(scene, walks, word, "in few pixels, far away");
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* A dark ball that becomes bright: of the walks that meet it roulette at the first step let
 * 1 in 20 survive, which count 19 times as much now. */
static void rarely_survived(void)
{
    static const char xml[] =
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='-1'/><integer name='rr_depth' value='1'/></integrator><sensor "
        "type='perspective'><float name='fov' value='40'/><film type='hdrfilm'><integer "
        "name='width' value='64'/><integer name='height' value='64'/><rfilter "
        "type='box'/></film></sensor><emitter type='constant'/><shape type='sphere'>"
        "<point name='center' value='0,0,8'/><float name='radius' value='.87'/><bsdf "
        "type='diffuse' id='ball'><float name='reflectance' value='.05'/></bsdf></shape>"
        "</scene>";
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    double off = 0, least = 1, most = 0;
    size_t k;
    test_must(ctx, imp_scene_find_param(scene, "ball.reflectance", &k));
    for (uint64_t seed = 1; seed <= 16; seed++) {
        struct imp_walks_weight all = IMP_WALKS_WEIGHT_INIT, some;
        test_must(ctx, imp_scene_set_values(scene, k, 1, &(double){0.05}));
        imp_walks *walks = keep(scene, 32, seed, IMP_POINTS_INDEPENDENT, false, -1);
        test_must(ctx, imp_scene_set_values(scene, k, 1, &(double){0.95}));
        test_must(ctx, imp_walks_weigh(walks, 0, NULL, &all));
        test_must(ctx, imp__walks_weigh(walks, walks->stores, NULL, 1024, &some, NULL));
        off = fmax(off, fabs(some.ess / all.ess - 1));
        least = fmin(least, all.ess);
        most = fmax(most, all.ess);
        imp_walks_destroy(walks);
    }
    tap_ok(least > 0.4 && most < 0.6 && off < 0.25,
           "a dark ball that becomes bright: some walks say what all say # ess %.3f to "
           "%.3f, off by at most %.2f of it",
           least, most, off);
    imp_scene_destroy(scene);
}

static void refusals(void)
{
    imp_scene *scene = test_scene(ctx, "textured.xml", IMP_RGB, NULL);
    imp_scene *other = test_scene(ctx, "cornell.xml", IMP_RGB, "res=16");
    imp_walks *walks = keep(scene, 4, 3, IMP_POINTS_SCENE, false, 0), *none = NULL;
    struct imp_walks_options o = IMP_WALKS_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    refused_with(other, walks, "another scene", "walks of another scene");
    set(scene, "metal.alpha", 0.2);
    refused_with(scene, walks, "effective sample size", "roughness far away");
    o.memory = 1e5;
    tap_ok(imp_walks_keep(other, &run, &o, &none) == IMP_E_NOMEM && !none &&
               strstr(imp_last_error(ctx), "MB"),
           "a budget that does not suffice # %s", imp_last_error(ctx));
    run.walks = walks;
    run.time_limit_s = 1;
    imp_film *film;
    tap_ok(imp_render(scene, &run, &film) == IMP_E_ARG, "a time limit");
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
    imp_scene_destroy(other);

    scene = test_scene(ctx, "cornell.xml", IMP_RGB, "res=8");
    test_must(ctx, imp_scene_add_geometry(scene, "tall_block.scale"));
    walks = keep(scene, 4, 3, IMP_POINTS_INDEPENDENT, false, 0);
    set(scene, "tall_block.scale", 0.8);
    refused_with(scene, walks, "tall_block.scale has another value",
                 "a shape that moved");
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);

    scene = test_scene(ctx, "cornell.xml", IMP_RGB, "res=8");
    walks = keep(scene, 300, 3, IMP_POINTS_SOBOL, false, 0); /* 64: the sets of a loss */
    imp_problem *p = problem_of(scene, "red.*");
    struct imp_estimate f;
    run = (struct imp_run)IMP_RUN_INIT;
    run.walks = walks;
    tap_ok(imp_problem_objective(p, NULL, &run, &f, NULL, NULL) == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "losses"),
           "a loss of a picture's points # %s", imp_last_error(ctx));
    const struct imp_fit_result *r;
    tap_ok(imp_fit(p, NULL, &run, &r) == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "run->walks"),
           "a fit of recorded walks, whose intervals would be too short # %s",
           imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);

    scene = test_scene(ctx, "cornell.xml", IMP_SPECTRAL, "res=8");
    walks = keep(scene, 16, 3, IMP_POINTS_INDEPENDENT, false, 0);
    p = problem_of(scene, "red.*");
    run = (struct imp_run)IMP_RUN_INIT;
    run.walks = walks;
    run.points = IMP_POINTS_INDEPENDENT;
    tap_ok(imp_problem_objective(p, NULL, &run, &f, NULL, NULL) == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "stratified wavelengths"),
           "a loss of a picture's wavelengths # %s", imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_walks_destroy(walks);
    walks = keep(scene, 1, 3, IMP_POINTS_INDEPENDENT, false, 0);
    p = problem_of(scene, "red.*");
    run.walks = walks;
    tap_ok(imp_problem_functional(p, NULL, &run, &f, NULL, NULL) == IMP_E_UNSUPPORTED,
           "an error from one walk a pixel # %s", imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

int main(void)
{
    ctx = test_context(2);
    to_the_bit("cornell.xml", "res=20", IMP_RGB, "*", IMP_POINTS_INDEPENDENT);
    to_the_bit("cornell.xml", "res=20", IMP_RGB, "*", IMP_POINTS_SOBOL);
    to_the_bit("stam.xml", "res=12 integrator=path", IMP_MONO, "*",
               IMP_POINTS_INDEPENDENT);
    to_the_bit("stam.xml", "res=12 integrator=stam", IMP_MONO, "*",
               IMP_POINTS_INDEPENDENT);
    to_the_bit("textured.xml", "width=32 height=24", IMP_RGB, "metal.*",
               IMP_POINTS_INDEPENDENT);
    to_the_bit("lamps.xml", "res=24", IMP_RGB, "*.scale.value", IMP_POINTS_INDEPENDENT);
    to_the_bit("cornell.xml", "res=12", IMP_SPECTRAL, "white.*", IMP_POINTS_INDEPENDENT);
    any_threads();
    elsewhere("cornell.xml", "res=24", IMP_RGB, "white.reflectance", 0.6, 0.9);
    elsewhere("cornell.xml", "res=24", IMP_RGB, "light.radiance", 2, 1);
    elsewhere("cornell.xml", "res=16", IMP_SPECTRAL, "white.reflectance.values", 0.7,
              0.9);
    elsewhere("textured.xml", "width=32 height=24", IMP_RGB, "metal.alpha", 0.85, 0.5);
    elsewhere("textured.xml", "width=32 height=24", IMP_RGB, "floor.reflectance.data",
              0.6, 0.9);
    elsewhere("textured.xml", "width=32 height=24", IMP_RGB, "metal.eta", 1.5, 1);
    elsewhere("textured.xml", "width=32 height=24", IMP_RGB, "sky.radiance", 1.5, 1);
    elsewhere("fog.xml", "res=16", IMP_RGB, "fog.albedo", 0.8, 0.9);
    elsewhere("fog.xml", "res=16", IMP_RGB, "fog.phase.g", 0.8, 0.5);
    elsewhere("stam.xml", "res=16 integrator=path", IMP_MONO, "sphere.exponent", 1.5,
              0.5);
    both_modes("cornell.xml", "res=12", IMP_RGB, "*", "white.reflectance");
    both_modes("stam.xml", "res=12 integrator=path", IMP_MONO, "*", "sphere.exponent");
    walk_by_walk("textured.xml", "width=32 height=24", "metal.alpha");
    walk_by_walk("cornell.xml", "res=24", "white.reflectance");
    closed_form(5);
    closed_form(9);
    closed_form_of_mixtures(9, 0.5, false);
    closed_form_of_mixtures(20, 0.2, false);
    closed_form_of_mixtures(9, 0.5, true);
    roulette_counts_once();
    diverging();
    next_to_the_limit();
    in_few_pixels("metal.alpha", 0.28, 0.01, "effective sample size");
    in_few_pixels("white.reflectance", 0.31, 0.9, "infinite");
    rarely_survived();
    refusals();
    imp_context_destroy(ctx);
    return tap_done();
}

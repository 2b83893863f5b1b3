/* SPDX-License-Identifier: Apache-2.0
 *
 * What parts and teams are tested with: a wall with a texture, and a ball, under a lamp; and
 * the calls that can be shared, with all the numbers that they give. */
#ifndef PARTS_KIT_H
#define PARTS_KIT_H

#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/kinds.h>
#include <importon/plan.h>
#include <stdatomic.h>

enum { WIDTH = 20, HEIGHT = 14, PIXELS = WIDTH * HEIGHT * 3, TEXELS = 20, SPP = 18 };
enum { MANY = TEXELS * TEXELS * 3 + 64 }; /* more than 1,024: summed in fixed point */

enum job { PICTURE, LOSS, TEXTURE, REVERSE, JACOBIAN, MEAN, PLAN, JOBS, FIT = JOBS };
static const char *const names[] __attribute__((unused)) = {"picture",
                                                            "loss and gradient",
                                                            "gradient of a texture",
                                                            "adjoint image",
                                                            "Jacobian and its table",
                                                            "mean of a picture",
                                                            "plan",
                                                            "fit"};

/* All that is compared, bit by bit. */
struct result {
    float mean[PIXELS], se[PIXELS];
    double objective[2], gradient[MANY], gradient_se[MANY];
};

static float target[PIXELS];
static enum imp_points points = IMP_POINTS_INDEPENDENT;

/* A texture that counts how often it is looked at: by walks. */
static _Atomic uint64_t looked;
static enum imp_status counted_build(const struct imp_build *b, void *self,
                                     struct imp_texture *t)
{
    (void)b, (void)self, (void)t;
    return IMP_OK;
}
static void counted_eval(const struct imp_texture *t, const struct imp_texcoord *at,
                         bool scalar, imp_spec *value)
{
    (void)t, (void)at, (void)scalar;
    atomic_fetch_add(&looked, 1);
    imp_spec_fill(value, .4);
}
/* It has no numbers. */
static void counted_scatter(const struct imp_texture *t, const struct imp_texcoord *at,
                            bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    (void)t, (void)at, (void)scalar, (void)bar, (void)sink;
}
static void counted_tangent(const struct imp_texture *t, const struct imp_texcoord *at,
                            bool scalar, imp_dot_fn *dot, const void *x_dot,
                            imp_spec *value_dot)
{
    (void)t, (void)at, (void)scalar, (void)dot, (void)x_dot;
    imp_spec_fill(value_dot, 0);
}
static bool counted_slope(const struct imp_texture *t, const struct imp_texcoord *at,
                          bool scalar, imp_spec d_uv[2])
{
    (void)t, (void)at, (void)scalar;
    imp_spec_fill(&d_uv[0], 0);
    imp_spec_fill(&d_uv[1], 0);
    return true;
}

static void rgb(imp_scene *s, const char *name, double r, double g, double b)
{
    imp_scene_rgb(s, name, (double[3]){r, g, b});
}

/* A wall with a texture, and a red ball, under a lamp. */
static imp_scene *scene_make(imp_context *ctx, const char *filter, double red)
{
    static const struct imp_texture_ops counted = {.size = sizeof counted,
                                                   .name = "counted",
                                                   .object_size = 1,
                                                   .build = counted_build,
                                                   .eval = counted_eval,
                                                   .scatter = counted_scatter,
                                                   .tangent = counted_tangent,
                                                   .slope = counted_slope};
    static float pixels[TEXELS * TEXELS * 3];
    imp_scene *s;
    for (int k = 0; k < TEXELS * TEXELS * 3; k++)
        pixels[k] = 0.2f + 0.5f * (float)(k % 7) / 7;
    test_must(ctx, imp_register_texture(ctx, &counted));
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "integrator", "path", NULL, NULL);
    imp_scene_integer(s, "max_depth", 3);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_float(s, "fov", 50);
    imp_scene_transform(s, "to_world",
                        (double[16]){-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 4, 0, 0, 0, 1});
    imp_scene_begin(s, "sampler", "independent", NULL, NULL);
    imp_scene_integer(s, "sample_count", SPP);
    imp_scene_end(s);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", WIDTH);
    imp_scene_integer(s, "height", HEIGHT);
    imp_scene_begin(s, "rfilter", filter, NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "rectangle", NULL, NULL);
    imp_scene_transform(s, "to_world",
                        (double[16]){2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, -1, 0, 0, 0, 1});
    imp_scene_begin(s, "bsdf", "diffuse", "wall", NULL);
    imp_scene_begin(s, "texture", "bitmap", "paper", "reflectance");
    imp_scene_image(s, TEXELS, TEXELS, 3, pixels);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "sphere", NULL, NULL);
    imp_scene_float(s, "radius", 0.6);
    imp_scene_begin(s, "bsdf", "diffuse", "ball", NULL);
    rgb(s, "reflectance", red, .2, .1);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "sphere", NULL, NULL);
    imp_scene_vector(s, "center", (double[3]){-1, -.6, 0});
    imp_scene_float(s, "radius", 0.4);
    imp_scene_begin(s, "bsdf", "diffuse", "pebble", NULL);
    imp_scene_begin(s, "texture", "counted", NULL, "reflectance");
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "sphere", NULL, NULL);
    imp_scene_vector(s, "center", (double[3]){1, 2, 2});
    imp_scene_float(s, "radius", 0.4);
    imp_scene_begin(s, "emitter", "area", "lamp", NULL);
    rgb(s, "radiance", 9, 8, 7);
    imp_scene_end(s);
    imp_scene_end(s);
    test_must(ctx, imp_scene_commit(s));
    return s;
}

static imp_problem *problem_make(imp_context *ctx, imp_scene *s, const char *active)
{
    imp_problem *p;
    struct imp_target t = IMP_TARGET_INIT;
    t.width = WIDTH, t.height = HEIGHT, t.channels = 3, t.pixels = target;
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, active));
    test_must(ctx, imp_problem_add_target(p, &t));
    return p;
}

static void film_take(imp_film *film, struct result *r)
{
    memcpy(r->mean, imp_film_mean(film), sizeof r->mean);
    memcpy(r->se, imp_film_se(film), sizeof r->se);
    imp_film_destroy(film);
}

static double plan_noise = 0.1;

/* Four exposures, one of which has been taken: their gains and informations, and what is chosen. */
static enum imp_status plan_run(imp_problem *p, const struct imp_run *run,
                                struct result *r)
{
    struct imp_plan_candidate c[4];
    struct imp_plan_options o = IMP_PLAN_OPTIONS_INIT;
    const struct imp_plan_result *plan;
    for (int i = 0; i < 4; i++) {
        c[i] = (struct imp_plan_candidate)IMP_PLAN_CANDIDATE_INIT;
        c[i].time = i + 1;
        c[i].have = i == 1;
    }
    o.read = plan_noise;
    o.take = 2;
    const enum imp_status st = imp_plan(p, c, 4, &o, run, &plan);
    double *to = r->gradient;
    if (st != IMP_OK) return st;
    for (size_t i = 0; i < plan->n_rows; i++) {
        const struct imp_plan_row *row = IMP_ROW(imp_plan_row, plan->rows, i);
        *to++ = row->gain.value;
        *to++ = row->gain.se;
        *to++ = (double)row->candidate;
        for (size_t k = 0; k < plan->n * plan->n; k++) *to++ = row->information[k];
    }
    for (size_t k = 0; k < plan->n; k++) *to++ = plan->chosen_se[k];
    r->objective[0] = plan->chosen_gain.value;
    r->objective[1] = plan->chosen_gain.se;
    return IMP_OK;
}

static enum imp_status job_run(imp_context *ctx, imp_scene *s, enum job job,
                               uint64_t seed, struct result *r)
{
    struct imp_run run = IMP_RUN_INIT;
    enum imp_status st;
    imp_film *film = NULL, *films[3] = {0};
    struct imp_estimate e = {0};
    run.seed = seed;
    run.points = points;
    memset(r, 0, sizeof *r);
    if (job == PICTURE) {
        st = imp_render(s, &run, &film);
        if (st == IMP_OK) film_take(film, r);
        return st;
    }
    imp_problem *p = problem_make(ctx, s, job == TEXTURE ? "*" : "ball.*");
    switch (job) {
    case LOSS:
    case TEXTURE:
        st = imp_problem_objective(p, NULL, &run, &e, r->gradient, r->gradient_se);
        r->objective[0] = e.value;
        r->objective[1] = e.se;
        break;
    case REVERSE:
        st = imp_problem_reverse(p, target, &run, r->gradient, r->gradient_se);
        break;
    case JACOBIAN: {
        struct imp_estimate sums[2];
        const int group[3] = {0, 1, 0};
        st = imp_problem_jacobian(p, &run, &film, films);
        if (st != IMP_OK && st != IMP_PART) break;
        /* The walks of a part, for its pictures and their sums. */
        const enum imp_status made = imp_problem_jacobian_sums(
            p, NULL, &run, film, st == IMP_OK ? films : NULL, group, 2, &e, sums);
        if (made != st) tap_ok(0, "sums of a Jacobian # %s", imp_last_error(ctx));
        if (st != IMP_OK) break;
        r->objective[0] = e.value;
        r->objective[1] = e.se;
        for (int k = 0; k < 2; k++) {
            r->gradient[k] = sums[k].value;
            r->gradient_se[k] = sums[k].se;
        }
        film_take(films[2], r);
        imp_film_destroy(films[1]);
        imp_film_destroy(films[0]);
        imp_film_destroy(film);
        break;
    }
    case MEAN:
        st = imp_problem_functional(p, NULL, &run, &e, r->gradient, r->gradient_se);
        r->objective[0] = e.value;
        r->objective[1] = e.se;
        break;
    case PLAN: st = plan_run(p, &run, r); break;
    default: {
        struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
        const struct imp_fit_result *f;
        o.max_iterations = 4;
        st = imp_fit(p, &o, &run, &f);
        for (int k = 0; k < 3 && st == IMP_OK; k++) {
            r->gradient[k] = f->variables[k].value;
            r->gradient_se[k] = f->variables[k].se;
        }
        if (st == IMP_OK) r->objective[0] = f->objective.value;
    }
    }
    imp_problem_destroy(p);
    return st;
}

static void alone(const char *filter, enum job job, struct result *r)
{
    imp_context *ctx = test_context(1);
    imp_scene *s = scene_make(ctx, filter, .6);
    test_must(ctx, job_run(ctx, s, job, 5, r));
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

static void target_set(void)
{
    for (int k = 0; k < PIXELS; k++) target[k] = 0.05f + 0.4f * (float)(k % 11) / 11;
}

/* ---- Parts in files -------------------------------------------------------------- */

static char folder[64] __attribute__((unused));
__attribute__((unused)) static const char *part_path(char path[96], int i, int n)
{
    snprintf(path, 96, "%s/%d-%d.part", folder, i, n);
    return path;
}

__attribute__((unused)) static void part_make(const char *filter, enum job job, int i,
                                              int n, int threads)
{
    char path[96];
    struct result none;
    imp_parts *part;
    imp_context *ctx = test_context(threads);
    imp_scene *s = scene_make(ctx, filter, .6);
    test_must(ctx, imp_parts_create(ctx, i, n, "a test", &part));
    test_must(ctx, imp_context_set_parts(ctx, part));
    const enum imp_status st = job_run(ctx, s, job, 5, &none);
    if (st != IMP_PART) tap_ok(0, "a part ends with IMP_PART # %s", imp_last_error(ctx));
    test_must(ctx, imp_parts_write(part, part_path(path, i, n)));
    imp_parts_destroy(part);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

/* Of the parts [n] named i/k; NULL: what the merge said is in `error`. */
__attribute__((unused)) static enum imp_status merge(const char *filter, enum job job,
                                                     const int (*which)[2], int n,
                                                     double red, uint64_t seed,
                                                     struct result *r, char error[400])
{
    char path[64][96];
    const char *paths[64];
    imp_parts *parts = NULL;
    imp_context *ctx = test_context(2);
    imp_scene *s = scene_make(ctx, filter, red);
    for (int k = 0; k < n; k++) paths[k] = part_path(path[k], which[k][0], which[k][1]);
    enum imp_status st = imp_parts_read(ctx, paths, (size_t)n, &parts);
    if (st == IMP_OK) st = imp_context_set_parts(ctx, parts);
    if (st == IMP_OK) st = job_run(ctx, s, job, seed, r);
    snprintf(error, 400, "%s", imp_last_error(ctx));
    imp_parts_destroy(parts);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return st;
}

#endif

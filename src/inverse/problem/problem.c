/* SPDX-License-Identifier: Apache-2.0
 *
 * Problems: which values are free, and what they have to match. */
#include "problem.h"
#include "match.h"
#include "scene/pose.h"
#include "scene/theta_near.h"
#include "search/optimize.h"
#include "walk/run/run.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum imp_status imp_problem_create(imp_scene *scene, imp_problem **out)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, scene, "scene");
    imp_context *ctx = scene->ctx;
    imp_problem *p = NULL;
    IMP_REQUIRE(ctx, out, "out");

    if (!scene->committed)
        return imp__error(ctx, IMP_E_ARG, "a problem needs a committed scene");
    p = imp__alloc(ctx, 1, sizeof *p);
    if (!p) return imp__error(ctx, IMP_E_NOMEM, "no memory for a problem");
    p->ctx = ctx;
    imp__context_hold(ctx);
    p->scene = scene;
    scene->in_problem = true;
    p->run = (struct imp_run)IMP_RUN_INIT;
    imp__arena_init(&p->fit_arena, ctx);
    imp__arena_init(&p->check_arena, ctx);
    imp__arena_init(&p->missing_arena, ctx);
    imp__arena_init(&p->plan_arena, ctx);
    imp__arena_init(&p->measure_arena, ctx);
    p->chosen = imp__alloc(ctx, imp_max(scene->n_params, (size_t)1), 1);
    if (!p->chosen) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a problem"));
    IMP_TRY(imp__active_create(scene, p->chosen, &p->active));
    *out = p;
    return IMP_OK;
out:
    imp_problem_destroy(p);
    return st;
}

void imp__fit_answer_free(struct imp_problem *p)
{
    imp__search_destroy(p->fit_answer.search);
    p->fit_answer = (struct imp__fit_answer){0};
    imp__arena_free(&p->fit_arena);
}

void imp_problem_destroy(imp_problem *p)
{
    if (!p) return;
    imp_context *ctx = p->ctx;
    for (size_t i = 0; i < p->n_targets; i++) imp__target_free(p->ctx, &p->targets[i]);
    imp__release(p->ctx, p->targets);
    for (size_t i = 0; i < p->n_regularisers; i++) {
        imp__release(p->ctx, p->regularisers[i].on);
        imp__release(p->ctx, p->regularisers[i].origin);
    }
    imp__release(p->ctx, p->regularisers);
    imp__active_destroy(p->ctx, &p->active);
    imp__release(p->ctx, p->blocks);
    imp__ties_free(p);
    imp__release(p->ctx, p->held);
    imp__fit_answer_free(p);
    imp__arena_free(&p->check_arena);
    imp__arena_free(&p->missing_arena);
    imp__arena_free(&p->plan_arena);
    imp__arena_free(&p->measure_arena);
    imp__release(ctx, p->chosen);
    imp__release(ctx, p);
    imp__context_drop(ctx);
}

/* ---- Active parameters --------------------------------------------------------- */

/* Properties of a camera that are no parameters: is it one of them that is meant? */
static enum imp_status camera_geometry(const imp_problem *p, const char *glob)
{
    static const char *const names[][2] = {{"to_world", "pose"},
                                           {"fov", "x_fov"},
                                           {"focal_length", "x_fov"},
                                           {"opencv_fx", "x_fov"},
                                           {"opencv_fy", "x_fov"},
                                           {"opencv_cx", "principal_point_offset_x"},
                                           {"opencv_cy", "principal_point_offset_y"},
                                           {"aperture_radius", NULL},
                                           {"focus_distance", NULL}};
    char name[256];
    if (strpbrk(glob, "*?[")) return IMP_OK; /* of parameters, then */
    for (int s = 0; s < p->scene->n_sensors; s++)
        for (size_t k = 0; k < imp_count(names); k++) {
            const char *camera = p->scene->sensors[s]->name;
            snprintf(name, sizeof name, "%s.%s", camera, names[k][0]);
            if (!imp__glob(glob, name)) continue;
            if (names[k][1])
                return imp__error(p->ctx, IMP_E_BIAS,
                                  "%s is no parameter: %s.%s is, where the camera is a "
                                  "perspective one",
                                  name, camera, names[k][1]);
            return imp__error(p->ctx, IMP_E_BIAS,
                              "%s has no unbiased derivative: it moves the edges of the "
                              "picture, and the terms of that motion are not computed",
                              name);
        }
    return IMP_OK;
}

static enum imp_status activate_named(imp_problem *p, const char *name, uint8_t *chosen)
{
    size_t k;
    const enum imp_status st = imp_scene_find_param(p->scene, name, &k);
    if (st == IMP_E_ARG) IMP_CHECKED(camera_geometry(p, name));
    if (st != IMP_OK) return st;
    const struct imp_param_info *info = &p->scene->params[k].info;
    if (info->flags & IMP_PARAM_INTEGER)
        return imp__error(p->ctx, IMP_E_BIAS,
                          "%s counts in whole numbers, so it has no derivative",
                          info->name);
    if (!(info->flags & IMP_PARAM_DIFFERENTIABLE) && info->why)
        return imp__error(p->ctx, IMP_E_BIAS, "%s has no unbiased derivative: %s",
                          info->name, info->why);
    if (!(info->flags & IMP_PARAM_DIFFERENTIABLE))
        return imp__error(
            p->ctx, IMP_E_BIAS,
            "%s has no unbiased derivative: changing it bends or moves light "
            "paths, or the densities they are drawn with, and the terms of that "
            "motion are not computed. Leave it at its value, or scan it",
            info->name);
    chosen[k] = 1;
    return IMP_OK;
}

/* Numbers of geometry are what a pattern means that names them, "*.pose". */
static bool is_passed_over(const struct imp_scene *scene, size_t param, const char *glob)
{
    const char *tail = strrchr(glob, '.');
    for (const struct imp_pose *q = scene->poses; q; q = q->next)
        if (q->param == (int)param)
            return !tail || strcmp(tail + 1, imp__pose_tail(q->kind)) != 0;
    return false;
}

enum imp_status imp_problem_activate(imp_problem *p, const char *glob)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, glob, "glob");
    const struct imp_scene *s = p->scene;
    uint8_t *chosen = imp__alloc(p->ctx, imp_max(s->n_params, (size_t)1), 1);

    if (!*glob) IMP_TRY(imp__error(p->ctx, IMP_E_ARG, "no parameter is named"));
    if (!chosen)
        IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for active parameters"));
    memcpy(chosen, p->chosen, s->n_params);
    if (!imp__has_wildcards(glob)) {
        IMP_TRY(activate_named(p, glob, chosen));
    } else {
        size_t met = 0, usable = 0, last = 0;
        for (size_t k = 0; k < s->n_params; k++) {
            if (!imp__glob(glob, s->params[k].info.name)) continue;
            met++;
            last = k;
            if (!(s->params[k].info.flags & IMP_PARAM_DIFFERENTIABLE) ||
                is_passed_over(s, k, glob))
                continue;
            usable++;
            chosen[k] = 1;
        }
        if (!met) IMP_TRY(camera_geometry(p, glob));
        if (!met)
            IMP_TRY(imp__error(p->ctx, IMP_E_ARG,
                               "no parameter matches '%s' (there are %zu)%s", glob,
                               s->n_params, imp__theta_near(s, glob).text));
        if (!usable) { /* the reason, of one of them */
            IMP_TRY(activate_named(p, s->params[last].info.name, chosen));
        }
    }
    IMP_TRY(imp__problem_layout(p, chosen));
out:
    imp__release(p->ctx, chosen);
    return st;
}

bool imp__problem_moves(const struct imp_problem *p)
{
    for (const struct imp_pose *q = p->scene->poses; q; q = q->next)
        if (imp__pose_moves(q) && p->active.base[q->param] >= 0) return true;
    return false;
}

size_t imp_problem_n_variables(const imp_problem *p) { return p ? p->n : 0; }

enum imp_status imp_problem_get_variable(const imp_problem *p, size_t i,
                                         struct imp_variable_info *info)
{
    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, info, "info");
    if (i >= p->n)
        return imp__error(p->ctx, IMP_E_ARG,
                          "there is no active number %zu (there are %zu)", i, p->n);
    const struct imp__block *b = imp__problem_block(p, i);
    const struct imp__bounds bounds = imp__block_bounds(p, b, i - b->first);
    const struct imp_variable_info all = {.size = sizeof all,
                                          .param = b->param,
                                          .element = i - b->first,
                                          .lo = bounds.lo,
                                          .hi = bounds.hi,
                                          .held = imp__block_held(p, b, i - b->first)};
    IMP_GIVE(p->ctx, info, all, "info");
    return IMP_OK;
}

enum imp_status imp_problem_get_x(const imp_problem *p, double *x)
{
    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, x, "x");
    IMP_READS(p->scene);
    for (size_t k = 0; k < p->n_blocks; k++) {
        const struct imp__block *b = &p->blocks[k];
        for (size_t e = 0; e < b->count; e++) x[b->first + e] = imp__block_get(p, b, e);
    }
    return IMP_OK;
}

enum imp_status imp_problem_set_x(imp_problem *p, const double *x)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, x, "x");
    IMP_SETS(p->scene, st);
    if (st != IMP_OK) return st;
    /* All or nothing: check everything before the first is set. */
    for (size_t k = 0; k < p->n_blocks; k++) {
        const struct imp__block *b = &p->blocks[k];
        for (size_t e = 0; e < b->count; e++) {
            const double v = x[b->first + e];
            const struct imp__bounds bounds = imp__block_bounds(p, b, e);
            if (!isfinite(v) || v < bounds.lo || v > bounds.hi)
                return imp__error(p->ctx, IMP_E_ARG, "%s[%zu] = %g is outside [%g, %g]",
                                  imp__block_name(p, b), e, v, bounds.lo, bounds.hi);
        }
    }
    for (size_t k = 0; k < p->scene->n_params; k++)
        if (p->active.base[k] >= 0) imp__tied_set(&p->active, &p->scene->params[k], k, x);
    imp__theta_announce(p->scene);
    return imp__poses_settle(p->scene);
}

/* ---- Targets ------------------------------------------------------------------- */

static enum imp_status plane_copy(imp_context *ctx, const float *from, size_t n,
                                  float **to)
{
    *to = imp__alloc(ctx, n, sizeof **to);
    if (!*to) return imp__error(ctx, IMP_E_NOMEM, "no memory for a target picture");
    memcpy(*to, from, n * sizeof *from);
    return IMP_OK;
}

/* Pixels with weight 0 may hold anything; they are stored as 0. */
static enum imp_status target_check(imp_problem *p, struct imp__target *t)
{
    const struct imp_target *d = &t->desc;
    const size_t channels = (size_t)d->channels;
    double total = 0;
    for (size_t i = 0; i < (size_t)d->width * (size_t)d->height; i++) {
        const int x = (int)(i % (size_t)d->width), y = (int)(i / (size_t)d->width);
        const float w = t->weights ? t->weights[i] : 1;
        if (!(w >= 0) || !isfinite(w))
            return imp__error(p->ctx, IMP_E_ARG,
                              "weight %g of target pixel (%d, %d) is not a number >= 0",
                              w, x, y);
        total += w;
        for (size_t c = 0; c < channels; c++) {
            float *v = &t->pixels[i * channels + c];
            if (w == 0) *v = 0;
            if (!isfinite(*v))
                return imp__error(
                    p->ctx, IMP_E_ARG,
                    "target pixel (%d, %d) is not finite; give it weight 0 to "
                    "leave it out",
                    x, y);
            float *se = t->noise_se ? &t->noise_se[i * channels + c] : NULL;
            if (se && w == 0) *se = 0;
            if (se && (!(*se >= 0) || !isfinite(*se)))
                return imp__error(
                    p->ctx, IMP_E_ARG,
                    "noise_se of target pixel (%d, %d) is not a number >= 0", x, y);
        }
    }
    if (total == 0)
        return imp__error(p->ctx, IMP_E_ARG, "all weights of the target are 0");
    return IMP_OK;
}

/* Values of a photograph are compared by their own size, whatever the exponent: in covariances their
 * noise is estimated from what is left over. */
void imp__target_photograph(const struct imp_problem *p, struct imp__target *t)
{
    const struct imp_sensor *s = p->scene->sensors[t->desc.sensor];
    if (!s->gain || !s->gain->fitted_gamma) return;
    t->photograph = (struct imp_photograph){.pixels = t->pixels,
                                            .x = s->film.crop_x,
                                            .y = s->film.crop_y,
                                            .width = t->desc.width,
                                            .height = t->desc.height,
                                            .channels = t->desc.channels};
    t->value_noise = t->noise_se;
    t->noise_se = NULL;
    t->desc.noise_se = NULL;
}

enum imp_status imp_problem_add_target(imp_problem *p, const struct imp_target *target)
{
    enum imp_status st = IMP_OK;
    struct imp__target t = {.desc = IMP_TARGET_INIT};
    struct imp_sensor_info sensor = {.size = sizeof sensor};

    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, target, "target");
    IMP_OPTIONS(p->ctx, t.desc, target, "target");
    const struct imp_target *d = &t.desc;
    IMP_TRY(imp_scene_get_sensor(p->scene, d->sensor, &sensor));
    if (d->width != sensor.width || d->height != sensor.height)
        IMP_TRY(imp__error(p->ctx, IMP_E_ARG,
                           "target is %d x %d, but sensor %d ('%s') makes %d x %d pixels",
                           d->width, d->height, d->sensor, sensor.name ? sensor.name : "",
                           sensor.width, sensor.height));
    const bool other = sensor.n_responses > 0 && sensor.n_responses != 3;
    if (other && d->channels != sensor.n_responses)
        IMP_TRY(
            imp__error(p->ctx, IMP_E_ARG,
                       "target has %d channels; the film of sensor %d has %d response "
                       "curves",
                       d->channels, d->sensor, sensor.n_responses));
    if (!other && d->channels != 1 && d->channels != p->scene->channels)
        IMP_TRY(imp__error(p->ctx, IMP_E_ARG,
                           "target has %d channels; this scene's pictures have %d",
                           d->channels, p->scene->channels));
    if (!d->pixels) IMP_TRY(imp__error(p->ctx, IMP_E_ARG, "target without pixels"));
    if ((unsigned)d->loss > IMP_LOSS_LOG)
        IMP_TRY(imp__error(p->ctx, IMP_E_ARG, "loss %d does not exist", (int)d->loss));
    if (!(d->epsilon >= 0) || !(d->scale >= 0) || !isfinite(d->epsilon) ||
        !isfinite(d->scale))
        IMP_TRY(imp__error(p->ctx, IMP_E_ARG,
                           "epsilon %g and scale %g must be finite and >= 0", d->epsilon,
                           d->scale));
    if (t.desc.epsilon == 0) t.desc.epsilon = 1e-2;
    if (t.desc.scale == 0) t.desc.scale = 1;

    const size_t n = (size_t)d->width * (size_t)d->height;
    IMP_TRY(plane_copy(p->ctx, d->pixels, n * (size_t)d->channels, &t.pixels));
    if (d->weights) IMP_TRY(plane_copy(p->ctx, d->weights, n, &t.weights));
    if (d->noise_se)
        IMP_TRY(plane_copy(p->ctx, d->noise_se, n * (size_t)d->channels, &t.noise_se));
    IMP_TRY(target_check(p, &t));
    t.desc.pixels = t.pixels;
    t.desc.weights = t.weights;
    t.desc.noise_se = t.noise_se;
    imp__target_photograph(p, &t);
    IMP_TRY(imp__target_split(p, &t));

    struct imp__target *grown =
        imp__grow(p->ctx, p->targets, &p->cap_targets, p->n_targets + 1, sizeof *grown);
    if (!grown) IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for a target"));
    p->targets = grown;
    p->targets[p->n_targets++] = t;
    return IMP_OK;
out:
    imp__target_free(p->ctx, &t);
    return st;
}

/* ---- NLopt's callback shape ---------------------------------------------------- */

enum imp_status imp_problem_set_run(imp_problem *p, const struct imp_run *run)
{
    struct imp_run own;
    IMP_REQUIRE(NULL, p, "problem");
    IMP_RUN(p->ctx, own, run);
    p->run = own;
    return IMP_OK;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * A grid whose points get as many samples as each of them needs, in two stages (Stein, Ann. Math. Statist.
 * 16, 1945). A pilot gives each point a mean x and the variance v of a sample, with nu degrees of
 * freedom. Point i then has
 *
 *     n_i = v_i (t/(e x_i))^2,    t: Student's quantile with nu degrees of freedom
 *
 * fresh samples, which alone make the answer. Given n_i, it is unbiased, and its error is that of any
 * reading with n_i samples. It lies within e x_i of the truth with the probability of t, whatever
 * the variance is, since for normal errors
 *
 *     (x - mu) sqrt(n_i)/s  with  n_i = s^2 (t/(e x))^2
 *
 * is Student's, with s of the pilot and x of the fresh samples. A variance known from 4 or 15 sets of
 * samples costs a larger t, and no promise. Sets of points gain by their size: a pilot of few samples
 * asks for too many, so while those it asks for are many, the next pilot has four times as many. */
#include "base/arguments.h"
#include "base/film.h"
#include "base/float_mode.h"
#include "film/film_render.h"
#include "grid_film.h"
#include "math/rng.h"
#include "math/stat.h"
#include "scene/access.h"
#include "walk/run/interim_looks.h"
#include <importon/rooms.h>
#include <math.h>

#define RUNS  4  /* of a pilot, each with sets of its own */
#define FIRST 64 /* samples of the first pilot */
#define LEAST 64 /* fresh samples: four sets of 16 points have an error */
#define PART  8  /* a pilot takes at most this part of the samples asked for */

struct stages {
    imp_scene *scene;
    const struct imp__looks *looks; /* options, and the run with its end of walks */
    struct imp_grid_film grid;
    size_t n;
    double *x, *v;    /* [n] of the pilot: mean, variance of a sample */
    int64_t *samples; /* [n] fresh ones */
    bool *only;       /* [n] points at work */
    double freedom;   /* of v */
    int renders;      /* so far, each with its own seed */
    double taken;     /* samples of all points */
};

static enum imp_status render(struct stages *s, int64_t spp, const bool *only, size_t n,
                              imp_film **film)
{
    struct imp_run run = *s->looks->outer;
    enum imp_status st = IMP_OK;
    IMP_FLOAT_MODE;
    IMP_READS(s->scene);
    run.preview = NULL;
    run.spp = (int)spp;
    run.seed = imp__mix64(run.seed + 0x9e3779b97f4a7c15u * (uint64_t)++s->renders);
    IMP_TRY(imp__render_pixels(s->scene, &run, only, film));
    IMP_TRY(imp__grid_film_check(&s->grid, *film));
    s->taken += (double)spp * (double)n;
out:
    return st;
}

/* x and v of all points, from RUNS pictures. */
static enum imp_status pilot(struct stages *s, int64_t spp)
{
    enum imp_status st = IMP_OK;
    imp_film *film = NULL;
    const int64_t each = imp_max(spp / RUNS, (int64_t)2);
    s->freedom = 0;
    for (size_t i = 0; i < s->n; i++) s->x[i] = s->v[i] = 0;
    for (int k = 0; k < RUNS; k++) {
        IMP_TRY(render(s, each, NULL, s->n, &film));
        for (size_t i = 0; i < s->n; i++) {
            double value, se;
            imp__grid_film_take(&s->grid, film, i, &value, &se);
            s->x[i] += value / RUNS;
            s->v[i] += se * se * (double)each / RUNS;
        }
        s->freedom += (double)imp__grid_film_sets(film) - 1;
        imp_film_destroy(film);
        film = NULL;
    }
out:
    imp_film_destroy(film);
    return st;
}

/* The next of four numbers between powers of two: points with equal ones are read together. */
static int64_t suited(double wanted, int64_t most)
{
    int64_t n = LEAST;
    for (int64_t octave = LEAST; (double)n < wanted && n < most; n += octave / 4)
        if (n == 2 * octave) octave = n;
    return imp_min(n, most);
}

/* Where the pilot has found no light there are as many samples as anywhere. The largest bound of an error,
 * as a part of the reading: INFINITY in the dark. */
static double fresh_samples(struct stages *s)
{
    const struct imp_until_options *o = &s->looks->options;
    const double z = -imp__normal_quantile(o->risk / 2),
                 t = imp__student_of_normal(z, s->freedom);
    int64_t largest = imp_min((int64_t)LEAST, (int64_t)o->most_spp);
    double bound = 0;
    bool lit = false;
    for (size_t i = 0; i < s->n; i++) {
        if (!(s->x[i] > 0)) continue;
        const double error = t * sqrt(s->v[i]) / s->x[i];
        s->samples[i] = suited(imp__sqr(error / o->relative), o->most_spp);
        largest = imp_max(largest, s->samples[i]);
        bound = fmax(bound, error / sqrt((double)s->samples[i]));
        lit = true;
    }
    for (size_t i = 0; i < s->n; i++)
        if (!(s->x[i] > 0)) s->samples[i] = largest;
    return lit ? bound : INFINITY;
}

static double all_samples(const struct stages *s)
{
    double sum = 0;
    for (size_t i = 0; i < s->n; i++) sum += (double)s->samples[i];
    return sum;
}

/* Points with equal numbers of samples together. sets: the least of any point. */
static enum imp_status read_fresh(struct stages *s, double *value, double *se,
                                  int64_t *sets)
{
    enum imp_status st = IMP_OK;
    imp_film *film = NULL;
    *sets = INT64_MAX;
    for (int64_t done = 0;;) {
        int64_t spp = INT64_MAX;
        size_t n = 0;
        for (size_t i = 0; i < s->n; i++)
            if (s->samples[i] > done) spp = imp_min(spp, s->samples[i]);
        if (spp == INT64_MAX) break;
        for (size_t i = 0; i < s->n; i++) n += s->only[i] = s->samples[i] == spp;
        IMP_TRY(render(s, spp, s->only, n, &film));
        for (size_t i = 0; i < s->n; i++)
            if (s->only[i]) imp__grid_film_take(&s->grid, film, i, &value[i], &se[i]);
        *sets = imp_min(*sets, imp__grid_film_sets(film));
        imp_film_destroy(film);
        film = NULL;
        done = spp;
    }
out:
    imp_film_destroy(film);
    return st;
}

static enum imp_status refuse(const imp_scene *scene, const struct stages *s,
                              const struct imp_run *run)
{
    if (s->grid.shared)
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "imp_grid_read_until: walks from the lights reach many points, "
                          "none of which has samples of its own");
    if (scene->integrator->ops->flags & IMP_INTEGRATOR_SOLVES)
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "imp_grid_read_until: integrator %s takes no samples by point",
                          scene->integrator->ops->name);
    if (run->time_limit_s > 0)
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "imp_grid_read_until: how long it takes is not known before "
                          "its pilot ends; it goes without time_limit_s");
    return IMP_OK;
}

enum imp_status imp_grid_read_until(imp_scene *scene, const struct imp_run *run,
                                    const struct imp_until_options *options,
                                    double *value, double *se,
                                    struct imp_estimate *average, int64_t *sets,
                                    struct imp_until_end *end)
{
    enum imp_status st = IMP_OK;
    struct imp__looks looks;
    struct stages s = {.scene = scene, .looks = &looks};
    struct imp_until_end ended = IMP_UNTIL_END_INIT;
    struct imp_run own;
    int64_t least;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, value, "value");
    IMP_REQUIRE(scene->ctx, se, "se");
    IMP_REQUIRE(scene->ctx, average, "average");
    if (end) IMP_SIZED(scene->ctx, end, "end");
    IMP_RUN(scene->ctx, own, run);
    IMP_CHECKED(imp__looks_begin(scene->ctx, __func__, &own, options, &looks));
    IMP_CHECKED(imp__grid_film_of(scene, &own, &s.grid));
    IMP_CHECKED(refuse(scene, &s, &own));
    const struct imp_film_desc *f = &s.grid.sensor->film;
    s.n = (size_t)f->crop_w * (size_t)f->crop_h;
    s.x = imp__alloc(scene->ctx, 2 * s.n, sizeof *s.x);
    s.samples = imp__alloc(scene->ctx, s.n, sizeof *s.samples);
    s.only = imp__alloc(scene->ctx, s.n, sizeof *s.only);
    if (!s.x || !s.samples || !s.only)
        IMP_TRY(imp__error(scene->ctx, IMP_E_NOMEM, "no memory for %zu points", s.n));
    s.v = s.x + s.n;
    for (int64_t spp = own.spp > 0 ? own.spp : FIRST;; spp *= 4) {
        IMP_TRY(pilot(&s, spp));
        ended.looks++;
        ended.relative = fresh_samples(&s);
        if ((double)(4 * PART * spp) * (double)s.n > all_samples(&s)) break;
    }
    IMP_TRY(read_fresh(&s, value, se, &least));
    ended.looks++;
    ended.spp = (int64_t)ceil(s.taken / (double)s.n);
    ended.reached = ended.relative <= looks.options.relative;
    double sum = 0, square = 0;
    for (size_t i = 0; i < s.n; i++) {
        sum += value[i] / (double)s.n;
        square += se[i] * se[i];
    }
    *average = (struct imp_estimate){.value = sum, .se = sqrt(square) / (double)s.n};
    if (sets) *sets = least;
    if (end) IMP_GIVE(scene->ctx, end, ended, "end");
out:
    imp__release(scene->ctx, s.x);
    imp__release(scene->ctx, s.samples);
    imp__release(scene->ctx, s.only);
    return st;
}

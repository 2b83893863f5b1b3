/* SPDX-License-Identifier: Apache-2.0
 *
 * Plans of replicates: how many, how many samples in each, and in how many sets of points, by
 * filter, loss and estimator (replicates.h). */
#include "replicates.h"
#include "adjoint.h"
#include "film/film_filter.h"
#include "inverse/problem/loss.h"
#include "walk/kept/store.h"
#include "walk/run/run.h"
#include <math.h>

#define WIDE_MANY    16  /* samples per pixel */
#define NORMAL_CHUNK 512 /* samples of a pixel, all pairs of which are products */
/* Least samples of a replicate with its own error: skewed sets of fewer points make them too
 * large (docs/estimators.md 14). And where errors of gradients are not read. */
#define LONE_TOLD   32
#define LONE_SOUGHT 4

/* Sets of points in a replicate: two for a product of independent means, more for the
 * jackknife of a loss that is not quadratic. A fixed adjoint needs one. */
enum { SETS = 2, SETS_CURVED = 4, SETS_FIXED = 1 };

static bool curved(const struct imp__target *t)
{
    return t && !imp__loss_quadratic(t->desc.loss);
}
/* Recorded walks have one number of sets for all kinds of loss. */
static int sets_of(const struct imp__target *t, const struct imp_run *run)
{
    if (run->walks) return SETS;
    return !t ? SETS_FIXED : curved(t) ? SETS_CURVED : SETS;
}

/* The samples of a replicate as `sets` sets of points, or as independent ones (0). */
static struct imp__replicates in_sets(struct imp__replicates r, int sets)
{
    const int m = r.n >= 2 * sets ? sets : r.n; /* points one by one are independent */
    r.m = sets > 0 ? m : r.n;
    r.stride = 1;
    if (sets > 0) r.stride = (((r.n - 1) / r.m) / IMP_SET_POINTS + 1) * IMP_SET_POINTS;
    return r;
}

static struct imp__replicates box_plan(int spp, int batch_max, int sets)
{
    struct imp__replicates r = {0};
    spp = imp_max(spp, 2);
    r.n = spp < 4 ? spp : imp_min(spp / 2, batch_max);
    r.R = (spp - 1) / r.n + 1;
    r.chunks = imp_max(1, r.R / IMP_BATCHES_PER_ITEM);
    return in_sets(r, sets);
}

struct imp__replicates imp__replicates_plan(int spp, int batch_max)
{
    return box_plan(spp, batch_max, 0);
}

/* The plan of replicates that are pictures, for filters wider than a pixel and for losses by
 * poses. In sets, two pictures are one replicate: the adjoint of each comes from the other. */
static struct imp__replicates wide_plan(int spp, int sets)
{
    const bool many = spp >= WIDE_MANY;
    struct imp__replicates r = {.R = many ? 4 : 2, .chunks = 1};
    r.n = imp_max(2, (spp - 1) / r.R + 1);
    if (!sets || sets == SETS_FIXED) return in_sets(r, sets);
    if (!many) return in_sets(r, r.n);
    r.R = 2;
    r.n *= 2;
    return in_sets(r, SETS);
}

static int spp_of(const struct imp_sensor *sensor, const struct imp_run *run)
{
    return run->spp > 0 ? run->spp : sensor->spp;
}
static const struct imp_sensor *sensor_of(const struct imp_scene *scene,
                                          const struct imp__target *t,
                                          const struct imp_run *run)
{
    return scene->sensors[t ? t->desc.sensor : run->sensor];
}

/* ---- Points ------------------------------------------------------------------------ */

void imp__points_of_normal(const struct imp_problem *p, struct imp_run *run)
{
    if (run->points != IMP_POINTS_SCENE || run->walks) return;
    for (size_t i = 0; i < p->n_targets; i++)
        if (p->scene->sensors[p->targets[i].desc.sensor]->points != IMP_POINTS_SCENE)
            return;
    if (p->n_targets > 0) run->points = IMP_POINTS_INDEPENDENT;
}
void imp__points_of_losses(const struct imp_problem *p, struct imp_run *run)
{
    if (p->scene->n_media > 0) imp__points_of_normal(p, run);
}

enum imp_points imp__points_recorded(const struct imp_scene *scene,
                                     const struct imp_run *run, const uint8_t *sensors,
                                     bool losses)
{
    if (run->points != IMP_POINTS_SCENE) return run->points;
    bool chosen = !losses;
    for (int k = 0; k < scene->n_sensors; k++)
        chosen |= sensors[k] && scene->sensors[k]->points != IMP_POINTS_SCENE;
    return chosen ? IMP_POINTS_SOBOL : IMP_POINTS_INDEPENDENT;
}

/* ---- Plans ------------------------------------------------------------------------- */

/* The sets of a picture as replicates: a picture and its derivatives by a fixed adjoint are of the
 * same walks. False where these sets differ in size. */
static bool picture_plan(const struct imp_sensor *sensor, int spp,
                         struct imp__replicates *out)
{
    const struct imp_tracer tracer = {.points = imp__points(), .sensor = sensor};
    const int sets = spp / imp__tracer_set(&tracer, spp);
    if (sets < 2 || spp % sets != 0) return false;
    out->R = sets;
    out->n = spp / sets;
    out->chunks = imp_max(1, sets / IMP_BATCHES_PER_ITEM);
    *out = in_sets(*out, SETS_FIXED);
    return true;
}

struct imp__replicates imp__replicates_of(const struct imp_scene *scene,
                                          const struct imp__target *t,
                                          const struct imp_run *run)
{
    const struct imp_sensor *sensor = sensor_of(scene, t, run);
    const int sets =
        imp__points_of(sensor, run) == IMP_POINTS_SOBOL ? sets_of(t, run) : 0;
    if (imp__film_border(&sensor->film) > 0) return wide_plan(spp_of(sensor, run), sets);
    struct imp__replicates fixed = {0};
    if (sets == SETS_FIXED && picture_plan(sensor, spp_of(sensor, run), &fixed))
        return fixed;
    /* Longer batches reduce the bias of a loss that is not quadratic. */
    const bool kept_sets = run->walks && sets;
    const int most = curved(t) && !kept_sets ? IMP_REPLICATE_MAX
                     : sets                  ? sets * IMP_SET_POINTS
                                             : IMP_BATCH_MAX;
    return box_plan(spp_of(sensor, run), most, sets);
}

struct imp__replicates imp__replicates_loss(const struct imp_problem *p,
                                            const struct imp__target *t,
                                            const struct imp_run *run)
{
    const struct imp_sensor *sensor = sensor_of(p->scene, t, run);
    const int spp = spp_of(sensor, run);
    const int least = p->use == IMP_LOSS_SOUGHT ? LONE_SOUGHT : LONE_TOLD;
    const int sets =
        imp__points_of(sensor, run) == IMP_POINTS_SOBOL ? sets_of(t, run) : 0;
    if (t && imp__problem_moves(p)) return wide_plan(spp, sets);
    struct imp__replicates r = imp__replicates_of(p->scene, t, run);
    if (p->use == IMP_LOSS_COMPARED || run->walks || curved(t) ||
        imp__film_border(&sensor->film) > 0 ||
        imp__points_of(sensor, run) != IMP_POINTS_SOBOL || spp < least ||
        spp > SETS * IMP_SET_POINTS)
        return r;
    /* With sets of unequal size the estimate of the error has a mean (docs/estimators.md 14). */
    r = (struct imp__replicates){
        .n = spp + spp % SETS, .R = 1, .chunks = 1, .lone = true};
    return in_sets(r, SETS);
}

/* Sets of a replicate of a Gauss-Newton matrix. */
static int normal_sets(const struct imp_sensor *sensor, const struct imp__target *t,
                       const struct imp_run *run)
{
    return imp__points_of(sensor, run) == IMP_POINTS_SOBOL ? sets_of(t, run) : 0;
}

struct imp__replicates imp__replicates_normal(const struct imp_scene *scene,
                                              const struct imp__target *t,
                                              const struct imp_run *run, int rounds)
{
    const struct imp_sensor *sensor = sensor_of(scene, t, run);
    const int sets = normal_sets(sensor, t, run);
    const int spp = imp_max(spp_of(sensor, run), 4);
    if (imp__film_border(&sensor->film) > 0)
        return imp__replicates_pictures(scene, t, run, rounds);
    struct imp__replicates r =
        box_plan(spp, sets ? sets * IMP_SET_POINTS : IMP_BATCH_MAX, sets);
    r.R *= rounds;
    r.chunks = imp_max(1, (int)((int64_t)r.R * r.n / NORMAL_CHUNK));
    return r;
}

struct imp__replicates imp__replicates_pictures(const struct imp_scene *scene,
                                                const struct imp__target *t,
                                                const struct imp_run *run, int rounds)
{
    const struct imp_sensor *sensor = sensor_of(scene, t, run);
    const double all = fmin((double)imp_max(spp_of(sensor, run), 4) * rounds, 1 << 26);
    struct imp__replicates r = {.R = all < 8 ? 4 : IMP_WIDE_REPLICATES, .chunks = 1};
    r.n = ((int)all - 1) / r.R + 1;
    return in_sets(r, normal_sets(sensor, t, run) ? SETS_FIXED : 0);
}

enum imp_status imp__replicates_kept(const struct imp_tracer *tracer,
                                     struct imp__replicates r)
{
    if (!tracer->kept) return IMP_OK;
    for (int b = 0; b < r.R; b++)
        for (int s = 0; s < r.m; s++) {
            const int n = imp__replicates_set(r, s + 1) - imp__replicates_set(r, s);
            const int64_t first = imp__replicates_first(r, b, s);
            if (imp__store_find(tracer->kept, first) < 0 ||
                imp__store_find(tracer->kept, first + n - 1) < 0)
                return imp__error(
                    tracer->scene->ctx, IMP_E_ARG,
                    "these walks were kept for pictures; a loss needs walks "
                    "in sets of their own: keep them with `losses`");
        }
    return IMP_OK;
}

enum imp_status imp_problem_get_spp(const imp_problem *p, int target,
                                    const struct imp_run *run, int *spp)
{
    struct imp_run own;
    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, spp, "spp");
    IMP_RUN(p->ctx, own, run);
    if (target < -1 || target >= (int)p->n_targets)
        return imp__error(p->ctx, IMP_E_ARG, "there is no target %d; the problem has %zu",
                          target, p->n_targets);
    const struct imp__target *t = target < 0 ? NULL : &p->targets[target];
    const int sensor = t ? t->desc.sensor : own.sensor;
    if (t) imp__points_of_losses(p, &own);
    if (sensor < 0 || sensor >= p->scene->n_sensors || own.spp < 0)
        return imp__error(p->ctx, IMP_E_ARG, "run: there is no sensor %d, or spp %d < 0",
                          sensor, own.spp);
    const struct imp__replicates r =
        t ? imp__replicates_loss(p, t, &own) : imp__replicates_of(p->scene, NULL, &own);
    *spp = r.n * r.R;
    return IMP_OK;
}

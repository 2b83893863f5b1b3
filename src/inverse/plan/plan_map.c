/* SPDX-License-Identifier: Apache-2.0
 *
 * Which pixels tell of which number: weights times products of two derivative pictures with
 * independent random numbers, whose sums over pixels are the information without bias. */
#include "base/arguments.h"
#include "color/rgb.h"
#include "inverse/estimate/problem_tracer.h"
#include "math/rng.h"
#include "plan_arguments.h"
#include "scene/camera_gain.h"
#include "walk/run/run.h"
#include <string.h>

#define MAP_SEED 0x3a9f

struct map {
    struct imp_problem *p;
    struct imp__target target;
    imp_film **J[2]; /* [n] each */
};

static void destroy_all(imp_film **films, size_t n)
{
    for (size_t k = 0; k < n; k++) {
        imp_film_destroy(films[k]);
        films[k] = NULL;
    }
}

static double derivative(const struct map *m, int side, size_t k, size_t pixel, int c)
{
    const imp_film *f = m->J[side][k];
    const float *at = f->mean + pixel * (size_t)f->channels;
    if (m->target.desc.channels == f->channels) return (double)at[c];
    return imp__luminance((double)at[0], (double)at[1], (double)at[2]);
}

static void films_fill(const struct map *m, const double *pull, double *x, imp_film **out)
{
    const size_t n = m->p->n;
    const struct imp_target *t = &m->target.desc;
    for (size_t i = 0; i < (size_t)t->width * (size_t)t->height; i++)
        for (int c = 0; c < t->channels; c++) {
            const size_t at = i * (size_t)t->channels + (size_t)c;
            const double w = m->target.precision[at];
            double sum = 0;
            for (size_t k = 0; k < n; k++) {
                x[k] = derivative(m, 0, k, i, c);
                x[n + k] = derivative(m, 1, k, i, c);
                out[k]->mean[at] = (float)(w * x[k] * x[n + k]);
            }
            for (size_t k = 0; k < n; k++)
                for (size_t l = 0; l < n; l++) sum += pull[k * n + l] * x[k] * x[n + l];
            out[n]->mean[at] = (float)(w * sum);
        }
}

enum imp_status imp_plan_map(imp_problem *problem,
                             const struct imp_plan_candidate *candidate,
                             const struct imp_plan_options *options,
                             const struct imp_run *run, const double *pull,
                             imp_film **films)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, problem, "problem");
    imp_context *ctx = problem->ctx;
    const size_t n = problem->n;
    struct map m = {.p = problem};
    struct imp__plan_stage stage = {0};
    struct imp_plan_candidate *c = NULL;
    struct imp_plan_options own;
    struct imp_run all;
    imp_problem *blank = NULL;
    imp_film **made = NULL;
    double *x = NULL, lit;
    IMP_REQUIRE(ctx, candidate, "candidate");
    IMP_REQUIRE(ctx, pull, "pull");
    IMP_REQUIRE(ctx, films, "films");
    IMP_RUN(ctx, all, run);
    IMP_CHECKED(imp__run_traces(ctx, "imp_plan_map", &all));
    IMP_CHECKED(imp__problem_no_parts(problem, "a map of pixels"));
    IMP_CHECKED(imp__plan_options_take(problem, __func__, options, &own));
    IMP_FINITE_ALL(ctx, pull, n * n, "pull");
    IMP_FLOAT_MODE;
    IMP_SETS(problem->scene, st);
    if (st != IMP_OK) return st;
    IMP_TRY(imp__plan_candidates_take(problem, __func__, "candidate", candidate, 1, &c));
    const struct imp_sensor *s = problem->scene->sensors[c->sensor];
    if (s->film.n_responses > 0 || (s->gain && s->gain->fitted_gamma))
        IMP_TRY(imp__error(ctx, IMP_E_UNSUPPORTED,
                           "maps are of films without response curves and gamma"));
    made = imp__alloc(ctx, 3 * n + 1, sizeof *made);
    x = imp__alloc(ctx, 2 * n, sizeof *x);
    if (!made || !x) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for maps"));
    m.J[0] = made + n + 1;
    m.J[1] = m.J[0] + n;
    IMP_TRY(imp_problem_create(problem->scene, &blank));
    IMP_TRY(imp__plan_stage_begin(problem->scene, c, &stage));
    IMP_TRY(imp__plan_target(problem, blank, c, &own, &all, &m.target, &lit));
    for (int side = 0; side < 2; side++) {
        struct imp_run one = all;
        one.sensor = c->sensor;
        one.seed = imp__mix64(all.seed ^ (MAP_SEED + (uint64_t)side));
        IMP_TRY(imp_problem_jacobian(problem, &one, NULL, m.J[side]));
    }
    for (size_t k = 0; k <= n; k++)
        IMP_TRY(imp_film_create(ctx, m.target.desc.width, m.target.desc.height,
                                m.target.desc.channels == 3 ? "R,G,B" : "Y", &made[k]));
    films_fill(&m, pull, x, made);
    memcpy(films, made, (n + 1) * sizeof *made);
    memset(made, 0, (n + 1) * sizeof *made);
out:
    imp__plan_stage_end(&stage);
    imp__target_free(ctx, &m.target);
    if (made) destroy_all(made, 3 * n + 1);
    imp__release(ctx, made);
    imp__release(ctx, x);
    imp__release(ctx, c);
    imp_problem_destroy(blank);
    return st;
}

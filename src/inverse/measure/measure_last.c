/* SPDX-License-Identifier: Apache-2.0
 *
 * The fit that gives the answer, and what is done where it goes astray. */
#include "base/arguments.h"
#include "measuring.h"
#include <math.h>
#include <stdio.h>

#define MORE 4  /* times as many samples where a fit is led by its noise ... */
#define MOST 16 /* ... up to these */

enum imp_measure_stage imp__measure_last_stage(const struct imp__measure *m)
{
    return imp__measure_count(m, IMP_MEASURE_TOGETHER) > 0 ? IMP_MEASURE_TOGETHER
                                                           : IMP_MEASURE_TEXTURES;
}

/* A fit whose cameras have no derivatives in this scene (what they see is refused by name) is
 * made without them, which is said. */
enum imp_status imp__measure_stage(struct imp__measure *m, enum imp_measure_stage stage,
                                   imp_problem **problem,
                                   const struct imp_fit_result **result)
{
    const enum imp_status st = imp__measure_fit(m, stage, m->round, problem, result);
    const size_t cameras = imp__measure_count(m, IMP_MEASURE_CAMERAS) +
                           imp__measure_count(m, IMP_MEASURE_LENS);
    const bool of_cameras = stage <= IMP_MEASURE_LENS;
    if ((st != IMP_E_UNSUPPORTED && st != IMP_E_BIAS) || !cameras ||
        (!of_cameras && stage != IMP_MEASURE_TOGETHER))
        return st;
    IMP_CHECKED(imp__measure_say(m, "round %d: cameras stay: %s", m->round,
                                 imp_last_error(m->ctx)));
    for (size_t k = 0; k < m->scene->n_params; k++)
        if (m->stage[k] <= IMP_MEASURE_LENS) m->stage[k] = IMP_MEASURE_STAGES;
    if (of_cameras && !problem) return IMP_OK;
    const enum imp_measure_stage left = imp__measure_last_stage(m);
    if (imp__measure_count(m, left) == 0) return st; /* there was nothing else */
    return imp__measure_fit(m, left, m->round, problem, result);
}

/* Is chi-square of a surely above that of b? */
static bool is_above(const struct imp_measure_row *a, const struct imp_measure_row *b)
{
    return a->chi2 - b->chi2 > IMP_MEASURE_SURE * hypot(a->chi2_se, b->chi2_se);
}

static const struct imp_measure_row *last_row(const struct imp__measure *m)
{
    return &m->rows[m->n_rows - 1];
}

/* The fit once more, from `theta` where that is there. */
static enum imp_status fit_again(struct imp__measure *m, const double *theta,
                                 imp_problem **problem,
                                 const struct imp_fit_result **result)
{
    imp_problem_destroy(*problem);
    *problem = NULL;
    if (theta) {
        m->looked = false;
        IMP_CHECKED(imp_scene_set_theta(m->scene, theta));
    }
    return imp__measure_stage(m, imp__measure_last_stage(m), problem, result);
}

/* Pixels that no mask has taken and the scene cannot explain lead a fit without robust weights away from
 * where the stages came to: then it has these weights, too. Where that does not help, it is the noise of
 * few samples that leads it along what the photographs hardly determine. */
enum imp_status imp__measure_last(struct imp__measure *m, imp_problem **problem,
                                  const struct imp_fit_result **result)
{
    enum imp_status st = IMP_OK;
    const enum imp_measure_stage stage = imp__measure_last_stage(m);
    const int spp = m->run.spp;
    struct imp_measure_row start = {.n = imp__measure_count(m, stage)};
    double *theta = imp__alloc(m->ctx, m->scene->n_theta + 1, sizeof *theta);
    if (!theta) IMP_TRY(imp__error(m->ctx, IMP_E_NOMEM, "no memory for a stage"));
    m->doubtful = m->astray = false;
    IMP_TRY(imp_scene_get_theta(m->scene, theta));
    IMP_TRY(imp__measure_look(m));
    imp__measure_judge(m, 0, &start);
    IMP_TRY(imp__measure_stage(m, stage, problem, result));
    if (stage != IMP_MEASURE_TOGETHER || last_row(m)->explained ||
        !is_above(last_row(m), &start))
        goto out;
    IMP_TRY(imp__measure_say(m,
                             "round %d: the last fit ended worse than it began, led by "
                             "values that the scene does not explain: again with the "
                             "weights of the stages; its intervals are too narrow",
                             m->round));
    m->doubtful = true;
    IMP_TRY(fit_again(m, theta, problem, result));
    while ((m->astray = is_above(last_row(m), &start)) && m->run.spp < MOST * spp) {
        m->doubtful = false;
        m->run.spp *= MORE;
        IMP_TRY(imp__measure_say(m,
                                 "round %d: the last fit ended worse than it began with "
                                 "these weights, too, led by its noise: again with %d "
                                 "samples per pixel",
                                 m->round, m->run.spp));
        IMP_TRY(fit_again(m, theta, problem, result));
    }
out:
    m->run.spp = spp;
    imp__release(m->ctx, theta);
    return st;
}

/* Numbers that the fit could not determine: by the photographs, or by so few samples. */
static size_t loose_count(const struct imp_problem *p, const struct imp_fit_result *r)
{
    size_t n = 0;
    for (size_t i = 0; i < r->n; i++) {
        struct imp_fit_variable v = IMP_FIT_VARIABLE_INIT;
        n += imp_problem_get_fit_variable(p, i, &v) == IMP_OK && !v.determined;
    }
    return n;
}

/* A fit ends where its gradient is within its noise. What the photographs know better is left over, and is
 * found with more samples, before anything is said to be wrong, or not to be determined; while they help. */
enum imp_status imp__measure_last_again(struct imp__measure *m, imp_problem **problem,
                                        const struct imp_fit_result **result)
{
    const int spp = m->run.spp;
    if (imp__measure_last_stage(m) != IMP_MEASURE_TOGETHER) return IMP_OK;
    size_t loose = loose_count(*problem, *result);
    m->round--; /* it is the last round's */
    while ((!last_row(m)->explained || loose > 0) &&
           last_row(m)->chi2_se < IMP_MEASURE_BLIND && m->run.spp < MOST * spp) {
        const struct imp_measure_row before = *last_row(m);
        const size_t loose_before = loose;
        char what[96] = "wrong";
        m->run.spp *= MORE;
        if (before.explained)
            snprintf(what, sizeof what, "not determined (%zu number%s)", loose,
                     loose == 1 ? "" : "s");
        IMP_CHECKED(imp__measure_say(m,
                                     "round %d: before anything is said to be %s, the "
                                     "last fit again with %d samples per pixel",
                                     m->round, what, m->run.spp));
        IMP_CHECKED(fit_again(m, NULL, problem, result));
        loose = loose_count(*problem, *result);
        if (!is_above(&before, last_row(m)) && loose >= loose_before) break;
    }
    m->round++;
    return IMP_OK;
}

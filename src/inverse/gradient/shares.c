/* SPDX-License-Identifier: Apache-2.0
 *
 * What parameters do to one pixel: elasticities x dR/dx / R, summed over a parameter's
 * values, where R is the mean over channels and walks. R is of first degree in what
 * lights emit, so the shares of all emission add up to 1 (Euler); the share of a
 * reflectance is the mean number of reflections by it, weighted by what they carried.
 * Standard errors are those of a ratio of means, by the delta method:
 *
 *     r = sum g/sum L,   var r = n/(n - 1) sum (g - r L)^2 / (sum L)^2
 *
 * over walks, or over sets of them where walks of a pixel depend on each other. */
#include "base/arguments.h"
#include "film/film_picture.h"
#include "inverse/estimate/problem_tracer.h"
#include "inverse/estimate/replicates.h"
#include "walk/rules/features.h"
#include "walk/run/run.h"
#include <importon/report.h>
#include <math.h>

struct share_sink { /* adds x dL/dx to its parameter */
    struct imp_sink sink;
    const struct imp_scene *scene;
    const struct imp_active *active;
    double *to; /* [n_params] */
};

static void share_add(struct imp_sink *sink, int param, size_t element, int channels,
                      const imp_spec *bar)
{
    struct share_sink *s = (struct share_sink *)sink;
    const struct imp_param *p = &s->scene->params[param];
    if (s->active->base[param] < 0) return;
    if (channels == 3) {
        for (int c = 0; c < 3; c++)
            s->to[param] += imp__param_get(p, element + (size_t)c) * (*bar)[c];
    } else {
        s->to[param] += imp__param_get(p, element) * imp__sum_used(*bar, s->scene->lanes);
    }
}

struct shares {
    size_t n;
    double *one, *set;         /* [n] of a walk, of the walks of a set */
    double *g, *gg, *gl;       /* [n] sums over sets */
    double l, ll, l_set, sets; /* of the radiance */
    double lm, mm, m_set;      /* with the numbers of walks of the sets */
};

static void set_close(struct shares *s)
{
    for (size_t k = 0; k < s->n; k++) {
        s->g[k] += s->set[k];
        s->gg[k] += s->set[k] * s->set[k];
        s->gl[k] += s->set[k] * s->l_set;
        s->set[k] = 0;
    }
    s->l += s->l_set;
    s->ll += s->l_set * s->l_set;
    s->lm += s->l_set * s->m_set;
    s->mm += s->m_set * s->m_set;
    s->l_set = s->m_set = 0;
    s->sets += 1;
}

static void shares_end(const struct shares *s, const imp_problem *p, double walks,
                       double *share, double *share_se, struct imp_estimate *radiance)
{
    const double more = s->sets > 1 ? s->sets / (s->sets - 1) : NAN, l = s->l;
    for (size_t k = 0; k < s->n; k++) {
        const double r = l != 0 ? s->g[k] / l : 0;
        const double square = s->gg[k] - 2 * r * s->gl[k] + r * r * s->ll;
        const bool active = p->active.base[k] >= 0 && l != 0;
        share[k] = active ? r : 0;
        share_se[k] = active ? sqrt(more * fmax(square, 0)) / fabs(l) : 0;
    }
    const double mean = l / walks,
                 square = s->ll - 2 * mean * s->lm + mean * mean * s->mm;
    radiance->value = mean;
    radiance->se = sqrt(more * fmax(square, 0)) / walks;
    radiance->bias_order = 0;
}

static enum imp_status walks_take(const struct imp_tracer *tracer, struct shares *s,
                                  int x, int y, int64_t n, double *walk_share,
                                  int64_t n_walks)
{
    const struct imp_scene *scene = tracer->scene;
    const int set = imp_max(imp__tracer_set(tracer, n), 1);
    struct share_sink sink = {{.add = share_add}, scene, tracer->active, s->one};
    struct imp_arena arena;
    enum imp_status st = IMP_OK;
    imp_spec bar = {0};
    for (int c = 0; c < scene->channels; c++) bar[c] = 1. / scene->channels;
    imp__arena_init(&arena, scene->ctx);
    for (int64_t i = 0; i < n && st == IMP_OK; i++) {
        const struct imp_arena_mark mark = imp__arena_mark(&arena);
        struct imp_walk walk;
        int64_t first, count;
        imp__set_at(set, n, i, &first, &count);
        imp__walk_trace(tracer, &arena, x, y,
                        imp__tracer_sets(tracer) ? imp__set_number(set, n, i) : i, &walk);
        if (walk.dropped == IMP_DROP_MEMORY)
            st =
                imp__error(scene->ctx, IMP_E_NOMEM, "no memory for the walks of a pixel");
        for (size_t k = 0; k < s->n; k++) s->one[k] = 0;
        if (!walk.dropped) imp__walk_sweep(tracer, &walk, bar, &sink.sink);
        for (int c = 0; c < scene->channels; c++) s->l_set += bar[c] * walk.L[c];
        s->m_set += 1;
        for (size_t k = 0; k < s->n; k++) {
            s->set[k] += s->one[k];
            if (i < n_walks) walk_share[(size_t)i * s->n + k] = s->one[k];
        }
        if (i + 1 == first + count) set_close(s);
        imp__arena_rewind(&arena, mark);
    }
    imp__arena_free(&arena);
    return st;
}

enum imp_status imp_problem_shares(imp_problem *problem, const struct imp_run *run, int x,
                                   int y, double *share, double *share_se,
                                   struct imp_estimate *radiance, double *walk_share,
                                   int64_t n_walks)
{
    enum imp_status st = IMP_OK;
    struct imp_run own;
    struct imp_tracer tracer;
    struct shares s = {0};
    IMP_REQUIRE(NULL, problem, "problem");
    IMP_REQUIRE(problem->ctx, share, "share");
    IMP_REQUIRE(problem->ctx, share_se, "share_se");
    IMP_REQUIRE(problem->ctx, radiance, "radiance");
    IMP_RUN(problem->ctx, own, run);
    IMP_FLOAT_MODE;
    IMP_READS(problem->scene);
    if (!problem->n) return imp__error(problem->ctx, IMP_E_ARG, "no parameter is active");
    if (n_walks < 0 || (n_walks > 0 && !walk_share))
        return imp__error(problem->ctx, IMP_E_ARG, "shares of %lld walks: no room",
                          (long long)n_walks);
    struct imp_job job = imp__job(problem->scene, NULL, &own, &problem->active);
    imp__job_state(&job, IMP_HAS_SHARES, NULL);
    IMP_CHECKED(imp__job_allowed(&job));
    IMP_TRY(imp__problem_tracer(problem, &own, NULL, &tracer));
    const int64_t n = imp__walks_of(&own, tracer.sensor);
    const struct imp_film_desc *film = &tracer.sensor->film;
    if (x < 0 || y < 0 || x >= film->crop_w || y >= film->crop_h)
        IMP_TRY(imp__error(problem->ctx, IMP_E_ARG, "there is no pixel %d,%d", x, y));
    if (n_walks > n)
        IMP_TRY(imp__error(problem->ctx, IMP_E_ARG, "there are %lld walks, and not %lld",
                           (long long)n, (long long)n_walks));
    imp__tracer_numbers(&tracer, &own, n);
    s.n = (size_t)problem->scene->n_params;
    s.one = imp__alloc(problem->ctx, 5 * s.n + 1, sizeof *s.one);
    if (!s.one) IMP_TRY(imp__error(problem->ctx, IMP_E_NOMEM, "no memory for shares"));
    s.set = s.one + s.n;
    s.g = s.set + s.n;
    s.gg = s.g + s.n;
    s.gl = s.gg + s.n;
    IMP_TRY(walks_take(&tracer, &s, x, y, n, walk_share, n_walks));
    shares_end(&s, problem, (double)n, share, share_se, radiance);
out:
    imp__release(problem->ctx, s.one);
    return st;
}

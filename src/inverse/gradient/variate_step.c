/* SPDX-License-Identifier: Apache-2.0
 *
 * An evaluation with a control variate: the moments of its walks, and the weight that the
 * next one derives from them. */
#include "base/arguments.h"
#include "base/team.h"
#include "inverse/estimate/adjoint.h"
#include "inverse/problem/loss.h"
#include "inverse/problem/target_channels.h"
#include "variate.h"
#include <string.h>

#define W_MOST     (1 - 1. / 512) /* an error carried on lasts so many evaluations */
#define W_FIRST    0.5            /* without moments */
#define MEMORY     0.5            /* of moments, from one evaluation to the next */
#define GAIN_LEAST 1.25 /* variance gain that repays the evaluation at theta_{t-1} */

/* ---- Before it -------------------------------------------------------------------- */

/* The w that minimises the variance of F + w (I - H), by moments of earlier walks of the
 * other half. */
static double weight_of(const struct imp__variate_view *view, int half)
{
    const double *m = view->half[half].before;
    const double all = m[IMP_VARIATE_H] + view->half[half].variance;
    return all > 0 ? imp_clamp(m[IMP_VARIATE_BOTH] / all, 0.0, W_MOST) : W_FIRST;
}

/* Does that remove enough of F's variance to evaluate every pixel at theta_{t-1}? */
static bool pays(const struct imp__variate_view *view, int half)
{
    const double *m = view->half[half].before, w = weight_of(view, half);
    const double left = m[IMP_VARIATE_F] - 2 * w * m[IMP_VARIATE_BOTH] +
                        w * w * (m[IMP_VARIATE_H] + view->half[half].variance);
    return m[IMP_VARIATE_F] >= GAIN_LEAST * left;
}

void imp__variate_begin(struct imp__variate *v)
{
    for (int k = 0; k < v->n_views; k++) {
        struct imp__variate_view *view = &v->views[k];
        view->looks = v->evaluations > 0 ? IMP_VARIATE_AT_FEW : IMP_VARIATE_AT_NONE;
        for (int h = 0; h < 2; h++) {
            view->half[h].rests = v->evaluations == 0 || !pays(view, h);
            view->half[h].w = view->half[h].rests ? 0 : weight_of(view, h);
            if (!view->half[h].rests) view->looks = IMP_VARIATE_AT_ALL;
        }
        memset(view->moments, 0, sizeof view->moments);
        if (view->sum) memset(view->sum, 0, view->chunks * view->n * sizeof *view->sum);
    }
}

struct imp__variate_view *imp__variate_use(struct imp__variate *v,
                                           const struct imp__target *target,
                                           struct imp_tracer *here,
                                           struct imp_tracer *there)
{
    struct imp__variate_view *view = v->views;
    while (view->target != target) view++;
    here->elsewhere = true;
    *there = *here;
    there->scene = v->there;
    there->sensor = v->there->sensors[target->desc.sensor];
    return view;
}

enum imp_status imp__variate_room(imp_context *ctx, struct imp__variate_view *view,
                                  size_t chunks)
{
    if (chunks == view->chunks) return IMP_OK;
    imp__release(ctx, view->sum);
    view->chunks = 0;
    view->sum = imp__alloc(ctx, chunks * view->n, sizeof *view->sum);
    if (!view->sum) return imp__error(ctx, IMP_E_NOMEM, "no memory for pictures");
    view->chunks = chunks;
    return IMP_OK;
}

/* ---- Its walks -------------------------------------------------------------------- */

/* Adds the estimate of the variance of a pixel's mean from the m sets of a replicate. */
static void moments_add(int m, double scale, const double *f, const double *h,
                        double *moments)
{
    double F = 0, H = 0, square[IMP_VARIATE_KINDS] = {0};
    for (int s = 0; s < m; s++) {
        F += f[s] / m;
        H += h[s] / m;
    }
    for (int s = 0; s < m; s++) {
        square[IMP_VARIATE_F] += (f[s] - F) * (f[s] - F);
        square[IMP_VARIATE_H] += (h[s] - H) * (h[s] - H);
        square[IMP_VARIATE_BOTH] += (f[s] - F) * (h[s] - H);
    }
    for (int k = 0; k < IMP_VARIATE_KINDS; k++)
        moments[k] += scale / (m * (m - 1.0)) * square[k];
}

void imp__variate_replicate(struct imp__variate_view *view, const struct imp__target *t,
                            struct imp__replicates plan, int k, size_t pixel,
                            const imp_spec *L, imp_spec *H, double *moments)
{
    const int m = plan.m;
    const struct imp_target *d = &t->desc;
    const bool luminance = imp__sees_luminance(t, view->channels);
    const size_t at = pixel * (size_t)view->channels, width = (size_t)view->width;
    const int half = (int)((pixel / width + pixel % width) % 2);
    const double by = view->half[half].w;
    double f[IMP_REPLICATE_MAX], h[IMP_REPLICATE_MAX];
    for (int c = 0; c < d->channels && m > 1 && moments; c++) {
        const double T = t->pixels[pixel * (size_t)d->channels + (size_t)c];
        const double w =
            imp__loss_weight(d->loss, imp__target_weight(t, pixel, c), d->epsilon, T);
        for (int s = 0; s < m; s++) {
            f[s] = imp__seen(luminance, (double[3]){L[s][0], L[s][1], L[s][2]}, c);
            h[s] = imp__seen(luminance, (double[3]){H[s][0], H[s][1], H[s][2]}, c);
        }
        const double scale = w / ((double)plan.R * plan.R);
        double *to = moments + 2 * half * IMP_VARIATE_KINDS;
        moments_add(m, scale, f, h, to);
        if (imp__variate_few(view, pixel))
            moments_add(m, scale, f, h, to + IMP_VARIATE_KINDS);
    }
    imp_spec rest = {0}, last = {0};
    for (int s = 0; s < m; s++) rest += by != 0 ? L[s] - by * H[s] : L[s];
    for (int c = 0; c < view->channels; c++) {
        if (moments)
            view->sum[(size_t)k * view->n + at + (size_t)c] += rest[c] / m / plan.R;
        last[c] = view->last[at + (size_t)c];
    }
    for (int s = 0; s < m; s++) H[s] = L[s] + by * (last - H[s]);
}

/* ---- After it --------------------------------------------------------------------- */

/* Each number is of one rank, and 0 on the others: as integers, their bits add up. */
static enum imp_status sum_share(imp_context *ctx, const struct imp__variate_view *view)
{
    struct imp_fixed_sum bits = {.n = view->chunks * view->n,
                                 .sum = (imp_fixed *)view->sum};
    return imp__shared_fixed(ctx, &bits);
}

/* Moments of the other half, by which the next w of a half is chosen. A disabled half goes by
 * the few pixels, whether or not there are others: what it goes by must not depend on what its own
 * walks have the other half do. */
static void moments_now(const struct imp__variate_view *view, int half, double *now)
{
    const double *all = view->moments + 2 * (1 - half) * IMP_VARIATE_KINDS;
    const double *few = all + IMP_VARIATE_KINDS;
    memcpy(now, all, IMP_VARIATE_KINDS * sizeof *now);
    if (!view->half[half].rests) return;
    const bool any = view->looks != IMP_VARIATE_AT_NONE && few[IMP_VARIATE_F] > 0;
    const double scale = any ? all[IMP_VARIATE_F] / few[IMP_VARIATE_F] : 1;
    /* where nothing was evaluated elsewhere: as if it had been equal */
    now[IMP_VARIATE_H] = scale * (any ? few[IMP_VARIATE_H] : all[IMP_VARIATE_F]);
    now[IMP_VARIATE_BOTH] = scale * (any ? few[IMP_VARIATE_BOTH] : all[IMP_VARIATE_F]);
}

static void half_step(struct imp__variate_view *view, int half, int evaluations)
{
    double now[IMP_VARIATE_KINDS], w = view->half[half].w;
    double *before = view->half[half].before;
    moments_now(view, half, now);
    view->half[half].variance = now[IMP_VARIATE_F] - 2 * w * now[IMP_VARIATE_BOTH] +
                                w * w * (now[IMP_VARIATE_H] + view->half[half].variance);
    for (int k = 0; k < IMP_VARIATE_KINDS; k++)
        before[k] = evaluations > 1 ? MEMORY * before[k] + (1 - MEMORY) * now[k] : now[k];
}

/* I_t = F - w H, which has been added up, + w I_{t-1}. */
static void view_step(struct imp__variate_view *view, int evaluations)
{
    const size_t width = (size_t)view->width, channels = (size_t)view->channels;
    for (size_t i = 0; i < view->n; i++) {
        const size_t pixel = i / channels;
        double sum = 0;
        for (size_t k = 0; k < view->chunks; k++) sum += view->sum[k * view->n + i];
        view->last[i] =
            sum + view->half[(pixel / width + pixel % width) % 2].w * view->last[i];
    }
    for (int h = 0; h < 2; h++) half_step(view, h, evaluations);
}

static void params_follow(struct imp_scene *there, const struct imp_problem *p)
{
    for (size_t k = 0; k < there->n_params; k++) {
        if (p->active.base[k] < 0) continue;
        struct imp_param *to = &there->params[k];
        for (size_t e = 0; e < to->info.count; e++)
            imp__param_set(to, e, imp__param_get(&p->scene->params[k], e));
    }
    imp__theta_announce(there);
}

enum imp_status imp__variate_end(struct imp__variate *v, const struct imp_problem *p)
{
    for (int k = 0; k < v->n_views; k++) IMP_CHECKED(sum_share(v->ctx, &v->views[k]));
    for (int k = 0; k < v->n_views; k++) view_step(&v->views[k], v->evaluations);
    params_follow(v->there, p);
    v->evaluations++;
    return IMP_OK;
}

double imp__variate_gain(const struct imp__variate *v)
{
    double walks = 0, pictures = 0;
    for (int k = 0; k < v->n_views; k++) {
        for (int h = 0; h < 2; h++) {
            walks += v->views[k].half[h].before[IMP_VARIATE_F];
            pictures += v->views[k].half[h].variance;
        }
    }
    return pictures > 0 ? walks / pictures : 1;
}

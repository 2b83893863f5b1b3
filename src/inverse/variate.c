/* SPDX-License-Identifier: Apache-2.0 */
#include "variate.h"
#include "adjoint.h"
#include "base/arguments.h"
#include "base/team.h"
#include "film/film_filter.h"
#include "loss.h"
#include "seen.h"
#include "walk/walk_integrator.h"
#include <string.h>

#define W_MOST  (1 - 1. / 512) /* what is carried on is forgotten in so many evaluations */
#define W_FIRST 0.5            /* where nothing is known */
#define MEMORY  0.5            /* of moments, from one evaluation to the next */

/* ---- Where they are possible ----------------------------------------------------- */

static enum imp_status params_allowed(const struct imp_problem *p)
{
    for (size_t k = 0; k < p->scene->n_params; k++) {
        const struct imp_param *q = &p->scene->params[k];
        if (p->active.base[k] < 0 || !q->probed) continue;
        return imp__error(p->ctx, IMP_E_UNSUPPORTED,
                          "control variate: collisions are drawn by %s, and where it "
                          "is 0 none are drawn that other numbers need",
                          q->info.name);
    }
    if (p->active.body)
        return imp__error(p->ctx, IMP_E_UNSUPPORTED,
                          "control variate: an active number bends rays, so that walks "
                          "are others at other numbers");
    return IMP_OK;
}

static enum imp_status targets_allowed(const struct imp_problem *p)
{
    for (size_t t = 0; t < p->n_targets; t++) {
        const struct imp_target *d = &p->targets[t].desc;
        if (!imp__loss_quadratic(d->loss))
            return imp__error(p->ctx, IMP_E_UNSUPPORTED,
                              "control variate: the noise of earlier pictures would "
                              "bias a loss that is not quadratic (use l2 or relative)");
        if (imp__film_border(&p->scene->sensors[d->sensor]->film) > 0)
            return imp__error(p->ctx, IMP_E_UNSUPPORTED,
                              "control variate: pixels of sensor '%s' share walks "
                              "through their filter (use rfilter box)",
                              p->scene->sensors[d->sensor]->name);
    }
    return IMP_OK;
}

static enum imp_status allowed(const struct imp_problem *p, const struct imp_run *run)
{
    const struct imp_walk_integrator *i = imp__walk_integrator(p->scene);
    if (i) IMP_CHECKED(imp__walks_from(p->scene, i, run->from, &i));
    if (!i || i->from_lights)
        return imp__error(p->ctx, IMP_E_UNSUPPORTED,
                          "control variate: walks have to begin at the sensor");
    if (!p->scene->twin)
        return imp__error(p->ctx, IMP_E_UNSUPPORTED,
                          "control variate: this scene cannot be made a second time");
    IMP_CHECKED(targets_allowed(p));
    return params_allowed(p);
}

/* ---- From the beginning to the end ----------------------------------------------- */

static enum imp_status views_create(const struct imp_problem *p, struct imp__variate *v)
{
    int n = 0;
    for (size_t t = 0; t < p->n_targets; t++) n += imp__target_parts(&p->targets[t]);
    v->views = imp__alloc(p->ctx, (size_t)n, sizeof *v->views);
    if (!v->views) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for pictures");
    for (size_t t = 0; t < p->n_targets; t++) {
        const struct imp_film_desc *film =
            &p->scene->sensors[p->targets[t].desc.sensor]->film;
        for (int k = 0; k < imp__target_parts(&p->targets[t]); k++) {
            struct imp__variate_view *view = &v->views[v->n_views++];
            view->target = imp__target_part(&p->targets[t], k);
            view->channels = p->scene->channels;
            view->width = film->crop_w;
            view->n =
                (size_t)film->crop_w * (size_t)film->crop_h * (size_t)p->scene->channels;
            view->last = imp__alloc(p->ctx, view->n, sizeof *view->last);
            if (!view->last)
                return imp__error(p->ctx, IMP_E_NOMEM, "no memory for pictures");
        }
    }
    return IMP_OK;
}

enum imp_status imp__variate_create(const struct imp_problem *p,
                                    const struct imp_run *run, struct imp__variate **out)
{
    enum imp_status st = IMP_OK;
    struct imp__variate *v = NULL;
    IMP_TRY(allowed(p, run));
    v = imp__alloc(p->ctx, 1, sizeof *v);
    if (!v) IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for pictures"));
    v->ctx = p->ctx;
    IMP_TRY(views_create(p, v));
    st = p->scene->twin(p->scene, &v->there);
    if (st != IMP_OK)
        IMP_TRY(imp__error_prefix(p->ctx, st, "control variate: a second scene"));
    *out = v;
    v = NULL;
out:
    imp__variate_destroy(v);
    return st;
}

void imp__variate_destroy(struct imp__variate *v)
{
    if (!v) return;
    for (int k = 0; k < v->n_views; k++) {
        imp__release(v->ctx, v->views[k].last);
        imp__release(v->ctx, v->views[k].sum);
    }
    imp__release(v->ctx, v->views);
    if (v->there) imp_scene_destroy(v->there);
    imp__release(v->ctx, v);
}

void imp__variate_forget(struct imp__variate *v)
{
    if (v) v->evaluations = 0;
}

/* ---- An evaluation --------------------------------------------------------------- */

/* The w that makes the variance of F + w (I - H) least, by what earlier walks of the other
 * half say. */
static double weight_of(const struct imp__variate_view *view, int half)
{
    const double *m = view->half[half].before;
    const double all = m[IMP_VARIATE_H] + view->half[half].variance;
    return all > 0 ? imp_clamp(m[IMP_VARIATE_BOTH] / all, 0.0, W_MOST) : W_FIRST;
}

void imp__variate_begin(struct imp__variate *v)
{
    for (int k = 0; k < v->n_views; k++) {
        struct imp__variate_view *view = &v->views[k];
        for (int h = 0; h < 2; h++)
            view->half[h].w = v->evaluations > 0 ? weight_of(view, h) : 0;
        memset(view->moments, 0, sizeof view->moments);
        if (view->sum)
            memset(view->sum, 0, (size_t)view->chunks * view->n * sizeof *view->sum);
    }
}

enum imp_status imp__variate_use(struct imp__variate *v, const struct imp__target *target,
                                 struct imp__replicates plan, struct imp_tracer *here,
                                 struct imp_tracer *there, struct imp__variate_view **out)
{
    struct imp__variate_view *view = v->views;
    while (view->target != target) view++;
    if (plan.chunks != view->chunks) {
        imp__release(v->ctx, view->sum);
        view->sum = imp__alloc(v->ctx, (size_t)plan.chunks * view->n, sizeof *view->sum);
        if (!view->sum) return imp__error(v->ctx, IMP_E_NOMEM, "no memory for pictures");
        view->chunks = plan.chunks;
    }
    here->elsewhere = true;
    *there = *here;
    there->scene = v->evaluations > 0 ? v->there : NULL;
    there->sensor = v->there->sensors[target->desc.sensor];
    *out = view;
    return IMP_OK;
}

/* Adds what the m sets of a replicate say of the variance of a pixel's mean. */
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
                            struct imp__replicates plan, int k, size_t pixel, imp_spec *L,
                            const imp_spec *H, double *moments)
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
        moments_add(m, w / ((double)plan.R * plan.R), f, h,
                    moments + half * IMP_VARIATE_KINDS);
    }
    imp_spec rest = {0}, last = {0};
    for (int s = 0; s < m; s++) rest += L[s] - by * H[s];
    for (int c = 0; c < view->channels; c++) {
        if (moments)
            view->sum[(size_t)k * view->n + at + (size_t)c] += rest[c] / m / plan.R;
        last[c] = view->last[at + (size_t)c];
    }
    for (int s = 0; s < m; s++) L[s] += by * (last - H[s]);
}

/* Each number is of one rank, and 0 on the others: as integers, their bits add up. */
static enum imp_status sum_share(imp_context *ctx, const struct imp__variate_view *view)
{
    struct imp_fixed_sum bits = {.n = (size_t)view->chunks * view->n,
                                 .sum = (imp_fixed *)view->sum};
    return imp__shared_fixed(ctx, &bits);
}

/* What the next w of a half is chosen by: moments of the other one. */
static void half_step(struct imp__variate_view *view, int half, int evaluations)
{
    const double *now = view->moments + (1 - half) * IMP_VARIATE_KINDS;
    double *before = view->half[half].before, w = view->half[half].w;
    view->half[half].variance = now[IMP_VARIATE_F] - 2 * w * now[IMP_VARIATE_BOTH] +
                                w * w * (now[IMP_VARIATE_H] + view->half[half].variance);
    for (int k = 0; k < IMP_VARIATE_KINDS; k++)
        before[k] = evaluations > 1 ? MEMORY * before[k] + (1 - MEMORY) * now[k] : now[k];
    if (evaluations == 0) /* nothing was evaluated elsewhere: as if it had been equal */
        before[IMP_VARIATE_H] = before[IMP_VARIATE_BOTH] = before[IMP_VARIATE_F];
}

/* I_t = F - w H, which has been added up, + w I_{t-1}. */
static void view_step(struct imp__variate_view *view, int evaluations)
{
    const size_t width = (size_t)view->width, channels = (size_t)view->channels;
    for (size_t i = 0; i < view->n; i++) {
        const size_t pixel = i / channels;
        double sum = 0;
        for (int k = 0; k < view->chunks; k++) sum += view->sum[(size_t)k * view->n + i];
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

/* ---- Checkpoints ------------------------------------------------------------------ */

size_t imp__variate_numbers(const struct imp__variate *v, const struct imp_problem *p)
{
    size_t n = 1;
    for (int k = 0; k < v->n_views; k++) n += v->views[k].n + 2 + IMP_VARIATE_MOMENTS;
    for (size_t k = 0; k < p->scene->n_params; k++)
        if (p->active.base[k] >= 0) n += p->scene->params[k].info.count;
    return n;
}

void imp__variate_save(const struct imp__variate *v, const struct imp_problem *p,
                       double *to)
{
    *to++ = v->evaluations;
    for (int k = 0; k < v->n_views; k++) {
        const struct imp__variate_view *view = &v->views[k];
        for (int h = 0; h < 2; h++) {
            *to++ = view->half[h].variance;
            for (int i = 0; i < IMP_VARIATE_KINDS; i++) *to++ = view->half[h].before[i];
        }
        memcpy(to, view->last, view->n * sizeof *to);
        to += view->n;
    }
    for (size_t k = 0; k < p->scene->n_params; k++)
        for (size_t e = 0; p->active.base[k] >= 0 && e < p->scene->params[k].info.count;
             e++)
            *to++ = imp__param_get(&v->there->params[k], e);
}

void imp__variate_restore(struct imp__variate *v, const struct imp_problem *p,
                          const double *from)
{
    v->evaluations = (int)imp_clamp(*from++, 0., 1e9);
    for (int k = 0; k < v->n_views; k++) {
        struct imp__variate_view *view = &v->views[k];
        for (int h = 0; h < 2; h++) {
            view->half[h].variance = *from++;
            for (int i = 0; i < IMP_VARIATE_KINDS; i++) view->half[h].before[i] = *from++;
        }
        memcpy(view->last, from, view->n * sizeof *from);
        from += view->n;
    }
    for (size_t k = 0; k < p->scene->n_params; k++)
        for (size_t e = 0; p->active.base[k] >= 0 && e < p->scene->params[k].info.count;
             e++)
            imp__param_set(&v->there->params[k], e, *from++);
    imp__theta_announce(v->there);
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures, weights and refusals of recursive control variates, and their numbers in a checkpoint
 * (variate.h). */
#include "variate.h"
#include "base/arguments.h"
#include "film/film_filter.h"
#include "inverse/problem/loss.h"
#include "walk/rules/features.h"
#include <string.h>

/* ---- Where they are possible ----------------------------------------------------- */

static enum imp_status allowed(const struct imp_problem *p, const struct imp_run *run)
{
    struct imp_job job = imp__job(p->scene, NULL, run, &p->active);
    imp__job_state(&job, IMP_HAS_CONTROL_VARIATE, NULL);
    imp__job_state(&job, IMP_HAS_EDGE_TERMS, NULL);
    if (!p->scene->twin) imp__job_state(&job, IMP_HAS_ONE_MAKING, NULL);
    const int n_stated = job.n_stated;
    IMP_CHECKED(imp__job_allowed(&job));
    for (size_t t = 0; t < p->n_targets; t++) {
        const struct imp_target *d = &p->targets[t].desc;
        const struct imp_sensor *sensor = p->scene->sensors[d->sensor];
        const struct imp_bearer by = {.name = sensor->name, .kind = sensor->ops->name};
        job.n_stated = n_stated;
        if (!imp__loss_quadratic(d->loss))
            imp__job_state(&job, IMP_HAS_NOT_QUADRATIC, NULL);
        if (imp__film_border(&sensor->film) > 0)
            imp__job_state(&job, IMP_HAS_SHARED_PIXELS, &by);
        IMP_CHECKED(imp__job_allowed(&job));
    }
    return IMP_OK;
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

/* ---- Checkpoints ------------------------------------------------------------------ */

size_t imp__variate_numbers(const struct imp__variate *v, const struct imp_problem *p)
{
    size_t n = 1;
    for (int k = 0; k < v->n_views; k++) n += v->views[k].n + 2 * (1 + IMP_VARIATE_KINDS);
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

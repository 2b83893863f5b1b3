/* SPDX-License-Identifier: Apache-2.0
 *
 * A fit of poses from coarse to fine: the first searches compare pictures through filters that are
 * wider than the film's own, with targets blurred alike. An object that is several pixels from where
 * it belongs then still overlaps it, and the loss falls towards the truth from farther away. Level k
 * of n has a tent of 2^(n - k) pixels; the last level is the film and the targets themselves. */
#include "film/film_filter.h"
#include "fit.h"
#include "math/rng.h"
#include <math.h>
#include <string.h>

#define REACH 32 /* pixels of the widest tent */

extern const struct imp_filter_ops imp__tent;

/* Films and targets as they are, while others take their place. */
struct blur {
    struct imp_problem *problem;
    struct imp_filter *filter; /* [n_sensors] */
    float **pixels;            /* [n_targets] */
};

/* What the part of a pixel d away sees of a tent: its integral over the pixel. */
static double weight_at(double radius, int d)
{
    const int steps = 16;
    double sum = 0;
    for (int i = 0; i < steps; i++)
        sum += fmax(0, 1 - fabs(d + (i + 0.5) / steps - 0.5) / radius) / steps;
    return sum;
}

/* to = from blurred along one axis: `lines` lines of n pixels of C channels, `next` from a pixel to the
 * next, `step` from a line to the next. */
static void blur_lines(const float *from, float *to, int n, size_t next, int lines,
                       size_t step, int C, double radius)
{
    const int reach = (int)ceil(radius + 0.5);
    for (int l = 0; l < lines; l++)
        for (int i = 0; i < n; i++)
            for (int c = 0; c < C; c++) {
                double sum = 0, weights = 0;
                for (int j = imp_max(0, i - reach); j <= imp_min(n - 1, i + reach); j++) {
                    const double w = weight_at(radius, j - i);
                    sum += w * from[(size_t)l * step + (size_t)j * next + (size_t)c];
                    weights += w;
                }
                to[(size_t)l * step + (size_t)i * next + (size_t)c] =
                    (float)(sum / weights);
            }
}

static enum imp_status target_blur(struct imp__target *t, imp_context *ctx,
                                   const float *pixels, double radius)
{
    const int w = t->desc.width, h = t->desc.height, C = t->desc.channels;
    const size_t row = (size_t)w * (size_t)C;
    float *across = imp__alloc(ctx, row * (size_t)h, sizeof *across);
    if (!across) return imp__error(ctx, IMP_E_NOMEM, "no memory for a blurred target");
    blur_lines(pixels, across, w, (size_t)C, h, row, C, radius);
    blur_lines(across, t->pixels, h, row, w, (size_t)C, C, radius);
    imp__release(ctx, across);
    return IMP_OK;
}

static void blur_end(struct blur *b)
{
    struct imp_problem *p = b->problem;
    for (int k = 0; b->filter && k < p->scene->n_sensors; k++)
        p->scene->sensors[k]->film.filter = b->filter[k];
    for (size_t t = 0; b->pixels && t < p->n_targets; t++) {
        const struct imp_target *d = &p->targets[t].desc;
        const size_t n = (size_t)d->width * (size_t)d->height * (size_t)d->channels;
        if (b->pixels[t]) memcpy(p->targets[t].pixels, b->pixels[t], n * sizeof(float));
        imp__release(p->ctx, b->pixels[t]);
    }
    imp__release(p->ctx, b->filter);
    imp__release(p->ctx, b->pixels);
}

static enum imp_status blur_begin(struct imp_problem *p, struct blur *b)
{
    *b = (struct blur){.problem = p};
    b->filter = imp__alloc(p->ctx, (size_t)p->scene->n_sensors, sizeof *b->filter);
    b->pixels = imp__alloc(p->ctx, p->n_targets, sizeof *b->pixels);
    if (!b->filter || !b->pixels)
        return imp__error(p->ctx, IMP_E_NOMEM, "no memory for blurred targets");
    for (int k = 0; k < p->scene->n_sensors; k++)
        b->filter[k] = p->scene->sensors[k]->film.filter;
    for (size_t t = 0; t < p->n_targets; t++) {
        const struct imp_target *d = &p->targets[t].desc;
        const size_t n = (size_t)d->width * (size_t)d->height * (size_t)d->channels;
        b->pixels[t] = imp__alloc(p->ctx, n, sizeof(float));
        if (!b->pixels[t])
            return imp__error(p->ctx, IMP_E_NOMEM, "no memory for blurred targets");
        memcpy(b->pixels[t], p->targets[t].pixels, n * sizeof(float));
    }
    return IMP_OK;
}

static enum imp_status blur_to(struct blur *b, double radius)
{
    struct imp_problem *p = b->problem;
    for (size_t t = 0; t < p->n_targets; t++) {
        struct imp__target *target = &p->targets[t];
        struct imp_film_desc *film = &p->scene->sensors[target->desc.sensor]->film;
        film->filter =
            (struct imp_filter){.ops = &imp__tent, .self = NULL, .radius = radius};
        const enum imp_status st = target_blur(target, p->ctx, b->pixels[t], radius);
        if (st != IMP_OK) return st;
    }
    return IMP_OK;
}

bool imp__fit_blurs(const struct imp__fit *f)
{
    return f->options.levels > 1 && imp__problem_moves(f->problem);
}

enum imp_status imp__fit_blurs_allowed(const struct imp_problem *p,
                                       const struct imp_fit_options *o)
{
    if (o->optimizer != IMP_ADAM && o->optimizer != IMP_LM)
        return imp__error(p->ctx, IMP_E_ARG,
                          "levels of poses are of Adam and Levenberg-Marquardt");
    for (size_t t = 0; t < p->n_targets; t++) {
        const struct imp__target *target = &p->targets[t];
        const char *what = target->weights             ? "weights"
                           : target->clip              ? "levels at which it is clipped"
                           : target->photograph.pixels ? "a gamma"
                                                       : NULL;
        if (what)
            return imp__error(p->ctx, IMP_E_UNSUPPORTED,
                              "levels of poses blur the targets, and target %zu has %s",
                              t, what);
    }
    return IMP_OK;
}

/* The search through one filter, from x of s, which it moves. */
static enum imp_status level_run(struct imp__fit *f, const struct imp__goal *goal,
                                 const struct imp__opt_options *options,
                                 struct imp__search *s)
{
    enum imp_status st = IMP_OK;
    struct imp__search *level = NULL;
    IMP_TRY(imp__search_create(goal, f->options.optimizer, options, s->x, &level));
    f->search = level;
    IMP_TRY(imp__optimize(goal, options, level));
    imp__search_settle(level);
    if (f->options.optimizer == IMP_ADAM) imp__search_move(&f->goal, s, level->x);
    else memcpy(s->x, level->x, s->n * sizeof *s->x);
out:
    f->search = NULL;
    imp__search_destroy(level);
    return st;
}

enum imp_status imp__fit_blurred(struct imp__fit *f,
                                 const struct imp__opt_options *options,
                                 struct imp__search *s)
{
    enum imp_status st = IMP_OK;
    struct blur blur;
    struct imp__opt_options own = *options;
    struct imp__goal goal = f->goal;
    const char *checkpoint = f->options.checkpoint;
    const int n = f->options.levels;
    if (f->options.optimizer == IMP_ADAM)
        own.max_iterations = imp_max(own.max_iterations / n, 1);
    f->options.checkpoint = NULL; /* a checkpoint holds the last search */
    IMP_TRY(blur_begin(f->problem, &blur));
    for (int k = 1; k < n; k++) {
        goal.seed = imp__mix64(f->goal.seed + (uint64_t)k);
        IMP_TRY(blur_to(&blur, fmin(ldexp(1, n - k), REACH)));
        IMP_TRY(level_run(f, &goal, &own, s));
    }
out:
    f->options.checkpoint = checkpoint;
    blur_end(&blur);
    return st;
}

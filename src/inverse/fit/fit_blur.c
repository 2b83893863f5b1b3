/* SPDX-License-Identifier: Apache-2.0
 *
 * A fit of poses from coarse to fine: the first searches compare pictures through filters that are
 * wider than the film's own, with targets blurred alike. An object that is several pixels from where
 * it belongs then still overlaps it, and the loss falls towards the truth from farther away. Level k
 * of n has a tent of 2^(n - k) pixels; the last level is the film and the targets themselves.
 *
 * Filters mix light, so that a photograph is compared in light before the last level: T^gamma, with
 * gamma as it is when the level begins. Clipped values have no weight there, nor has what a tent
 * mixes with them; a target is blurred by its weights, and a level at which no quarter of its
 * weights is left is passed over. */
#include "base/arguments.h"
#include "film/film_filter.h"
#include "fit.h"
#include "inverse/problem/target_levels.h"
#include "math/rng.h"
#include <math.h>
#include <string.h>

#define REACH 32   /* pixels of the widest tent */
#define LEFT  0.25 /* of the weights that a level needs */

extern const struct imp_filter_ops imp__tent;

/* Films and targets as they are, while others take their place. */
struct blur {
    struct imp_problem *problem;
    struct imp_filter *filter;   /* [n_sensors] */
    struct imp__target *targets; /* [n_targets] */
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

/* Values of a target in light, and their weights: out [n] and weights [pixels]. */
static void target_light(const struct imp_problem *p, const struct imp__target *t,
                         float *out, float *weights)
{
    const size_t C = (size_t)t->desc.channels,
                 n = (size_t)t->desc.width * (size_t)t->desc.height;
    const struct imp_camera_gain *g = p->scene->sensors[t->desc.sensor]->gain;
    const float *from = t->clip ? t->clip->measured : t->pixels;
    const double gamma = t->photograph.pixels ? g->input[IMP_GAIN_GAMMA]->value[0] : 1;
    for (size_t i = 0; i < n; i++) {
        weights[i] = t->weights ? t->weights[i] : 1;
        for (size_t c = 0; c < C; c++) {
            const float v = from[i * C + c];
            out[i * C + c] = gamma == 1 ? v : (float)pow(fmax((double)v, 0), gamma);
            if (t->clip && v >= t->clip->high) weights[i] = 0;
        }
    }
}

/* No weight where a tent mixes with a pixel that has none: what is there is not known. own
 * [pixels]. */
static void weights_shrink(const struct imp__target *t, double radius, const float *own,
                           float *weights)
{
    const int w = t->desc.width, h = t->desc.height, reach = (int)ceil(radius);
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++) {
            const size_t at = (size_t)y * (size_t)w + (size_t)x;
            bool known = true;
            for (int j = imp_max(0, y - reach); j <= imp_min(h - 1, y + reach); j++)
                for (int i = imp_max(0, x - reach); i <= imp_min(w - 1, x + reach); i++)
                    known &= own[(size_t)j * (size_t)w + (size_t)i] > 0;
            weights[at] = known ? own[at] : 0;
        }
}

/* light [n] becomes its blurred self; by weights where some are 0 or differ. */
static enum imp_status light_blur(const struct imp__target *t, imp_context *ctx,
                                  double radius, const float *weights, float *light)
{
    const int w = t->desc.width, h = t->desc.height, C = t->desc.channels;
    const size_t row = (size_t)w * (size_t)C, n = row * (size_t)h;
    enum imp_status st = IMP_OK;
    float *by = NULL, *across = imp__alloc(ctx, n, sizeof *across);
    if (!across) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a blurred target"));
    if (t->weights || t->clip) {
        by = imp__alloc(ctx, n, sizeof *by);
        if (!by) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a blurred target"));
        for (size_t i = 0; i < n; i++) {
            by[i] = weights[i / (size_t)C];
            light[i] *= by[i];
        }
        blur_lines(by, across, w, (size_t)C, h, row, C, radius);
        blur_lines(across, by, h, row, w, (size_t)C, C, radius);
    }
    blur_lines(light, across, w, (size_t)C, h, row, C, radius);
    blur_lines(across, light, h, row, w, (size_t)C, C, radius);
    for (size_t i = 0; by && i < n; i++) light[i] = by[i] > 0 ? light[i] / by[i] : 0;
out:
    imp__release(ctx, across);
    imp__release(ctx, by);
    return st;
}

static void level_free(imp_context *ctx, struct imp__target *t,
                       const struct imp__target *own)
{
    if (t->pixels != own->pixels) imp__release(ctx, t->pixels);
    if (t->weights != own->weights) imp__release(ctx, t->weights);
    *t = *own;
}

/* The target of a level in place of its own. *left: the part of its weights. */
static enum imp_status target_blur(struct imp_problem *p, struct imp__target *t,
                                   const struct imp__target *own, double radius,
                                   double *left)
{
    imp_context *ctx = p->ctx;
    const size_t n = (size_t)t->desc.width * (size_t)t->desc.height;
    double before = 0, after = 0;
    level_free(ctx, t, own);
    float *light = imp__alloc(ctx, n * (size_t)t->desc.channels, sizeof *light);
    float *weights = imp__alloc(ctx, n, sizeof *weights);
    float *all = imp__alloc(ctx, n, sizeof *all);
    enum imp_status st = IMP_OK;
    if (!light || !weights || !all)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a blurred target"));
    target_light(p, own, light, all);
    for (size_t i = 0; i < n; i++) before += own->weights ? (double)own->weights[i] : 1;
    IMP_TRY(light_blur(own, ctx, radius, all, light));
    weights_shrink(own, radius, all, weights);
    for (size_t i = 0; i < n; i++) after += (double)weights[i];
    *left = after / before;
    t->pixels = light;
    light = NULL;
    if (own->weights || own->clip) {
        t->weights = weights;
        weights = NULL;
    }
    t->clip = NULL;
    t->silent = NULL;
    t->precision = NULL;
    t->photograph = (struct imp_photograph){.pixels = NULL};
    t->desc.pixels = t->pixels;
    t->desc.weights = t->weights;
out:
    imp__release(ctx, light);
    imp__release(ctx, weights);
    imp__release(ctx, all);
    return st;
}

static void blur_end(struct blur *b)
{
    struct imp_problem *p = b->problem;
    for (int k = 0; b->filter && k < p->scene->n_sensors; k++)
        p->scene->sensors[k]->film.filter = b->filter[k];
    for (size_t t = 0; b->targets && t < p->n_targets; t++)
        level_free(p->ctx, &p->targets[t], &b->targets[t]);
    imp__release(p->ctx, b->filter);
    imp__release(p->ctx, b->targets);
}

static enum imp_status blur_begin(struct imp_problem *p, struct blur *b)
{
    *b = (struct blur){.problem = p};
    b->filter = imp__alloc(p->ctx, (size_t)p->scene->n_sensors, sizeof *b->filter);
    b->targets = imp__alloc(p->ctx, p->n_targets, sizeof *b->targets);
    if (!b->filter || !b->targets)
        return imp__error(p->ctx, IMP_E_NOMEM, "no memory for blurred targets");
    for (int k = 0; k < p->scene->n_sensors; k++)
        b->filter[k] = p->scene->sensors[k]->film.filter;
    memcpy(b->targets, p->targets, p->n_targets * sizeof *b->targets);
    return IMP_OK;
}

/* *taken false: too little is left of some target. */
static enum imp_status blur_to(struct blur *b, double radius, bool *taken)
{
    struct imp_problem *p = b->problem;
    *taken = true;
    for (size_t t = 0; t < p->n_targets; t++) {
        struct imp__target *target = &p->targets[t];
        struct imp_film_desc *film = &p->scene->sensors[target->desc.sensor]->film;
        double left;
        film->filter =
            (struct imp_filter){.ops = &imp__tent, .self = NULL, .radius = radius};
        IMP_CHECKED(target_blur(p, target, &b->targets[t], radius, &left));
        *taken &= left >= LEFT;
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
    for (size_t t = 0; t < p->n_targets; t++)
        if (p->targets[t].n_parts > 0)
            return imp__error(p->ctx, IMP_E_UNSUPPORTED,
                              "levels of poses blur the targets, and target %zu has "
                              "response curves",
                              t);
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
        bool taken;
        IMP_TRY(blur_to(&blur, fmin(ldexp(1, n - k), REACH), &taken));
        if (taken) IMP_TRY(level_run(f, &goal, &own, s));
    }
out:
    f->options.checkpoint = checkpoint;
    blur_end(&blur);
    return st;
}

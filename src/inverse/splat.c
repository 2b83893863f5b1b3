/* SPDX-License-Identifier: Apache-2.0 */
#include "splat.h"
#include "film/film_picture.h"
#include "loss.h"
#include "seen.h"

static void sample_radiance(const void *payload, struct imp_sample *s)
{
    const struct imp_tracer *tracer = payload;
    struct imp_walk walk;
    imp__sample_walk(s, tracer, &walk);
    for (int c = 0; c < tracer->scene->channels; c++) s->value[c] = walk.L[c];
}

/* Positions only: an integrator that stops at the sensor. */
static void sample_position(const void *payload, struct imp_sample *s)
{
    imp__walk_position(payload, s->x, s->y, s->index, &s->px, &s->py);
    s->value[0] = 0;
}

/* The loss of one replicate's picture; the variance of a quadratic one is taken off. */
static double picture_loss(const struct imp__splat *s, const imp_film *film)
{
    const struct imp_target *t = &s->target->desc;
    const size_t pixels = (size_t)film->width * (size_t)film->height;
    const bool luminance = imp__sees_luminance(s->target, s->channels);
    double total = 0;
    for (size_t p = 0; p < pixels; p++) {
        const double scale = t->scale * (s->target->weights ? s->target->weights[p] : 1);
        for (int c = 0; c < t->channels; c++) {
            double mean[3], se[3];
            for (int k = 0; k < s->channels; k++) {
                mean[k] = film->mean[p * (size_t)s->channels + (size_t)k];
                se[k] = film->se[p * (size_t)s->channels + (size_t)k];
            }
            const double I = imp__seen(luminance, mean, c);
            /* Channels of a sample correlate: the luminance of their errors. */
            const double variance = imp__sqr(imp__seen(luminance, se, c));
            const double T = s->target->pixels[p * (size_t)t->channels + (size_t)c];
            struct imp__loss_at at;
            imp__loss_eval(t->loss, scale, t->epsilon, I, T, &at);
            total += at.value;
            if (imp__loss_quadratic(t->loss) && isfinite(variance))
                total -= 0.5 * imp__loss_weight(t->loss, scale, t->epsilon, T) * variance;
        }
    }
    return total;
}

enum imp_status imp__splat_create(const struct imp_problem *p,
                                  const struct imp_tracer *tracer,
                                  const struct imp__target *target, const float *seed,
                                  struct imp__replicates plan, const struct imp_run *run,
                                  struct imp__splat *out)
{
    imp_context *ctx = p->ctx;
    enum imp_status st = IMP_OK;
    struct imp__splat s = {.target = target,
                           .seed = seed,
                           .film = &tracer->sensor->film,
                           .channels = p->scene->channels,
                           .R = plan.R};
    const size_t pixels = (size_t)s.film->crop_w * (size_t)s.film->crop_h;
    double sum = 0, square = 0;
    s.weights = imp__alloc(ctx, (size_t)plan.R, sizeof *s.weights);
    s.films = imp__alloc(ctx, (size_t)plan.R, sizeof *s.films);
    if (!s.weights || !s.films) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory"));
    for (int b = 0; b < plan.R; b++) {
        s.weights[b] = imp__alloc(ctx, pixels, sizeof **s.weights);
        if (!s.weights[b]) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory"));
        struct imp_run own = *run;
        own.spp = plan.n;
        own.time_limit_s = 0;
        const int n = target ? s.channels : 1;
        const struct imp_picture picture = {.sensor = tracer->sensor,
                                            .stage = "picture",
                                            .names = n == 3 ? "R,G,B" : "Y",
                                            .n = n,
                                            .sample = target ? sample_radiance
                                                             : sample_position,
                                            .payload = tracer,
                                            .first = (int64_t)b * plan.n,
                                            .weights = s.weights[b]};
        IMP_TRY(imp__picture_make(ctx, &picture, &own, &s.films[b]));
        if (!target) continue;
        const double value = picture_loss(&s, s.films[b]);
        sum += value;
        square += value * value;
    }
    const double R = plan.R;
    s.objective = sum / R;
    s.objective_variance = (square - sum * sum / R) / (R * (R - 1));
    *out = s;
out:
    if (st != IMP_OK) imp__splat_destroy(ctx, &s);
    return st;
}

void imp__splat_destroy(imp_context *ctx, struct imp__splat *s)
{
    for (int b = 0; b < s->R; b++) {
        if (s->weights) imp__release(ctx, s->weights[b]);
        if (s->films) imp_film_destroy(s->films[b]);
    }
    imp__release(ctx, s->weights);
    imp__release(ctx, s->films);
    *s = (struct imp__splat){0};
}

/* l' of pixel p without the sample, as an adjoint of radiance. */
static imp_spec pixel_adjoint(const struct imp__splat *s, int b, size_t p, double w,
                              imp_spec L)
{
    const int n = s->channels;
    double bar[3] = {0, 0, 0}, rest[3];
    if (!s->target) {
        for (int c = 0; c < n; c++) bar[c] = s->seed[p * (size_t)n + (size_t)c];
        return imp__seen_bar(false, n, bar);
    }
    const struct imp_target *t = &s->target->desc;
    const double scale = t->scale * (s->target->weights ? s->target->weights[p] : 1);
    const double W = s->weights[b][p];
    const bool luminance = imp__sees_luminance(s->target, n);
    const float *mean = s->films[b]->mean + p * (size_t)n;
    for (int c = 0; c < n; c++) /* alone in its pixel: without it there is no estimate */
        rest[c] = W - w > 1e-9 * W ? (mean[c] * W - w * L[c]) / (W - w) : mean[c];
    for (int c = 0; c < t->channels; c++) {
        struct imp__loss_at at;
        imp__loss_eval(t->loss, scale, t->epsilon, imp__seen(luminance, rest, c),
                       s->target->pixels[p * (size_t)t->channels + (size_t)c], &at);
        bar[c] = at.d1;
    }
    return imp__seen_bar(luminance, t->channels, bar);
}

imp_spec imp__splat_adjoint(const struct imp__splat *s, int b, double px, double py,
                            imp_spec L)
{
    const struct imp_film_desc *film = s->film;
    const struct imp_filter *f = &film->filter;
    struct imp_taps across, down;
    imp_spec P = {0};
    imp__film_taps(f, px - film->crop_x, 0, film->crop_w - 1, &across);
    imp__film_taps(f, py - film->crop_y, 0, film->crop_h - 1, &down);
    for (int j = 0; j < down.n; j++)
        for (int i = 0; i < across.n; i++) {
            const double w = down.w[j] * across.w[i];
            const size_t p = (size_t)(down.first + j) * (size_t)film->crop_w +
                             (size_t)(across.first + i);
            if (w == 0 || s->weights[b][p] == 0) continue;
            P += pixel_adjoint(s, b, p, w, L) * (w / s->weights[b][p]);
        }
    return P;
}

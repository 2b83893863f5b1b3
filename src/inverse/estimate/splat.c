/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures of replicates through a wide filter, and the adjoint P_i of a sample with its own
 * part left out (splat.h). */
#include "splat.h"
#include "film/film_picture.h"
#include "film/film_sums.h"
#include "film/film_tiles.h"
#include "inverse/problem/loss.h"
#include "inverse/problem/target_channels.h"
#include "overlap.h"

#define REPLICATES 4 /* most of a plan for wide filters */

static void sample_radiance(const void *payload, struct imp_sample *s)
{
    const struct imp_tracer *tracer = payload;
    struct imp_walk walk;
    /* The index is the number of a sample, not its place among kept ones. */
    if (s->supply) imp__supply_take(s->supply, s->x, s->y, s->index, &walk);
    else imp__walk_trace(tracer, s->arena, s->x, s->y, s->index, &walk);
    s->px = walk.px;
    s->py = walk.py;
    s->dropped = walk.dropped;
    for (int c = 0; c < tracer->scene->channels; c++) s->value[c] = walk.L[c];
}

/* Positions only: an integrator that stops at the sensor. */
static void sample_position(const void *payload, struct imp_sample *s)
{
    imp__walk_position(payload, s->x, s->y, s->index, &s->px, &s->py);
    s->value[0] = 0;
}

static void mean_of(const struct imp__splat *s, int film, size_t p, double mean[3])
{
    const float *from = s->films[film]->mean + p * (size_t)s->channels;
    for (int k = 0; k < s->channels; k++) mean[k] = from[k];
}

/* Adds the loss of pixel p, from the pictures of the sets of replicate b. */
static void sets_loss(const struct imp__splat *s, int b, size_t p, double *total)
{
    const struct imp_target *t = &s->target->desc;
    const bool luminance = imp__sees_luminance(s->target, s->channels);
    for (int c = 0; c < t->channels; c++) {
        const double T = s->target->pixels[p * (size_t)t->channels + (size_t)c];
        const double scale = imp__target_weight(s->target, p, c);
        double mean[3], sum = 0, square = 0;
        for (int k = b * s->m; k < (b + 1) * s->m; k++) {
            mean_of(s, k, p, mean);
            const double I = imp__seen(luminance, mean, c);
            sum += I;
            square += I * I;
        }
        const double w = imp__loss_weight(t->loss, scale, t->epsilon, T);
        struct imp__loss_at at;
        imp__loss_eval(t->loss, scale, t->epsilon, sum / s->m, T, &at);
        *total += imp__loss_quadratic(t->loss)
                      ? imp__loss_unbiased(w, T, s->m, sum, square)
                      : at.value;
    }
}

/* The same, from the picture of a replicate; a quadratic loss is made unbiased by
 * subtracting the variance of the mean. */
static void picture_loss(const struct imp__splat *s, int b, size_t p, double *total)
{
    const struct imp_target *t = &s->target->desc;
    const imp_film *film = s->films[b];
    const bool luminance = imp__sees_luminance(s->target, s->channels);
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
        const double scale = imp__target_weight(s->target, p, c);
        struct imp__loss_at at;
        imp__loss_eval(t->loss, scale, t->epsilon, I, T, &at);
        *total += at.value;
        if (imp__loss_quadratic(t->loss) && isfinite(variance))
            *total -= 0.5 * imp__loss_weight(t->loss, scale, t->epsilon, T) * variance;
    }
}

static void pixel_loss(const struct imp__splat *s, int b, size_t p, double *total)
{
    if (s->m > 1) sets_loss(s, b, p, total);
    else picture_loss(s, b, p, total);
}

/* ---- The loss ------------------------------------------------------------------ */

/* Variance of a mean over R replicates. */
static double spread_of(const double *values, int R)
{
    double sum = 0, square = 0;
    for (int b = 0; b < R; b++) {
        sum += values[b];
        square += values[b] * values[b];
    }
    return (square - sum * sum / R) / (R * (R - 1.0));
}

static double loss_variance(const struct imp__splat *s, int R)
{
    const int width = s->film->crop_w, height = s->film->crop_h, side = IMP_TILE_SIDE;
    double pixels = 0, tiles = 0;
    for (int y0 = 0; y0 < height; y0 += side)
        for (int x0 = 0; x0 < width; x0 += side) {
            double tile[REPLICATES] = {0};
            for (int y = y0; y < imp_min(y0 + side, height); y++)
                for (int x = x0; x < imp_min(x0 + side, width); x++) {
                    const size_t p = (size_t)y * (size_t)width + (size_t)x;
                    double pixel[REPLICATES] = {0};
                    for (int b = 0; b < R; b++) {
                        pixel_loss(s, b, p, &pixel[b]);
                        tile[b] += pixel[b];
                    }
                    pixels += spread_of(pixel, R);
                }
            tiles += spread_of(tile, R);
        }
    const struct imp__overlap overlap = imp__overlap_of(s->film, 0, R);
    return imp__overlap_variance(overlap.loss, overlap.few, pixels, tiles);
}

static size_t pixels_of(const struct imp__splat *s)
{
    return (size_t)s->film->crop_w * (size_t)s->film->crop_h;
}
static const char *names_of(int channels) { return channels == 3 ? "R,G,B" : "Y"; }

/* Weights, and room for films. Ended by imp__splat_destroy, also after a failure. */
static enum imp_status begin(const struct imp_problem *p, const struct imp_tracer *tracer,
                             const struct imp__target *target, const float *seed,
                             struct imp__replicates plan, struct imp__splat *s)
{
    *s = (struct imp__splat){.target = target,
                             .seed = seed,
                             .film = &tracer->sensor->film,
                             .channels = p->scene->channels,
                             .m = target && plan.m < plan.n ? plan.m : 1};
    s->n = plan.R * s->m;
    s->weights = imp__alloc(p->ctx, (size_t)s->n, sizeof *s->weights);
    s->films = imp__alloc(p->ctx, (size_t)s->n, sizeof *s->films);
    bool fine = s->weights && s->films;
    for (int k = 0; k < s->n && fine; k++) {
        s->weights[k] = imp__alloc(p->ctx, pixels_of(s), sizeof **s->weights);
        fine = s->weights[k];
    }
    return fine ? IMP_OK : imp__error(p->ctx, IMP_E_NOMEM, "no memory");
}

static double replicate_loss(const struct imp__splat *s, int b)
{
    double value = 0;
    for (size_t p = 0; p < pixels_of(s); p++) pixel_loss(s, b, p, &value);
    return value;
}

enum imp_status imp__splat_create(const struct imp_problem *p,
                                  const struct imp_tracer *tracer,
                                  const struct imp__target *target, const float *seed,
                                  struct imp__replicates plan, const struct imp_run *run,
                                  struct imp__splat *out)
{
    imp_context *ctx = p->ctx;
    enum imp_status st = IMP_OK;
    struct imp__splat s;
    const bool one_by_one = plan.m == plan.n;
    double sum = 0;
    IMP_TRY(begin(p, tracer, target, seed, plan, &s));
    for (int k = 0; k < s.n; k++) {
        const int b = k / s.m, set = k % s.m;
        struct imp_run own = *run;
        own.spp = plan.n;
        if (s.m > 1)
            own.spp = imp__replicates_set(plan, set + 1) - imp__replicates_set(plan, set);
        own.time_limit_s = 0;
        own.walks =
            NULL; /* the tracer has them: a picture of run->walks takes them all */
        const int n = target ? s.channels : 1;
        const struct imp_picture picture = {
            .sensor = tracer->sensor,
            .stage = "picture",
            .names = names_of(n),
            .n = n,
            .sample = target ? sample_radiance : sample_position,
            .payload = tracer,
            .first = imp__replicates_first(plan, b, set),
            .step = one_by_one ? plan.stride : 1,
            .weights = s.weights[k],
            .walks = target ? imp__bundle_use(tracer) : NULL};
        IMP_TRY(imp__picture_make(ctx, &picture, &own, &s.films[k]));
        if (!target || set < s.m - 1) continue;
        sum += replicate_loss(&s, b);
    }
    s.objective = sum / plan.R;
    if (target) s.objective_variance = loss_variance(&s, plan.R);
    *out = s;
out:
    if (st != IMP_OK) imp__splat_destroy(ctx, &s);
    return st;
}

/* ---- Pictures that are made as walks go ---------------------------------------------- */

enum imp_status imp__splat_begin(const struct imp_problem *p,
                                 const struct imp_tracer *tracer,
                                 const struct imp__target *target,
                                 struct imp__replicates plan, struct imp__splat *out)
{
    enum imp_status st = begin(p, tracer, target, NULL, plan, out);
    for (int k = 0; k < out->n && st == IMP_OK; k++)
        st = imp__film_create(p->ctx, out->film->crop_w, out->film->crop_h,
                              names_of(out->channels), true, &out->films[k]);
    if (st != IMP_OK) imp__splat_destroy(p->ctx, out);
    return st;
}

void imp__splat_take(const struct imp__splat *s, int b, int set, size_t pixel, int n,
                     const struct imp_walk *walks)
{
    const int k = s->m > 1 ? b * s->m + set : b;
    double sums[2 * 3] = {0};
    for (int i = 0; i < n; i++) {
        double value[3];
        for (int c = 0; c < s->channels; c++) value[c] = walks[i].L[c];
        imp__box_add(value, s->channels, sums);
    }
    s->weights[k][pixel] = n;
    for (int c = 0; c < s->channels; c++) {
        const size_t at = pixel * (size_t)s->channels + (size_t)c;
        s->films[k]->mean[at] = imp__box_mean(sums[2 * c], n);
        s->films[k]->se[at] = imp__box_error(sums[2 * c], sums[2 * c + 1], n, 1);
    }
}

void imp__splat_end(struct imp__splat *s, struct imp__replicates plan)
{
    double sum = 0;
    for (int b = 0; b < plan.R; b++) sum += replicate_loss(s, b);
    s->objective = sum / plan.R;
    s->objective_variance = loss_variance(s, plan.R);
}

void imp__splat_destroy(imp_context *ctx, struct imp__splat *s)
{
    for (int k = 0; k < s->n; k++) {
        if (s->weights) imp__release(ctx, s->weights[k]);
        if (s->films) imp_film_destroy(s->films[k]);
    }
    imp__release(ctx, s->weights);
    imp__release(ctx, s->films);
    *s = (struct imp__splat){0};
}

/* Mean of pixel p without the sample, or over the other sets. */
static void rest_of(const struct imp__splat *s, int b, int k, size_t p, double w,
                    imp_spec L, double rest[3])
{
    if (s->m > 1) {
        for (int c = 0; c < s->channels; c++) rest[c] = 0;
        for (int t = 0; t < s->m; t++) {
            double mean[3];
            if (t == k) continue;
            mean_of(s, b * s->m + t, p, mean);
            for (int c = 0; c < s->channels; c++) rest[c] += mean[c] / (s->m - 1);
        }
        return;
    }
    const double W = s->weights[b][p];
    mean_of(s, b, p, rest);
    for (int c = 0; c < s->channels; c++) /* alone in its pixel: nothing else is known */
        if (W - w > 1e-9 * W) rest[c] = (rest[c] * W - w * L[c]) / (W - w);
}

/* l' at a mean, as an adjoint of radiance. */
static imp_spec adjoint_of(const struct imp__splat *s, size_t p, const double mean[3])
{
    const struct imp_target *t = &s->target->desc;
    const bool luminance = imp__sees_luminance(s->target, s->channels);
    double bar[3] = {0, 0, 0};
    for (int c = 0; c < t->channels; c++) {
        struct imp__loss_at at;
        imp__loss_eval(t->loss, imp__target_weight(s->target, p, c), t->epsilon,
                       imp__seen(luminance, mean, c),
                       s->target->pixels[p * (size_t)t->channels + (size_t)c], &at);
        bar[c] = at.d1;
    }
    return imp__seen_bar(luminance, t->channels, bar);
}

/* The same without the sample. */
static imp_spec pixel_adjoint(const struct imp__splat *s, int b, int k, size_t p,
                              double w, imp_spec L)
{
    const int n = s->channels;
    double bar[3] = {0, 0, 0}, rest[3];
    if (!s->target) {
        for (int c = 0; c < n; c++) bar[c] = s->seed[p * (size_t)n + (size_t)c];
        return imp__seen_bar(false, n, bar);
    }
    rest_of(s, b, k, p, w, L, rest);
    return adjoint_of(s, p, rest);
}

imp_spec imp__splat_pixel(const struct imp__splat *s, int b, size_t p)
{
    const int from = b < 0 ? 0 : b * s->m, end = b < 0 ? s->n : from + s->m;
    double sum[3] = {0, 0, 0}, mean[3];
    for (int k = from; k < end; k++) {
        mean_of(s, k, p, mean);
        for (int c = 0; c < s->channels; c++) sum[c] += mean[c] / (end - from);
    }
    return adjoint_of(s, p, sum);
}

imp_spec imp__splat_adjoint(const struct imp__splat *s, int b, int k, double px,
                            double py, imp_spec L)
{
    const struct imp_film_desc *film = s->film;
    const struct imp_filter *f = &film->filter;
    struct imp_taps across, down;
    const double *weights = s->weights[s->m > 1 ? b * s->m + k : b];
    imp_spec P = {0};
    imp__film_taps(f, px - film->crop_x, 0, film->crop_w - 1, &across);
    imp__film_taps(f, py - film->crop_y, 0, film->crop_h - 1, &down);
    for (int j = 0; j < down.n; j++)
        for (int i = 0; i < across.n; i++) {
            const double w = down.w[j] * across.w[i];
            const size_t p = (size_t)(down.first + j) * (size_t)film->crop_w +
                             (size_t)(across.first + i);
            if (w == 0 || weights[p] == 0) continue;
            P += pixel_adjoint(s, b, k, p, w, L) * (w / (weights[p] * s->m));
        }
    return P;
}

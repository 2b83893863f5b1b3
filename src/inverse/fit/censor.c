/* SPDX-License-Identifier: Apache-2.0
 *
 * Which values of a clipped target have a weight. V is the scene's value, from a picture
 * J of other random numbers than the loss has, s_V its standard error and s that of the
 * target's noise. With the level `high` at white
 *
 *     no weight      where V + 3 s_V > high - 3 s  and  T > high - 6 s - 3 s_V
 *     T = high       where V + 3 s_V <= high - 3 s and  T >= high
 *     as it is       else
 *
 * At the truth, |V - T| < 3 s but for 3 values in 1000 where V is well known, so the
 * second condition of the first line hardly ever decides, and weights depend on J alone,
 * not on the noise of T: values near the level are neither used nor left out by their
 * noise. The second condition gives a weight to a value that is far from the level, where
 * the scene is wrong.
 *
 * A photograph (docs/photographs.md) is compared by a power of T, whose noise is in the
 * power. Here the power is expanded about V instead,
 *
 *     at/gamma (V^(1 - gamma) g L - V) - [ at (T - V) + 1/2 at (at - 1) s_V^2/V ]
 *
 * which is linear in T; `at` is the gamma of J, and the last term is the mean of what the
 * noise of V adds. Where a scene follows gamma so that its photograph stays, that noise
 * enters by its square alone, at any gamma: it does not hold gamma at `at`. */
#include "censor.h"
#include "base/arguments.h"
#include "inverse/problem/target_channels.h"
#include "math/hash.h"
#include "walk/rules/features.h"
#include "walk/run/run.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SIGMAS      3
#define MORE        4   /* samples of the deciding picture, over those of a loss */
#define LEAST_SPP   64  /* of it */
#define FEW         30  /* values, below which the noise is not estimated */
#define LEAST_NOISE 0.1 /* part of the variance of T - V that is the target's, at least */
#define MOST_NOISE  0.03 /* of the range of the values: more is a scene that is wrong */
#define FAR         4    /* standard deviations of T - V that noise alone may be */
#define KNOWN_SE    0.25 /* V is expanded about where its relative error is smaller */

bool imp__problem_clips(const struct imp_problem *p)
{
    for (size_t t = 0; t < p->n_targets; t++)
        if (p->targets[t].clip) return true;
    return false;
}

static size_t numbers_of(const struct imp__target *t)
{
    return (size_t)t->desc.width * (size_t)t->desc.height * (size_t)t->desc.channels;
}
static bool has_weight(const struct imp__target *t, size_t i)
{
    return !t->weights || t->weights[i / (size_t)t->desc.channels] > 0;
}
static bool is_clipped(const struct imp__clip *c, size_t i)
{
    return c->measured[i] <= c->low || c->measured[i] >= c->high;
}
static double at_level(const struct imp__clip *c, size_t i)
{
    return (double)fmaxf(c->low, fminf(c->high, c->measured[i]));
}

/* The gamma of a photograph at the scene's present parameters; 1 of other targets. */
static double gamma_of(const struct imp_problem *p, const struct imp__target *t)
{
    const struct imp_camera_gain *gain = p->scene->sensors[t->desc.sensor]->gain;
    return t->clip->base ? gain->input[IMP_GAIN_GAMMA]->value[0] : 1;
}

static void target_reset(const struct imp_problem *p, struct imp__target *t)
{
    struct imp__clip *c = t->clip;
    for (size_t i = 0; i < numbers_of(t); i++) {
        c->silent[i] = is_clipped(c, i);
        t->pixels[i] = c->measured[i];
        t->precision[i] = 1;
        if (c->base) c->base[i] = c->measured[i];
    }
    t->photograph.at = gamma_of(p, t);
}

void imp__clip_reset(struct imp_problem *p)
{
    for (size_t t = 0; t < p->n_targets; t++)
        if (p->targets[t].clip) target_reset(p, &p->targets[t]);
}

enum imp_status imp_problem_clip(imp_problem *p, int target, double low, double high)
{
    enum imp_status st = IMP_OK;
    struct imp__clip *c = NULL;
    IMP_REQUIRE(NULL, p, "problem");
    imp_context *ctx = p->ctx;
    IMP_FINITE(ctx, low, "low");
    IMP_FINITE(ctx, high, "high");
    if (target < 0 || (size_t)target >= p->n_targets)
        return imp__error(ctx, IMP_E_ARG, "there is no target %d; there are %zu", target,
                          p->n_targets);
    struct imp__target *t = &p->targets[target];
    if (!(low < high))
        return imp__error(ctx, IMP_E_ARG,
                          "levels of clipping: low = %g is not less than high = %g", low,
                          high);
    if (t->clip)
        return imp__error(ctx, IMP_E_ARG, "target %d has levels of clipping", target);
    struct imp_job job = {.ctx = ctx};
    const struct imp_bearer by = {.number = (size_t)target};
    imp__job_state(&job, IMP_HAS_CLIPPED_TARGET, &by);
    if (t->n_parts > 0) imp__job_state(&job, IMP_HAS_RESPONSE_LOSS, &by);
    IMP_CHECKED(imp__job_allowed(&job));
    const size_t n = numbers_of(t);
    c = imp__alloc(ctx, 1, sizeof *c);
    if (!c) return imp__error(ctx, IMP_E_NOMEM, "no memory for clipped numbers");
    c->low = (float)fmax(low, (double)-FLT_MAX);
    c->high = (float)fmin(high, (double)FLT_MAX);
    c->measured = imp__alloc(ctx, n, sizeof *c->measured);
    c->silent = imp__alloc(ctx, n, sizeof *c->silent);
    if (t->photograph.pixels) c->base = imp__alloc(ctx, n, sizeof *c->base);
    t->precision = imp__alloc(ctx, n, sizeof *t->precision);
    if (!c->measured || !c->silent || !t->precision || (t->photograph.pixels && !c->base))
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for clipped numbers"));
    memcpy(c->measured, t->pixels, n * sizeof *c->measured);
    t->clip = c;
    t->silent = c->silent;
    if (c->base) t->photograph.pixels = c->base;
    target_reset(p, t);
    return IMP_OK;
out:
    imp__release(ctx, t->precision);
    t->precision = NULL;
    imp__clip_free(ctx, c);
    return st;
}

/* ---- Decisions ------------------------------------------------------------------- */

struct decision {
    struct imp__target *t;
    double gamma;
    float *V, *up, *down; /* [numbers]: by J, J + 3 se, J - 3 se */
    float *off;           /* [numbers] |T - V| of some */
    double noise[2];      /* of the target, about black and about white */
    double fewer;         /* samples of J over those of a loss */
};

static double value_of(const struct decision *d, double linear)
{
    const double v = fmax(linear, 0);
    return d->t->clip->base ? pow(v, 1 / d->gamma) : linear;
}

static void values_take(struct decision *d, const imp_film *film, int channels)
{
    const struct imp__target *t = d->t;
    const int C = t->desc.channels;
    const bool luminance = imp__sees_luminance(t, channels);
    for (size_t i = 0; i < numbers_of(t); i++) {
        const size_t pixel = i / (size_t)C;
        double mean[3], error[3];
        for (int c = 0; c < channels; c++) {
            mean[c] = film->mean[pixel * (size_t)channels + (size_t)c];
            error[c] = film->se[pixel * (size_t)channels + (size_t)c];
        }
        const int c = (int)(i % (size_t)C);
        const double J = imp__seen(luminance, mean, c);
        const double e = SIGMAS * imp__seen(luminance, error, c);
        d->V[i] = (float)value_of(d, J);
        d->up[i] = (float)value_of(d, J + e);
        d->down[i] = (float)value_of(d, J - e);
    }
}

static int ascending(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static double median(float *v, size_t n)
{
    qsort(v, n, sizeof *v, ascending);
    return (double)v[n / 2];
}

/* |T - V|, or the standard error of V, of numbers where neither is clipped: in one half of
 * the values between lo and hi, or in both. */
static size_t gather(struct decision *d, bool errors, int half, bool all, double lo,
                     double hi)
{
    const struct imp__target *t = d->t;
    const struct imp__clip *c = t->clip;
    size_t n = 0;
    for (size_t i = 0; i < numbers_of(t); i++) {
        const float V = d->V[i];
        if (!has_weight(t, i) || is_clipped(c, i) || !(V > c->low && V < c->high))
            continue;
        if (!all && ((double)V > 0.5 * (lo + hi)) != half) continue;
        d->off[n++] =
            errors ? (d->up[i] - d->down[i]) / (2 * SIGMAS) : fabsf(c->measured[i] - V);
    }
    return n;
}

/* Standard deviation of the target's noise, from medians; in one half of the values, as
 * noise differs between dark and bright. It contains what the scene misses. */
static double noise_of(struct decision *d, int half)
{
    const struct imp__target *t = d->t;
    double lo = INFINITY, hi = -INFINITY;
    for (size_t i = 0; i < numbers_of(t); i++) {
        if (!has_weight(t, i) || is_clipped(t->clip, i)) continue;
        lo = fmin(lo, (double)t->clip->measured[i]);
        hi = fmax(hi, (double)t->clip->measured[i]);
    }
    const bool all = gather(d, false, half, false, lo, hi) < FEW;
    const size_t n = gather(d, false, half, all, lo, hi);
    if (n == 0) return 0;
    const double off = median(d->off, n) / 0.6745;
    gather(d, true, half, all, lo, hi);
    const double own = median(d->off, n);
    return fmin(sqrt(fmax(off * off - own * own, LEAST_NOISE * off * off)),
                MOST_NOISE * (hi - lo));
}

/* A photograph's value, expanded about V. Far from T, where the scene is not yet right,
 * the expansion may fall below 0, and the power is that of T: its residual
 * T^(1 - gamma) V^gamma - T of a dark value where the scene is bright is many times gamma (V - T),
 * and the value gets the weight that makes up for it. */
static void photograph_set(struct decision *d, size_t i)
{
    struct imp__target *t = d->t;
    struct imp__clip *c = t->clip;
    const double T = at_level(c, i), V = (double)d->V[i], gamma = d->gamma;
    const double se = ((double)d->up[i] - (double)d->down[i]) / (2 * SIGMAS);
    /* Where the target's noise is given, noise alone does not make a value far: tails that count otherwise
     * than the rest would pull the mean. */
    const double noise = t->value_noise ? (double)t->value_noise[i] : 0;
    if (V < IMP_PHOTOGRAPH_LEAST || se > KNOWN_SE * V ||
        T < fmin(fmax(0.5, 1 - 0.5 / gamma) * V, V - FAR * hypot(noise, se))) {
        const double far = T >= IMP_PHOTOGRAPH_LEAST ? T * (pow(V / T, gamma) - 1) : 0;
        const double plain = gamma * (V - T);
        c->base[i] = (float)T;
        t->pixels[i] = (float)T;
        if (plain > 0 && far > plain)
            t->precision[i] *= (float)((plain / far) * (plain / far));
        return;
    }
    c->base[i] = d->V[i];
    t->pixels[i] = (float)(V + gamma * (T - V) + 0.5 * gamma * (gamma - 1) * se * se / V);
}

/* A value that the walks of a loss know less well than the target counts less: where a lamp covers a part of a
 * pixel, few walks meet it, and a handful of such pixels would be most of the noise of a loss. */
static void precision_set(struct decision *d, size_t i)
{
    const double V = (double)d->V[i];
    const double se = ((double)d->up[i] - (double)d->down[i]) / (2 * SIGMAS);
    const double s = d->noise[V > 0.5 * (double)(d->t->clip->low + d->t->clip->high)];
    const double own = d->fewer * se * se;
    d->t->precision[i] = (float)(s > 0 ? s * s / (s * s + own) : 1);
}

static void target_decide(struct decision *d)
{
    struct imp__target *t = d->t;
    struct imp__clip *c = t->clip;
    const double black = SIGMAS * d->noise[0], white = SIGMAS * d->noise[1];
    const double low = (double)c->low, high = (double)c->high;
    c->changed = 0;
    for (size_t i = 0; i < numbers_of(t); i++) {
        const double T = (double)c->measured[i], V = (double)d->V[i];
        const double up = (double)d->up[i], down = (double)d->down[i];
        const bool bright = up > high - white && T > high - 2 * white - (up - V);
        const bool dark = down < low + black && T < low + 2 * black + (V - down);
        const bool silent = bright || dark;
        c->changed += silent != c->silent[i] && has_weight(t, i);
        c->silent[i] = silent;
        precision_set(d, i);
        if (c->base) photograph_set(d, i);
        else t->pixels[i] = (float)at_level(c, i);
    }
}

/* The scene's own picture, whatever the film's pixel format. Decisions depend on the error of
 * each pixel alone, of which few sets of points give too poor an estimate. */
static enum imp_status picture_make(struct imp_problem *p, const struct imp__target *t,
                                    int number, const struct imp_run *run, double *fewer,
                                    imp_film **out)
{
    struct imp_run own = *run;
    struct imp_problem *plain = NULL;
    const int spp = run->spp > 0 ? run->spp : p->scene->sensors[t->desc.sensor]->spp;
    own.sensor = t->desc.sensor;
    own.spp = (int)fmin(fmax((double)MORE * spp, LEAST_SPP), 1 << 26);
    own.seed = imp__mix64(run->seed ^ (UINT64_C(0xc11bbed) + (uint64_t)number));
    *fewer = (double)own.spp / spp;
    own.time_limit_s = 0;
    own.walks = NULL;
    own.points = IMP_POINTS_INDEPENDENT;
    enum imp_status st = imp_problem_create(p->scene, &plain);
    if (st == IMP_OK) st = imp_problem_jacobian(plain, &own, out, NULL);
    imp_problem_destroy(plain);
    return st;
}

static enum imp_status target_censor(struct imp_problem *p, size_t number,
                                     const struct imp_run *run)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = p->ctx;
    struct imp__target *t = &p->targets[number];
    struct decision d = {.t = t, .gamma = gamma_of(p, t)};
    const size_t n = numbers_of(t);
    imp_film *film = NULL;
    t->photograph.at = d.gamma;
    d.V = imp__alloc(ctx, 4 * n, sizeof *d.V);
    if (!d.V) return imp__error(ctx, IMP_E_NOMEM, "no memory for clipped numbers");
    d.up = d.V + n;
    d.down = d.up + n;
    d.off = d.down + n;
    IMP_TRY(picture_make(p, t, (int)number, run, &d.fewer, &film));
    values_take(&d, film, p->scene->channels);
    for (int half = 0; half < 2; half++) d.noise[half] = noise_of(&d, half);
    target_decide(&d);
out:
    imp_film_destroy(film);
    imp__release(ctx, d.V);
    return st;
}

enum imp_status imp__censor(struct imp_problem *p, const struct imp_run *run,
                            size_t *changed, size_t *numbers)
{
    enum imp_status st = IMP_OK;
    *changed = *numbers = 0;
    for (size_t k = 0; k < p->n_targets; k++) {
        if (!p->targets[k].clip) continue;
        IMP_TRY(target_censor(p, k, run));
        *changed += p->targets[k].clip->changed;
        for (size_t i = 0; i < numbers_of(&p->targets[k]); i++)
            *numbers += has_weight(&p->targets[k], i);
    }
out:
    return st;
}

enum imp_status imp_problem_censor(imp_problem *p, const struct imp_run *run)
{
    struct imp_run own;
    size_t changed, numbers;
    IMP_REQUIRE(NULL, p, "problem");
    IMP_RUN(p->ctx, own, run);
    IMP_CHECKED(imp__problem_no_parts(p, "a decision on clipped numbers"));
    IMP_FLOAT_MODE;
    IMP_READS(p->scene);
    return imp__censor(p, &own, &changed, &numbers);
}

enum imp_status imp_problem_get_clipped(const imp_problem *p, struct imp_clipped *out)
{
    struct imp_clipped all = IMP_CLIPPED_INIT;
    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, out, "out");
    for (size_t k = 0; k < p->n_targets; k++) {
        const struct imp__target *t = &p->targets[k];
        if (!t->clip) continue;
        for (size_t i = 0; i < numbers_of(t); i++) {
            if (!has_weight(t, i)) continue;
            all.numbers++;
            all.clipped += is_clipped(t->clip, i);
            all.silent += t->clip->silent[i];
            all.against += is_clipped(t->clip, i) && !t->clip->silent[i];
        }
    }
    IMP_GIVE(p->ctx, out, all, "out");
    return IMP_OK;
}

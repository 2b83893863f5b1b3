/* SPDX-License-Identifier: Apache-2.0
 *
 * The information of a picture that has not been taken. A pilot picture with random numbers of its
 * own gives each value v and so its weight 1/D, D = read^2/t^2 + shot v/t + (relative v)^2; to the
 * second order in the pilot's error s the mean of 1/D is too large by half its second derivative
 * times s^2, which is taken off. J^T W J is that of the normal equations of a fit (inverse/gauss),
 * products of different sets of walks.
 *
 * A photograph is compared as V^(1 - gamma) g L - V (scene/camera_gain.h), so that the variance of
 * what is compared is V^(2 - 2 gamma) D. */
#include "color/rgb.h"
#include "inverse/estimate/replicates.h"
#include "inverse/gauss/gauss_newton.h"
#include "math/rng.h"
#include "planning.h"
#include "scene/camera_gain.h"
#include <string.h>

#define RELATIVE_READ 0.01 /* of the mean, where no noise is given */
#define PILOT_SEED    0x9107

/* ---- The picture --------------------------------------------------------------------- */

/* The pilot's value and standard error of channel c of the target. */
struct pilot {
    const imp_film *film;
    bool luminance;
};

static double pilot_at(const struct pilot *p, size_t pixel, int c, double *se)
{
    static const double weight[3] = {IMP_LUM_R, IMP_LUM_G, IMP_LUM_B};
    const imp_film *f = p->film;
    const size_t at = pixel * (size_t)f->channels;
    double value = 0, square = 0;
    for (int k = 0; p->luminance && k < 3; k++) {
        const double s = f->se ? (double)f->se[at + (size_t)k] : 0;
        value += weight[k] * (double)f->mean[at + (size_t)k];
        square += imp__sqr(weight[k] * s);
    }
    if (!p->luminance) {
        value = (double)f->mean[at + (size_t)c];
        square = f->se ? imp__sqr((double)f->se[at + (size_t)c]) : 0;
    }
    *se = isfinite(square) ? sqrt(square) : 0;
    return fmax(value, 0);
}

static enum imp_status pilot_make(struct imp_problem *blank, const struct imp_sensor *s,
                                  const struct imp_run *run, imp_film **out)
{
    return s->film.n_responses > 0 ? imp_render(blank->scene, run, out)
                                   : imp_problem_jacobian(blank, run, out, NULL);
}

/* ---- Weights ------------------------------------------------------------------------- */

struct noise {
    double read2, shot, relative2,
        white; /* in the units of the picture; white INFINITY: none */
};

static struct noise noise_of(const struct imp_plan_options *o,
                             const struct imp_plan_candidate *c, double mean)
{
    const double t = c->time;
    const bool none = o->read == 0 && o->shot == 0 && o->relative == 0;
    const double read = none ? RELATIVE_READ * mean : o->read;
    return (struct noise){.read2 = imp__sqr(read / t),
                          .shot = o->shot / t,
                          .relative2 = imp__sqr(o->relative),
                          .white = o->white > 0 ? o->white / t : INFINITY};
}

/* 1/D, or 0 where a value tells nothing. */
static double weight_of(const struct noise *n, double v, double se)
{
    if (v >= n->white) return 0;
    const double D = n->read2 + n->shot * v + n->relative2 * v * v;
    if (!(D > 0)) return 0;
    const double slope = n->shot + 2 * n->relative2 * v;
    const double second = 2 * (slope * slope / D - n->relative2) / (D * D);
    return imp_clamp(1 / D - 0.5 * second * se * se, 0.5 / D, 2 / D);
}

static double mean_of(const struct pilot *p, size_t pixels, int channels)
{
    double sum = 0, se;
    for (size_t i = 0; i < pixels; i++)
        for (int c = 0; c < channels; c++) sum += pilot_at(p, i, c, &se);
    return sum / ((double)pixels * channels);
}

static void target_fill(const struct pilot *p, const struct noise *n, double gamma,
                        struct imp__target *t, double *lit)
{
    const size_t pixels = (size_t)t->desc.width * (size_t)t->desc.height;
    const int channels = t->desc.channels;
    double count = 0;
    for (size_t i = 0; i < pixels; i++)
        for (int c = 0; c < channels; c++) {
            const size_t at = i * (size_t)channels + (size_t)c;
            double se;
            const double v = pilot_at(p, i, c, &se), w = weight_of(n, v, se);
            const double V = gamma > 0 ? pow(v, 1 / gamma) : v;
            const bool counts = gamma <= 0 || V >= IMP_PHOTOGRAPH_LEAST;
            const double units = gamma > 0 && counts ? pow(V, 2 * gamma - 2) : 1;
            t->pixels[at] = (float)V;
            t->precision[at] = counts ? (float)fmin(w * units, 1e30) : 0;
            count += v > 0 && t->precision[at] > 0;
        }
    *lit = count / ((double)pixels * channels);
}

enum imp_status imp__plan_target(struct imp_problem *p, struct imp_problem *blank,
                                 const struct imp_plan_candidate *c,
                                 const struct imp_plan_options *options,
                                 const struct imp_run *run, struct imp__target *target,
                                 double *lit)
{
    enum imp_status st = IMP_OK;
    const struct imp_sensor *s = p->scene->sensors[c->sensor];
    const int responses = s->film.n_responses;
    const bool one = !responses && p->scene->channels == 3 &&
                     s->film.pixel_format <= IMP_PIXEL_LUMINANCE_ALPHA;
    struct imp__target t = {.desc = IMP_TARGET_INIT};
    struct imp_run own = *run;
    imp_film *film = NULL;

    own.seed = imp__mix64(run->seed ^ PILOT_SEED);
    own.sensor = c->sensor;
    IMP_TRY(pilot_make(blank, s, &own, &film));
    t.desc.sensor = c->sensor;
    t.desc.width = film->width;
    t.desc.height = film->height;
    t.desc.channels = responses ? responses : one ? 1 : p->scene->channels;
    t.desc.scale = 1;
    t.desc.epsilon = 1;
    if (film->channels < t.desc.channels)
        IMP_TRY(imp__error(p->ctx, IMP_E_UNSUPPORTED, "its film has %d of %d channels",
                           film->channels, t.desc.channels));
    const size_t pixels = (size_t)film->width * (size_t)film->height;
    t.pixels = imp__alloc(p->ctx, pixels * (size_t)t.desc.channels, sizeof *t.pixels);
    t.precision =
        imp__alloc(p->ctx, pixels * (size_t)t.desc.channels, sizeof *t.precision);
    if (!t.pixels || !t.precision)
        IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for a picture of a plan"));
    t.desc.pixels = t.pixels;
    imp__target_photograph(p, &t);
    const struct pilot pilot = {film, one};
    const struct noise noise =
        noise_of(options, c, mean_of(&pilot, pixels, t.desc.channels));
    target_fill(&pilot, &noise,
                t.photograph.pixels ? s->gain->input[IMP_GAIN_GAMMA]->value[0] : 0, &t,
                lit);
    IMP_TRY(imp__target_split(p, &t));
    *target = t;
    t = (struct imp__target){0};
out:
    imp__target_free(p->ctx, &t);
    imp_film_destroy(film);
    return st;
}

/* ---- J^T W J ------------------------------------------------------------------------- */

enum imp_status imp__plan_information(struct imp_problem *p, struct imp_problem *blank,
                                      const struct imp_plan_candidate *c,
                                      const struct imp_plan_options *options,
                                      const struct imp_run *run, const double *width,
                                      struct imp__plan_data *out)
{
    enum imp_status st = IMP_OK;
    const size_t n = p->n;
    struct imp__plan_stage stage;
    struct imp__target target = {0};
    struct imp__target *const targets = p->targets;
    const size_t n_targets = p->n_targets;
    struct imp_run own = *run;
    struct imp__gauss_newton gn = {.H = out->H, .deviations = out->deviations};

    IMP_TRY(imp__plan_stage_begin(p->scene, c, &stage));
    IMP_TRY(imp__plan_target(p, blank, c, options, run, &target, &out->lit));
    p->targets = &target;
    p->n_targets = 1;
    imp__points_of_normal(p, &own);
    st = imp__gauss_newton(p, NULL, &own, &gn);
    p->targets = targets;
    p->n_targets = n_targets;
    if (st != IMP_OK) goto out;
    for (size_t g = 0; g <= IMP_DEVIATIONS; g++) {
        double *A = g ? out->deviations + (g - 1) * n * n : out->H;
        for (size_t k = 0; k < n; k++)
            for (size_t l = 0; l < n; l++) A[k * n + l] *= width[k] * width[l];
    }
out:
    imp__target_free(p->ctx, &target);
    imp__plan_stage_end(&stage);
    return st;
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Does the answer of a fit explain its pictures? The loss at the answer, less our own
 * Monte Carlo noise, is compared with what the targets' noise alone leaves,
 *
 *     chi^2 per degree of freedom = J / [ sum 1/2 w sigma^2 (M - m)/M ]
 *
 * with M residuals and m determined values: with weights w = 1/sigma^2 the usual one,
 * with others its weighted form. It is 1 for a scene that can make the picture, and its
 * spread for Gaussian noise follows from sum 1/2 w^2 sigma^4, taken for fully correlated
 * colour channels, and for what filters wider than a pixel correlate (up to CORRELATED
 * pixels). The log loss has w = 1/(T + e)^2, to first order in the noise. */
#include "film/film_picture.h"
#include "fit.h"
#include "inverse/problem/loss.h"
#include <math.h>

#define CORRELATED 4.

struct sums {
    double expected; /* loss by noise of the target; NAN: not known */
    double variance; /* of that loss */
    double signal;   /* sum w T^2; for the log loss sum w */
    double count;    /* residuals */
};

static void add_target(const struct imp__fit *f, const struct imp__target *target,
                       struct sums *out)
{
    const struct imp_target *t = &target->desc;
    const struct imp_film_desc *film = &f->problem->scene->sensors[t->sensor]->film;
    const double pixels = imp__film_border(film) > 0 ? CORRELATED : 1;
    const bool log_loss = t->loss == IMP_LOSS_LOG;
    const int n = t->channels;
    for (size_t i = 0; i < (size_t)t->width * (size_t)t->height * (size_t)n; i++) {
        const double weight =
            imp__target_weight(target, i / (size_t)n, (int)(i % (size_t)n));
        const double T = target->pixels[i];
        if (!(weight > 0)) continue;
        const double w = imp__loss_gauss_newton(t->loss, weight, t->epsilon, T, T);
        out->count += 1;
        out->signal += log_loss ? weight : w * T * T;
        if (!target->noise_se) continue;
        const double e = 0.5 * w * target->noise_se[i] * target->noise_se[i];
        out->expected += e;
        out->variance += 2 * e * e * n * pixels;
    }
    if (!target->noise_se) out->expected = NAN;
}

struct imp__fit_residual imp__fit_residual(const struct imp__fit *f, const double *x,
                                           struct imp_estimate objective,
                                           size_t determined)
{
    const struct imp_problem *p = f->problem;
    struct imp__fit_residual r = {NAN, NAN, NAN, NAN, NAN, NAN};
    struct sums s = {0};
    for (size_t t = 0; t < p->n_targets; t++) {
        if (p->targets[t].desc.loss == IMP_LOSS_L1) return r; /* contains our noise */
        add_target(f, &p->targets[t], &s);
    }
    const double data = objective.value - imp__regularise(p, x, NULL);
    const double freedom = s.count - (double)determined;
    r.count = s.count;
    r.freedom = freedom;
    if (s.signal > 0 && !isnan(data)) { /* cancelled before its first evaluation */
        r.relative = sqrt(fmax(0, 2 * data) / s.signal);
        r.relative_hi = sqrt(fmax(0, 2 * (data + 2 * objective.se)) / s.signal);
    }
    if (!(s.expected > 0) || !(freedom > 0)) return r;
    const double unit = s.expected * freedom / s.count;
    r.chi2 = data / unit;
    r.chi2_se = hypot(objective.se, sqrt(s.variance)) / unit;
    return r;
}

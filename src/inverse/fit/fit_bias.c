/* SPDX-License-Identifier: Apache-2.0
 *
 * How far the bias of few samples moves an answer. Losses that are not quadratic, and
 * pixels that are ratios of sums (wide filters), leave a bias b(N) that falls at least
 * like 1/N. At the answer x of N samples let g be the gradient by 4 N samples and G the
 * inverse of H: the Newton point x - G g is the answer of 4 N samples, and G g at least
 * 3/4 of the bias of x. */
#include "film/film_picture.h"
#include "fit.h"
#include "inverse/problem/loss.h"
#include <math.h>

#define MORE 4

bool imp__fit_is_biased(const struct imp_problem *p)
{
    for (size_t t = 0; t < p->n_targets; t++) {
        const struct imp_target *d = &p->targets[t].desc;
        if (!imp__loss_quadratic(d->loss) ||
            imp__film_border(&p->scene->sensors[d->sensor]->film) > 0)
            return true;
    }
    return false;
}

enum imp_status imp__fit_shift(struct imp__fit *f, const double *x, const double *G,
                               uint64_t seed, const struct imp_fit_variable *variables,
                               struct imp__fit_shift *out)
{
    enum imp_status st = IMP_OK;
    const size_t n = f->problem->n;
    const struct imp_run before = f->run;
    const int sensor = f->problem->targets[0].desc.sensor;
    const double spp =
        f->run.spp > 0 ? f->run.spp : f->problem->scene->sensors[sensor]->spp;
    struct imp__fit_shift worst = {.of_se = -1};
    struct imp__normal e = {0}; /* the gradient that x is a zero of, not another one */
    IMP_TRY(imp__normal_create(f->problem->ctx, n, false, &e));
    f->run.spp = (int)fmin(MORE * spp, 1 << 26);
    IMP_TRY(f->goal.normal(x, seed, 1, &e, f));
    for (size_t k = 0; k < n; k++) {
        double step = 0, variance = 0;
        for (size_t l = 0; l < n; l++) {
            step -= G[k * n + l] * e.g[l];
            for (size_t m = 0; m < n; m++)
                variance += G[k * n + l] * e.cov_g[l * n + m] * G[k * n + m];
        }
        const double of_se = fabs(step) / variables[k].se;
        if (!(of_se > worst.of_se) || variables[k].at_bound) continue;
        worst = (struct imp__fit_shift){k, step, sqrt(fmax(variance, 0)), of_se};
    }
    *out = worst;
out:
    f->run = before;
    imp__normal_destroy(f->problem->ctx, &e);
    return st;
}

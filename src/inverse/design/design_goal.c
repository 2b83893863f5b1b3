/* SPDX-License-Identifier: Apache-2.0
 *
 * Measurements of the sources, their derivatives, and the goal that an optimiser sees. */
#include "design.h"
#include <math.h>
#include <string.h>

enum imp_status imp__design_stopped(const struct imp__design *d)
{
    return d->e->stop
               ? imp__error(d->goal.ctx, IMP_CANCELLED, "stopped: %s", d->e->reason)
               : IMP_OK;
}

enum imp_status imp__design_weigh(struct imp__design *d, const double *w)
{
    imp__el_weigh(d->e, w);
    return imp__el_bin(d->e);
}

enum imp_status imp__design_measure(struct imp__design *d, double *J)
{
    return imp__el_measure_each(d->e, J);
}

/* d (sum of w_k J_k) / dx, added to g [n]. */
static enum imp_status slope(struct imp__design *d, const double *w, double *g)
{
    enum imp_status st = IMP_OK;
    const struct imp_elements_row *rows;
    size_t n_rows;
    IMP_TRY(imp__design_weigh(d, w));
    IMP_TRY(imp_elements_sensitivity(d->e, &rows, &n_rows));
    IMP_TRY(imp__design_stopped(d));
    for (size_t i = 0; i < n_rows; i++) {
        if (rows[i].param < 0) continue;
        const int64_t base = d->p->active.base[rows[i].param];
        if (base >= 0) g[(size_t)base + rows[i].element] += rows[i].derivative;
    }
out:
    return st;
}

static enum imp_status rows_of(struct imp__design *d, double *A)
{
    enum imp_status st = IMP_OK;
    memset(A, 0, d->goals * d->n * sizeof *A);
    for (size_t k = 0; k < d->goals; k++) {
        memset(d->unit, 0, d->goals * sizeof *d->unit);
        d->unit[k] = 1;
        IMP_TRY(slope(d, d->unit, A + k * d->n));
    }
out:
    return st;
}

enum imp_status imp__design_at(struct imp__design *d, const double *x)
{
    enum imp_status st = IMP_OK;
    if (d->linear) {
        for (size_t k = 0; k < d->goals; k++) {
            d->J[k] = d->J0[k];
            for (size_t i = 0; i < d->n; i++) d->J[k] += d->A[k * d->n + i] * x[i];
        }
        imp__el_tick(d->e, "fit", -1, NULL);
        return imp__design_stopped(d);
    }
    IMP_TRY(imp_problem_set_x(d->p, x));
    IMP_TRY(imp_elements_update(d->e));
    IMP_TRY(imp__design_stopped(d));
    IMP_TRY(imp__design_measure(d, d->J));
out:
    return st;
}

double imp__design_value(const struct imp__design *d)
{
    double sum = 0;
    for (size_t k = 0; k < d->goals; k++)
        sum += 0.5 * d->w[k] * imp__sqr(d->J[k] - d->t[k]);
    return sum;
}

enum imp_status imp__design_eval(const double *x, uint64_t seed, struct imp_estimate *f,
                                 double *g, double *g_se, void *payload)
{
    struct imp__design *d = payload;
    enum imp_status st = IMP_OK;
    (void)seed;
    st = imp__design_at(d, x);
    if (st == IMP_E_NUMERIC) { /* reflections do not converge: the worst value */
        *f = (struct imp_estimate){.value = HUGE_VAL, .se = 0};
        if (g) memset(g, 0, d->n * sizeof *g);
        if (g_se) memset(g_se, 0, d->n * sizeof *g_se);
        return imp__el_sweep(d->e, 1, true, true); /* not from those values */
    }
    IMP_TRY(st);
    *f = (struct imp_estimate){.value = imp__design_value(d), .se = 0};
    if (g) {
        memset(g, 0, d->n * sizeof *g);
        for (size_t k = 0; k < d->goals; k++) d->unit[k] = d->w[k] * (d->J[k] - d->t[k]);
        for (size_t k = 0; k < d->goals && d->linear; k++)
            for (size_t i = 0; i < d->n; i++) g[i] += d->unit[k] * d->A[k * d->n + i];
        if (!d->linear) IMP_TRY(slope(d, d->unit, g));
    }
    if (g_se) memset(g_se, 0, d->n * sizeof *g_se);
    f->value += imp__regularise(d->p, x, g);
out:
    return st;
}

enum imp_status imp__design_normal(const double *x, uint64_t seed, int rounds,
                                   struct imp__normal *out, void *payload)
{
    struct imp__design *d = payload;
    enum imp_status st = IMP_OK;
    const size_t n = d->n;
    (void)seed;
    (void)rounds;
    IMP_TRY(imp__design_at(d, x));
    if (!d->linear) IMP_TRY(rows_of(d, d->A));
    memset(out->g, 0, n * sizeof *out->g);
    memset(out->cov_g, 0, n * n * sizeof *out->cov_g);
    memset(out->cov_excess, 0, n * n * sizeof *out->cov_excess);
    memset(out->H_meas, 0, n * n * sizeof *out->H_meas);
    memcpy(out->H_prior, d->H_prior, n * n * sizeof *out->H_prior);
    memcpy(out->H, d->H_prior, n * n * sizeof *out->H);
    for (size_t k = 0; k < d->goals; k++) {
        const double *a = d->A + k * n, r = d->J[k] - d->t[k];
        for (size_t i = 0; i < n; i++) {
            out->g[i] += d->w[k] * r * a[i];
            for (size_t j = 0; j < n; j++) out->H[i * n + j] += d->w[k] * a[i] * a[j];
        }
    }
    memcpy(out->H_same, out->H, n * n * sizeof *out->H_same);
    out->chi2 = 2 * imp__design_value(d);
    out->f = (struct imp_estimate){
        .value = imp__design_value(d) + imp__regularise(d->p, x, out->g), .se = 0};
    out->pairs = out->f;
    out->n_residuals = (double)d->goals;
    out->noise_known = true;
out:
    return st;
}

enum imp_status imp__design_matrix(struct imp__design *d, const double *x)
{
    enum imp_status st = IMP_OK;
    IMP_TRY(rows_of(d, d->A)); /* leaves the solution settled */
    IMP_TRY(imp__design_measure(d, d->J0));
    for (size_t k = 0; k < d->goals; k++)
        for (size_t i = 0; i < d->n; i++) d->J0[k] -= d->A[k * d->n + i] * x[i];
out:
    return st;
}

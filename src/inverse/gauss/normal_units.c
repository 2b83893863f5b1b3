/* SPDX-License-Identifier: Apache-2.0
 *
 * Units of a pixel's samples, and their residuals: what dense and sparse normal equations
 * have in common (gauss_newton.c has the formulas). */
#include "inverse/problem/loss.h"
#include "normal_tiles.h"

/* Units have one size where that can be: pairs of units are all pairs but those within a unit. */
int imp__normal_units(int sets)
{
    if (sets <= IMP_NORMAL_UNITS) return sets;
    for (int m = IMP_NORMAL_UNITS; m >= IMP_NORMAL_UNITS / 2; m--)
        if (sets % m == 0) return m;
    return IMP_NORMAL_UNITS;
}

/* Factor of the derivative of unit a where the loss is not quadratic, by
 * the jackknife over units (adjoint.c). */
static void jackknife(const struct imp_target *t, double scale, double T, int units,
                      double r[][3], size_t c, double *factor)
{
    struct imp__loss_at at;
    const double M = units;
    double S = 0, A = 0;
    for (int a = 0; a < units; a++) S += r[a][c];
    for (int a = 0; a < units; a++) {
        imp__loss_eval(t->loss, scale, t->epsilon, (S - r[a][c]) / (M - 1), T, &at);
        factor[a] = at.d1;
        A += at.d1;
    }
    imp__loss_eval(t->loss, scale, t->epsilon, S / M, T, &at);
    for (int a = 0; a < units; a++) factor[a] = at.d1 - (A - factor[a]) / M;
}

double imp__normal_residuals(const struct imp__target *target, size_t pixel, size_t c,
                             int units, double r[][3], double *factor)
{
    const struct imp_target *t = &target->desc;
    const double scale = imp__target_weight(target, pixel, (int)c);
    double T = t->pixels[pixel * (size_t)t->channels + c], mean = 0;
    for (int a = 0; a < units; a++) mean += r[a][c] / units;
    const double weight = imp__loss_gauss_newton(t->loss, scale, t->epsilon, mean, T);
    if (!imp__loss_quadratic(t->loss)) {
        struct imp__loss_at at;
        jackknife(t, scale, T, units, r, c, factor);
        imp__loss_eval(t->loss, scale, t->epsilon, mean, T, &at);
        T = weight > 0 ? mean - at.d1 / weight : T;
    }
    for (int a = 0; a < units; a++) r[a][c] -= T;
    return weight;
}

double imp__normal_residual_count(const struct imp__target *t)
{
    const size_t n = (size_t)t->desc.width * (size_t)t->desc.height;
    double count = 0;
    for (size_t i = 0; i < n; i++)
        for (int c = 0; c < t->desc.channels; c++)
            count += imp__target_weight(t, i, c) > 0;
    return count;
}

double imp__normal_pixel_count(const struct imp_problem *problem)
{
    double count = 0;
    for (size_t k = 0; k < problem->n_targets; k++) {
        const struct imp__target *t = &problem->targets[k];
        const size_t n = (size_t)t->desc.width * (size_t)t->desc.height;
        for (size_t i = 0; i < n; i++) {
            bool counts = false;
            for (int c = 0; c < t->desc.channels; c++)
                counts |= imp__target_weight(t, i, c) > 0;
            count += counts;
        }
    }
    return count;
}

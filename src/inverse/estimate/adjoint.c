/* SPDX-License-Identifier: Apache-2.0
 *
 * The adjoint of walk i uses the mean of the others,
 *
 *     P_i = (1/n) l'( (S - L_i)/(n - 1) ),   S = sum L                (leave-one-out)
 *
 * which is independent of L_i and of its derivative: the gradient of a quadratic loss is
 * unbiased at any n >= 2 (docs/estimators.md 5.2). For a smooth loss that is not
 * quadratic, the jackknife removes the bias of order 1/n (5.4). */
#include "adjoint.h"
#include "inverse/problem/loss.h"
#include "inverse/problem/target_channels.h"

#define EDGES 0.1 /* docs/estimators.md 14 */

/* The loss of one number of a pixel. */
struct loss {
    enum imp_loss kind;
    double scale, epsilon, T;
};

/* l, m, a [n]: samples, those of residuals, adjoints; returns the loss. */
static double leave_one_out(const struct loss *f, int n, const double *l, const double *m,
                            double *a)
{
    const double w = imp__loss_weight(f->kind, f->scale, f->epsilon, f->T);
    double S = 0, S2 = 0, M = 0;
    for (int i = 0; i < n; i++) {
        S += l[i];
        S2 += l[i] * l[i];
        M += m[i];
    }
    for (int i = 0; i < n; i++) a[i] = imp__loss_loo(w, f->T, n, M, m[i]) / n;
    return imp__loss_unbiased(w, f->T, n, S, S2);
}

/* N g - (N-1)/N sum_i g_-i with g = l'(mean) mean(x) is linear in the x_j; the factor of
 * x_j is l'(mean) - (A - a_j)/N, a_i = l'(mean without i), A = sum a_i. L1 has a kink,
 * where the expansion behind the jackknife fails: plain a_j/N. */
static double jackknife(const struct loss *f, int n, const double *l, double *a)
{
    const bool kink = f->kind == IMP_LOSS_L1;
    const double N = n;
    struct imp__loss_at at;
    double S = 0, A = 0, values = 0;
    for (int i = 0; i < n; i++) S += l[i];
    for (int i = 0; i < n; i++) {
        imp__loss_eval(f->kind, f->scale, f->epsilon, (S - l[i]) / (N - 1), f->T, &at);
        a[i] = at.d1;
        A += at.d1;
        values += at.value;
    }
    imp__loss_eval(f->kind, f->scale, f->epsilon, S / N, f->T, &at);
    for (int i = 0; i < n; i++) a[i] = kink ? a[i] / N : at.d1 - (A - a[i]) / N;
    return kink ? at.value : N * at.value - (N - 1) / N * values;
}

double imp__replicate_adjoints(const struct imp__target *target, int channels,
                               size_t pixel, int n, const imp_spec *L, const imp_spec *M,
                               imp_spec *P)
{
    const struct imp_target *t = &target->desc;
    const bool luminance = imp__sees_luminance(target, channels);
    double value = 0, l[IMP_REPLICATE_MAX], m[IMP_REPLICATE_MAX], a[IMP_REPLICATE_MAX];
    for (int i = 0; i < n; i++) P[i] = (imp_spec){0};
    for (int c = 0; c < t->channels; c++) {
        const struct loss f = {t->loss, imp__target_weight(target, pixel, c), t->epsilon,
                               target->pixels[pixel * (size_t)t->channels + (size_t)c]};
        for (int i = 0; i < n; i++)
            l[i] = imp__seen(luminance, (double[3]){L[i][0], L[i][1], L[i][2]}, c);
        for (int i = 0; M != L && i < n; i++)
            m[i] = imp__seen(luminance, (double[3]){M[i][0], M[i][1], M[i][2]}, c);
        value += imp__loss_quadratic(t->loss) ? leave_one_out(&f, n, l, M == L ? l : m, a)
                                              : jackknife(&f, n, l, a);
        for (int i = 0; i < n; i++)
            if (luminance) P[i] = imp__seen_bar(true, 1, &a[i]);
            else P[i][c] = a[i];
    }
    return value;
}

double imp__replicate_errors(const struct imp__target *target, int channels, size_t pixel,
                             const imp_spec L[2], const imp_spec P[2], imp_spec E[2])
{
    const struct imp_target *t = &target->desc;
    const bool luminance = imp__sees_luminance(target, channels);
    double error = 0, apart = 0, a[2];
    E[0] = P[1];
    E[1] = -P[0];
    for (int c = 0; c < t->channels; c++) {
        const double T = target->pixels[pixel * (size_t)t->channels + (size_t)c];
        const double w = imp__loss_weight(t->loss, imp__target_weight(target, pixel, c),
                                          t->epsilon, T);
        for (int i = 0; i < 2; i++)
            a[i] = imp__seen(luminance, (double[3]){L[i][0], L[i][1], L[i][2]}, c) - T;
        error += w / 4 * (a[0] - a[1]) * (a[0] + a[1]);
        apart += w / 4 * (a[0] - a[1]) * (a[0] - a[1]);
    }
    return error * error + EDGES * apart * apart;
}

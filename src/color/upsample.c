/* SPDX-License-Identifier: Apache-2.0
 *
 * The coefficients are found by Gauss-Newton steps with damping (Levenberg) from the grey
 * of the same mean, so that they depend on the colour alone. They end where the colour is
 * met to 1e-12: all but the most saturated colours of sRGB, whose spectra would have to be
 * steeper than COEFFICIENT_MAX allows. */
#include "upsample.h"
#include "base/compiler.h"
#include "cie.h"
#include "math/linalg.h"
#include "math/vec.h"
#include "rgb.h"
#include "rgb_basis.h"
#include <string.h>

#define COEFFICIENT_MAX 200.0
#define V_MAX           1e6 /* S(V_MAX) = 1 - 2.5e-13 */
#define STEPS           60
#define MET             1e-12

/* x; outside the range in which colours are seen, as at its ends. */
static double place(double nm)
{
    const double x = (nm - IMP_CIE_FIRST_NM) / (IMP_CIE_STEP_NM * (IMP_CIE_N - 1));
    return imp_clamp(x, 0.0, 1.0);
}
static double sigmoid(double v) { return 0.5 + 0.5 * v / sqrt(1 + v * v); }
static double sigmoid_d(double v)
{
    const double q = 1 / sqrt(1 + v * v);
    return 0.5 * q * q * q;
}

static double table_at(const double *table, int q)
{
    return q % 2 ? 0.5 * (table[q / 2] + table[q / 2 + 1]) : table[q / 2];
}

/* By Simpson's rule over the steps of the tables, each channel scaled so that white is 1. */
void imp__lifter_make(struct imp__lifter *out)
{
    double sum[3] = {0, 0, 0};
    for (int q = 0; q < IMP__LIFT_POINTS; q++) {
        const double w = q % 2 ? 4 : q == 0 || q == IMP__LIFT_POINTS - 1 ? 1 : 2;
        const double light = w * table_at(imp__cie_d65, q);
        double xyz[3], rgb[3];
        for (int c = 0; c < 3; c++) xyz[c] = light * table_at(imp__cie_xyz[c], q);
        imp__xyz_to_rgb(xyz, rgb);
        out->x[q] = (double)q / (IMP__LIFT_POINTS - 1);
        out->weight[q] = imp__v3(rgb[0], rgb[1], rgb[2]);
        for (int c = 0; c < 3; c++) sum[c] += rgb[c];
    }
    for (int q = 0; q < IMP__LIFT_POINTS; q++)
        for (int c = 0; c < 3; c++) out->weight[q][c] /= sum[c];
}

/* rgb of S, and J = d rgb/d c divided by peak. Sums run along q, channels in lanes. */
static void colour_of(const struct imp__lifter *by, const double c[3], double rgb[3],
                      double J[9], double *peak)
{
    double s[IMP__LIFT_POINTS], slope[IMP__LIFT_POINTS];
    for (int q = 0; q < IMP__LIFT_POINTS; q++) {
        const double x = by->x[q];
        const double v = (c[0] * x + c[1]) * x + c[2];
        s[q] = sigmoid(v);
        slope[q] = sigmoid_d(v);
    }
    imp_spec sum = {0}, by_c0 = {0}, by_c1 = {0}, by_c2 = {0};
    *peak = 0;
    for (int q = 0; q < IMP__LIFT_POINTS; q++) {
        *peak = imp_max(*peak, slope[q]);
        sum += by->weight[q] * imp__spec(s[q]);
    }
    for (int q = 0; q < IMP__LIFT_POINTS; q++) {
        const double x = by->x[q];
        const imp_spec a = by->weight[q] * imp__spec(slope[q] / *peak), ax = a * x;
        by_c0 += ax * x;
        by_c1 += ax;
        by_c2 += a;
    }
    for (int k = 0; k < 3; k++) {
        rgb[k] = sum[k];
        J[3 * k] = by_c0[k];
        J[3 * k + 1] = by_c1[k];
        J[3 * k + 2] = by_c2[k];
    }
}

/* x of A x = b, 3 x 3, by Cramer's rule; false: singular. */
static bool solve3(const double A[9], const double b[3], double x[3])
{
    const double m0 = A[4] * A[8] - A[5] * A[7], m1 = A[5] * A[6] - A[3] * A[8],
                 m2 = A[3] * A[7] - A[4] * A[6];
    const double det = A[0] * m0 + A[1] * m1 + A[2] * m2;
    if (!(fabs(det) > 0)) return false;
    x[0] = (b[0] * m0 + A[1] * (A[5] * b[2] - b[1] * A[8]) +
            A[2] * (b[1] * A[7] - A[4] * b[2])) /
           det;
    x[1] = (A[0] * (b[1] * A[8] - A[5] * b[2]) + b[0] * m1 +
            A[2] * (A[3] * b[2] - b[1] * A[6])) /
           det;
    x[2] = (A[0] * (A[4] * b[2] - b[1] * A[7]) + A[1] * (b[1] * A[6] - A[3] * b[2]) +
            b[0] * m2) /
           det;
    return isfinite(x[0]) && isfinite(x[1]) && isfinite(x[2]);
}

static double distance2(const double a[3], const double b[3])
{
    double sum = 0;
    for (int k = 0; k < 3; k++) sum += (a[k] - b[k]) * (a[k] - b[k]);
    return sum;
}

static double grey_v(double a)
{
    const double room = a * (1 - a);
    const double v = room > 0 ? (a - 0.5) / sqrt(room) : a > 0.5 ? V_MAX : -V_MAX;
    return imp_clamp(v, -V_MAX, V_MAX);
}

/* Coefficients, and d_c = (J/peak)^-1. */
static void fit(const struct imp__lifter *by, const double target[3],
                struct imp__lifted *out)
{
    double rgb[3], J[9], peak, damping = 1e-6;
    double *c = out->c;
    c[0] = c[1] = 0;
    const bool grey = target[0] == target[1] && target[1] == target[2];
    c[2] = grey ? grey_v(target[0])
                : grey_v(imp_clamp((target[0] + target[1] + target[2]) / 3, 0.02, 0.98));
    colour_of(by, c, rgb, J, &peak);
    double error = distance2(rgb, target);
    for (int step = 0; step < STEPS && !grey && error > MET * MET; step++) {
        double N[9], g[3], d[3], next[3], next_rgb[3], next_J[9], next_peak;
        for (int i = 0; i < 3; i++) {
            g[i] = 0;
            for (int k = 0; k < 3; k++) g[i] += J[3 * k + i] * (target[k] - rgb[k]);
            for (int j = 0; j < 3; j++) {
                N[3 * i + j] = 0;
                for (int k = 0; k < 3; k++) N[3 * i + j] += J[3 * k + i] * J[3 * k + j];
            }
        }
        for (int i = 0; i < 3; i++) N[4 * i] *= 1 + damping;
        if (!solve3(N, g, d)) break;
        for (int i = 0; i < 3; i++)
            next[i] = imp_clamp(c[i] + d[i] / peak, -COEFFICIENT_MAX, COEFFICIENT_MAX);
        colour_of(by, next, next_rgb, next_J, &next_peak);
        const double next_error = distance2(next_rgb, target);
        if (!(next_error < error)) {
            damping *= 8;
            if (damping > 1e12) break;
            continue;
        }
        damping = imp_max(damping * 0.1, 1e-14);
        memcpy(c, next, sizeof next);
        memcpy(rgb, next_rgb, sizeof rgb);
        memcpy(J, next_J, sizeof J);
        peak = next_peak;
        error = next_error;
    }
    out->peak = peak;
    for (int k = 0; k < 3; k++) {
        const double e[3] = {k == 0, k == 1, k == 2};
        double column[3] = {0, 0, 0};
        if (!solve3(J, e, column)) memset(column, 0, sizeof column);
        for (int i = 0; i < 3; i++) out->d_c[i][k] = column[i];
    }
}

void imp__lift_reflectance_by(const struct imp__lifter *by, const double rgb[3],
                              struct imp__lifted *out)
{
    double inside[3];
    struct imp__lifted l = {.scale = 1};
    for (int k = 0; k < 3; k++) inside[k] = imp_clamp(rgb[k], 0.0, 1.0);
    fit(by, inside, &l);
    for (int k = 0; k < 3; k++)
        if (rgb[k] < 0 || rgb[k] > 1)
            for (int i = 0; i < 3; i++) l.d_c[i][k] = 0;
    *out = l;
}

static int largest(const double rgb[3])
{
    int top = 0;
    for (int k = 1; k < 3; k++)
        if (rgb[k] > rgb[top]) top = k;
    return top;
}

/* value = s S(c(rgb/s)), with ds/drgb[top] = d_s: a change of s alone changes rgb/s along
 * itself. */
static void lift_scaled(const struct imp__lifter *by, const double rgb[3], int top,
                        double s, double d_s, struct imp__lifted *out)
{
    double part[3] = {0.5, 0.5, 0.5};
    struct imp__lifted l = {.scale = s};
    if (s > 0)
        for (int k = 0; k < 3; k++) part[k] = imp_max(rgb[k] / s, 0.0);
    fit(by, part, &l);
    l.d_scale[top] = d_s;
    for (int i = 0; i < 3; i++) {
        double along = 0;
        for (int k = 0; k < 3; k++) along += l.d_c[i][k] * part[k];
        for (int k = 0; k < 3; k++)
            l.d_c[i][k] = s > 0 ? ((l.d_c[i][k] - (k == top ? d_s * along : 0)) / s) : 0;
    }
    *out = l;
}

void imp__lift_unbounded_by(const struct imp__lifter *by, const double rgb[3],
                            struct imp__lifted *out)
{
    const int top = largest(rgb);
    lift_scaled(by, rgb, top, 2 * rgb[top], 2, out);
}

void imp__lift_reflectance(const double rgb[3], struct imp__lifted *out)
{
    struct imp__lifter by;
    imp__lifter_make(&by);
    imp__lift_reflectance_by(&by, rgb, out);
}

void imp__lift_unbounded(const double rgb[3], struct imp__lifted *out)
{
    struct imp__lifter by;
    imp__lifter_make(&by);
    imp__lift_unbounded_by(&by, rgb, out);
}

void imp__lift_extinction(const double rgb[3], struct imp__lifted *out)
{
    struct imp__lifter by;
    imp__lifter_make(&by);
    const int top = largest(rgb);
    const bool beyond = rgb[top] > 1;
    lift_scaled(&by, rgb, top, beyond ? 2 * rgb[top] - 1 : 1, beyond ? 2 : 0, out);
}

void imp__lift_linear(const double rgb[3], bool bounded, struct imp__lifted *out)
{
    struct imp__lifted l = {.linear = true};
    for (int k = 0; k < 3; k++) {
        const bool inside = rgb[k] >= 0 && !(bounded && rgb[k] > 1);
        l.c[k] = inside ? rgb[k] : rgb[k] > 0;
        l.d_scale[k] = inside;
    }
    *out = l;
}

double imp__lifted_value(const struct imp__lifted *l, double nm)
{
    if (l->linear) {
        double b[3];
        imp__rgb_basis(nm, b);
        return l->c[0] * b[0] + l->c[1] * b[1] + l->c[2] * b[2];
    }
    const double x = place(nm);
    return l->scale * sigmoid((l->c[0] * x + l->c[1]) * x + l->c[2]);
}

void imp__lifted_lanes(const struct imp__lifted *l, const double nm[4], imp_spec *value)
{
    if (l->linear) {
        for (int j = 0; j < 4; j++) (*value)[j] = imp__lifted_value(l, nm[j]);
        return;
    }
    double out[4];
    for (int j = 0; j < 4; j++) {
        const double x = place(nm[j]);
        out[j] = l->scale * sigmoid((l->c[0] * x + l->c[1]) * x + l->c[2]);
    }
    *value = (imp_spec){out[0], out[1], out[2], out[3]};
}

double imp__lifted_value_d(const struct imp__lifted *l, double nm, double d[3])
{
    if (l->linear) {
        double b[3];
        imp__rgb_basis(nm, b);
        for (int k = 0; k < 3; k++) d[k] = l->d_scale[k] * b[k];
        return l->c[0] * b[0] + l->c[1] * b[1] + l->c[2] * b[2];
    }
    const double x = place(nm);
    const double v = (l->c[0] * x + l->c[1]) * x + l->c[2], S = sigmoid(v);
    const double slope = l->scale * sigmoid_d(v) / l->peak;
    for (int k = 0; k < 3; k++)
        d[k] = l->d_scale[k] * S +
               slope * ((l->d_c[0][k] * x + l->d_c[1][k]) * x + l->d_c[2][k]);
    return l->scale * S;
}

/* S rises with v, which is largest at an end or at the vertex of the parabola; the basis
 * sums to 1. */
double imp__lifted_most(const struct imp__lifted *l)
{
    const double *c = l->c;
    if (l->linear) return imp_max(imp_max(c[0], c[1]), c[2]);
    double v = imp_max(c[2], c[0] + c[1] + c[2]);
    const double x = c[0] < 0 ? -c[1] / (2 * c[0]) : 0;
    if (x > 0 && x < 1) v = imp_max(v, (c[0] * x + c[1]) * x + c[2]);
    return l->scale * sigmoid(v);
}

/* SPDX-License-Identifier: Apache-2.0
 *
 * Distributions, quadrature and small linear algebra against published or exact numbers.
 */
#include "base/number.h"
#include "base/radix.h"
#include "imp_tap.h"
#include "math/exp.h"
#include "math/linalg.h"
#include "math/quadrature.h"
#include "math/rng.h"
#include "math/stat.h"
#include "math/trig.h"
#include <stdlib.h>

static void distributions(void)
{
    tap_near(imp__normal_cdf(1.959963984540054), 0.975, 1e-14, 0, "normal cdf at 1.96");
    tap_near(imp__normal_cdf(-10), 7.619853024160527e-24, 1e-12, 0,
             "normal cdf far left");
    tap_near(imp__normal_quantile(0.975), 1.959963984540054, 1e-14, 0,
             "normal quantile .975");
    tap_near(imp__normal_quantile(1e-20), -9.262340089798408, 1e-13, 0,
             "quantile of 1e-20");
    double worst = 0;
    for (int i = 1; i < 1000; i++) {
        const double p = i / 1000.0;
        worst = fmax(worst, fabs(imp__normal_cdf(imp__normal_quantile(p)) - p));
    }
    tap_near(worst, 0, 0, 1e-15, "cdf(quantile(p)) = p");
    /* Q(1, x) = e^-x; Q(1/2, x) = erfc(sqrt x); tables for the rest. */
    tap_near(imp__gamma_q(1, 3), exp(-3), 1e-14, 0, "Q(1, 3)");
    tap_near(imp__gamma_q(0.5, 0.3), erfc(sqrt(0.3)), 1e-14, 0, "Q(1/2, 0.3)");
    tap_near(imp__gamma_q(0.5, 30), erfc(sqrt(30)), 1e-12, 0, "Q(1/2, 30)");
    tap_near(imp__chi2_tail(124.342113404004, 100), 0.05, 1e-11, 0,
             "chi-square, 100, 5 %");
    tap_near(imp__chi2_tail(3.841458820694124, 1), 0.05, 1e-13, 0, "chi-square, 1, 5 %");
    /* 99.5 % of Student's t with 3 and 6 degrees of freedom, and 99.9 % with 6 */
    tap_near(imp__normal_of_student(5.840909, 3), 2.575829, .02, 0, "Student's t, 3");
    tap_near(imp__normal_of_student(-3.707428, 6), -2.575829, .01, 0, "Student's t, 6");
    tap_near(imp__normal_of_student(5.207626, 6), 3.090232, .01, 0,
             "Student's t, 6, far");
    tap_ok(imp__normal_of_student(3, INFINITY) == 3, "Student's t, normal in the limit");
    tap_near(imp__student_of_normal(2.575829, 3), 5.840909, .25, 0, "and back, 3");
    tap_near(imp__student_of_normal(-2.575829, 6), -3.707428, .05, 0, "and back, 6");
    tap_ok(imp__student_of_normal(3, INFINITY) == 3, "and back, normal in the limit");
    /* Q(n, x) is a Poisson sum, also where both expansions meet. */
    double sum = 0;
    for (int k = 0; k < 2000; k++) {
        int sign;
        sum += exp(-2000.0 + k * log(2000.0) - lgamma_r(k + 1.0, &sign));
    }
    tap_near(imp__gamma_q(2000, 2000), sum, 1e-10, 0, "Q(2000, 2000)");
    tap_near(imp__sidak(0.01, 4096), 2.45e-6, 0, 0.005e-6, "Sidak over 64 x 64 pixels");
    tap_near(pow(1 - imp__sidak(0.01, 4096), 4096), 0.99, 1e-12, 0, "and back");
}

static void quadrature(void)
{
    for (size_t n = 1; n <= 65; n += 16) {
        double x[65], w[65], error = 0;
        imp__gauss_legendre(n, -1, 2, x, w);
        for (size_t d = 0; d < 2 * n && d < 40; d++) {
            double q = 0;
            for (size_t i = 0; i < n; i++) q += w[i] * pow(x[i], (double)d);
            const double exact = (pow(2, d + 1.0) - pow(-1, d + 1.0)) / (d + 1);
            error = fmax(error, fabs(q - exact) / pow(2, d + 1.0));
        }
        tap_ok(error < 1e-14, "%zu points are exact to degree %zu # error %.1e", n,
               2 * n - 1, error);
    }
}

static void linear_algebra(void)
{
    enum { N = 12 };
    double a[N * N], l[N * N], inverse[N * N], b[N], x[N], work[N * N], values[N],
        v[N * N];
    const struct imp_key key = imp__key(3, 1, 4);
    double m[N * N];
    for (int i = 0; i < N * N; i++) m[i] = imp__u01(key, (unsigned)i) - 0.5;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            a[i * N + j] = i == j ? 0.1 : 0;
            for (int k = 0; k < N; k++) a[i * N + j] += m[i * N + k] * m[j * N + k];
        }
    memcpy(l, a, sizeof a);
    tap_ok(imp__cholesky(N, l), "a positive definite matrix has a factor");
    imp__cholesky_inverse(N, l, inverse);
    double error = 0, residual = 0, eigen = 0, ortho = 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            double s = 0;
            for (int k = 0; k < N; k++) s += a[i * N + k] * inverse[k * N + j];
            error = fmax(error, fabs(s - (i == j)));
        }
    tap_ok(error < 1e-12, "A A^-1 = 1 # error %.1e", error);
    for (int i = 0; i < N; i++) x[i] = b[i] = imp__u01(key, 500 + (unsigned)i);
    imp__cholesky_solve(N, l, x);
    for (int i = 0; i < N; i++) {
        double s = 0;
        for (int k = 0; k < N; k++) s += a[i * N + k] * x[k];
        residual = fmax(residual, fabs(s - b[i]));
    }
    tap_ok(residual < 1e-13, "A x = b # residual %.1e", residual);
    memcpy(work, a, sizeof a);
    tap_ok(imp__eigen_symmetric(N, work, values, v), "Jacobi converges");
    for (int k = 0; k < N; k++)
        for (int i = 0; i < N; i++) {
            double s = 0, o = 0;
            for (int j = 0; j < N; j++) {
                s += a[i * N + j] * v[k * N + j];
                o += v[k * N + j] * v[i * N + j];
            }
            eigen = fmax(eigen, fabs(s - values[k] * v[k * N + i]));
            ortho = fmax(ortho, fabs(o - (i == k)));
        }
    tap_ok(eigen < 1e-14 && ortho < 1e-14, "A v = lambda v, v orthonormal # %.1e %.1e",
           eigen, ortho);
    int ascending = 1;
    for (int k = 1; k < N; k++) ascending &= values[k - 1] <= values[k];
    tap_ok(ascending, "eigenvalues ascend");

    /* Hilbert matrix, order 6: the least eigenvalue has all its digits. */
    for (int i = 0; i < 36; i++) work[i] = 1.0 / (i / 6 + i % 6 + 1);
    imp__eigen_symmetric(6, work, values, v);
    tap_near(values[0], 1.082799485e-07, 1e-8, 0, "Hilbert 6: least eigenvalue");
    double singular[4] = {1, 2, 2, 4}, indefinite[4] = {1, 2, 2, 1},
           nan[4] = {NAN, 0, 0, 1};
    /* Of rank 1, where rounding leaves the second pivot above 0. */
    double rounded[4] = {0.1 * 0.1, 0.1 * 10.3, 0.1 * 10.3, 10.3 * 10.3};
    tap_ok(rounded[3] - rounded[1] / sqrt(rounded[0]) * (rounded[1] / sqrt(rounded[0])) >
                   0 &&
               !imp__cholesky(2, rounded),
           "what is left of a pivot is rounding");
    tap_ok(!imp__cholesky(2, singular) && !imp__cholesky(2, indefinite) &&
               !imp__cholesky(2, nan),
           "singular, indefinite and NaN matrices have no factor");
    double bad[4] = {1, NAN, NAN, 1};
    tap_ok(!imp__eigen_symmetric(2, bad, values, v), "NaN: no eigenvalues, and no hang");
}

/* Of vectors in all directions above the x axis, of lengths that differ by powers of two. */
static void angles(void)
{
    double worst = 0;
    for (uint32_t i = 0; i < 100000; i++) {
        const struct imp_key key = imp__key(3, 0, i);
        const double turn = IMP_PI * imp__u01(key, 0), size = exp2(i % 200 - 100.);
        const imp_v3 x = {size * cos(turn), -size, 0, size * imp__u01(key, 1)},
                     y = {size * sin(turn), size * exp2(-(double)(i % 60)), size, size};
        const imp_v3 a = imp__angles_4(x, y);
        for (int k = 0; k < 4; k++) {
            const long double right = atan2l(y[k], x[k]);
            worst = fmax(worst, (double)fabsl((a[k] - right) / right));
        }
        const imp_v3 sign = {-1, 1, -1, 1}, b = imp__angles_signed_4(x * sign, -y * sign);
        for (int k = 0; k < 4; k++) {
            const long double right = atan2l(-y[k] * sign[k], x[k] * sign[k]);
            worst = fmax(worst, (double)fabsl((b[k] - right) / right));
        }
    }
    const imp_v3 flat = imp__angles_4((imp_v3){2, -2, 0, 1}, (imp_v3){0, 0, 3, 1});
    tap_ok(flat[0] == 0 && flat[1] == IMP_PI && flat[2] == IMP_PI / 2 &&
               flat[3] == IMP_PI / 4,
           "along the axes and between them");
    const imp_v3 round =
        imp__angles_signed_4((imp_v3){0, -1, 0, -1}, (imp_v3){0, 0, -1, -1});
    tap_ok(round[0] == 0 && round[1] == IMP_PI && round[2] == -IMP_PI / 2 &&
               round[3] == -0.75 * IMP_PI,
           "the vector 0 has the angle 0, and those below the axis a negative one");
    tap_ok(worst < 0x1p-51, "angles of vectors # worst relative error %.3g", worst);
}

/* Of numbers of all sizes, and beyond what it has. */
static void exponentials(void)
{
    double worst = 0;
    for (uint32_t i = 0; i < 100000; i++) {
        const struct imp_key key = imp__key(4, 0, i);
        const double u = imp__u01(key, 0), small = exp2(-(double)(i % 70));
        const imp_v3 x = {1417 * u - 708, -u * small, u * small, 40 * u - 40};
        const imp_v3 e = imp__exp_4(x);
        for (int k = 0; k < 4; k++) {
            const long double right = expl(x[k]);
            worst = fmax(worst, (double)fabsl((e[k] - right) / right));
        }
    }
    tap_ok(worst < 0x1p-52, "exponentials # worst relative error %.3g", worst);
    const imp_v3 end = imp__exp_4((imp_v3){0, -INFINITY, INFINITY, NAN});
    const imp_v3 off = imp__exp_4((imp_v3){-709, 710, 1e300, -1e300});
    tap_ok(end[0] == 1 && end[1] == 0 && isinf(end[2]) && isnan(end[3]) && off[0] == 0 &&
               isinf(off[1]) && isinf(off[2]) && off[3] == 0,
           "of 0, of what is too large, and of no number");
}

/* Decimal numbers of up to 24 digits, with leading zeros, points and exponents, that end where the text
 * ends or before it; and whole numbers. The program's locale is "C". */
/* Halfway points of neighbours, which have up to 768 digits, as they are, with the last digit one less,
 * and with a digit far behind; and exponents that undo long rows of zeros. */
static void long_decimals(void)
{
    enum { N = 6000, ZEROS = 200000 };
    static char text[ZEROS + 2048];
    int wrong = 0;
    for (uint64_t i = 0; i < N; i++) {
        const struct imp_key key = imp__key(7, 0, i);
        const double x = ldexp(1 + imp__u01(key, 0), (int)(600 * imp__u01(key, 1)) - 300);
        const long double half =
            ((long double)x + (long double)nextafter(x, INFINITY)) / 2;
        int n = snprintf(text, 1400, i % 2 ? "%.1080Lf" : "%.900Le", half);
        char *e = strchr(text, 'e');
        char *last = (e ? e : text + n) - 1;
        if (i % 3 == 1) {
            while (*last == '0' || *last == '.') last--;
            *last = (char)(*last - 1);
        } else if (i % 3 == 2) {
            *last = '7';
        }
        const char *s = text, *end = text + n;
        double y = 0;
        wrong += !imp__number(&s, end, &y) || s != end || y != strtod(text, NULL);
    }
    tap_ok(wrong == 0, "long ones, half way between two doubles # %d of %d differ", wrong,
           N);
    memset(text, '0', ZEROS);
    text[1] = '.';
    sprintf(text + ZEROS, "123456789012345678901e%d", ZEROS);
    const char *s = text;
    double x = 0;
    const bool read = imp__number(&s, text + strlen(text), &x);
    tap_ok(read && *s == '\0' && x == strtod(text, NULL) && x > 10, "%d zeros # %g",
           ZEROS, x);
}

static void decimals(void)
{
    int wrong = 0, whole = 0, n = 0;
    for (uint64_t i = 0; i < 200000; i++) {
        const struct imp_key key = imp__key(6, 0, i);
        char text[80];
        const int digits = 1 + (int)(24 * imp__u01(key, 0) * imp__u01(key, 1)),
                  point = (int)((digits + 2) * imp__u01(key, 2)),
                  zeros = imp__u01(key, 3) < 0.3 ? digits / 2 : 0;
        int at = imp__u01(key, 4) < 0.3 ? sprintf(text, "-") : 0;
        for (int k = 0; k < digits; k++) {
            if (k == point) text[at++] = '.';
            text[at++] =
                (char)(k < zeros ? '0'
                                 : '0' + (int)(10 * imp__u01(key, 8 + (uint32_t)k)));
        }
        const int before = at;
        if (imp__u01(key, 5) < 0.3)
            at += sprintf(text + at, "e%d", (int)(40 * imp__u01(key, 6)) - 20);
        const int number_ends = at;
        at += sprintf(text + at, "%s", imp__u01(key, 7) < 0.5 ? "" : " 12345678901");
        const char *s = text, *end = text + at;
        double x = 0;
        wrong += !imp__number(&s, end, &x) || s != text + number_ends ||
                 x != strtod(text, NULL);
        if (point < digits || digits > 18) continue;
        int64_t j = 0;
        s = text;
        whole += !imp__integer(&s, end, &j) || s != text + before ||
                 j != strtoll(text, NULL, 10);
        n++;
    }
    tap_ok(wrong == 0, "decimal numbers as strtod reads them # %d of 200000 differ",
           wrong);
    long_decimals();
    tap_ok(whole == 0 && n > 5000, "whole ones as strtoll # %d of %d differ", whole, n);
}

/* Of doubles of all sizes and both signs, some of them equal, and both zeros. */
static void keys(void)
{
    enum { N = 20000 };
    static double x[N], ordered[N], room;
    static struct imp_keyed list[N], spare[N];
    int wrong = 0, equal = 0, others = 0, unsaid = 0;
    for (uint64_t k = 0; k < N; k++) {
        const struct imp_key key = imp__key(7, 0, k);
        x[k] = (imp__u01(key, 0) - 0.5) * pow(10, floor(600 * imp__u01(key, 1)) - 300);
        if (imp__u01(key, 2) < 0.3) x[k] = floor(20 * imp__u01(key, 3)) - 10;
        if (x[k] == 0 && k % 2) x[k] = -0.0;
        list[k] = (struct imp_keyed){imp__radix_key(x[k]), k};
        ordered[k] = x[k];
    }
    imp__radix_sort(list, N, spare);
    for (int k = 1; k < N; k++) {
        const size_t a = list[k - 1].value, b = list[k].value;
        wrong += x[a] > x[b] || (x[a] == x[b] && a >= b);
        equal += x[a] == x[b];
    }
    tap_ok(wrong == 0 && equal > N / 5, "radix sort # %d of %d misplaced, %d equal",
           wrong, N, equal);
    memcpy(spare, list, sizeof spare);
    imp__keyed_order(list, N, ordered, sizeof *ordered, &room);
    for (size_t k = 0; k < N; k++) {
        others += memcmp(&ordered[k], &x[spare[k].value], sizeof *x) != 0;
        unsaid += list[k].value != k;
    }
    tap_ok(others == 0 && unsaid == 0, "things in that order # %d of %d are others",
           others, N);
}

int main(void)
{
    angles();
    keys();
    decimals();
    exponentials();
    distributions();
    quadrature();
    linear_algebra();
    return tap_done();
}

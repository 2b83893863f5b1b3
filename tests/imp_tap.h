/* SPDX-License-Identifier: Apache-2.0
 *
 * Tests are plain C programs that print TAP. A check prints value, uncertainty and
 * verdict:
 *
 *     ok 1 - albedo is rho # mean 0.50004 se 0.00065 ref 0.5 z 0.06
 */
#ifndef IMP_TAP_H
#define IMP_TAP_H

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

static int tap_count, tap_failed;

/* A program whose suite "long" runs it as `PROGRAM long`: all cases, not only the short form. */
static inline bool tap_is_long(int argc, char **argv)
{
    return argc > 1 && strcmp(argv[1], "long") == 0;
}

/* Running mean and variance (Welford). */
struct tap_stat {
    double n, mean, m2;
};
static inline void tap_add(struct tap_stat *s, double x)
{
    s->n += 1;
    const double d = x - s->mean;
    s->mean += d / s->n;
    s->m2 += d * (x - s->mean);
}
static inline double tap_se(const struct tap_stat *s)
{
    return s->n > 1 ? sqrt(s->m2 / (s->n - 1) / s->n) : INFINITY;
}

__attribute__((format(printf, 2, 3))) static inline int tap_ok(int ok, const char *format,
                                                               ...)
{
    va_list args;
    va_start(args, format);
    printf("%sok %d - ", ok ? "" : "not ", ++tap_count);
    vprintf(format, args);
    printf("\n");
    va_end(args);
    fflush(stdout);
    if (!ok) tap_failed++;
    return ok;
}
/* |value - ref| <= relative * |ref| + absolute */
static inline int tap_near(double value, double ref, double relative, double absolute,
                           const char *what)
{
    const double error = fabs(value - ref);
    return tap_ok(error <= relative * fabs(ref) + absolute,
                  "%s # value %.12g ref %.12g error %.2e", what, value, ref, error);
}
/* z-test: |z| <= 4.5 (1 in 150000 by chance) and the SE small enough to tell. */
static inline int tap_z(const struct tap_stat *s, double ref, double se_limit,
                        const char *what)
{
    const double se = tap_se(s), z = se > 0 ? (s->mean - ref) / se : 0;
    const int exact = se == 0 && fabs(s->mean - ref) <= 1e-12 * fabs(ref);
    return tap_ok((exact || (se > 0 && fabs(z) <= 4.5)) && se <= se_limit,
                  "%s # mean %.8g se %.2g ref %.8g z %.2f", what, s->mean, se, ref, z);
}
static inline void tap_skip(const char *what, const char *why)
{
    printf("ok %d - %s # SKIP %s\n", ++tap_count, what, why);
}
static inline int tap_done(void)
{
    printf("1..%d\n", tap_count);
    if (tap_failed) printf("# %d failed\n", tap_failed);
    return tap_failed ? 1 : 0;
}

#endif

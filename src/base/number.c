/* SPDX-License-Identifier: Apache-2.0
 *
 * Decimal numbers from text and to text. The C library's own functions follow the
 * locale of the host, which may write a comma for the decimal point. */
#include "number.h"
#include "compiler.h"
#include "little.h"
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <strings.h>

#define DIGITS_MAX 19  /* always fit 64 bits */
#define DIGITS_ALL 800 /* the halfway point of two doubles has at most 768 */

static const uint64_t power_of_ten[] = {1,      10,      100,      1000,     10000,
                                        100000, 1000000, 10000000, 100000000};

static bool is_digit(char c) { return c >= '0' && c <= '9'; }

/* How many of the eight characters at p are digits, up to the first that is none; the digits as a
 * number. Of w, with a digit in each byte, the first one lowest, pairs, fours and eights are made by
 * three multiplications. */
static int eight_digits(const char *p, uint64_t *value)
{
    uint64_t w = imp__little_u64((const unsigned char *)p) ^ 0x3030303030303030u;
    const uint64_t other = ((w + 0x7676767676767676u) | w) & 0x8080808080808080u;
    const int n = other ? __builtin_ctzll(other) / 8 : 8;
    if (n == 0) return 0;
    w <<= 64 - 8 * n;
    w = 10 * w + (w >> 8);
    w = (w & 0x000000ff000000ffu) * 0x000f424000000064u +
        ((w >> 16) & 0x000000ff000000ffu) * 0x0000271000000001u;
    *value = w >> 32;
    return n;
}

/* The digits at p behind those of *value, which wraps beyond DIGITS_MAX. Returns the first character that
 * is none. Where branches say where digits end, the processor reads on before the digits are known. */
static const char *digits_read(const char *p, const char *end, uint64_t *value)
{
    while (p < end && is_digit(*p)) {
        uint64_t v = (uint64_t)(*p - '0');
        int n = 1;
        if (end - p >= 8 && is_digit(p[1])) n = eight_digits(p, &v);
        if (n == 8) {
            *value = 100000000 * *value + v;
            p += 8;
            continue;
        }
        *value = power_of_ten[n] * *value + v;
        p += n;
    }
    return p;
}

static bool word(const char **s, const char *end, const char *text, size_t n)
{
    if ((size_t)(end - *s) < n || strncasecmp(*s, text, n) != 0) return false;
    *s += n;
    return true;
}

IMP_COLD static bool word_read(const char **s, const char *end, double *out)
{
    *out = NAN;
    if (word(s, end, "nan", 3)) return true;
    *out = INFINITY;
    return word(s, end, "infinity", 8) || word(s, end, "inf", 3);
}

/* mantissa * 10^exponent. */
struct decimal {
    uint64_t mantissa;
    int64_t exponent;
};

/* digits * 10^exponent by the C library in its "C" locale, else about so. text has room for the
 * exponent behind its n digits, the first of which is not 0. */
static double value_rounded(char *text, int n, int64_t exponent, double about)
{
    if (n + exponent > 400) return INFINITY;
    if (n + exponent < -400) return 0;
    sprintf(text + n, "e%d", (int)exponent);
    const locale_t c = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (!c) return about;
    const double value = strtod_l(text, NULL, c);
    freelocale(c);
    return value;
}

/* Correctly rounded. Both factors exact below 2^53 and 10^22: one rounding (Clinger, "How to read
 * floating point numbers accurately", 1990). */
static double value_of(const struct decimal *x)
{
    static const double power[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                   1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                   1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    if (x->mantissa == 0) return 0;
    if (x->mantissa <= (uint64_t)1 << 53) {
        if (x->exponent < 0 && x->exponent >= -22)
            return (double)x->mantissa / power[-x->exponent];
        if (x->exponent >= 0 && x->exponent <= 22)
            return (double)x->mantissa * power[x->exponent];
    }
    char text[64];
    const int n = snprintf(text, sizeof text, "%llu", (unsigned long long)x->mantissa);
    return value_rounded(text, n, x->exponent,
                         (double)x->mantissa * pow(10, (double)x->exponent));
}

/* Digits with at most one point among them, more than DIGITS_MAX, leading zeros included, times
 * 10^exponent. All that can decide how it is rounded are kept, and a 1 for others that are not 0. */
IMP_COLD static double long_decimal(const char *p, const char *end, int64_t exponent)
{
    char text[DIGITS_ALL + 32];
    int n = 0;
    double about = 0;
    bool fraction = false, more = false;
    for (; p < end; p++) {
        if (*p == '.') {
            fraction = true;
            continue;
        }
        exponent -= fraction;
        if (n == 0 && *p == '0') continue; /* leading zeros are free */
        if (n < DIGITS_ALL) {
            text[n++] = *p;
            about = 10 * about + (*p - '0');
        } else {
            more |= *p != '0';
            exponent++;
        }
    }
    if (n == 0) return 0;
    if (more) {
        text[n++] = '1';
        exponent--;
    }
    return value_rounded(text, n, exponent, about * pow(10, (double)exponent));
}

/* What follows an 'e' at *s counts if it is a number. */
IMP_COLD static void exponent_read(const char **s, const char *end, int64_t *exponent)
{
    const char *p = *s + 1;
    bool minus = false;
    if (p < end && (*p == '+' || *p == '-')) minus = *p++ == '-';
    if (p >= end || !is_digit(*p)) return;
    int64_t e = 0; /* far beyond the length of any text */
    for (; p < end && is_digit(*p); p++)
        if (e < INT64_MAX / 100) e = 10 * e + (*p - '0');
    *exponent += minus ? -e : e;
    *s = p;
}

bool imp__number(const char **s, const char *end, double *out)
{
    const char *p = *s;
    const bool negative = p < end && *p == '-';
    if (negative || (p < end && *p == '+')) p++;

    const char *first = p;
    struct decimal x = {0};
    p = digits_read(p, end, &x.mantissa);
    ptrdiff_t digits = p - first;
    if (p < end && *p == '.') {
        const char *point = p++;
        p = digits_read(p, end, &x.mantissa);
        digits += p - point - 1;
        x.exponent = point + 1 - p;
    }
    double value;
    if (digits > 0) {
        const char *last = p;
        const int64_t by_point = x.exponent;
        if (p < end && (*p == 'e' || *p == 'E')) exponent_read(&p, end, &x.exponent);
        value = digits <= DIGITS_MAX ? value_of(&x)
                                     : long_decimal(first, last, x.exponent - by_point);
    } else {
        p = first;
        if (!word_read(&p, end, &value)) return false;
    }
    *s = p;
    *out = negative ? -value : value;
    return true;
}

bool imp__integer(const char **s, const char *end, int64_t *out)
{
    const char *p = *s;
    bool negative = false;
    int n;
    uint64_t first;
    if (p < end && (*p == '+' || *p == '-')) negative = *p++ == '-';
    if (p >= end || !is_digit(*p)) return false;
    int64_t value = 0;
    if (end - p >= 8 && (n = eight_digits(p, &first)) > 0) {
        value = negative ? -(int64_t)first : (int64_t)first;
        p += n;
    }
    for (; p < end && is_digit(*p); p++)
        if (__builtin_mul_overflow(value, 10, &value) ||
            (negative ? __builtin_sub_overflow(value, *p - '0', &value)
                      : __builtin_add_overflow(value, *p - '0', &value)))
            return false;
    *s = p;
    *out = value;
    return true;
}

/* The C locale is a constant of glibc: getting it cannot fail, and changing to it and back
 * takes 14 ns beside the 500 ns of printing a double. */
int imp__vformat(char *text, size_t size, const char *format, va_list args)
{
    const locale_t c = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    const locale_t host = c ? uselocale(c) : (locale_t)0;
    const int n = vsnprintf(text, size, format, args);
    if (host) uselocale(host);
    if (c) freelocale(c);
    return n;
}

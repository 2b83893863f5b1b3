/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers in text, independent of the host's locale. */
#ifndef IMP_BASE_NUMBER_H
#define IMP_BASE_NUMBER_H

#include "compiler.h"
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Read a number that starts at *s and ends before `end`, and move *s behind it; false,
 * and nothing moved, if there is none. Decimal with optional sign, fraction and exponent;
 * "inf" and "nan" are read too, callers that mind check with isfinite. */
bool imp__number(const char **s, const char *end, double *out);
/* The same for decimal integers; false also if it does not fit. */
bool imp__integer(const char **s, const char *end, int64_t *out);

/* vsnprintf for files and answers: with a decimal point, whatever the host's locale. */
IMP_PRINTF(3, 0)
int imp__vformat(char *text, size_t size, const char *format, va_list args);

#endif

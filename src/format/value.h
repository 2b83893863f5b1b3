/* SPDX-License-Identifier: Apache-2.0
 *
 * Values of attributes: numbers, lists, booleans (docs/scene-format.md 1.1, 1.3). */
#ifndef IMP_FORMAT_VALUE_H
#define IMP_FORMAT_VALUE_H

#include "base/context.h"

/* The whole text must be one value; leading blanks are allowed. Numbers are finite. */
bool imp__value_float(const char *text, double *out);
bool imp__value_integer(const char *text, int64_t *out);
bool imp__value_bool(const char *text, bool *out);
/* Numbers split at commas and blanks, at most `max`; their count, or -1 if an item is not
 * a number, or max + 1 if there are more. */
int imp__value_list(const char *text, int max, double *out);
/* Three numbers, or one for all three; false otherwise. */
bool imp__value_triple(const char *text, double out[3]);

/* Wavelength and value pairs: *list holds n wavelengths, then n values (imp__release). */
struct imp_samples {
    size_t n;
    double *list;
};
/* "400:0.3, 500:0.4" */
enum imp_status imp__samples_parse(imp_context *ctx, const char *text,
                                   struct imp_samples *out);
/* An .spd file: lines "wavelength value"; blank lines and lines that start with # do not
 * count. The message names file and line. */
enum imp_status imp__samples_read(imp_context *ctx, const char *path,
                                  struct imp_samples *out);
/* At least two, wavelengths strictly increasing, all numbers finite. */
enum imp_status imp__samples_check(imp_context *ctx, const struct imp_samples *s);

#endif

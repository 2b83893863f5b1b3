/* SPDX-License-Identifier: Apache-2.0
 *
 * Bytes as text, in base64 (RFC 4648), and so the numbers of a picture, 16-bit floats
 * [channel][y][x]: their low bytes and then their high bytes, as a zlib stream (RFC 1950). */
#ifndef IMP_REPORT_PLANES_H
#define IMP_REPORT_PLANES_H

#include "base/film.h"
#include "base/text.h"

void imp__base64_put(struct imp_text *t, const unsigned char *bytes, size_t n);

/* values: [height][width][channels] of the film. Returns the power of two that the numbers
 * written are to be multiplied by: the largest finite one is then below 2^15, and those
 * 2^29 times smaller are still normal numbers. */
double imp__planes_put(struct imp_text *t, const imp_film *film, const float *values);

#endif

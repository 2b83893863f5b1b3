/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers of a picture as text: [channel][y][x], 16-bit floats, little-endian, in base64
 * (RFC 4648). */
#ifndef IMP_REPORT_PLANES_H
#define IMP_REPORT_PLANES_H

#include "base/film.h"
#include "base/text.h"

/* values: [height][width][channels] of the film. Returns the power of two that the numbers
 * written are to be multiplied by: the largest finite one is then below 2^15, and those
 * 2^29 times smaller are still normal numbers. */
double imp__planes_put(struct imp_text *t, const imp_film *film, const float *values);

#endif

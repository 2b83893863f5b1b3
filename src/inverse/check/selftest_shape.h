/* SPDX-License-Identifier: Apache-2.0
 *
 * What the files of the self-test of shapes share. */
#ifndef IMP_INVERSE_SELFTEST_SHAPE_H
#define IMP_INVERSE_SELFTEST_SHAPE_H

#include "selftest.h"
#include "selftest_lines.h"

/* Is the point outside of the shape's box, by more than rounding? */
bool imp__shape_outside(const struct imp__probe *p, imp_v3 x);

/* Rows of area and of drawn points (selftest_points.c). */
enum imp_status imp__selftest_points(struct imp__selftest *t, const struct imp__probe *p);

#endif

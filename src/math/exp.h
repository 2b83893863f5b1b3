/* SPDX-License-Identifier: Apache-2.0
 *
 * Exponential function and logarithm: what media let through, and how far light gets in them.
 * They have the same bits with every C library. */
#ifndef IMP_MATH_EXP_H
#define IMP_MATH_EXP_H

#define IMP_WIDE 1
#define IMP_TEXT "math/exp_text.h"
#include "lane_text.h"
#define IMP_WIDE 4
#define IMP_TEXT "math/exp_text.h"
#include "lane_text.h"
#define IMP_WIDE 8
#define IMP_TEXT "math/exp_text.h"
#include "lane_text.h"

#endif

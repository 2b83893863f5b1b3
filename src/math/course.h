/* SPDX-License-Identifier: Apache-2.0
 *
 * A factor over time: linear between given times, constant before the first and after the
 * last. */
#ifndef IMP_MATH_COURSE_H
#define IMP_MATH_COURSE_H

#include <stddef.h>

struct imp_course {
    size_t n;            /* at least 1 */
    const double *time;  /* [n] ascending */
    const double *value; /* [n] not negative */
};

double imp__course_at(const struct imp_course *c, double time);
/* Its integral over [open, close]. */
double imp__course_integral(const struct imp_course *c, double open, double close);
/* The time with density proportional to it at which a share u of the integral is past;
 * open < close, and the integral is positive. */
double imp__course_draw(const struct imp_course *c, double open, double close, double u);

#endif
